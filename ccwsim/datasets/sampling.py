"""Sample hard data from a reference field at random, along wells or on a regular grid."""

from collections.abc import Mapping
from math import prod

import numpy as np
from numpy.random import RandomState

from ccwsim import HardData
from ccwsim.model import (
    Array,
    CCWSIMError,
    Floats,
    Integers,
    Ints,
    as_array,
    as_integers,
    as_seed,
    check_int,
    refused,
    shown,
)

DIRECTIONS = ("N-S", "E-W")
VERTICAL_WELLS = "vertical"
MAX_PERMUTED = 4_000_000
"""Maximum number of cells to permute; more cells would block other threads for too long."""


def sample_random(field: Integers, n: int, seed: int = 0) -> HardData:
    """Sample hard data at `n` different random cells of a map or a volume."""
    shape = _shape(field)
    n, n_cells = check_int("the number of data", n, 1), prod(shape)
    cells = _distinct(_random(seed), n_cells, min(n, n_cells))
    return _read(field, np.unravel_index(cells, shape))


def sample_wells(
    field: Integers,
    n: int,
    seed: int = 0,
    *,
    direction: str | None = None,
    every: int = 1,
) -> HardData:
    """Sample a map along straight wells across the map, or a volume along vertical wells.

    The direction is "N-S" (default) or "E-W" in a map, and "vertical" in a volume. `every` is the
    distance between data along a well, in cells.
    """
    shape = _shape(field)
    directions = DIRECTIONS if len(shape) == 2 else (VERTICAL_WELLS,)
    way = directions[0] if direction is None else direction
    if way not in directions:
        allowed = " or ".join(f'"{one}"' for one in directions)
        raise CCWSIMError(f"direction = {shown(direction)} must be {allowed}")
    n, every = check_int("the number of wells", n, 1), check_int("every", every, 1)
    *_, ny, nx = shape
    if way == VERTICAL_WELLS:
        columns = _distinct(_random(seed), ny * nx, min(n, ny * nx))
        layers, positions = np.meshgrid(np.arange(0, shape[0], every), columns, indexing="ij")
        rows, columns = np.divmod(positions.ravel(), nx)
        return _read(field, (layers.ravel(), rows, columns))
    along, across = (ny, nx) if way == "N-S" else (nx, ny)
    wells = _random(seed).choice(across, min(n, across), replace=False)
    down, positions = np.meshgrid(np.arange(0, along, min(every, along)), wells, indexing="ij")
    rows, columns = (down, positions) if way == "N-S" else (positions, down)
    return _read(field, (rows.ravel(), columns.ravel()))


def sample_grid(field: Integers, every: int) -> HardData:
    """Sample a map on a regular, centred grid, or a volume along vertical wells on this grid."""
    *layers, ny, nx = _shape(field)
    every = min(check_int("every", every, 1), max(ny, nx))
    axes = [np.arange((length - 1) % every // 2, length, every) for length in (ny, nx)]
    cells = np.meshgrid(*[*map(np.arange, layers), *axes], indexing="ij")
    return _read(field, tuple(axis.ravel() for axis in cells))


def _read(field: Integers, cells: tuple[Array, ...]) -> HardData:
    """Return the facies of a field in cells, given by (layers,) rows and columns."""
    return HardData(np.column_stack(cells), np.asarray(field)[cells])


def values_in_cells(data: HardData, values: Mapping[str, Floats]) -> HardData:
    """Return data with the values of fields, by name, in their cells."""
    cells = tuple(data.cells.T)
    measured = {name: field[cells] for name, field in values.items()}
    return HardData(data.cells, data.facies, values=measured)


def _distinct(random: RandomState, n_cells: int, n: int) -> Ints:
    """Return n different random cells; do not permute all cells if there are too many cells."""
    if n_cells <= MAX_PERMUTED or n > n_cells // 2:
        return random.choice(n_cells, n, replace=False)
    cells = np.empty(0, np.int64)
    while len(cells) < n:
        drawn = np.concatenate([cells, random.randint(0, n_cells, n, dtype=np.int64)])
        _, first = np.unique(drawn, return_index=True)
        cells = drawn[np.sort(first)]
    return cells[:n]


def _random(seed: int) -> RandomState:
    return RandomState(as_seed(seed, 2**32 - 1))


def _shape(field: Integers) -> tuple[int, ...]:
    array = as_array(field, "field")
    if array.ndim not in (2, 3) or not array.size:
        raise refused("reference_field_shape", shape=array.shape)
    if array.dtype.kind not in "bui":
        as_integers(array, "field")
    return array.shape
