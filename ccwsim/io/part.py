"""A part of a grid: a rectangle, some layers, or every second, third, … cell along each side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, prod, sqrt
from operator import add, le
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.limits import limits
from ccwsim.model.arrays import check_int, is_whole
from ccwsim.model.errors import CCWSIMError, shown

Crop = tuple[int, int, int, int] | None
"""First row from the south, first column, number of rows, number of columns."""
Layers = tuple[int, int] | None
"""First layer from the bottom, number of layers."""


@dataclass(frozen=True)
class FilePart:
    """A selection of cells of a grid."""

    crop: Crop = None  # the rectangle; None for the whole grid
    every: int = 1  # keep the middle cell of each square of `every` × `every` cells
    layers: Layers = None  # the layers of a volume; None for all layers

    def __post_init__(self) -> None:
        for name, words in _NUMBERS.items():
            given = getattr(self, name)
            n = words.count(",") + 1
            if given is not None and not (
                isinstance(given, (tuple, list)) and len(given) == n and all(map(is_whole, given))
            ):
                raise CCWSIMError(f"{name} = {shown(given)} must be {words}, whole numbers")
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

    def box(self, name: str, shape: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Return first cell and sides of this part of a shape; sides are multiples of `every`."""
        row, column, ny, nx = self.crop or (0, 0, *shape[-2:])
        layer, nz = self.layers or (0, *shape[:-2], 1)[:2]
        first, last = (layer, row, column), (layer + nz, row + ny, column + nx)
        inside = all(map(le, last, (1, *shape)[-3:])) and min(first) >= 0
        if not inside or min(ny, nx) < self.every or nz < 1:
            said = ", ".join(f"{k} = {shown(getattr(self, k))}" for k in _ARGUMENTS)
            raise CCWSIMError(
                f"{name}: {said} selects no cell, or exceeds the {' × '.join(map(str, shape))} "
                "cells of the grid, as [layers ×] rows × columns; correct these numbers"
            )
        k, n = self.every, len(shape)
        return first[-n:], (nz, ny - ny % k, nx - nx % k)[-n:]

    def of(self, name: str, grid: NDArray) -> NDArray:
        """Return this part of a grid of shape (ny, nx) or (nz, ny, nx), row 0 in the south."""
        first, sides = self.box(name, grid.shape)
        piece = grid[tuple(map(slice, first, map(add, first, sides)))]
        return piece[..., (self.every - 1) // 2 :: self.every, self.every // 2 :: self.every]


_ARGUMENTS = ("crop", "every", "layers")
_NUMBERS = {"crop": "(row, column, rows, columns)", "layers": "(first layer, number of layers)"}
"""Arguments of several numbers, and what the numbers are."""


def thinning(shape: tuple[int, ...], copies: float = 1.0) -> int:
    """Return the smallest `every` with which `copies` of a grid are within the limit of cells."""
    cells = prod(shape) * copies
    return min(max(1, ceil(sqrt(cells / limits().cells))), *shape[-2:])


def largest_without_gaps(known: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """Return first row, first column, rows and columns of the largest known rectangle."""
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
