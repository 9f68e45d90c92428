"""Put a map or a volume on the page; only this module chooses the component."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ccwsim.model.grid import Grid
from ccwsim.ui.frontend.cell_map import CellMap
from ccwsim.ui.frontend.component import draw_component
from ccwsim.ui.frontend.map import map_content
from ccwsim.ui.frontend.volume import volume_content


def draw_cells(
    cells: CellMap,
    key: str,
    *,
    name: str = "cells",
    grid: Grid | None = None,
    link: str = "",
    max_height: int | None = None,
    scale: str = "",
    leads: bool = True,
    tools: bool = True,
    on_cell: Callable[[int, int], None] | None = None,
    body: bool = True,
    cursor: Sequence[int] | None = None,
) -> None:
    """Put a map or a volume on the page, under a unique `key`.

    `name` is the file name of the saved picture, without ending. The coordinates of `grid` are
    drawn along the edges. Maps with the same `link` zoom, pan and hover together; volumes share
    cursor, slices and vertical exaggeration. `max_height` limits the height in pixels of a map, or
    of each slice and the body of a volume.

    Options of maps: maps with the same `scale` share one cell size, the largest at which each map
    with `leads` fits on the page. `tools` shows buttons for zooming and saving. `on_cell` is called
    with the row and column of a clicked cell. Options of volumes: `body` shows the volume beside
    three slices. If `cursor` (layer, row, column) changes, the slices move to this cell; otherwise
    only the user moves the slices.
    """
    options: dict[str, Any] = {"grid": grid, "link": link, "name": name}
    if max_height:
        options["max_height"] = max_height
    if cells.indices.ndim == 3:
        key = f"volume_{key}"
        content = volume_content(cells, key, body=body, cursor=cursor, **options)
        draw_component("volume", key, content)
        return
    options |= {"scale": scale, "leads": leads, "tools": tools, "picks": on_cell is not None}

    def picked(cell: Sequence[int]) -> None:
        if on_cell is not None:
            on_cell(int(cell[0]), int(cell[1]))

    draw_component("map", f"map_{key}", map_content(cells, **options), "cell", picked)


def draw_editable(
    cells: CellMap,
    take_edits: Callable[[list[dict[str, Any]]], None],
    editing: dict[str, Any],
    **options: Any,
) -> None:
    """Put a map or a volume with editable points on the page.

    `take_edits` is called with a list of edits; an edit may arrive twice. An edit has an increasing
    number `seq` and either `do` ("undo" or "redo") or a drawing. A drawing on a map has `set`, a
    list of [row, column, facies index or −1 to erase]. A drawing in a slice of a volume has `axis`,
    the axis perpendicular to the slice, and `cells`, a list of [layer, row, column] that the user
    clicked, drew over, or marked at the cross hairs with Enter.

    `editing` has `ack` (the number of the last applied edit), `can_undo` and `can_redo`. For a map,
    `editing` also has `brushes` (label and colour of each facies), `reads` (whether the map shows
    facies to place) and `empty` (whether the map is blank). `options` replace defaults of the
    component.
    """
    if cells.indices.ndim == 3:
        key = "volume_editor"
        content = volume_content(cells, key, picks=True, **options) | editing
        draw_component("volume", key, content, "edits", take_edits)
    else:
        content = map_content(cells, scale="maps", **options) | editing
        draw_component("editor", "editor", content, "edits", take_edits)
