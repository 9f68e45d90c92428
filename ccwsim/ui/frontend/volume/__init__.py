"""Volumes on a canvas: three linked slices with cross hairs, and the volume itself as a body."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from hashlib import blake2b
from typing import Any

import numpy as np
import streamlit as st
from numpy.typing import NDArray

from ccwsim.model.grid import Grid
from ccwsim.ui.frontend.cell_map import CellMap, shared_content
from ccwsim.ui.frontend.component import canvas_component, reported

LEVEL = 6
"""Of the compression: level 9 takes ten times as long for a tenth of the bytes."""


def draw_volume(
    cells: CellMap,
    key: str,
    *,
    on_edits: Callable[[list[dict[str, Any]]], None] | None = None,
    editing: Mapping[str, Any] | None = None,
    **options: Any,
) -> None:
    """Put a volume on the page; `options` are those of `volume_content`.

    Volumes of the same `link` share the cursor, the slices and the vertical exaggeration.
    `on_edits` gets edits that the page may have had already, each with `seq`, a growing number, and
    either `cells`, the (layer, row, column) that the user clicks or draws over in a slice, or where
    the cross hairs are when Enter is pressed, and `axis`, that across the slice; or `do`, "undo" or
    "redo". `editing` has `ack`, the number of the last edit taken, `can_undo` and `can_redo`.
    """
    content = volume_content(cells, key, **options) | {"picks": on_edits is not None}

    def edited() -> None:
        edits = reported(key, "edits")
        if edits and on_edits:
            on_edits(edits)

    content |= editing or {}
    canvas_component("volume")(key=key, data=content, on_edits_change=edited)


def volume_content(
    cells: CellMap,
    key: str,
    *,
    grid: Grid | None = None,
    link: str = "",
    name: str = "volume",
    body: bool = True,
    cursor: Sequence[int] | None = None,
    max_height: int = 480,
) -> dict[str, Any]:
    """Return what the canvas needs to draw a volume.

    The coordinates of `grid` are drawn along the edges of the slices. Without `body` there are the
    three slices alone, for a small panel. Slices go through the cell `cursor` (layer, row, column)
    when it is another than before; else the user alone moves them. The browser keeps cursor, angle
    and mode under `key`, or under `link`. `name` is the file name, without ending, of the saved
    picture; `max_height` of the map and of the body is in pixels.

    Examples
    --------
    >>> cells = CellMap(np.zeros((2, 3, 4), np.uint8), ["#888888"], ["mud"], "A volume of mud")
    >>> content = volume_content(cells, "mud", grid=Grid(3, 4, (25.0, 25.0, 0.5), nz=2))
    >>> content["shape"], content["cell_size"], content["axes"]
    ([4, 3, 2], [25.0, 25.0, 0.5], True)
    """
    indices = np.ascontiguousarray(cells.indices, np.uint8)
    digest = blake2b(indices.tobytes(), digest_size=16).hexdigest()
    return shared_content(cells) | {
        "cells": _packed(f"{indices.shape} {digest}", indices),
        "digest": digest,
        "shape": list(indices.shape[::-1]),  # along x, y and z, as all in the browser
        "axes": grid is not None,
        "cell_size": list(grid.cell_size) if grid else [1.0, 1.0, 1.0],
        "origin": list(grid.origin) if grid else [0.0, 0.0, 0.0],
        "key": key,
        "link": link,
        "name": name,
        "body": body,
        "cursor": list(cursor[::-1]) if cursor else None,
        "max_height": max_height,
    }


@st.cache_data(max_entries=32, show_spinner=False)
def _packed(digest: str, _indices: NDArray[np.uint8]) -> str:
    """Cells, x fastest, then y, then z from the bottom; compressed, as text."""
    return b64encode(zlib.compress(_indices.tobytes(), LEVEL)).decode()
