"""Maps of facies and probabilities: square cells, linked zoom, hover, data on top."""

from __future__ import annotations

from base64 import b64encode
from typing import Any

from ccwsim.figures import index_png
from ccwsim.model.grid import Grid
from ccwsim.ui.frontend.cell_map import CellMap, shared_content

OPTIONS = {
    "link": "",
    "scale": "",
    "leads": True,
    "name": "map",
    "max_height": 620,
    "tools": True,
    "picks": False,
}
"""Default options of a map: the options of `draw_cells`, and whether a click picks a cell."""


def map_content(cell_map: CellMap, *, grid: Grid | None = None, **options: Any) -> dict[str, Any]:
    """Return the content of the map component, with some of `OPTIONS` replaced."""
    ny, nx = cell_map.indices.shape
    return shared_content(cell_map, grid) | {
        "png": b64encode(index_png(cell_map.indices)).decode(),
        "nx": nx,
        "ny": ny,
        "marks": cell_map.marks,
        "trail": cell_map.trail,
        **OPTIONS,
        **options,
    }
