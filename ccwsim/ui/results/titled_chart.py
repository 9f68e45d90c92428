"""A chart under its title, with a menu to take it home as PNG, SVG or CSV."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import streamlit as st

from ccwsim.ui.results.charts import draw_chart
from ccwsim.ui.widgets.maps import canvas_component
from ccwsim.ui.widgets.steps import panel_title


def titled_chart(
    title: str, note: str, chart: Any, key: str, alt: str,
    draw: Callable[[Any, str, str], None] = draw_chart,
) -> None:  # fmt: skip
    """Draw title, note, menu and chart.

    Parameters
    ----------
    title, note : str
        What is shown, and what it says.
    chart : plotly figure
    key : str
        Unique on the page; also the file name.
    alt : str
        For those who cannot see it.
    draw : callable
        Puts the chart on the page, called as draw(chart, key, alt).
    """
    with st.container(key=f"panel_{key}"):
        with st.container(horizontal=True, gap="small", key=f"title_{key}"):
            panel_title(title, note)
            chart_menu(title, key)
        draw(chart, key, alt)


def chart_menu(title: str, key: str) -> None:
    """Draw the menu that saves the chart of that key."""
    data = {"title": title, "chart": f"chart_{key}", "name": key}
    canvas_component("chart_menu")(key=f"menu_{key}", data=data, width="content")
