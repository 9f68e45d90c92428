"""Where results will be, before there are any."""

from __future__ import annotations

from html import escape

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
    shape = f"aspect-ratio: {grid.nx} / {grid.ny}"
    with middle:
        text = "A field that looks like the training image and honours the data"
        ghost_panel(text, shape, "Realization", "ghost large")
    with right:
        text = "How often each cell has a facies in all realizations: its probability"
        ghost_panel(text, shape, "E-type")


def ghost_panel(text: str, shape: str, title: str = "", kind: str = "ghost") -> None:
    """Draw the outline of a result that is still to come; `shape` is its size in CSS."""
    if title:
        panel_title(title)
    st.html(f'<div class="{kind}" style="{shape}">{escape(text)}</div>')
