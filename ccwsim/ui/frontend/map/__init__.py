"""Maps of facies and probabilities: square cells, linked zoom, hover, data on top."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from typing import Any

from ccwsim.figures import index_png
from ccwsim.model.grid import Grid
from ccwsim.ui.frontend.cell_map import CellMap, shared_content
from ccwsim.ui.frontend.component import canvas_component, reported


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
