"""Put a chart on the page, in the same way everywhere."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import streamlit as st

from ccwsim.ui.session.state import session_state
from ccwsim.ui.widgets.errors import catch_callback_errors


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


def draw_clickable_chart(
    chart: Any,
    key: str,
    alt: str,
    choose: Callable[[int], None],
    *,
    n_series: int = 1,
    mode_bar: bool = True,
) -> None:
    """Draw a chart whose first series have points to click; `choose` gets the point's number."""

    def clicked() -> None:
        points = st.session_state[f"chart_{key}"].selection.points
        numbers = [p["point_index"] for p in points if p.get("curve_number", n_series) < n_series]
        if numbers:
            choose(int(numbers[0]))

    select: Any = {"on_select": catch_callback_errors(clicked), "selection_mode": "points"}
    config: dict = {"displayModeBar": False}
    if mode_bar:
        config = {"displaylogo": False, "modeBarButtons": [["toImage"]]}
    st.plotly_chart(chart, key=f"chart_{key}", theme=None, alt=alt, config=config, **select)
