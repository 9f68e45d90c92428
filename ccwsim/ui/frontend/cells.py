"""Maps and volumes on a page: cells with colours and labels, with data and marks on top."""

import zlib
from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import Grid, HardData, TrainingImage
from ccwsim.figures import CIVIDIS, VALUE_COLOURS, steps_of
from ccwsim.figures.style import value_limits
from ccwsim.model import Array, Bytes, Floats, minus, three_digits
from ccwsim.sharing.choices import CellsOfWells
from ccwsim.ui.frontend.component import draw_component

MAX_WELL_NAMES = 30
"""Maximum number of wells whose names are written; with more wells, names appear on hovering."""
COMPRESSION = {2: 4, 3: 6}
"""Compression level of zlib by number of dimensions. Higher levels save a third of the bytes of a
volume, but take six times as long for a map of probabilities."""


@dataclass(frozen=True)
class CellMap:
    """A map or volume to draw: indices with a colour and a label for each value."""

    indices: Bytes  # (ny, nx) or (nz, ny, nx)
    colours: Sequence[str]  # colour "#rrggbb" of each value of `indices`
    labels: Sequence[str]  # label of each value, shown on hovering
    alt: str
    keys: Sequence[tuple[str, str]] = ()  # (label, colour) pairs of the legend
    strip: dict[str, Any] | None = None  # replaces the legend; keys: colours, low, high
    # each point has (layer,) row, column, colour index, and whether the datum is wrong
    points: list[list[int]] = field(default_factory=list)
    point_colours: Sequence[str] = ()
    points_are: tuple[str, str] = ("datum", "data")  # name of a point, in singular and plural
    # marks on a map; each has a kind ("box", "ring", "disc", "cross"), row, column, height,
    # width, colour and label
    marks: list[dict[str, Any]] = field(default_factory=list)
    trail: list[list[float]] = field(default_factory=list)  # line of cells with an arrow
    # points of lines, each with (layer,) row, column in cells and the index of a colour
    lines: list[list[list[float]]] = field(default_factory=list)
    line_colours: Sequence[str] = ()
    wells: CellsOfWells = ()  # named wells, with the cells of each well


def facies_map(
    indices: Bytes, training_image: TrainingImage, colours: Sequence[str], alt: str
) -> CellMap:
    """Return a map or volume of facies indices in the colours of the facies."""
    names = training_image.facies_names
    keys = list(zip(names, colours, strict=True))[:8]
    return CellMap(indices, colours, names, alt, keys=keys, point_colours=colours)


def number_map(
    numbers: Floats,
    name: str,
    alt: str,
    *,
    limits: tuple[float, float] = (0.0, 1.0),
    text: Callable[[float], str] = "{:.2f}".format,
    units: str = "",
    colours: Sequence[str] = CIVIDIS,
    point_colours: Sequence[str] = (),
) -> CellMap:
    """Return a map or volume of numbers between limits, such as probabilities or values.

    `text` writes the numbers in labels, which `units` follow.
    """
    indices, steps = steps_of(numbers, limits, tuple(colours))
    places = np.linspace(*limits, len(steps)).tolist()
    labels = [minus(f"{name} {text(place)}{units}") for place in places]
    low, high = (minus(three_digits(limit)) for limit in limits)
    strip = {"colours": list(colours), "low": low, "high": f"{high}{units}"}
    return CellMap(indices, steps, labels, alt, strip=strip, point_colours=point_colours)


def map_of_values(
    values: Floats, image: TrainingImage, data: HardData, alt: str, name: str = ""
) -> CellMap:
    """Return a map of values of a continuous variable, by default with its name."""
    return number_map(
        values,
        name or image.variable,
        alt,
        limits=value_limits(image, data),
        text=three_digits,
        units=f" {image.units}".rstrip(),
        colours=VALUE_COLOURS,
    )


def editor_points(
    data: HardData, training_image: TrainingImage, realization: Array | None = None
) -> list[list[int]]:
    """Return data as [(layer,) row, column, facies index, wrong in `realization`].

    A realization has facies codes, or values.
    """
    if not data.n:
        return []
    indices = np.searchsorted(training_image.codes, data.facies)
    wrong = np.zeros(data.n, bool)
    if realization is not None:
        wrong = realization[tuple(data.cells.T)] != data.measured
    return np.column_stack([data.cells, indices, wrong]).astype(int).tolist()


