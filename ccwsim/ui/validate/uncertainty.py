"""Where the realizations agree: probability of each facies, most likely facies and entropy."""

from __future__ import annotations

from collections.abc import Sequence

import streamlit as st

from ccwsim.figures import ENTROPY
from ccwsim.metrics import EType
from ccwsim.ui.session.state import State
from ccwsim.ui.validate.panel import panel
from ccwsim.ui.validate.statistics import e_type
from ccwsim.ui.widgets.facts import three_digits
from ccwsim.ui.widgets.maps import draw_map, facies_map, points_of, share_map
from ccwsim.ui.widgets.steps import panel_title

MAP_HEIGHT = 400
CERTAIN = 0.05
"""Entropy below which a cell counts as certain."""


def draw_uncertainty(state: State, colours: Sequence[str]) -> None:
    """Draw the three maps side by side, linked."""
    ensemble = state.ensemble
    assert ensemble is not None

    def draw(found: EType) -> None:
        draw_three(found, state, colours)

    panel(state, "uncertainty", e_type(ensemble), draw)


def draw_three(found: EType, state: State, colours: Sequence[str], prefix: str = "") -> None:
    """Draw probability of the chosen facies, most likely facies and entropy."""
    assert state.ensemble is not None
    image, data = state.ensemble.training_image, state.ensemble.hard_data
    name = image.facies_names[state.facies]
    places = st.columns(3, gap="medium")
    certain = float((found.entropy < CERTAIN).mean())
    maps = (
        (f"Probability of {name}", "E-type", "probability",
         share_map(found.probability[state.facies], f"P({name}) =", f"Probability of {name}",
                   point_colours=colours)),
        ("Most likely facies", "", "most_likely",
         facies_map(found.most_likely, image, colours, "Most likely facies")),
        ("Entropy", f"{three_digits(100 * certain)} % of the cells are certain", "entropy",
         share_map(found.entropy, "entropy", "Entropy, from 0, certain, to 1, all equally likely",
                   colours=ENTROPY, point_colours=colours)),
    )  # fmt: skip
    for place, (title, note, word, shown) in zip(places, maps, strict=True):
        with place:
            panel_title(title, note)
            shown.points.extend(points_of(data, image))
            draw_map(
                shown, f"map_{prefix}{word}", link="grid", scale=f"{prefix}three", name=word,
                max_height=MAP_HEIGHT,
            )  # fmt: skip
