"""The results: maps, charts and files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import streamlit as st

from ccwsim.figures import map_png
from ccwsim.figures.proportions import proportions_height
from ccwsim.io import parameters_to_json, realizations_as_bytes
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.results.curves import draw_curves, draw_proportions
from ccwsim.ui.results.maps import (
    MAP_WIDTHS,
    SMALLEST_IMAGE,
    colours_of_ran,
    draw_e_type,
    draw_gallery,
    draw_ghost,
    draw_realization,
    draw_training_image,
    is_wide,
    map_columns,
)
from ccwsim.ui.results.tables import curves_csv, realizations_csv
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import is_current
from ccwsim.ui.widgets.facts import draw_facts
from ccwsim.ui.widgets.text import step_note

USUAL_WIDTH = 400
PROPORTIONS_TITLE = 40
"""Pixels of a realization on a usual screen, and of the title of the proportions."""
OLD_FILES = "Out of date: files are of the realizations that are shown and their settings."
MIME = {
    "npz": "application/octet-stream",
    "gslib": "text/plain",
    "png": "image/png",
    "json": "application/json",
    "csv": "text/csv",
}


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
    below = room_below_image(ensemble)
    widths = (image_width(ensemble), *MAP_WIDTHS)
    with st.container(key="maps"):
        left, middle, right = map_columns(widths, 1, ensemble.grid)
    with middle:  # first, so that it is the first to be seen
        draw_realization(ensemble, colours, state.shown, ensemble.grid)
    with right:
        draw_e_type(state, ensemble, colours)
    with left, st.container(key="image_beside"):
        link = {"link": "image", "scale": "maps", "leads": False}
        draw_training_image(ensemble.training_image, colours, **link)
        if below:
            draw_proportions(ensemble, colours)
    draw_gallery(ensemble, colours, state.shown, lambda r: setattr(state, "shown", r))
    draw_curves(ensemble, state.facies, None if below else colours)


def image_width(ensemble: Ensemble) -> float:
    """Return how wide the training image is for one of `USUAL_WIDTH`; as its cells where it can."""
    share = ensemble.training_image.shape[1] / ensemble.grid.nx
    return min(max(share, SMALLEST_IMAGE), 1.0)


def room_below_image(ensemble: Ensemble) -> bool:
    """Whether the training image, at the scale of the realizations, leaves room for a chart."""
    image, grid = ensemble.training_image, ensemble.grid
    left = (grid.ny - image.shape[0]) / grid.nx
    if is_wide(grid):
        high = image_width(ensemble) * image.shape[0] / image.shape[1]
        left = 2 * sum(MAP_WIDTHS) * grid.ny / grid.nx - high
    return left * USUAL_WIDTH > PROPORTIONS_TITLE + proportions_height(image.n_facies)


def draw_downloads(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw a menu of files; each is made when it is asked for."""
    shown = state.shown

    def all_as(kind: str) -> bytes:
        return realizations_as_bytes(ensemble, kind, colours=colours)

    files: dict[str, tuple[str, Callable[[], bytes]]] = {
        "realizations.npz": ("All realizations, NumPy", lambda: all_as("npz")),
        "realizations.gslib": ("All realizations, GSLIB", lambda: all_as("gslib")),
        "realizations.png": ("All realizations, one picture", lambda: all_as("png")),
        f"realization_{shown + 1}.png": (
            f"Realization {shown + 1}, PNG",
            lambda: map_png(ensemble.indices[shown], colours, scale=2),
        ),
        "parameters.json": (
            "Parameters, JSON",
            lambda: parameters_to_json(ensemble.parameters).encode(),
        ),
        "curves.csv": ("Curves, CSV", lambda: curves_csv(ensemble, state.facies)),
        "realizations.csv": ("Times and proportions, CSV", lambda: realizations_csv(ensemble)),
    }
    with st.popover("Download", key="downloads"):
        if not is_current(state):
            step_note(OLD_FILES)
        for name, (label, content) in files.items():
            options: dict[str, Any] = {"mime": MIME[name.rsplit(".", 1)[1]], "width": "stretch"}
            key = f"download_{name.replace('.', '_')}"
            st.download_button(label, content, name, key=key, on_click="ignore", **options)
