"""Maps of facies and probabilities: square cells, linked zoom, hover, data on top."""

from __future__ import annotations

from base64 import b64encode
from typing import Any

from ccwsim.figures import index_png
from ccwsim.model.grid import Grid
from ccwsim.ui.frontend.cell_map import CellMap, shared_content


def map_content(
    cell_map: CellMap,
    *,
    grid: Grid | None = None,
    link: str = "",
    scale: str = "",
    leads: bool = True,
    name: str = "map",
    max_height: int = 620,
    tools: bool = True,
    picks: bool = False,
) -> dict[str, Any]:
    """Return the content of the component that draws a map; see `draw_cells`."""
    ny, nx = cell_map.indices.shape
    return shared_content(cell_map, grid) | {
        "png": b64encode(index_png(cell_map.indices)).decode(),
        "nx": nx,
        "ny": ny,
        "marks": cell_map.marks,
        "trail": cell_map.trail,
        "link": link,
        "scale": scale,
        "leads": leads,
        "name": name,
        "max_height": max_height,
        "tools": tools,
        "picks": picks,
    }
