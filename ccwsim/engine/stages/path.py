"""The raster path: from a random origin in a random direction (section 4.1).

Each of the 8 symmetries of a square is one origin and direction. Every stage works in the *path
frame*: there the path always starts at row 0, column 0 and goes along rows, so that the overlap is
always on the left and at the top. The images are oriented instead of the algorithm.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

N_ORIENTATIONS = 8
"""Bit 0 starts at the far end of the rows, bit 1 of the columns, bit 2 goes along columns."""


def to_path(image: NDArray, orientation: int) -> NDArray:
    """Return a view of `image`, shape (ny, nx), as the path sees it."""
    oriented = image.T if orientation & 4 else image
    oriented = oriented[::-1] if orientation & 1 else oriented
    return oriented[:, ::-1] if orientation & 2 else oriented


def from_path(image: NDArray, orientation: int) -> NDArray:
    """Return a view of `image` in grid coordinates: undoes `to_path`."""
    oriented = image[:, ::-1] if orientation & 2 else image
    oriented = oriented[::-1] if orientation & 1 else oriented
    return oriented.T if orientation & 4 else oriented


def cells_to_path(
    cells: NDArray[np.int64], shape: tuple[int, int], orientation: int
) -> NDArray[np.int64]:
    """Return the path coordinates of cells (row, col), shape (n, 2), of a grid of `shape`."""
    rows, columns = cells.T
    n_rows, n_columns = shape
    if orientation & 4:
        rows, columns, n_rows, n_columns = columns, rows, n_columns, n_rows
    rows = n_rows - 1 - rows if orientation & 1 else rows
    columns = n_columns - 1 - columns if orientation & 2 else columns
    return np.stack([rows, columns], axis=1)


def n_tiles(length: int, template_size: int, overlap_size: int) -> int:
    """Return how many patches cover `length` cells."""
    step = template_size - overlap_size
    return max(1, -(-(length - overlap_size) // step))


class RasterPath(NamedTuple):
    """A raster path over a grid."""

    orientation: int  # 0 … 7
    shape: tuple[int, int]  # rows and columns of the grid in path coordinates
    # how many tiles cover it
    n_rows: int
    n_columns: int
    full: tuple[int, int]  # rows and columns that whole tiles cover, at least `shape`


def make_path(
    grid_shape: tuple[int, int], orientation: int, template_size: int, overlap_size: int
) -> RasterPath:
    """Return the path over a grid of (ny, nx) cells.

    Examples
    --------
    >>> make_path((60, 100), 4, 32, 8)
    RasterPath(orientation=4, shape=(100, 60), n_rows=4, n_columns=3, full=(104, 80))
    """
    ny, nx = grid_shape
    shape = (nx, ny) if orientation & 4 else (ny, nx)
    n_rows, n_columns = (n_tiles(length, template_size, overlap_size) for length in shape)
    step = template_size - overlap_size
    full = n_rows * step + overlap_size, n_columns * step + overlap_size
    return RasterPath(orientation, shape, n_rows, n_columns, full)
