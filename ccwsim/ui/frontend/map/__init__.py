"""A component for maps: square cells, linked zoom, labels on hovering, data on top."""

from __future__ import annotations

from base64 import b64encode
from hashlib import blake2b
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import NDArray

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
    indices = np.ascontiguousarray(cell_map.indices, np.uint8)
    ny, nx = indices.shape
    digest = blake2b(indices.tobytes(), digest_size=16).hexdigest()
    return shared_content(cell_map, grid) | {
        "png": _encoded(f"{indices.shape} {digest}", indices),
        "nx": nx,
        "ny": ny,
        "marks": cell_map.marks,
        "trail": cell_map.trail,
        **OPTIONS,
        **options,
    }


@st.cache_data(max_entries=64, show_spinner=False)
def _encoded(digest: str, _indices: NDArray[np.uint8]) -> str:
    """Return the cells as an encoded picture, which all sessions share."""
    return b64encode(index_png(_indices)).decode()
