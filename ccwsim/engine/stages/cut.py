"""The minimum-error boundary cut and the paste (section 4.3; Algorithm 1, line 10)."""

from __future__ import annotations

import numpy as np

from ccwsim.engine.kernels import kernel

UNKNOWN = 255
"""A cell without datum in the grid of data, or not simulated yet in the simulation grid."""

KEEP_OLD, TAKE_NEW = 1, 2
BROKEN = 1 << 16
"""What a cut pays for each datum it would drop: more than any path without one."""


@kernel
def boundary(error, demand, cost, path):
    """Find the cheapest boundary through an overlap, by dynamic programming.

    Boundary c of a line keeps the cells before c as they are and takes the new ones from c on. It
    pays the error on both its sides and moves by at most one cell a line, so there is no step that
    the error would not see.

    Parameters
    ----------
    error : ndarray of uint8, shape (n, m)
        1 where old and new cells differ; n lines along the boundary, m cells across.
    demand : ndarray of uint8, shape (n, m)
        KEEP_OLD or TAKE_NEW where only that honours a datum, else 0.
    cost : ndarray of int64, shape (n, m + 1)
        Room to work in; the cost of the best path to each boundary on return.
    path : ndarray of int64, shape (n,)
        The boundary of each line, 0 … m.
    """
    n, m = error.shape
    for i in range(n):
        broken = 0
        for x in range(m):
            broken += demand[i, x] == KEEP_OLD
        for c in range(m + 1):
            if c > 0:
                broken += demand[i, c - 1] == TAKE_NEW
                broken -= demand[i, c - 1] == KEEP_OLD
            before = error[i, max(c - 1, 0)]
            after = error[i, min(c, m - 1)]
            here = before + after + BROKEN * broken
            if i > 0:
                best = cost[i - 1, c]
                if c > 0:
                    best = min(best, cost[i - 1, c - 1])
                if c < m:
                    best = min(best, cost[i - 1, c + 1])
                here += best
            cost[i, c] = here
    at = 0
    for c in range(1, m + 1):
        if cost[n - 1, c] < cost[n - 1, at]:
            at = c
    path[n - 1] = at
    for i in range(n - 2, -1, -1):
        best = at
        if at > 0 and cost[i, at - 1] < cost[i, best]:
            best = at - 1
        if at < m and cost[i, at + 1] < cost[i, best]:
            best = at + 1
        at = best
        path[i] = at


@kernel
def wanted(old, new, datum):
    """Say which of two facies a cut must choose to honour the datum of a cell."""
    if datum == UNKNOWN or (old == datum) == (new == datum):
        return 0
    return KEEP_OLD if old == datum else TAKE_NEW


@kernel
def keep_old(grid, data, patch, y0, x0, overlap, sides, kept):
    """Mark in `kept` the cells of a tile where the grid stays as it is.

    The strips are cut one after the other: what one keeps is old for the next, so that they meet in
    the corners without a gap.

    Parameters
    ----------
    grid, data : ndarray of uint8, shape (ny, nx)
        The simulation grid and the facies of the data, UNKNOWN elsewhere.
    patch : ndarray of uint8, shape (h, w)
        The new facies of the tile.
    y0, x0 : int
        First cell of the tile.
    overlap : int
        Width of the strips.
    sides : int
        Bits: 1 left, 2 top, 4 right, 8 bottom.
    kept : ndarray of bool, shape (h, w)
    """
    height, width = patch.shape
    longest = max(height, width)
    error = np.empty((longest, overlap), np.uint8)
    demand = np.empty((longest, overlap), np.uint8)
    cost = np.empty((longest, overlap + 1), np.int64)
    path = np.empty(longest, np.int64)
    kept[:] = False
    for side in range(4):
        if not sides & (1 << side):
            continue
        upright = side == 0 or side == 2
        n = height if upright else width
        for i in range(n):
            for c in range(overlap):
                y, x = _cell_of_strip(side, i, c, height, width)
                old, new = grid[y0 + y, x0 + x], patch[y, x]
                same = kept[y, x] or old == new
                error[i, c] = 0 if same else 1
                demand[i, c] = 0 if same else wanted(old, new, data[y0 + y, x0 + x])
        boundary(error[:n], demand[:n], cost, path)
        for i in range(n):
            for c in range(path[i]):
                y, x = _cell_of_strip(side, i, c, height, width)
                kept[y, x] = True


@kernel
def _cell_of_strip(side, i, c, height, width):
    """Return the cell that lies i along a side and c cells inwards from it."""
    if side == 0:
        return i, c
    if side == 1:
        return c, i
    if side == 2:
        return i, width - 1 - c
    return height - 1 - c, i


@kernel
def paste_sources(ty, tx, width, kept, y0, x0, sources):
    """Note, for the cells of a tile that are not kept, the flat index in a TI of `width` columns.

    `ty`, `tx` are the first cell of the patch in the TI, `y0`, `x0` that of the tile.
    """
    for y in range(kept.shape[0]):
        for x in range(kept.shape[1]):
            if not kept[y, x]:
                sources[y0 + y, x0 + x] = (ty + y) * width + tx + x


@kernel
def paste(patch, kept, shape, overlap, counts, y0, x0, grid):
    """Paste the cells of a tile that are not kept, which can only be those of its overlap.

    `counts` of facies are kept up to date, but where there are none: cells of the overlap, whose
    `shape` is given, were simulated before and are counted already.
    """
    height, width = patch.shape
    for y in range(height):
        row, new = grid[y0 + y, x0 : x0 + width], patch[y]
        old = width if shape & 2 and y < overlap else (overlap if shape & 1 else 0)
        if len(counts):
            for x in range(old):
                counts[row[x]] -= not kept[y, x]
            for x in range(width):
                counts[new[x]] += x >= old or not kept[y, x]
        for x in range(old):
            row[x] = row[x] if kept[y, x] else new[x]
        for x in range(old, width):
            row[x] = new[x]
