"""Charts on the pages, with a menu that saves a chart as PNG, SVG or CSV."""

from collections.abc import Callable
from html import escape
from typing import Any

import streamlit as st

from ccwsim.report.verdicts import Verdict
from ccwsim.ui.frontend.component import draw_component
from ccwsim.ui.widgets.errors import catch_callback_errors
from ccwsim.ui.widgets.text import panel_title

SAVE_BUTTON: dict[str, Any] = {"displaylogo": False, "modeBarButtons": [["toImage"]]}
"""Configuration of plotly with a hidden button; the menu that saves a chart presses this button."""


def draw_caption(text: str) -> None:
    """Add the caption that saved charts and the printed page have, and the screen does not show."""
    st.html(f'<p class="chart-caption">{escape(text)}</p>')


def draw_chart(chart: Any, key: str, alt: str) -> None:
    """Draw a plotly figure that already has a style."""
    st.plotly_chart(chart, key=f"chart_{key}", theme=None, alt=alt, config=SAVE_BUTTON)


def draw_clickable_chart(
    chart: Any, key: str, alt: str, choose: Callable[[int], None], *, n_series: int = 1
) -> None:
    """Draw a chart; `choose` is called with the index of a clicked point of the first series."""

    def clicked() -> None:
        points = st.session_state[f"chart_{key}"].selection.points
        numbers = [p["point_index"] for p in points if p.get("curve_number", n_series) < n_series]
        if numbers:
            choose(int(numbers[0]))

    select: Any = {"on_select": catch_callback_errors(clicked), "selection_mode": "points"}
    shown: Any = {"theme": None, "alt": alt, "config": SAVE_BUTTON}
    st.plotly_chart(chart, key=f"chart_{key}", **shown, **select)


def titled_chart(
    title: str,
    note: str | Verdict,
    chart: Any,
    key: str,
    alt: str,
    draw: Callable[[Any, str, str], None] = draw_chart,
) -> None:
    """Draw title, note, menu and chart; `key` is unique and the file name, `alt` is read aloud."""
    with st.container(key=f"panel_{key}"):
        with st.container(horizontal=True, gap="small", key=f"title_{key}"):
            panel_title(title, note)
            chart_menu(title, key)
        draw(chart, key, alt)


def chart_menu(title: str, key: str) -> None:
    """Draw the menu that saves the chart with the key `key`."""
    data = {"title": title, "chart": f"chart_{key}", "name": key}
    draw_component("chart_menu", f"menu_{key}", data, width="content")
