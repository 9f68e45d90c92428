"""A part of a grid: all cells of a rectangle, or every second, third, … cell along each side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.limits import limits
from ccwsim.model.arrays import check_int, is_whole
from ccwsim.model.errors import CCWSIMError, shown

Crop = tuple[int, int, int, int] | None
"""First row from the south, first column, number of rows, number of columns."""


@dataclass(frozen=True)
class FilePart:
    """A selection of cells of a grid."""

    crop: Crop = None  # the rectangle; None for the whole grid
    every: int = 1  # keep the middle cell of each square of `every` × `every` cells

    def __post_init__(self) -> None:
        crop = self.crop
        if crop is not None and not (
            isinstance(crop, (tuple, list)) and len(crop) == 4 and all(map(is_whole, crop))
        ):
            raise CCWSIMError(
                f"crop = {shown(crop)} must be (row, column, rows, columns), whole numbers"
            )
        check_int("every", self.every, 1, 10**6)

    @classmethod
    def answered(cls, answers: Mapping[str, Any]) -> FilePart | None:
        """Return the part given by the arguments `crop` and `every`; None for the whole grid."""
        crop, every = answers.get("crop"), answers.get("every", 1)
        return None if crop is None and every == 1 else cls(crop, every)

    def box(self, name: str, shape: tuple[int, int]) -> tuple[int, int, int, int]:
        """Return first row and column, and numbers of rows and columns (multiples of `every`)."""
        row, column, ny, nx = self.crop or (0, 0, *shape)
        outside = row < 0 or column < 0 or row + ny > shape[0] or column + nx > shape[1]
        if outside or min(ny, nx) < self.every:
            said = f"crop = {shown(self.crop)}, every = {self.every}"
            raise CCWSIMError(
                f"{name}: {said} selects no cell, or exceeds the {shape[0]} rows and {shape[1]} "
                "columns of the grid; correct crop or every"
            )
        return row, column, ny - ny % self.every, nx - nx % self.every

    def of(self, name: str, grid: NDArray) -> NDArray:
        """Return this part of a grid of shape (ny, nx) or (nz, ny, nx), row 0 in the south."""
        row, column, ny, nx = self.box(name, grid.shape[-2:])
        piece = grid[..., row : row + ny, column : column + nx]
        return piece[..., (self.every - 1) // 2 :: self.every, self.every // 2 :: self.every]


def thinning(shape: tuple[int, int]) -> int:
    """Return the smallest `every` with which a grid of this shape is within the limit of cells.

    Examples
    --------
    >>> thinning((300, 200))
    1
    """
    cells, most = shape[0] * shape[1], limits().cells
    return min(max(1, ceil(sqrt(cells / most))), *shape)


def largest_without_gaps(known: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """Return first row and column, and numbers of rows and columns, of the largest known rectangle.

    All four numbers are 0 if no cell is known. For each row, the numbers of consecutive known cells
    up to this row form a histogram by column; its largest rectangle is computed in linear time.
    """
    ny, nx = known.shape
    heights = np.zeros(nx + 1, np.int64)  # the extra column of height 0 ends the last rectangle
    best, rectangle = 0, (0, 0, 0, 0)
    for row in range(ny):
        heights[:nx] = np.where(known[row], heights[:nx] + 1, 0)
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
