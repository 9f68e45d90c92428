"""A component for maps: square cells, linked zoom, labels on hovering, data on top."""

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
"""Default options of a map: the options of `draw_cells`, and `picks` (a click selects a cell)."""


def map_content(cell_map: CellMap, *, grid: Grid | None = None, **options: Any) -> dict[str, Any]:
    """Return the content of the map component; `options` replace some of `OPTIONS`."""
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
