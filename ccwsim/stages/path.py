"""The raster path: from a random origin in a random direction (section 4.1).

Each of the 8 symmetries of a square is one origin and direction. Every stage works in the *path
frame*: there the path always starts at row 0, column 0 and goes along rows, so that the overlap is
always on the left and at the top. The images are turned instead of the algorithm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

N_ORIENTATIONS = 8
"""Bit 0 starts at the far end of the rows, bit 1 of the columns, bit 2 goes along columns."""


def to_path_frame(image: NDArray, orientation: int) -> NDArray:
    """Return a view of `image`, shape (ny, nx), as the path sees it.

    Examples
    --------
    >>> to_path_frame(np.array([[1, 2, 3], [4, 5, 6]]), 5)
    array([[3, 6], [2, 5], [1, 4]])
    """
    turned = image.T if orientation & 4 else image
    turned = turned[::-1] if orientation & 1 else turned
    return turned[:, ::-1] if orientation & 2 else turned


def from_path_frame(image: NDArray, orientation: int) -> NDArray:
    """Return a view of `image` as it lies in the world: undoes `to_path_frame`."""
    turned = image[:, ::-1] if orientation & 2 else image
    turned = turned[::-1] if orientation & 1 else turned
    return turned.T if orientation & 4 else turned


def cells_to_path_frame(
    cells: NDArray[np.int64], shape: tuple[int, int], orientation: int
) -> NDArray[np.int64]:
    """Return where cells (row, col), shape (n, 2), of a grid of `shape` lie in the path frame."""
    rows, columns = cells.T
    n_rows, n_columns = shape
    if orientation & 4:
        rows, columns, n_rows, n_columns = columns, rows, n_columns, n_rows
    rows = n_rows - 1 - rows if orientation & 1 else rows
    columns = n_columns - 1 - columns if orientation & 2 else columns
    return np.stack([rows, columns], axis=1)


def n_tiles(length: int, template_size: int, overlap_size: int) -> int:
    """Return how many patches cover `length` cells.

    Examples
    --------
    >>> n_tiles(512, 32, 8)
    21
    """
    step = template_size - overlap_size
    return max(1, -(-(length - overlap_size) // step))