def shared_content(cell_map: CellMap, grid: Grid | None, axes: bool = True) -> dict[str, Any]:
    """Return the content that the components of maps and of volumes share.

    The geometry of `grid` is read out; with `axes`, coordinates are also drawn along the edges.
    """
    indices = np.ascontiguousarray(cell_map.indices, np.uint8)
    n_dimensions = indices.ndim
    digest = f"{indices.shape} {blake2b(indices.tobytes(), digest_size=16).hexdigest()}"
    n_wrong = sum(point[n_dimensions + 1] for point in cell_map.points)
    return {
        "cells": _packed(digest, indices),
        "digest": digest,
        "lut": list(cell_map.colours),
        "labels": list(cell_map.labels),
        "keys": [list(pair) for pair in cell_map.keys],
        "strip": cell_map.strip,
        "points": cell_map.points,
        "lines": cell_map.lines,
        "line_lut": list(cell_map.line_colours),
        "wells": [[name, list(map(list, path))] for name, path in cell_map.wells],
        "max_names": MAX_WELL_NAMES,
        "point_lut": list(cell_map.point_colours) or None,
        "points_are": list(cell_map.points_are),
        "wrong_label": f"{n_wrong} not honoured" if n_wrong else "",
        "alt": cell_map.alt,
        "axes": grid is not None and axes,
        "cell_size": list(grid.cell_size) if grid else [1.0] * n_dimensions,
        "origin": list(grid.origin) if grid else [0.0] * n_dimensions,
    }


def draw_cells(
    cell_map: CellMap,
    key: str,
    *,
    name: str = "cells",
    grid: Grid | None = None,
    axes: bool = True,
    link: str = "",
    max_height: int | None = None,
    scale: str = "",
    leads: bool = True,
    tools: bool = True,
    on_cell: Callable[[int, int], None] | None = None,
    answer: int = 0,
    body: bool = True,
    cursor: Sequence[int] | None = None,
    fits: bool = False,
) -> None:
    """Put a map or a volume on the page, under a unique `key`.

    `name` is the file name of the saved picture, without ending. The coordinates of `grid` are
    read out and, with `axes`, drawn along the edges. Maps with the same `link` zoom, pan and hover
    together; volumes share cursor, slices and vertical exaggeration. `max_height` limits the height
    in pixels of a map, or of each slice and the body of a volume.

    Options of maps: maps with the same `scale` share one cell size, the largest at which each map
    with `leads` fits on the page. `tools` shows buttons for zooming and saving. `on_cell` is called
    with the row and column of a clicked cell. After `answer` has changed, the user can compare the
    map with the previous map. Options of volumes: `body` shows the volume beside three slices; if
    the volume `fits` the height that the style sheet sets, instead of the slices on request. If
    `cursor` (layer, row, column) changes, the slices move to this cell; otherwise
    only the user moves the slices.
    """
    options: dict[str, Any] = {"grid": grid, "axes": axes, "link": link, "name": name}
    if max_height:
        options["max_height"] = max_height
    if cell_map.indices.ndim == 3:
        key = f"volume_{key}"
        content = volume_content(cell_map, key, body=body, cursor=cursor, fits=fits, **options)
        draw_component("volume", key, content)
        return

    def picked(cell: Sequence[int]) -> None:
        if on_cell is not None:
            on_cell(int(cell[0]), int(cell[1]))

    content = map_content(
        cell_map,
        scale=scale,
        leads=leads,
        tools=tools,
        picks=on_cell is not None,
        answer=answer,
        **options,
    )
    draw_component("map", f"map_{key}", content, "cell", picked)


def draw_editable(
    cell_map: CellMap,
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
    if cell_map.indices.ndim == 3:
        key = "volume_editor"
        content = volume_content(cell_map, key, picks=True, **options) | editing
        draw_component("volume", key, content, "edits", take_edits)
    else:
        content = map_content(cell_map, scale="maps", **options) | editing
        draw_component("editor", "editor", content, "edits", take_edits)


def map_content(
    cell_map: CellMap, *, grid: Grid | None = None, axes: bool = True, **options: Any
) -> dict[str, Any]:
    """Return the content of the map component; `options` are those that map.js reads."""
    ny, nx = cell_map.indices.shape
    return shared_content(cell_map, grid, axes) | {
        "nx": nx,
        "ny": ny,
        "marks": cell_map.marks,
        "trail": cell_map.trail,
        **options,
    }


def volume_content(
    cell_map: CellMap,
    key: str,
    *,
    grid: Grid | None = None,
    axes: bool = True,
    cursor: Sequence[int] | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Return the content of the volume component; `options` are those that volume.js reads.

    The browser stores cursor, view angle and mode under the name `link`, by default `key`.
    """
    return shared_content(cell_map, grid, axes) | {
        "shape": list(cell_map.indices.shape[::-1]),  # the browser's axis order is x, y, z
        "key": key,
        "cursor": list(cursor[::-1]) if cursor else None,
        **options,
    }


@st.cache_data(max_entries=64, show_spinner=False)
def _packed(digest: str, _indices: Bytes) -> str:
    """Return cells as compressed text, which all sessions share; x varies fastest, z slowest."""
    level = COMPRESSION[_indices.ndim]
    return b64encode(zlib.compress(_indices.tobytes(), level)).decode()
