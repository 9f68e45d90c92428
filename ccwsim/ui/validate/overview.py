"""The first screen of validation: a realization, E-type, MDS plot, variograms and connection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import streamlit as st

from ccwsim.figures import Bundle, Group, curves_chart, mds_chart
from ccwsim.metrics import Anodi
from ccwsim.model.bounds import MAX_CURVES
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.results.curves_panel import said
from ccwsim.ui.results.e_type import draw_e_type
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.guarding import error_boundary
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.panel import begin, panel
from ccwsim.ui.validate.state import Validation
from ccwsim.ui.validate.statistics import MAX_COMPARED, curves, patterns
from ccwsim.ui.widgets.errors import catch_callback_errors
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.maps import draw_map, facies_map, points_of
from ccwsim.ui.widgets.steps import panel_title
from ccwsim.ui.widgets.theme import chart_theme

MAP_HEIGHT = 392
CHART_HEIGHT = MAP_HEIGHT + 26
CURVES = (
    ("variogram", "E-W"),
    ("variogram", "N-S"),
    ("connection", "E-W"),
    ("connection", "N-S"),
)
SIGNS = {"variogram": ("Variogram", "γ", "varies"), "connection": ("Connection", "τ", "connected")}


@st.fragment
def draw_look(state: State, colours: Sequence[str], elsewhere: tuple) -> None:
    """Draw maps and MDS plot; a click in the plot redraws only this.

    Parameters
    ----------
    state : State
    colours : sequence of str
        One "#rrggbb" a facies.
    elsewhere : tuple
        What the rest of the page shows, as `shown_elsewhere` gives it.
    """
    with error_boundary():
        if shown_elsewhere(state) != elsewhere:
            st.rerun()
        begin(state)
        ensemble = state.ensemble
        assert ensemble is not None
        with st.container(key="maps"):
            left, middle, right = st.columns(3, gap="medium")
        with left:
            _realization(state, ensemble, colours)
        with middle:
            draw_e_type(state, ensemble, colours)
        with right:
            _scaling(state, ensemble)


def shown_elsewhere(state: State) -> tuple:
    """Return the choices made in the maps that the rest of the page depends on."""
    follows = "reuse" in state.page(Validation).seen
    return state.facies, state.shown if follows else None


def _realization(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    image, r = ensemble.training_image, state.shown
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="shown_row"):
        panel_title(f"Realization {ensemble.numbers[r] + 1} of {ensemble.n}")
        for step, label, name in ((-1, "‹", "previous"), (1, "›", "next")):
            button(
                label, key=f"shown_{name}", on_click=_step, args=(state, step),
                help=f"The {name} realization", disabled=ensemble.n == 1,
            )  # fmt: skip
    shown = facies_map(ensemble.indices[r], image, colours, f"Realization {r + 1}")
    shown.points.extend(points_of(ensemble.hard_data, image, ensemble.realizations[r]))
    draw_map(
        shown, "map_realization", link="grid", scale="maps", name=f"realization_{r + 1}",
        max_height=MAP_HEIGHT,
    )  # fmt: skip


def _step(state: State, step: int) -> None:
    if state.ensemble is not None:
        state.shown = (state.shown + step) % state.ensemble.n


def _scaling(state: State, ensemble: Ensemble) -> None:
    def draw(found: Anodi) -> None:
        n = len(found.owner) - 1
        note = "click a realization to see it"
        if ensemble.n > MAX_COMPARED:
            note = f"of the first {n}; click one to see it"
        placed = found.scaling()
        theme, labels = chart_theme(), [f"realization {r + 1}" for r in ensemble.numbers[:n]]
        ringed = state.shown if state.shown < n else None
        image, *positions = placed.positions
        realizations = Group(
            "realizations", np.array(positions), theme.ink, labels=labels, ringed=ringed
        )
        chart = mds_chart(image, [realizations], placed.explained, theme, height=CHART_HEIGHT)
        alt = "MDS plot: realizations and training image, placed by the distance of their patterns"
        titled_chart(
            "MDS plot", note, chart, "mds", alt,
            lambda chart, key, alt: _selectable(state, n, chart, key, alt),
        )  # fmt: skip

    panel(state, "mds", patterns(ensemble), draw)


def _selectable(state: State, n: int, chart: Any, key: str, alt: str) -> None:
    def chosen() -> None:
        points = st.session_state[f"chart_{key}"].selection.points
        clicked = [p["point_index"] for p in points if p.get("curve_number") == 0]
        if clicked:
            state.shown = min(max(int(clicked[0]), 0), n - 1)

    st.plotly_chart(
        chart, key=f"chart_{key}", theme=None, alt=alt, on_select=catch_callback_errors(chosen),
        selection_mode="points",
        config={"displaylogo": False, "modeBarButtons": [["toImage"]]},
    )  # fmt: skip


def draw_curves_row(state: State, ensemble: Ensemble) -> None:
    """Draw variograms and connection of the chosen facies along both axes, with their key."""
    draw_key(ensemble)
    with st.container(key="charts"):
        places = st.columns(4, gap="medium")
    for place, (statistic, way) in zip(places, CURVES, strict=True):
        with place:
            draw_bundle(state, ensemble, statistic, way)


def draw_key(ensemble: Ensemble) -> None:
    """Write what the lines of the curves are."""
    few = min(ensemble.n, MAX_CURVES)
    entries = (
        (2, "reference", "training image"),
        (2, "ink", "median of the realizations"),
        (10, "band", "5–95 % of them"),
        (1, "each", f"each of {few}" if few == ensemble.n else f"each of the first {few}"),
    )
    lines = "".join(
        f'<span><i style="border-top: {width}px solid var(--{colour})"></i>{text}</span>'
        for width, colour, text in entries
    )
    st.html(f'<div class="curve-key">{lines}</div>')


def draw_bundle(
    state: State, ensemble: Ensemble, statistic: str, way: str | float, height: int = 190
) -> None:
    """Draw one statistic of the chosen facies along one direction."""
    title, sign, how = SIGNS[statistic]
    name = ensemble.training_image.facies_names[state.facies]
    p = float(ensemble.training_image.proportions[state.facies])
    # twice the sill, which is more than a variogram usually reaches: comparable across directions
    top = 1.5 * p * (1 - p) or 0.5
    where = way.replace("-", "–") if isinstance(way, str) else f"{way:.0f}°"
    word = f"{statistic}_{way[0] if isinstance(way, str) else 'azimuth'}"

    def draw(bundle: Bundle) -> None:
        highest = float(np.nanmax([np.nanmax(bundle.each), np.nanmax(bundle.reference)]))
        y_range = (0, 1.04) if statistic == "connection" else (0, max(top, 1.05 * highest))
        tolerance = 0.02 if statistic == "connection" else 0.05 * top
        chart = curves_chart(
            bundle, chart_theme(), y_title=f"{sign} of {name}", y_range=y_range, height=height
        )
        alt = f"{title} {where} of {name}: training image over realizations, median and 5–95 %"
        whole = replace(bundle, lags=np.floor(bundle.lags))
        titled_chart(f"{title} {where}", said(whole, how, tolerance), chart, word, alt)

    panel(state, word, curves(ensemble, statistic, state.facies, way), draw)
