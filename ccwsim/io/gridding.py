"""Parts of grids, and tables with one row per cell (x, y and facies) as grids."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from math import ceil, prod, sqrt
from operator import add, le
from typing import Any, NamedTuple

import numpy as np

from ccwsim.io.data_file import DataFile, Geometry
from ccwsim.io.formats.text_tables import numbered
from ccwsim.io.hard_data import columns as of_data
from ccwsim.io.limits import limits
from ccwsim.model import (
    Array,
    CCWSIMError,
    Floats,
    Ints,
    Mask,
    Shape,
    check_int,
    is_integer,
    refused,
    shown,
)

Crop = tuple[int, int, int, int] | None  # first row from the south and column, numbers of both
Layers = tuple[int, int] | None  # first layer from the bottom, number of layers


@dataclass(frozen=True)
class FilePart:
    """A selection of cells of a grid."""

    crop: Crop = None  # the rectangle; None for the whole grid
    every: int = 1  # keep the middle cell of each square of `every` × `every` cells
    layers: Layers = None  # the layers of a volume; None for all layers

    def __post_init__(self) -> None:
        for name, words in _NUMBERS.items():
            value = getattr(self, name)
            n = words.count(",") + 1
            if value is not None and not (
                isinstance(value, (tuple, list)) and len(value) == n and all(map(is_integer, value))
            ):
                raise CCWSIMError(f"{name} = {shown(value)} must be {words}, whole numbers")
        check_int("every", self.every, 1, 10**6)

    @classmethod
    def answered(cls, answers: Mapping[str, Any]) -> FilePart | None:
        """Return the part given by arguments of `read_training_image`; None for the whole grid."""
        part = cls.of_answers(answers)
        return None if part == cls() else part

    @classmethod
    def of_answers(cls, answers: Mapping[str, Any]) -> FilePart:
        """Return the part given by arguments of `read_training_image`."""
        return cls(**{name: answers[name] for name in _ARGUMENTS if name in answers})

    def box(self, name: str, shape: Shape) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Return first cell and sides of this part of a shape; sides are multiples of `every`."""
        row, column, ny, nx = self.crop or (0, 0, *shape[-2:])
        layer, nz = self.layers or (0, *shape[:-2], 1)[:2]
        first, last = (layer, row, column), (layer + nz, row + ny, column + nx)
        inside = all(map(le, last, (1, *shape)[-3:])) and min(first) >= 0
        if not inside or min(ny, nx) < self.every or nz < 1:
            arguments = ", ".join(f"{k} = {shown(getattr(self, k))}" for k in _ARGUMENTS)
            raise refused(
                "piece_outside", name=name, said=arguments, shape=" × ".join(map(str, shape))
            )
        k, n = self.every, len(shape)
        return first[-n:], (nz, ny - ny % k, nx - nx % k)[-n:]

    def of(self, name: str, grid: Array) -> Array:
        """Return this part of a grid of shape (ny, nx) or (nz, ny, nx), row 0 in the south."""
        first, sides = self.box(name, grid.shape)
        piece = grid[tuple(map(slice, first, map(add, first, sides)))]
        return piece[..., (self.every - 1) // 2 :: self.every, self.every // 2 :: self.every]


_ARGUMENTS = ("crop", "every", "layers")
_NUMBERS = {"crop": "(row, column, rows, columns)", "layers": "(first layer, number of layers)"}
"""Arguments that have several numbers, and the meaning of the numbers."""


def thinning(shape: Shape, copies: float = 1.0) -> int:
    """Return the smallest `every` with which `copies` of a grid are within the limit of cells."""
    n_cells = prod(shape) * copies
    return min(max(1, ceil(sqrt(n_cells / limits().cells))), min(shape[-2:]))


def largest_without_gaps(filled: Mask) -> tuple[int, int, int, int]:
    """Return first row, first column, rows and columns of the largest known rectangle."""
    ny, nx = filled.shape
    heights = np.zeros(nx + 1, np.int64)  # the extra column of height 0 ends the last rectangle
    best, rectangle = 0, (0, 0, 0, 0)
    for row in range(ny):
        heights[:nx] = np.where(filled[row], heights[:nx] + 1, 0)
        if best >= nx * heights.max():
            continue
        ends = heights.tolist()
        open_columns: list[tuple[int, int]] = []  # (first column, height), heights ascending
        for column, height in enumerate(ends):
            first = column
            while open_columns and open_columns[-1][1] >= height:
                first, high = open_columns.pop()
                if high * (column - first) > best:
                    best = high * (column - first)
                    rectangle = (row - high + 1, first, high, column - first)
            if height:
                open_columns.append((first, height))
    return rectangle


MIN_FILLED = 0.5  # minimum share of cells with a row; a table with fewer rows contains points
MIN_ROWS = 16  # minimum number of rows of a table that is read as a grid
MAX_AXIS_CELLS = 2**31  # maximum number of cells along an axis
CENTRE_TOLERANCE = 1e-3  # maximum deviation of a coordinate from the centre of its cell, in cells


def as_grid(file: DataFile, shape: Shape | None = None) -> DataFile:
    """Return a table with one row per cell as a grid; return other files unchanged.

    Cells without a row are NaN.
    """
    if shape is None and not file.is_table:
        return _of_rows(file)
    if shape is not None or not of_data.is_points(list(file.names)):
        return file
    x, y, world, _ = of_data.place_columns(file)
    height = of_data.height_column(list(file.variables), "")
    if {*file.names} == {x, y, height}:  # the third number is the value
        height = ""
    axes = [name for name in (height, y, x) if name in file.variables]
    axes = axes if len(axes) > 1 else []
    grid_axes = [_axis(of_data.upward(name, file.variables[name])) for name in axes]
    sides = tuple(axis.n for axis in grid_axes)
    n_rows = len(next(iter(file.variables.values())))
    few = n_rows < MIN_ROWS or not {x, y} <= file.variables.keys()
    if few or not grid_axes or 0 in sides or prod(sides) > min(n_rows / MIN_FILLED, limits().whole):
        raise refused("points_no_image", name=file.name)
    cell_indices = np.ravel_multi_index(tuple(axis.indices for axis in grid_axes), sides)
    if len(np.unique(cell_indices)) < n_rows:
        raise CCWSIMError(f"{file.name}: several rows have the same coordinates; keep one of them")
    columns, labels = _columns(file, axes)
    grids = {}
    for name, values in columns.items():
        flat = np.full(prod(sides), np.nan)
        flat[cell_indices] = values
        grids[name] = flat.reshape((1, *sides)[-3:])
    gridded = replace(file, variables=grids, is_table=False, lines=None, words={}, columns=())
    gridded = replace(gridded, labels=labels, south_first=True)
    if not world or of_data.counts_from_one((x, y)):
        return gridded
    along = grid_axes[::-1]
    return gridded.at([axis.size for axis in along], [axis.start for axis in along])


def part_of_grid(
    file: DataFile,
    part: FilePart,
    shape: Shape | None = None,
    *,
    up: bool | None = None,
    z_up: bool | None = None,
) -> DataFile:
    """Return a file with a part of its grids; a grid one cell wide becomes a vertical section."""
    south_first = file.south_first if up is None else up
    rights = ((-2, south_first), (-3, z_up in (None, file.bottom_first)))
    flipped = tuple(axis for axis, right in rights if not right)
    grids = {key: file.grid_of(key, shape) for key in file.variables}
    if section := all(len(grid) > 1 and 1 in grid.shape[1:] for grid in grids.values()):
        grids = {key: grid.reshape(1, len(grid), -1) for key, grid in grids.items()}
    for key, grid in grids.items():
        piece = part.of(file.name, np.flip(grid, flipped))
        grids[key] = np.ascontiguousarray(np.flip(piece, flipped))  # a view would keep the grid
    cut = replace(file, variables=grids, is_table=False, lines=None, words={}, columns=())
    if not file.geometry.cell_size or section:
        return replace(cut, geometry=Geometry(crs=file.geometry.crs))
    first, _ = part.box(file.name, grid.shape)
    return replace(cut, geometry=file.geometry.part(first, part.every))


def _of_rows(file: DataFile) -> DataFile:
    """Return a text of three unnamed columns as a grid, if the first two are x and y of cells."""
    matrix = file.variables.get("matrix", np.empty((1, 0, 0)))[0]
    if file.kind != "text matrix" or matrix.shape[1] != 3 or len(matrix) < MIN_ROWS:
        return file
    columns = dict(zip(("x", "y", "value"), matrix.T, strict=True))
    with suppress(CCWSIMError):
        return as_grid(replace(file, variables=columns, is_table=True, asks_up=False))
    return file


class _Axis(NamedTuple):
    """The cells of a grid along one axis."""

    indices: Ints  # index of the cell of each row of a table
    n: int  # number of cells; 0 if the coordinates are not equally spaced
    size: float
    start: float  # outer side of the first cell


def _axis(places: Floats) -> _Axis:
    """Return the cells along an axis whose centres are the coordinates of a table."""
    different = np.unique(places)
    if not np.isfinite(different).all():
        return _Axis(np.empty(0, np.int64), 0, 1.0, 0.0)
    size = float(np.diff(different).min()) if len(different) > 1 else 1.0
    span = (different[-1] - different[0]) / size
    n_steps = round(span) if span < MAX_AXIS_CELLS else 0
    size = float(f"{(different[-1] - different[0]) / n_steps:.12g}") if n_steps else size
    steps = (places - different[0]) / size
    nearest = np.rint(steps)
    regular = span < MAX_AXIS_CELLS and np.abs(steps - nearest).max() <= CENTRE_TOLERANCE
    n = n_steps + 1 if regular else 0
    indices = nearest.astype(np.int64) if n else np.empty(0, np.int64)
    return _Axis(indices, n, size, float(f"{different[0] - size / 2:.12g}"))


def _columns(
    file: DataFile, axes: list[str]
) -> tuple[dict[str, Floats], dict[str, tuple[str, ...]]]:
    """Return the columns that are not coordinates; words become codes, with labels."""
    columns = {name: values for name, values in file.variables.items() if name not in axes}
    labels = {}
    for name, fields in file.words.items():
        columns[name], labels[name] = numbered(fields, {""})
    if not columns:
        raise CCWSIMError(f"{file.name} has only coordinates; add a column of facies")
    return columns, labels
