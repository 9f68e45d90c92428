"""Where results will be, before there are any."""

from __future__ import annotations

import streamlit as st

from ccwsim.ui.results.facies import colours_of, pretty
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.maps import draw_map, facies_map
from ccwsim.ui.widgets.steps import panel_title

SMALLEST_IMAGE = 0.5
"""The training image is never narrower than this share of a realization on the page."""


def draw_ghost(state: State) -> None:
    """Show where the results will be, and what they will say, before there are any."""
    image, grid = image_of(state.choices.image), state.choices.grid
    with st.container(key="maps"):
        left, middle, right = st.columns([SMALLEST_IMAGE, 1.08, 1.0], gap="medium")
    with left:
        panel_title("Training image", pretty(image.name))
        shown = facies_map(image.indices, image, colours_of(state), f"Training image {image.name}")
        draw_map(shown, "map_image", name="training_image")
    for place, kind, title, text in (
        (middle, "ghost large", "Realization",
         "A field that looks like the training image and honours the data"),
        (right, "ghost", "E-type",
         "How often each cell has a facies in all realizations: its probability"),
    ):  # fmt: skip
        with place:
            panel_title(title)
            shape = f"aspect-ratio: {grid.nx} / {grid.ny}"
            st.html(f'<div class="{kind}" style="{shape}">{text}</div>')
