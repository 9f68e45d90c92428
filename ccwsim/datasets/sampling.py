"""Read hard data off a known field: at random, along wells, or on a regular grid."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from ccwsim.model.arrays import as_array, as_integers, is_whole, whole_number
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.hard_data import HardData

DIRECTIONS = ("N-S", "E-W")


def sample_random(truth: NDArray[np.integer], n: int, seed: int = 0) -> HardData:
    """Read cells of a truth that are drawn at random, none of them twice.

    Parameters
    ----------
    truth : ndarray of int, shape (ny, nx)
        Facies codes, row 0 at the south.
    n : int
        How many cells; all of them where the truth has fewer.
    seed : int

    Raises
    ------
    CCWSIMError
        For a truth that is no map, or a number of data below 1.

    Examples
    --------
    >>> sample_random(np.eye(40, dtype=int), 12, seed=1).n
    12
    """
    ny, nx = _shape(truth)
    n = _counted("the number of data", n)
    cells = _random(seed).choice(ny * nx, min(n, ny * nx), replace=False)
    return _read(truth, *np.divmod(cells, nx))


def sample_wells(
    truth: NDArray[np.integer], n: int, seed: int = 0, *, direction: str = "N-S", every: int = 1
) -> HardData:
    """Read a truth along straight wells that cross it from edge to edge.

    Parameters
    ----------
    truth : ndarray of int, shape (ny, nx)
        Facies codes, row 0 at the south.
    n : int
        How many wells; at most one a column (or row). They are drawn at random.
    seed : int
    direction : "N-S" or "E-W"
        Along columns, as vertical wells of a cross-section are, or along rows.
    every : int
        Cells from one datum of a well to the next.

    Raises
    ------
    CCWSIMError
        For a truth that is no map, another direction, or numbers below 1.

    Examples
    --------
    >>> data = sample_wells(np.eye(40, dtype=int), 2, direction="E-W", every=4)
    >>> data.n, len(set(data.cells[:, 0].tolist()))
    (20, 2)
    """
    shape = _shape(truth)
    if not isinstance(direction, str) or direction not in DIRECTIONS:
        raise CCWSIMError(f'direction = {shown(direction)} must be "N-S" or "E-W"')
    along, across = shape if direction == "N-S" else shape[::-1]
    n, every = _counted("the number of wells", n), min(_counted("every", every), along)
    wells = _random(seed).choice(across, min(n, across), replace=False)
    down, at = np.meshgrid(np.arange(0, along, every), wells, indexing="ij")
    rows, columns = (down, at) if direction == "N-S" else (at, down)
    return _read(truth, rows.ravel(), columns.ravel())


def sample_grid(truth: NDArray[np.integer], every: int) -> HardData:
    """Read a truth on a regular grid, as far from the edges at one side as at the other.

    Parameters
    ----------
    truth : ndarray of int, shape (ny, nx)
        Facies codes, row 0 at the south.
    every : int
        Cells from one datum to the next, along x and y.

    Raises
    ------
    CCWSIMError
        For a truth that is no map, or a spacing below 1.

    Examples
    --------
    >>> sample_grid(np.eye(10, dtype=int), 5).cells.tolist()
    [[2, 2], [2, 7], [7, 2], [7, 7]]
    """
    shape = _shape(truth)
    every = min(_counted("every", every), max(shape))
    axes = [np.arange((length - 1) % every // 2, length, every) for length in shape]
    rows, columns = np.meshgrid(*axes, indexing="ij")
    return _read(truth, rows.ravel(), columns.ravel())


def _read(truth: NDArray[np.integer], rows: NDArray, columns: NDArray) -> HardData:
    return HardData(np.column_stack([rows, columns]), np.asarray(truth)[rows, columns])


def _random(seed: int) -> RandomState:
    return RandomState(whole_number("seed", seed, 0, 2**32 - 1))


def _shape(truth: NDArray[np.integer]) -> tuple[int, int]:
    array = as_array(truth, "truth")
    if array.ndim != 2 or not array.size:
        raise CCWSIMError(f"a truth of shape (ny, nx) is needed, not {array.shape}")
    if array.dtype.kind not in "bui":
        as_integers(array, "truth")
    return array.shape[0], array.shape[1]


def _counted(name: str, value: int) -> int:
    if not is_whole(value) or value < 1:
        raise CCWSIMError(f"{name} = {shown(value)} must be a whole number, at least 1")
    return int(value)
