"""Arrange a table with one row per cell (x, y and facies) as a grid."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from math import prod

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile
from ccwsim.io.formats.text_tables import numbered
from ccwsim.io.hard_data.columns import (
    counts_from_one,
    height_column,
    is_points,
    place_columns,
)
from ccwsim.io.limits import limits
from ccwsim.io.part import FilePart
from ccwsim.model.errors import CCWSIMError

MIN_FILLED = 0.5
"""Minimum share of the cells of a grid that have a row; a table with fewer rows has points."""
MIN_ROWS = 16
"""Minimum number of rows of a table that is taken for a grid."""
MAX_STEPS = 2**31
"""Maximum number of cells along an axis."""
TOLERANCE = 1e-3
"""Maximum deviation of a coordinate from the centre of its cell, in cells."""


def as_grid(file: DataFile, shape: tuple[int, ...] | None = None) -> DataFile:
    """Return a table with one row per cell as a grid, NaN without a row; other files unchanged."""
    if shape is None and not file.is_table:
        return _of_rows(file)
    if shape is not None or not is_points(list(file.names)):
        return file
    x, y, world, _ = place_columns(file)
    height = height_column(list(file.variables), "")
    if {*file.names} == {x, y, height}:  # the third number is the value
        height = ""
    axes = [name for name in (height, y, x) if name in file.variables]
    along = [_cells(file.variables[name]) for name in axes] if len(axes) > 1 else []
    sides = tuple(n for _, n, _, _ in along)
    n_rows = len(next(iter(file.variables.values())))
    few = n_rows < MIN_ROWS or not {x, y} <= file.variables.keys()
    if few or not along or 0 in sides or prod(sides) > min(n_rows / MIN_FILLED, limits().whole):
        raise CCWSIMError(f"{file.name} contains points, not an image; use it as hard data")
    at = np.ravel_multi_index(tuple(cells for cells, *_ in along), sides)
    if len(np.unique(at)) < n_rows:
        raise CCWSIMError(f"{file.name}: several rows have the same coordinates; keep one of them")
    columns, labels = _columns(file, axes)
    grids = {}
    for name, values in columns.items():
        flat = np.full(prod(sides), np.nan)
        flat[at] = values
        grids[name] = flat.reshape((1, *sides)[-3:])
    made = replace(file, variables=grids, is_table=False, lines=None, words={}, columns=())
    made = replace(made, labels=labels, south_first=True)
    if not world or counts_from_one(x, y):
        return made
    _, _, sizes, starts = zip(*along[::-1], strict=True)
    return made.at(sizes, starts)


def part_of_grid(
    file: DataFile,
    part: FilePart,
    shape: tuple[int, ...] | None = None,
    *,
    up: bool | None = None,
    z_up: bool | None = None,
) -> DataFile:
    """Return a file with a part of its grids; a grid one cell wide becomes a vertical section."""
    south_first = file.south_first if up is None else up
    rights = ((-2, south_first), (-3, z_up is not False))
    turned = tuple(axis for axis, right in rights if not right)
    grids = {key: file.grid_of(key, shape) for key in file.variables}
    if section := all(len(grid) > 1 and 1 in grid.shape[1:] for grid in grids.values()):
        grids = {key: grid.reshape(1, len(grid), -1) for key, grid in grids.items()}
    for key, grid in grids.items():
        piece = part.of(file.name, np.flip(grid, turned))
        grids[key] = np.ascontiguousarray(np.flip(piece, turned))  # a view would keep the grid
    made = replace(file, variables=grids, is_table=False, lines=None, words={}, columns=())
    if file.cell_size is None or section:
        return replace(made, cell_size=None, origin=None, along_z=None)
    k, first = part.every, part.box(file.name, grid.shape)[0]
    (sx, sy), (x, y) = file.cell_size, file.origin or (0.0, 0.0)
    if file.along_z is not None:
        height, bottom = file.along_z
        made = replace(made, along_z=(height, bottom + first[0] * height))
    place = (x + first[-1] * sx, y + first[-2] * sy)
    return replace(made, cell_size=(k * sx, k * sy), origin=place)


def _of_rows(file: DataFile) -> DataFile:
    """Return a text of three unnamed columns as a grid, if the first two are x and y of cells."""
    matrix = file.variables.get("matrix", np.empty((1, 0, 0)))[0]
    if file.kind != "text matrix" or matrix.shape[1] != 3 or len(matrix) < MIN_ROWS:
        return file
    columns = dict(zip(("x", "y", "value"), matrix.T, strict=True))
    with suppress(CCWSIMError):
        return as_grid(replace(file, variables=columns, is_table=True, asks_up=False))
    return file


def _cells(places: NDArray[np.float64]) -> tuple[NDArray[np.int64], int, float, float]:
    """Return cells, their number (0 if not equally spaced), their size and the first corner."""
    different = np.unique(places)
    if not np.isfinite(different).all():
        return np.empty(0, np.int64), 0, 1.0, 0.0
    size = float(np.diff(different).min()) if len(different) > 1 else 1.0
    span = (different[-1] - different[0]) / size
    n_steps = round(span) if span < MAX_STEPS else 0
    size = float(f"{(different[-1] - different[0]) / n_steps:.12g}") if n_steps else size
    cells = (places - different[0]) / size
    nearest = np.rint(cells)
    regular = span < MAX_STEPS and np.abs(cells - nearest).max() <= TOLERANCE
    n = n_steps + 1 if regular else 0
    cells = nearest.astype(np.int64) if n else np.empty(0, np.int64)
    return cells, n, size, float(f"{different[0] - size / 2:.12g}")


def _columns(
    file: DataFile, axes: list[str]
) -> tuple[dict[str, NDArray[np.float64]], dict[str, tuple[str, ...]]]:
    """Return the columns that are not coordinates; words become codes, with labels."""
    columns = {name: values for name, values in file.variables.items() if name not in axes}
    labels = {}
    for name, fields in file.words.items():
        columns[name], labels[name] = numbered(fields, {""})
    if not columns:
        raise CCWSIMError(f"{file.name} has only coordinates; add a column of facies")
    return columns, labels
