"""The raster path: from a random origin in a random direction (section 4.1).

A map has 8 ways, the symmetries of a square: an origin and a direction each. A volume has 48: its
layers from below or from above, and as the slowest, the middle or the fastest axis of the path.
Every stage works in the *path frame*: there the path always starts at layer 0, row 0, column 0, so
that the overlap is always below, at the top and on the left. The images are oriented instead of the
algorithm.
"""

from __future__ import annotations

from math import prod
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
Triple = tuple[int, int, int]
"""Lengths, or a place, along z, y and x."""
N_ORIENTATIONS = 8
"""Bit 0 starts at the far end of the rows, bit 1 of the columns, bit 2 goes along columns."""
FROM_ABOVE = 8
"""Bit 3 starts at the top layer."""
ORDERS = ((0, 1, 2), (1, 0, 2), (1, 2, 0))
"""Axes from the slowest to the fastest of the path: only the order of patches depends on them."""


def in_layers(shape: tuple[int, ...]) -> Triple:
    """Return the shape of a map or a volume with its layers.

    Examples
    --------
    >>> in_layers((60, 100))
    (1, 60, 100)
    """
    nz, ny, nx = (1, *shape)[-3:]
    return nz, ny, nx


def in_three(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return cells with their layer, 0 in a map."""
    return np.pad(cells, ((0, 0), (3 - cells.shape[1], 0)))


def overlap_cells(template: Triple, overlap: Triple) -> int:
    """Return how many cells a patch has in the overlap where it overlaps on each axis.

    Examples
    --------
    >>> overlap_cells((1, 32, 32), (0, 8, 8))
    448
    """
    inside = prod(t - o for t, o in zip(template, overlap, strict=True))
    return prod(template) - inside


def to_path(image: NDArray, orientation: int) -> NDArray:
    """Return a view of `image`, shape (ny, nx) or (nz, ny, nx), as the path sees it."""
    oriented = image.swapaxes(-2, -1) if orientation & 4 else image
    oriented = oriented[..., ::-1, :] if orientation & 1 else oriented
    oriented = oriented[..., ::-1] if orientation & 2 else oriented
    return oriented[::-1] if orientation & FROM_ABOVE else oriented


def from_path(image: NDArray, orientation: int) -> NDArray:
    """Return a view of `image` in grid coordinates: undoes `to_path`."""
    oriented = image[::-1] if orientation & FROM_ABOVE else image
    oriented = oriented[..., ::-1] if orientation & 2 else oriented
    oriented = oriented[..., ::-1, :] if orientation & 1 else oriented
    return oriented.swapaxes(-2, -1) if orientation & 4 else oriented


def along_path(lengths: tuple[T, T, T], orientation: int) -> tuple[T, T, T]:
    """Return what belongs to z, y and x of the grid as the path sees it.

    Examples
    --------
    >>> along_path((8, 32, 16), 4)
    (8, 16, 32)
    """
    z, y, x = lengths
    return (z, x, y) if orientation & 4 else (z, y, x)


def cells_to_path(
    cells: NDArray[np.int64], shape: tuple[int, ...], orientation: int
) -> NDArray[np.int64]:
    """Return the path coordinates of cells, shape (n, 2) or (n, 3), of a grid of `shape`."""
    *layers, rows, columns = cells.T
    n_rows, n_columns = shape[-2:]
    if orientation & 4:
        rows, columns, n_rows, n_columns = columns, rows, n_columns, n_rows
    rows = n_rows - 1 - rows if orientation & 1 else rows
    columns = n_columns - 1 - columns if orientation & 2 else columns
    layers = [shape[0] - 1 - z if orientation & FROM_ABOVE else z for z in layers]
    return np.stack([*layers, rows, columns], axis=1)


def cells_from_path(
    cells: NDArray[np.int64], shape: tuple[int, ...], orientation: int
) -> NDArray[np.int64]:
    """Return the grid coordinates of cells, shape (n, 3), of a path of `shape`.

    Examples
    --------
    >>> cells_from_path(np.array([[0, 1, 2]]), (4, 5, 6), 4 | 1)
    array([[0, 2, 3]])
    """
    layers, rows, columns = cells.T
    layers = shape[0] - 1 - layers if orientation & FROM_ABOVE else layers
    columns = shape[2] - 1 - columns if orientation & 2 else columns
    rows = shape[1] - 1 - rows if orientation & 1 else rows
    across = (columns, rows) if orientation & 4 else (rows, columns)
    return np.stack([layers, *across], axis=1)


def n_tiles(length: int, template_size: int, overlap_size: int) -> int:
    """Return how many patches cover `length` cells."""
    step = template_size - overlap_size
    return max(1, -(-(length - overlap_size) // step))


class RasterPath(NamedTuple):
    """A raster path over a grid."""

    orientation: int  # 0 … 7 in a map, 0 … 15 in a volume
    order: int  # which of ORDERS
    shape: Triple  # of the grid in path coordinates
    tiles: Triple  # how many tiles cover it along each axis
    full: Triple  # what whole tiles cover, at least `shape` and what is before it
    offset: Triple = (0, 0, 0)  # how far before the grid the first tile begins


def make_path(
    grid_shape: Triple,
    orientation: int,
    template: Triple,
    overlap: Triple,
    order: int = 0,
    offset: Triple = (0, 0, 0),
) -> RasterPath:
    """Return the path over a grid; all but its shape are along the axes of the path.

    The first tile begins `offset` cells before the grid: where it always begins with the grid,
    seams are at the same cells in all realizations, and show in their mean.

    Examples
    --------
    >>> path = make_path((1, 60, 100), 4, (1, 32, 32), (0, 8, 8))
    >>> path.shape, path.tiles, path.full
    ((1, 100, 60), (1, 4, 3), (1, 104, 80))
    """
    shape = along_path(grid_shape, orientation)
    covered = [n + before for n, before in zip(shape, offset, strict=True)]
    own = [*zip(covered, template, overlap, strict=True)]
    tiles = tuple(n_tiles(*each) for each in own)
    full = tuple(n * (t - o) + o for n, (_, t, o) in zip(tiles, own, strict=True))
    return RasterPath(orientation, order, shape, tiles, full, offset)  # type: ignore[arg-type]


def in_order(path: RasterPath) -> NDArray[np.int64]:
    """Return the numbers of the tiles, by layer, row and column, in the order of the path."""
    numbers = np.arange(path.tiles[0] * path.tiles[1] * path.tiles[2])
    return numbers.reshape(path.tiles).transpose(ORDERS[path.order]).ravel()
