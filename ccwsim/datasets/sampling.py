"""Sample hard data from a reference field: at random, along wells, or on a regular grid."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from ccwsim.model.arrays import as_array, as_integers, check_int, is_whole
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.hard_data import HardData

DIRECTIONS = ("N-S", "E-W")
MAX_PERMUTED = 4_000_000
"""Cells put into a random order to draw some: more hold up all other threads for too long."""


def sample_random(field: NDArray[np.integer], n: int, seed: int = 0) -> HardData:
    """Sample cells that are chosen at random, none of them twice.

    Examples
    --------
    >>> sample_random(np.eye(40, dtype=int), 12, seed=1).n
    12
    """
    ny, nx = _shape(field)
    n = _checked_count("the number of data", n)
    cells = _distinct(_random(seed), ny * nx, min(n, ny * nx))
    return _read(field, *np.divmod(cells, nx))


def sample_wells(
    field: NDArray[np.integer], n: int, seed: int = 0, *, direction: str = "N-S", every: int = 1
) -> HardData:
    """Sample a field along straight wells that cross it from edge to edge.

    Examples
    --------
    >>> data = sample_wells(np.eye(40, dtype=int), 2, direction="E-W", every=4)
    >>> data.n, len(set(data.cells[:, 0].tolist()))
    (20, 2)
    """
    shape = _shape(field)
    if not isinstance(direction, str) or direction not in DIRECTIONS:
        raise CCWSIMError(f'direction = {shown(direction)} must be "N-S" or "E-W"')
    along, across = shape if direction == "N-S" else shape[::-1]
    n, every = _checked_count("the number of wells", n), min(_checked_count("every", every), along)
    wells = _random(seed).choice(across, min(n, across), replace=False)
    down, at = np.meshgrid(np.arange(0, along, every), wells, indexing="ij")
    rows, columns = (down, at) if direction == "N-S" else (at, down)
    return _read(field, rows.ravel(), columns.ravel())


def sample_grid(field: NDArray[np.integer], every: int) -> HardData:
    """Sample a field on a regular grid that is centred in it.

    Examples
    --------
    >>> sample_grid(np.eye(10, dtype=int), 5).cells.tolist()
    [[2, 2], [2, 7], [7, 2], [7, 7]]
    """
    shape = _shape(field)
    every = min(_checked_count("every", every), max(shape))
    axes = [np.arange((length - 1) % every // 2, length, every) for length in shape]
    rows, columns = np.meshgrid(*axes, indexing="ij")
    return _read(field, rows.ravel(), columns.ravel())


def _read(field: NDArray[np.integer], rows: NDArray, columns: NDArray) -> HardData:
    return HardData(np.column_stack([rows, columns]), np.asarray(field)[rows, columns])


def _distinct(random: RandomState, n_cells: int, n: int) -> NDArray[np.int64]:
    """Return n different cells; few of very many without putting all of them into an order."""
    if n_cells <= MAX_PERMUTED or n > n_cells // 2:
        return random.choice(n_cells, n, replace=False)
    cells = np.empty(0, np.int64)
    while len(cells) < n:
        drawn = np.concatenate([cells, random.randint(0, n_cells, n, dtype=np.int64)])
        _, first = np.unique(drawn, return_index=True)
        cells = drawn[np.sort(first)]
    return cells[:n]


def _random(seed: int) -> RandomState:
    return RandomState(check_int("seed", seed, 0, 2**32 - 1))


def _shape(field: NDArray[np.integer]) -> tuple[int, int]:
    array = as_array(field, "field")
    if array.ndim != 2 or not array.size:
        raise CCWSIMError(f"a reference field of shape (ny, nx) is needed, not {array.shape}")
    if array.dtype.kind not in "bui":
        as_integers(array, "field")
    return array.shape[0], array.shape[1]


def _checked_count(name: str, value: int) -> int:
    if not is_whole(value) or value < 1:
        raise CCWSIMError(f"{name} = {shown(value)} must be a whole number, at least 1")
    return int(value)
