"""Variograms in any direction, over all lags at once, and transiograms of all pairs of facies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import streamlit as st

from ccwsim.figures import Bundle, lag_map_chart, transiogram_chart
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.overview import draw_bundle
from ccwsim.ui.validate.panel import panel
from ccwsim.ui.validate.state import Validation
from ccwsim.ui.validate.statistics import LagMaps, lag_maps, transitions
from ccwsim.ui.widgets.facts import three_digits
from ccwsim.ui.widgets.fields import field
from ccwsim.ui.widgets.steps import step_note
from ccwsim.ui.widgets.theme import chart_theme

FEW_FACIES = 3
"""Up to so many facies all pairs are drawn at once."""
MAX_HEADS = 6


def draw_directions(state: State, colours: Sequence[str]) -> None:
    """Draw the variogram maps, and the variogram and connection along a chosen direction."""
    ensemble = state.ensemble
    assert ensemble is not None
    _ask_azimuth(state)
    azimuth = float(state.page(Validation).azimuth)
    left, right = st.columns(2, gap="medium")
    with left:
        draw_bundle(state, ensemble, "variogram", azimuth, height=220)
    with right:
        draw_bundle(state, ensemble, "connection", azimuth, height=220)
    name = ensemble.training_image.facies_names[state.facies]
    panel(
        state, "lag_maps", lag_maps(ensemble, state.facies),
        lambda found: _draw_maps(found, name, azimuth),
    )  # fmt: skip


def _ask_azimuth(state: State) -> None:
    page_state = state.page(Validation)
    field(
        st.slider, "Direction, degrees from north to east", key="azimuth", min_value=0,
        max_value=175, step=5, value=page_state.azimuth, width=420,
        help="0 is N–S, 45 is NE–SW, 90 is E–W, 135 is NW–SE. The dotted line on the maps.",
        write=lambda azimuth: setattr(page_state, "azimuth", int(azimuth)),
    )  # fmt: skip


def _draw_maps(found: LagMaps, name: str, azimuth: float) -> None:
    largest = float(max(found.reference.max(), found.mean.max())) or 0.5
    apart = found.mean - found.reference
    widest = float(np.abs(apart).max()) or largest
    what = f"γ of {name}"
    for place, (title, note, word, values, top, is_apart) in zip(
        st.columns(3, gap="medium"),
        (
            ("Training image", "variogram map", "lags_image", found.reference, largest, False),
            ("Realizations", "mean variogram map", "lags_mean", found.mean, largest, False),
            ("Difference", f"at most {three_digits(widest)}", "lags_apart", apart, widest, True),
        ),
        strict=True,
    ):
        with place:
            chart = lag_map_chart(
                found.lags, values, chart_theme(), name=what, largest=top, azimuth=azimuth,
                difference=is_apart,
            )  # fmt: skip
            alt = f"{title}: variogram map of {name}, lags east and north"
            titled_chart(title, note, chart, word, alt)


def draw_transitions(state: State, colours: Sequence[str]) -> None:
    """Draw the transiograms E–W; with many facies, those that start in one of them."""
    page_state = state.page(Validation)
    ensemble = state.ensemble
    assert ensemble is not None
    names = ensemble.training_image.facies_names
    n = len(names)
    tails = list(range(n))
    with st.container(horizontal=True, gap="medium", vertical_alignment="bottom"):
        field(
            st.segmented_control, "Along", key="transitions_along", options=["E-W", "N-S"],
            value=page_state.along, format_func=lambda way: way.replace("-", "–"),
            write=lambda way: setattr(page_state, "along", way),
        )  # fmt: skip
        if n > FEW_FACIES:
            page_state.tail = min(page_state.tail, n - 1)
            field(
                st.selectbox, "From", key="transitions_tail", options=tails, width=220,
                value=page_state.tail, format_func=lambda k: names[k],
                write=lambda k: setattr(page_state, "tail", k),
            )  # fmt: skip
            tails = [page_state.tail]
    heads = list(range(n))[:MAX_HEADS]

    def draw(bundles: dict[tuple[int, int], Bundle]) -> None:
        chart = transiogram_chart(bundles, tails, heads, names, chart_theme())
        titled_chart(
            "Transiograms", "probability of the second facies at a lag from the first", chart,
            "transiograms", "Transition probabilities between facies over the lag",
        )  # fmt: skip

    panel(state, "transitions", transitions(ensemble, page_state.along), draw)
    if n > MAX_HEADS:
        step_note(f"The first {MAX_HEADS} of {n} facies.")
