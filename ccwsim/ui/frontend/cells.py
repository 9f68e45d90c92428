"""Put a map or a volume on the page: only here and in the layout of a page the two differ."""

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
    """Put a map or a volume on the page, under a `key` of its own.

    `name` is the file name, without ending, of the saved picture. The coordinates of `grid` are
    drawn along the edges. Maps of one `link` zoom, move and hover together; volumes share the
    cursor, the slices and the vertical exaggeration. `max_height` is in pixels: of a map, or of the
    map and the body of a volume.

    Only maps: those of one `scale` have cells of the same size on the page, as large as all that
    lead (`leads`) have room for; without `tools` (zoom, save) a small one keeps its room; `on_cell`
    gets row and column of a cell that the user clicks. Only volumes: `body` shows the volume beside
    its three slices; these go through the cell `cursor` (layer, row, column) when it is another
    than before, otherwise only the user moves them.
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
    """Put a map or a volume on the page whose points can be edited.

    `take_edits` gets edits that the page may have had already, each with `seq`, a growing number,
    and either `do`, "undo" or "redo", or what was drawn: on a map `set`, a list of [row, column,
    index of the facies or −1 to erase]; in a volume `cells`, a list of [layer, row, column] that
    the user clicks or draws over in a slice, or at the cross hairs when Enter is pressed, and
    `axis`, that across the slice.

    `editing` has `ack`, the number of the last edit taken, `can_undo` and `can_redo`; of a map also
    `brushes`, label and colour of each facies, `reads`, whether the map shows facies to place, and
    `empty`, whether it shows nothing. `options` are those of the content of the component.
    """
    if cells.indices.ndim == 3:
        key = "volume_editor"
        content = volume_content(cells, key, picks=True, **options) | editing
        draw_component("volume", key, content, "edits", take_edits)
    else:
        content = map_content(cells, scale="maps", **options) | editing
        draw_component("editor", "editor", content, "edits", take_edits)
