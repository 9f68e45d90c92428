"""Put a chart on the page, in the same way everywhere."""

from __future__ import annotations

from typing import Any

import streamlit as st

from ccwsim.ui.session.state import session_state


def draw_chart(chart: Any, key: str, alt: str) -> None:
    """Draw a plotly figure that already has its own style; its one button saves it."""
    kind = session_state().chart_format
    st.plotly_chart(
        chart,
        key=f"chart_{key}",
        theme=None,
        alt=alt,
        config={
            "displaylogo": False,
            "modeBarButtons": [["toImage"]],
            "toImageButtonOptions": {
                "format": kind,
                "filename": key,
                "scale": 3 if kind == "png" else 1,
            },
        },
    )
