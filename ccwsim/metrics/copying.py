"""How much of a realization is copied from the training image, and in how large pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.model.arrays import as_array
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid


@dataclass(frozen=True, eq=False)
class Copying:
    """Where the cells of a realization came from.

    Attributes
    ----------
    copied : float
        Share of the pairs of touching cells that touch in the same way in the training image.
    largest_square : int
        Side of the largest square copied verbatim, in cells.
    square_at : tuple of int
        Row and column of its south-west cell.
    largest_block : int
        Cells of the largest piece, joined by sides, that was copied verbatim.
    uses : ndarray of int, shape of the training image
        How often each of its cells was used.
    used : float
        Share of the training image that was used at all.
    seams : ndarray of bool, shape (ny, nx)
        Cells whose eastern or northern neighbour was not their neighbour in the training image.
    n_unknown : int
        Cells without a source (a position below 0).
    """

    copied: float
    largest_square: int
    square_at: tuple[int, int]
    largest_block: int
    uses: NDArray[np.int64]
    used: float
    seams: NDArray[np.bool_]
    n_unknown: int


def copying(positions: ArrayLike, ti_shape: tuple[int, int]) -> Copying:
    """Return what was copied, from the locations in the training image that the cells came from.

    Parameters
    ----------
    positions : array_like of int, shape (ny, nx)
        Row · nx + column in the training image of each cell; below 0 without a source.
    ti_shape : pair of int
        Rows and columns of the training image.

    Returns
    -------
    Copying

    Raises
    ------
    CCWSIMError
        For another number of dimensions or a location outside the training image.

    Examples
    --------
    >>> found = copying([[0, 1, 4], [3, 4, 7]], (3, 3))
    >>> found.largest_square, found.largest_block, round(found.copied, 3)
    (2, 4, 0.714)
    """
    source, ti_shape = as_array(positions, "positions"), Grid.of(ti_shape).shape
    if source.ndim != 2 or source.dtype.kind not in "ui" or not source.size:
        raise CCWSIMError(
            f"positions of shape (ny, nx) and whole numbers are needed, not {source.shape} of "
            f"type {source.dtype}"
        )
    n_cells = ti_shape[0] * ti_shape[1]
    if source.max() >= n_cells:
        raise CCWSIMError(
            f"position {source.max()} lies outside a training image of {ti_shape[0]} × "
            f"{ti_shape[1]} cells; the largest is {n_cells - 1}"
        )
    shift = _shifts(source.astype(np.int64), ti_shape)
    east = (shift[:, 1:] == shift[:, :-1]) & (shift[:, 1:] >= 0)
    north = (shift[1:] == shift[:-1]) & (shift[1:] >= 0)
    seams = np.zeros(source.shape, bool)
    seams[:, :-1] |= ~east
    seams[:-1] |= ~north
    known = source[source >= 0]
    uses = np.bincount(known.ravel(), minlength=n_cells).reshape(ti_shape)
    side, row, column = _largest_square(shift)
    n_pairs = east.size + north.size
    return Copying(
        copied=float((east.sum() + north.sum()) / n_pairs) if n_pairs else 0.0,
        largest_square=int(side),
        square_at=(int(row), int(column)),
        largest_block=int(_largest_block(shift)),
        uses=uses,
        used=float(np.mean(uses > 0)),
        seams=seams,
        n_unknown=int(source.size - known.size),
    )


def _shifts(source: NDArray[np.int64], ti_shape: tuple[int, int]) -> NDArray[np.int64]:
    """Return a number for each cell, equal for cells shifted by the same (rows, columns)."""
    ny, nx = source.shape
    down = source // ti_shape[1] - np.arange(ny)[:, None] + ny
    along = source % ti_shape[1] - np.arange(nx) + nx
    return np.where(source >= 0, down * (ti_shape[1] + nx + 1) + along, -1)


@kernel
def _largest_square(shift):
    """Grow squares of one shift from the south-west, a row at a time."""
    ny, nx = shift.shape
    sides = np.zeros((2, nx), np.int64)
    best, row, column = 0, 0, 0
    for i in range(ny):
        now, before = sides[i % 2], sides[(i + 1) % 2]
        for j in range(nx):
            now[j] = 1 if shift[i, j] >= 0 else 0
            if i and j and now[j]:
                same = shift[i, j] == shift[i - 1, j] and shift[i, j] == shift[i, j - 1]
                if same and shift[i, j] == shift[i - 1, j - 1]:
                    now[j] = 1 + min(before[j], now[j - 1], before[j - 1])
            if now[j] > best:
                best, row, column = now[j], i + 1 - now[j], j + 1 - now[j]
    return best, row, column


@kernel
def _largest_block(shift):
    """Return the cells of the largest piece of one shift, found by flooding."""
    ny, nx = shift.shape
    seen = shift < 0
    stack = np.empty((ny * nx, 2), np.int64)
    best = 0
    for i in range(ny):
        for j in range(nx):
            if seen[i, j]:
                continue
            seen[i, j] = True
            stack[0] = i, j
            n, size = 1, 0
            while n:
                n -= 1
                size += 1
                y, x = stack[n]
                for dy, dx in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                    v, u = y + dy, x + dx
                    if v < 0 or u < 0 or v >= ny or u >= nx or seen[v, u]:
                        continue
                    if shift[v, u] == shift[y, x]:
                        seen[v, u] = True
                        stack[n] = v, u
                        n += 1
            best = max(best, size)
    return best
