"""The results: maps side by side, the contact sheet, and what the charts say."""

from __future__ import annotations

import streamlit as st

from ccwsim.figures.proportions import proportions_height
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.results.curves_panel import draw_curves, draw_proportions
from ccwsim.ui.results.e_type import draw_e_type
from ccwsim.ui.results.facies import colours_of_ran, pretty
from ccwsim.ui.results.gallery import draw_gallery
from ccwsim.ui.results.ghost import SMALLEST_IMAGE, draw_ghost
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.state import State
from ccwsim.ui.simulate.downloads import draw_downloads
from ccwsim.ui.widgets.facts import draw_facts
from ccwsim.ui.widgets.maps import draw_map, facies_map, points_of
from ccwsim.ui.widgets.steps import panel_title

USUAL_WIDTH = 400
PROPORTIONS_TITLE = 40
"""Pixels of a realization on a usual screen, and of the title of the proportions."""


@st.fragment
def draw_results(state: State) -> None:
    """Draw everything that the latest run gave; choosing a realization redraws only this."""
    with error_boundary():
        if state.ensemble is None:
            draw_ghost(state)
        else:
            _results(state, state.ensemble)


def _results(state: State, ensemble: Ensemble) -> None:
    state.shown = min(state.shown, ensemble.n - 1)
    state.facies = min(state.facies, ensemble.training_image.n_facies - 1)
    colours = colours_of_ran(state)
    with st.container(horizontal=True, vertical_alignment="center", key="facts_row"):
        draw_facts(ensemble)
        draw_downloads(state, ensemble, colours)
    share = ensemble.training_image.shape[1] / ensemble.grid.nx
    widths = [min(max(share, SMALLEST_IMAGE), 1.0), 1.08, 1.0]
    with st.container(key="maps"):
        left, middle, right = st.columns(widths, gap="medium")
    with middle:  # first, so that it is the first to be seen
        _realization(state, ensemble, colours)
    with right:
        draw_e_type(state, ensemble, colours)
    with left:
        _image(ensemble, colours)
    draw_gallery(ensemble, colours, state.shown, lambda r: setattr(state, "shown", r))
    draw_curves(ensemble, state.facies, None if room_below_image(ensemble) else colours)


def _image(ensemble: Ensemble, colours: list[str]) -> None:
    image = ensemble.training_image
    panel_title("Training image", pretty(image.name))
    shown = facies_map(image.indices, image, colours, f"Training image {image.name}")
    draw_map(shown, "map_image", name="training_image", link="image", scale="maps", leads=False)
    if room_below_image(ensemble):
        draw_proportions(ensemble, colours)


def room_below_image(ensemble: Ensemble) -> bool:
    """Whether the training image, at the scale of the realizations, leaves room for a chart."""
    image, grid = ensemble.training_image, ensemble.grid
    left = (grid.ny - image.shape[0]) * USUAL_WIDTH / grid.nx
    return left > PROPORTIONS_TITLE + proportions_height(image.n_facies)


def _realization(state: State, ensemble: Ensemble, colours: list[str]) -> None:
    image, r = ensemble.training_image, state.shown
    panel_title(f"Realization {r + 1} of {ensemble.n}")
    shown = facies_map(ensemble.indices[r], image, colours, f"Realization {r + 1}")
    points = points_of(ensemble.hard_data, image, ensemble.realizations[r])
    shown.points.extend(points)
    draw_map(
        shown,
        "map_realization",
        grid=ensemble.grid,
        link="grid",
        scale="maps",
        name=f"realization_{r + 1}",
    )
