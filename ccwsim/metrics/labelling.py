"""Connected cells of a map or volume, numbered by a union of runs: linear in the cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import allocating_kernel, part_of_kernel
from ccwsim.metrics.stack import N_AXES
from ccwsim.model.errors import CCWSIMError, shown

NEIGHBOURS = {2: (8, 4), 3: (26, 18, 6)}
"""Which cells may count as touching, by the number of axes; the first is the default."""
_LINES = {
    6: ((0, -1, 0), (-1, 0, 0)),
    18: ((0, -1, 1), (-1, 0, 1), (-1, -1, 0), (-1, 1, 0)),
    26: ((0, -1, 1), (-1, 0, 1), (-1, -1, 1), (-1, 1, 1)),
}
"""Earlier lines of cells (layers up, rows up) that touch a line, and by how many cells aslant."""


def neighbours_of(shape: tuple[int, ...], neighbours: int | None) -> int:
    """Return how many cells count as touching in images of a shape; 8 or 26 where not given.

    Raises
    ------
    CCWSIMError
        For another number than 4 or 8 in maps, or 6, 18 or 26 in volumes.

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


def in_volume(neighbours: int) -> int:
    """Return which neighbours in a volume of one layer are those of a map.

    Examples
    --------
    >>> in_volume(8), in_volume(4), in_volume(18)
    (26, 6, 18)
    """
    return {8: 26, 4: 6}.get(neighbours, neighbours)


def label(inside: NDArray[np.bool_], neighbours: int) -> tuple[NDArray[np.int32], int]:
    """Number the connected sets of cells of a volume from 1 on, in the order of their first cells.

    Parameters
    ----------
    inside : ndarray of bool, shape (nz, ny, nx)
    neighbours : int
        As `neighbours_of` returns it.

    Returns
    -------
    labels : ndarray of int32, shape (nz, ny, nx)
        0 outside.
    n : int

    Examples
    --------
    >>> label(np.eye(3, dtype=bool)[None], 4)[1], label(np.eye(3, dtype=bool)[None], 8)[1]
    (3, 1)
    """
    labels = np.empty(inside.shape, np.int32)
    cells = np.ascontiguousarray(inside).view(np.uint8)
    n = _label(cells, np.array(_LINES[in_volume(neighbours)]), labels)
    return labels, int(n)


@part_of_kernel
def _root(parents, run):
    """Return the first run of a set, and halve the way to it."""
    while parents[run] != run:
        parents[run] = parents[parents[run]]
        run = parents[run]
    return run


@part_of_kernel
def _unite(parents, a, b):
    """Make one set of two; its first run stands for it."""
    a, b = _root(parents, a), _root(parents, b)
    if a < b:
        parents[b] = a
    else:
        parents[a] = b


