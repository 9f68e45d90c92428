"""Patterns of all settings: the MDS plot, and the table of ANODI ratios."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np
import streamlit as st

from ccwsim.experiments.comparison import Comparison
from ccwsim.figures import SYMBOLS, Group, mds_chart, setting_colours
from ccwsim.ui.compare.name import draw_point_key
from ccwsim.ui.compare.state import Comparing
from ccwsim.ui.compare.words import said_ratio
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.errors import catch_callback_errors
from ccwsim.ui.widgets.facts import three_digits
from ccwsim.ui.widgets.scrolled import scrolled
from ccwsim.ui.widgets.steps import panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme


def draw_patterns(state: State, found: Comparison) -> None:
    """Draw both, or say that they are still worked out or why they cannot be."""
    if found.anodi is None:
        if found.problem:
            step_note(f"Patterns are not compared: {found.problem}.")
        elif state.page(Comparing).job is not None:
            st.html('<div class="unseen patterns"></div>')
        else:
            step_note("Patterns were not compared: it was stopped before.")
        return
    left, right = st.columns([1.0, 1.15], gap="large")
    with left:
        _plot(state, found)
    with right:
        _table(found)


def _plot(state: State, found: Comparison) -> None:
    assert found.anodi is not None
    assert found.scaling is not None
    here = state.page(Comparing)
    theme, n = chart_theme(), found.ensembles[0].n
    groups = []
    for k, name in enumerate(found.names):
        own, colour = found.scaling.positions[found.anodi.owner == k], setting_colours(theme)[k]
        labels = [f"{name}, realization {r + 1}" for r in range(len(own))]
        groups.append(Group(name, own, colour, SYMBOLS[k], labels, here.shown))
    chart = mds_chart(found.scaling.positions[0], groups, found.scaling.explained, theme)

    def draw(chart: Any, key: str, alt: str) -> None:
        def chosen() -> None:
            points = st.session_state[f"chart_{key}"].selection.points
            clicked = [p for p in points if p.get("curve_number", 99) < len(found.names)]
            if clicked:
                here.shown = min(max(int(clicked[0]["point_index"]), 0), n - 1)

        draw_point_key(found.names)
        st.plotly_chart(
            chart, key=f"chart_{key}", theme=None, alt=alt, on_select=catch_callback_errors(chosen),
            selection_mode="points",
            config={"displaylogo": False, "modeBarButtons": [["toImage"]]},
        )  # fmt: skip

    alt = "MDS plot: realizations of all settings and the training image"
    titled_chart("MDS plot", "click a realization to see it", chart, "compared_mds", alt, draw)


def _table(found: Comparison) -> None:
    panel_title("ANODI ratios", "every setting against each one before it")
    st.html(scrolled(ratio_table(found), "ANODI ratios"))
    assert found.anodi is not None
    weights = ", ".join(three_digits(w) for w in found.anodi.weights)
    size = found.anodi.pattern_size
    step_note(
        "Between: how varied the realizations are; within: how far they lie from the training "
        "image; ratio = between / within. Above 1 the first setting is the better one "
        f"(Tan et al. 2014, on exact histograms of all {size} × {size} patterns at full, half and "
        f"third resolution, weighted {weights})."
    )


def ratio_table(found: Comparison) -> str:
    """Return between, within and ratio of every pair as an HTML table, with what it says."""

    def cell(value: float) -> str:
        return f"<td>{f'{value:.2f}' if np.isfinite(value) else '–'}</td>"

    rows = "".join(
        f"<tr><th>{escape(row.name)} : {escape(row.other)}</th>{cell(row.between)}"
        f'{cell(row.within)}{cell(row.ratio)}<td class="reason">{escape(said_ratio(row))}</td></tr>'
        for row in found.ratios
    )
    head = "<tr><th></th><th>between</th><th>within</th><th>ratio</th><th></th></tr>"
    return f'<table class="numbers ratios">{head}{rows}</table>'
