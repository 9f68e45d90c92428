"""Connected sets of cells in a map or volume, and the Euler number of a set of cells."""

from __future__ import annotations

from itertools import product
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics.stack import N_AXES
from ccwsim.model.errors import CCWSIMError, shown

NEIGHBOURS = {2: (8, 4), 3: (26, 18, 6)}
"""Allowed numbers of neighbours of a cell, by number of axes; the first number is the default."""
_SHARED_AXES = {4: 1, 6: 1, 18: 2, 8: 3, 26: 3}
"""Maximum number of axes along which neighbours differ, by number of neighbours."""


def neighbours_of(shape: tuple[int, ...], neighbours: int | None) -> int:
    """Return the number of neighbours of a cell after checking it; 8 or 26 by default.

    Examples
    --------
    >>> neighbours_of((30, 40), None), neighbours_of((5, 30, 40), 6)
    (8, 6)
    """
    known = NEIGHBOURS[len(shape)]
    if neighbours is None:
        return known[0]
    if not isinstance(neighbours, (int, np.integer)) or neighbours not in known:
        one_of = "4 or 8" if len(shape) < N_AXES else "6, 18 or 26 in volumes"
        raise CCWSIMError(f"neighbours = {shown(neighbours)} must be {one_of}")
    return int(neighbours)


def label(inside: NDArray[np.bool_], neighbours: int) -> tuple[NDArray[np.int32], int]:
    """Label the connected sets of cells of a volume 1, 2, … in the order of their first cells.

    Cells outside the mask have label 0. The second result is the number of sets.
    """
    from scipy import ndimage  # imported here because loading takes time

    cells = inside[0] if len(inside) == 1 else inside  # a single layer is labelled faster as a map
    touching = ndimage.generate_binary_structure(cells.ndim, _SHARED_AXES[neighbours])
    labels, n = cast(tuple[NDArray[np.int32], int], ndimage.label(cells, touching))
    return labels.reshape(inside.shape), n


def euler_number(inside: NDArray[np.bool_], neighbours: int) -> int:
    """Return geobodies − holes in a map, or geobodies − tunnels + cavities in a volume.

    With 8 or 26 neighbours, the result is corners − edges + faces − cells of the union of cells.
    With 4 or 6 neighbours, cells are points, and adjacent points span edges, faces and cubes. With
    18 neighbours, a corner that only two opposite cells share counts twice.
    """
    cells = np.pad(inside[0] if len(inside) == 1 else inside, 1)
    only_sides = _SHARED_AXES[neighbours] == 1
    total = _alternating_sum(cells, np.logical_and if only_sides else np.logical_or)
    if not only_sides:
        total *= (-1) ** cells.ndim
    if neighbours == 18 and cells.ndim == N_AXES:
        total += _count_corner_contacts(cells)
    return total


def _alternating_sum(cells: NDArray[np.bool_], combine: np.ufunc, axis: int = 0) -> int:
    """Return Σ (−1)ⁿ · (number of cells, combined in pairs along n axes), over all sets of axes."""
    if axis == cells.ndim:
        return int(np.count_nonzero(cells))
    lines = np.moveaxis(cells, axis, 0)
    pairs = np.moveaxis(combine(lines[:-1], lines[1:]), 0, axis)
    return _alternating_sum(cells, combine, axis + 1) - _alternating_sum(pairs, combine, axis + 1)


def _count_corner_contacts(cells: NDArray[np.bool_]) -> int:
    """Count the 2 × 2 × 2 blocks in which only two cells are set, at opposite corners."""
    n_cells = cells.view(np.uint8)
    for axis in range(N_AXES):
        lines = np.moveaxis(n_cells, axis, 0)
        n_cells = np.moveaxis(lines[:-1] + lines[1:], 0, axis)
    ends = slice(None, -1), slice(1, None)
    opposite = np.zeros(n_cells.shape, bool)
    for y, x in product((0, 1), repeat=2):
        opposite |= cells[ends[0], ends[y], ends[x]] & cells[ends[1], ends[1 - y], ends[1 - x]]
    return int(np.count_nonzero(opposite & (n_cells == 2)))