@allocating_kernel
def _label(inside, lines, labels):
    """Find the runs of each line of cells, unite those that touch, and number the sets."""
    nz, ny, nx = inside.shape
    firsts = np.zeros(nz * ny + 1, np.int64)
    for line in range(nz * ny):
        cells = inside[line // ny, line % ny]
        n_runs = np.int64(cells[0])
        for j in range(1, nx):
            n_runs += np.int64(cells[j] > cells[j - 1])
        firsts[line + 1] = firsts[line] + n_runs
    n_runs = firsts[-1]
    starts, stops = np.empty(n_runs, np.int32), np.empty(n_runs, np.int32)
    parents = np.arange(n_runs)
    for line in range(nz * ny):
        k, i = line // ny, line % ny
        cells = inside[k, i]
        run = firsts[line]
        before = np.uint8(0)
        for j in range(nx):
            if cells[j] != before:
                if before:
                    stops[run] = j
                    run += 1
                else:
                    starts[run] = j
                before = cells[j]
        if before:
            stops[run] = nx
        for n in range(len(lines)):
            above, across, aslant = lines[n]
            if k + above < 0 or i + across < 0 or i + across >= ny:
                continue
            other = line + above * ny + across
            b, last = firsts[other], firsts[other + 1]
            for a in range(firsts[line], firsts[line + 1]):
                while b < last and stops[b] + aslant <= starts[a]:
                    b += 1
                c = b
                while c < last and starts[c] < stops[a] + aslant:
                    _unite(parents, a, c)
                    c += 1
    n_sets = 0
    numbers = np.empty(n_runs, np.int32)
    labels[:] = 0
    for line in range(nz * ny):
        row = labels[line // ny, line % ny]
        for a in range(firsts[line], firsts[line + 1]):
            root = _root(parents, a)
            if root == a:
                n_sets += 1
                numbers[a] = n_sets
            else:
                numbers[a] = numbers[root]
            row[starts[a] : stops[a]] = numbers[a]
    return n_sets


def euler_number(labels: NDArray[np.int32], neighbours: int) -> int:
    """Return geobodies minus holes; in a volume geobodies − tunnels + cavities.

    Counted by the 2 × 2 × 2 cells around each corner (Gray 1971): an eighth of the Euler number of
    their union for 26 neighbours; for 18 two cells that share no more than the corner count twice,
    and for 6 cells touch by their sides only.

    Examples
    --------
    >>> ring = np.ones((1, 3, 3), np.int32)
    >>> ring[0, 1, 1] = 0
    >>> euler_number(ring, 8)
    0
    """
    table = _TABLES[in_volume(neighbours)]
    return int(_sum_corners(np.pad((labels > 0).view(np.uint8), 1), table)) // 8


def _table(neighbours: int) -> NDArray[np.int64]:
    """Return 8 × the share of the Euler number by which cells of 2 × 2 × 2 are inside."""
    found = np.zeros(256, np.int64)
    places = [(z, y, x) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    for number in range(256):
        cells = np.array([number >> k & 1 for k in range(8)], bool).reshape(2, 2, 2)
        # Each part of a cell at the corner: the corner itself, 3 edges, 3 faces and the cell, of
        # which the 2 × 2 × 2 cells at both ends count one half for each axis that it lies along.
        total = 0
        for along in places:  # along which axes the part has a length
            n_axes = sum(along)
            sides = [(0, 1) if length else (slice(None),) for length in along]
            parts = [cells[z, y, x] for z in sides[0] for y in sides[1] for x in sides[2]]
            if neighbours == 6:  # cells are the corners of the parts: all of them must be inside
                inside = sum(bool(np.all(part)) for part in parts)
                total += (-1) ** (3 - n_axes) * inside * 8 // 2**n_axes
            else:
                inside = sum(bool(np.any(part)) for part in parts)
                total += (-1) ** n_axes * inside * 8 // 2**n_axes
        is_pair = cells.sum() == 2 and bool((cells & cells[::-1, ::-1, ::-1]).any())
        found[number] = total + (8 if is_pair and neighbours == 18 else 0)
    return found


_TABLES = {neighbours: _table(neighbours) for neighbours in _LINES}


@allocating_kernel
def _sum_corners(inside, table):
    """Sum a table over all 2 × 2 × 2 cells; those above a map are a mirror image of those below."""
    nz, ny, nx = inside.shape
    n_layers, times = (1, 2) if nz == 3 else (nz - 1, 1)  # with the layers around it
    columns = np.empty(nx, np.uint8)
    total = 0
    for k in range(n_layers):
        for i in range(ny - 1):
            a, b = inside[k, i], inside[k, i + 1]
            c, d = inside[k + 1, i], inside[k + 1, i + 1]
            for j in range(nx):
                columns[j] = a[j] + np.uint8(4) * b[j] + np.uint8(16) * c[j] + np.uint8(64) * d[j]
            for j in range(1, nx):
                total += table[np.uint8(columns[j - 1] + np.uint8(2) * columns[j])]
    return total * times
