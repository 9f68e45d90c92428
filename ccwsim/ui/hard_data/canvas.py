"""The map that takes data: what it shows, and the edits that come back."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import NDArray
from streamlit.components import v2

from ccwsim.model.ensemble import FORCED, WRONG, Ensemble
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.hard_data.actions import take_edits
from ccwsim.ui.hard_data.state import Editor
from ccwsim.ui.results.e_type import uncertainty_map
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.errors import catch_callback_errors
from ccwsim.ui.widgets.maps import CANVAS, CellMap, facies_map, map_content, points_of
from ccwsim.ui.widgets.theme import chart_theme

KEY = "editor"
MAX_HEIGHT = 620
SHARED = "export default function (component)"


def draw_canvas(
    state: State, data: HardData, image: TrainingImage, colours: list[str],
    ensemble: Ensemble | None,
) -> None:  # fmt: skip
    """Draw the map with the data on it; its edits are taken into the state."""
    page_state = state.page(Editor)
    grid = state.choices.grid
    ground = page_state.ground if ensemble is not None else "empty"
    if ensemble is None or ground == "empty":
        shown = empty_map(grid)
    elif ground == "realization":
        indices = ensemble.indices[state.shown]
        shown = replace(facies_map(indices, image, colours, "Hard data"), keys=())
    else:
        shown = uncertainty_map(state, ensemble, colours)
    helped = helped_by(data, ensemble, state.shown if ground == "realization" else None)
    shown = replace(
        shown, point_colours=colours, alt="Hard data; arrow keys move, Enter places, Delete erases",
        points=[
            [*point[:3], int(help == WRONG), 0 if help == WRONG else help]
            for point, help in zip(points_of(data, image), helped, strict=True)
        ],
    )  # fmt: skip
    content = map_content(shown, grid, "grid", "maps", True, "hard_data", MAX_HEIGHT)
    history = page_state.history
    content |= {
        "brushes": [
            {"label": name, "colour": colour}
            for name, colour in zip(image.facies_names, colours, strict=True)
        ],
        "reads": ground == "realization",
        "empty": ground == "empty",
        "ack": page_state.taken,
        "can_undo": bool(history.past),
        "can_redo": bool(history.future),
    }

    def edited() -> None:
        edits = st.session_state[KEY].edits
        if edits:
            take_edits(state, edits)

    component()(key=KEY, data=content, on_edits_change=catch_callback_errors(edited))


def empty_map(grid: Grid) -> CellMap:
    """Return a map of a grid with nothing on it."""
    nothing = np.zeros(grid.shape, np.uint8)
    return CellMap(nothing, [chart_theme().paper], ["no datum"], "Empty grid")


def helped_by(data: HardData, ensemble: Ensemble | None, shown: int | None) -> list[int]:
    """Return the `Ensemble.data_status` of each datum in a realization; 0 where unknown."""
    if ensemble is None or shown is None or ensemble.hard_data.digest != data.digest:
        return [0] * data.n
    return ensemble.data_status[shown].tolist()


def said_help(data_status: NDArray[np.integer]) -> str:
    """Say in words how the data of one realization were met.

    Parameters
    ----------
    data_status : ndarray of int, shape (n_data,)
        A row of `Ensemble.data_status`.

    Examples
    --------
    >>> said_help(np.array([0, 0, 16, 8, -1]))
    '2 met by the raster, 2 mended in windows of 8 to 16 cells, 1 set by force'
    >>> said_help(np.array([0, 0]))
    'all 2 met by the raster'
    >>> said_help(np.array([0, -2]))
    '1 met by the raster, 1 wrong, as exact data is off'
    """
    sizes = data_status[data_status > 0]
    n_raster, n_forced = np.count_nonzero(data_status == 0), np.count_nonzero(data_status == FORCED)
    n_wrong = np.count_nonzero(data_status == WRONG)
    if n_raster == len(data_status):
        return f"all {n_raster} met by the raster" if n_raster > 1 else "met by the raster"
    parts = [f"{n_raster} met by the raster"] if n_raster else []
    if len(sizes):
        low, high = sizes.min(), sizes.max()
        span = f"{low} cells" if low == high else f"{low} to {high} cells"
        parts.append(
            f"{len(sizes)} mended in {'a window' if len(sizes) == 1 else 'windows'} of {span}"
        )
    if n_forced:
        parts.append(f"{n_forced} set by force")
    if n_wrong:
        parts.append(f"{n_wrong} wrong, as exact data is off")
    return ", ".join(parts)


@cache
def component() -> Any:
    """Return the component: the map's own drawing and the editor on top, as one module."""
    html = (CANVAS / "editor.html").read_text("utf-8")
    css = "\n".join((CANVAS / f"{name}.css").read_text("utf-8") for name in ("map", "editor"))
    drawing = (CANVAS / "map.js").read_text("utf-8")
    drawing = drawing.replace(SHARED, "function showMap(component)")
    js = f"{drawing}\n{(CANVAS / 'editor.js').read_text('utf-8')}"
    return v2.component("ccwsim_editor", html=html, css=css, js=js)
