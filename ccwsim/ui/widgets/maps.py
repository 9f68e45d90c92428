"""Maps of facies and probabilities on a canvas: square cells, linked zoom, hover, data on top.

A volume has the same colours, labels and data; `volumes.draw_volume` draws it.
"""

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
BELOW = {
    "map": ("drawing",),
    "editor": ("drawing", "map", "edits"),
    "volume": ("drawing", "edits", "slice", "body"),
}
"""The modules before that of a component, after `calls`; it is one text in the browser."""
ENTRY = "export default "
"""Before what Streamlit calls: of the modules of a component that is the last one."""
N_STEPS = 200
"""Steps of a probability map; ensembles of up to so many realizations show exact shares."""


@dataclass(frozen=True)
class CellMap:
    """A map or volume as the canvas takes it: indices, what each looks like and is called."""

    indices: NDArray[np.uint8]  # (ny, nx) or (nz, ny, nx)
    colours: Sequence[str]  # "#rrggbb" of each value of `indices`
    labels: Sequence[str]  # what the hover says of each
    alt: str
    keys: Sequence[tuple[str, str]] = ()  # (label, colour) pairs of the legend
    strip: dict[str, Any] | None = None  # a colour strip instead: colours, low, high
    # (layer,) row, column, index of colour, wrong
    points: list[list[int]] = field(default_factory=list)
    point_colours: Sequence[str] = ()
    points_are: tuple[str, str] = ("datum", "data")  # what one of the points and several are called
    # drawn on top of a map: kind ("box", "ring", "disc", "cross"), row, column, height, width,
    # colour, label
    marks: list[dict[str, Any]] = field(default_factory=list)
    trail: list[list[float]] = field(default_factory=list)  # a line through cells, with an arrow


def facies_map(
    indices: NDArray[np.uint8], training_image: TrainingImage, colours: Sequence[str], alt: str
) -> CellMap:
    """Return the map or volume of facies indices in the colours of the facies."""
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
    """Return the map or volume of numbers from 0 to 1, such as probabilities."""
    steps = ramp(colours, N_STEPS + 1)
    labels = [f"{what} {k / N_STEPS:.2f}" for k in range(N_STEPS + 1)]
    indices = np.rint(shares * N_STEPS).astype(np.uint8)
    strip = {"colours": list(colours), "low": "0", "high": "1"}
    return CellMap(indices, steps, labels, alt, strip=strip, point_colours=point_colours)


def points_of(
    data: HardData, training_image: TrainingImage, realization: NDArray[np.integer] | None = None
) -> list[list[int]]:
    """Return hard data as [row, column, facies index, wrong], in volumes after the layer.

    A datum is wrong where a `realization`, in facies codes, says another facies.
    """
    if not data.n:
        return []
    places = np.searchsorted(training_image.codes, data.facies)
    wrong = np.zeros(data.n, bool)
    if realization is not None:
        wrong = realization[tuple(data.cells.T)] != data.facies
    return np.column_stack([data.cells, places, wrong]).astype(int).tolist()


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
    return shared_content(cell_map) | {
        "png": b64encode(index_png(cell_map.indices)).decode(),
        "nx": nx,
        "ny": ny,
        "marks": cell_map.marks,
        "trail": cell_map.trail,
        "axes": grid is not None,
        "cell_size": list(grid.cell_size) if grid else [1.0, 1.0],
        "origin": list(grid.origin) if grid else [0.0, 0.0],
        "link": link,
        "scale": scale,
        "leads": leads,
        "name": name,
        "max_height": max_height,
    }


def shared_content(cell_map: CellMap) -> dict[str, Any]:
    """Return what the canvas needs to draw a map as well as a volume."""
    n_wrong = sum(point[cell_map.indices.ndim + 1] for point in cell_map.points)
    return {
        "lut": list(cell_map.colours),
        "labels": list(cell_map.labels),
        "keys": [list(pair) for pair in cell_map.keys],
        "strip": cell_map.strip,
        "points": cell_map.points,
        "point_lut": list(cell_map.point_colours) or None,
        "points_are": list(cell_map.points_are),
        "wrong_label": f"{n_wrong} not honoured" if n_wrong else "",
        "alt": cell_map.alt,
    }


def reported(key: str, name: str) -> Any:
    """Return what a component reported, for a callback; None after a run that was interrupted."""
    return getattr(st.session_state.get(key), name, None)


@cache
def canvas_component(name: str) -> Any:
    """Return the component whose parts are `canvas/<name>.html`, `.css` and `.js`."""
    html, css, js = component_parts(name)
    component = v2.component(f"ccwsim_{name}", html=html, css=css, js=js)

    def draw(**options: Any) -> Any:
        for option, value in options.items():
            if option.startswith("on_"):
                options[option] = catch_callback_errors(value)
        return component(**options)

    return draw


def component_parts(name: str) -> tuple[str, str, str]:
    """Return HTML, CSS and JavaScript of a component, after the modules that it builds on."""
    modules = "calls", *BELOW.get(name, ()), name
    css, js = ("\n".join(_text(f"{module}.{kind}") for module in modules) for kind in ("css", "js"))
    inherited = js.count(ENTRY) - 1
    return _text(f"{name}.html"), css, js.replace(ENTRY, "", inherited)


def _text(name: str) -> str:
    """A file of the folder; a module without a style sheet has none."""
    path = CANVAS / name
    return path.read_text("utf-8") if path.exists() or path.suffix != ".css" else ""
