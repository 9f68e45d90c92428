"""A component for volumes: three linked slices with cross hairs, and a 3D view (the body)."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Sequence
from hashlib import blake2b
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.model.grid import Grid
from ccwsim.ui.frontend.cell_map import CellMap, shared_content

OPTIONS = {"link": "", "name": "volume", "body": True, "max_height": 480, "picks": False}
"""Default options of a volume: the options of `draw_cells`, and `picks` (clicks select cells)."""
COMPRESSION = 6
"""Compression level of zlib; level 9 is ten times slower and saves only 10 % of the bytes."""


def volume_content(
    cells: CellMap,
    key: str,
    *,
    grid: Grid | None = None,
    cursor: Sequence[int] | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Return the content of the volume component; `options` replace some of `OPTIONS`.

    The browser stores cursor, view angle and mode under the name `link`, by default `key`.
    """
    indices = np.ascontiguousarray(cells.indices, np.uint8)
    digest = blake2b(indices.tobytes(), digest_size=16).hexdigest()
    return shared_content(cells, grid) | {
        "cells": _packed(f"{indices.shape} {digest}", indices),
        "digest": digest,
        "shape": list(indices.shape[::-1]),  # the browser's axis order is x, y, z
        "key": key,
        "wells": [[name, list(map(list, path))] for name, path in cells.wells],
        "cursor": list(cursor[::-1]) if cursor else None,
        **OPTIONS,
        **options,
    }


@st.cache_data(max_entries=32, show_spinner=False)
def _packed(digest: str, _indices: NDArray[np.uint8]) -> str:
    """Return the cells as compressed text; x varies fastest, z slowest, starting at the bottom."""
    return b64encode(zlib.compress(_indices.tobytes(), COMPRESSION)).decode()
