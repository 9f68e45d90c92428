"""Maps of facies and probabilities on a canvas: square cells, linked zoom, hover, data on top."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import NDArray
from streamlit.components import v2

from ccwsim.figures import CIVIDIS, index_png, ramp
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.widgets.errors import catch_callback_errors

CANVAS = Path(__file__).parent / "canvas"
N_STEPS = 200
"""Steps of a probability map; ensembles of up to so many realizations show exact shares."""


@dataclass(frozen=True)
class CellMap:
    """A map as the canvas takes it: indices, and what each index looks like and is called."""

    indices: NDArray[np.uint8]  # (ny, nx)
    colours: Sequence[str]  # "#rrggbb" of each value of `indices`
    labels: Sequence[str]  # what the hover says of each
    alt: str
    keys: Sequence[tuple[str, str]] = ()  # (label, colour) pairs of the legend
    strip: dict[str, Any] | None = None  # a colour strip instead: colours, low, high
    points: list[list[int]] = field(default_factory=list)  # row, column, index of colour, wrong
    point_colours: Sequence[str] = ()
    # drawn on top: kind ("box", "ring", "disc", "cross"), row, column, height, width, colour, label
    marks: list[dict[str, Any]] = field(default_factory=list)
    trail: list[list[float]] = field(default_factory=list)  # a line through cells, with an arrow


def facies_map(
    indices: NDArray[np.uint8], training_image: TrainingImage, colours: Sequence[str], alt: str
) -> CellMap:
    """Return the map of facies indices, shape (ny, nx), in the colours of the facies."""
    names = training_image.facies_names
    keys = list(zip(names, colours, strict=True))[:8]
    return CellMap(indices, colours, names, alt, keys=keys, point_colours=colours)


def share_map(
    shares: NDArray[np.float64],
    what: str,
    alt: str,
    *,
    colours: Sequence[str] = CIVIDIS,
    point_colours: Sequence[str] = (),
) -> CellMap:
    """Return the map of numbers from 0 to 1, such as probabilities, shape (ny, nx)."""
    steps = ramp(colours, N_STEPS + 1)
    labels = [f"{what} {k / N_STEPS:.2f}" for k in range(N_STEPS + 1)]
    indices = np.rint(shares * N_STEPS).astype(np.uint8)
    strip = {"colours": list(colours), "low": "0", "high": "1"}
    return CellMap(indices, steps, labels, alt, strip=strip, point_colours=point_colours)


def points_of(
    data: HardData, training_image: TrainingImage, realization: NDArray[np.integer] | None = None
) -> list[list[int]]:
    """Return hard data as [row, column, facies index, wrong] for a map.

    A datum is wrong where a `realization`, in facies codes, says another facies.
    """
    if not data.n:
        return []
    rows, columns = data.cells.T
    places = np.searchsorted(training_image.codes, data.facies)
    wrong = np.zeros(data.n, bool)
    if realization is not None:
        wrong = realization[rows, columns] != data.facies
    return np.column_stack([rows, columns, places, wrong]).astype(int).tolist()


def draw_map(
    cell_map: CellMap,
    key: str,
    *,
    link: str = "",
    tools: bool = True,
    on_cell: Callable[[int, int], None] | None = None,
    **options: Any,
) -> None:
    """Put a map on the page; `options` are those of `map_content`.

    Maps of the same `link` zoom, move and hover together. Without `tools` it cannot be zoomed and
    saved, as a small map has no room for the buttons. `on_cell` gets row and column of a cell that
    the user clicks.
    """
    content = map_content(cell_map, link=link, **options)
    content |= {"picks": on_cell is not None, "tools": tools}

    def picked() -> None:
        cell = reported(key, "cell")
        if cell and on_cell:
            on_cell(int(cell[0]), int(cell[1]))

    canvas_component("map")(key=key, data=content, on_cell_change=picked)


def map_content(
    cell_map: CellMap,
    *,
    grid: Grid | None = None,
    link: str = "",
    scale: str = "",
    leads: bool = True,
    name: str = "map",
    max_height: int = 620,
) -> dict[str, Any]:
    """Return what the canvas needs to draw a map.

    The coordinates of `grid` are drawn along the edges. Maps of the same `scale` have cells of the
    same size on the page, as large as all those that lead have room for. `name` is the file name,
    without ending, of the saved picture; `max_height` is in pixels.
    """
    ny, nx = cell_map.indices.shape
    n_wrong = sum(point[3] for point in cell_map.points)
    return {
        "png": b64encode(index_png(cell_map.indices)).decode(),
        "nx": nx,
        "ny": ny,
        "lut": list(cell_map.colours),
        "labels": list(cell_map.labels),
        "keys": [list(pair) for pair in cell_map.keys],
        "strip": cell_map.strip,
        "points": cell_map.points,
        "point_lut": list(cell_map.point_colours) or None,
        "marks": cell_map.marks,
        "trail": cell_map.trail,
        "wrong_label": f"{n_wrong} not honoured" if n_wrong else "",
        "alt": cell_map.alt,
        "axes": grid is not None,
        "cell_size": list(grid.cell_size) if grid else [1.0, 1.0],
        "origin": list(grid.origin) if grid else [0.0, 0.0],
        "link": link,
        "scale": scale,
        "leads": leads,
        "name": name,
        "max_height": max_height,
    }


def reported(key: str, name: str) -> Any:
    """Return what a component reported, for a callback; None after a run that was interrupted."""
    return getattr(st.session_state.get(key), name, None)


@cache
def canvas_component(name: str) -> Any:
    """Return the component whose parts are `canvas/<name>.html`, `.css` and `.js`."""
    kinds = ("html", "css", "js")
    html, css, js = ((CANVAS / f"{name}.{kind}").read_text("utf-8") for kind in kinds)
    component = v2.component(f"ccwsim_{name}", html=html, css=css, js=js)

    def draw(**options: Any) -> Any:
        for option, value in options.items():
            if option.startswith("on_"):
                options[option] = catch_callback_errors(value)
        return component(**options)

    return draw
