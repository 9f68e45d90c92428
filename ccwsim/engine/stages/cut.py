"""The minimum error boundary cut (section 2) and the paste (section 4.4; Algorithm 1, line 14)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import part_of_kernel

UNKNOWN = 255
"""A cell without datum in the grid of data, or not simulated yet in the simulation grid."""

KEEP_OLD, TAKE_NEW = 1, 2
BROKEN = 1 << 16
"""What a cut pays for each datum it would drop: more than any path without one."""


class CutWorkspace(NamedTuple):
    """Arrays for the cuts of one patch, large enough for each of its sides."""

    keep_mask: NDArray[np.bool_]  # shape (size, size): where the grid stays as it is
    # shape (size, overlap): 1 where old and new cells differ; lines along the boundary, cells
    # across
    error: NDArray[np.uint8]
    # shape (size, overlap): KEEP_OLD or TAKE_NEW where only that honours a datum, else 0
    demand: NDArray[np.uint8]
    cost: NDArray[np.int64]  # shape (size, overlap + 1): cost of the best path to each boundary
    path: NDArray[np.int64]  # shape (size,): the chosen boundary of each line


def make_cut(size: int, overlap: int) -> CutWorkspace:
    """Return the workspace for boxes of at most `size` cells and overlaps of at most `overlap`."""
    return CutWorkspace(
        np.zeros((size, size), np.bool_),
        np.zeros((size, overlap), np.uint8),
        np.zeros((size, overlap), np.uint8),
        np.zeros((size, overlap + 1), np.int64),
        np.zeros(size, np.int64),
    )


@part_of_kernel
def boundary(cut, n, m):
    """Fill `cut.path` with the cheapest boundary through n lines of m cells.

    Dynamic programming: boundary c of a line, 0 … m, keeps the cells before c as they are and takes
    the new ones from c on. It pays the error on both its sides and moves by at most one cell a
    line, so there is no step that the error would not see.
    """
    error, demand, cost, path = cut.error, cut.demand, cut.cost, cut.path
    for i in range(n):
        broken = 0
        for x in range(m):
            broken += demand[i, x] == KEEP_OLD
        for c in range(m + 1):
            if c > 0:
                broken += demand[i, c - 1] == TAKE_NEW
                broken -= demand[i, c - 1] == KEEP_OLD
            total = np.int64(error[i, max(c - 1, 0)]) + error[i, min(c, m - 1)]
            total += BROKEN * broken
            if i > 0:
                best = cost[i - 1, c]
                if c > 0:
                    best = min(best, cost[i - 1, c - 1])
                if c < m:
                    best = min(best, cost[i - 1, c + 1])
                total += best
            cost[i, c] = total
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


@part_of_kernel
def wanted(old, new, datum):
    """Return which of two facies a cut must choose to honour the datum of a cell."""
    if datum == UNKNOWN or (old == datum) == (new == datum):
        return 0
    return KEEP_OLD if old == datum else TAKE_NEW


@part_of_kernel
def keep_old(grid, data, image, ty, tx, box, cut):
    """Mark in `cut.keep_mask` the cells of a box where the grid stays as it is.

    The strips are cut one after the other: what one keeps is old for the next, so that they meet in
    the corners without a gap.
    """
    size, m, keep_mask = box.size, box.overlap, cut.keep_mask
    for y in range(size):
        for x in range(size):
            keep_mask[y, x] = False
    for side in range(4):
        if not box.sides & (1 << side):
            continue
        upright, far = side == 0 or side == 2, side >= 2
        for i in range(size):
            for c in range(m):
                inwards = size - 1 - c if far else c
                y, x = (i, inwards) if upright else (inwards, i)
                old, new = grid[box.y0 + y, box.x0 + x], image[ty + y, tx + x]
                same = keep_mask[y, x] or old == new
                cut.error[i, c] = 0 if same else 1
                datum = data[box.y0 + y, box.x0 + x]
                cut.demand[i, c] = 0 if same else wanted(old, new, datum)
        boundary(cut, size, m)
        for i in range(size):
            for c in range(cut.path[i]):
                inwards = size - 1 - c if far else c
                y, x = (i, inwards) if upright else (inwards, i)
                keep_mask[y, x] = True


@part_of_kernel
def paste(image, ty, tx, box, keep_mask, counts, grid, sources):
    """Paste the patch at (ty, tx) of the image where the grid is not kept.

    `counts` (cells by facies) and `sources` (flat indices in the image) are kept up to date where
    they are not empty.
    """
    for y in range(box.size):
        row = grid[box.y0 + y, box.x0 : box.x0 + box.size]
        new, keep = image[ty + y, tx : tx + box.size], keep_mask[y]
        if len(counts):
            for x in range(box.size):
                if not keep[x]:
                    counts[new[x]] += 1
                    if row[x] != UNKNOWN:
                        counts[row[x]] -= 1
        for x in range(box.size):
            row[x] = row[x] if keep[x] else new[x]
        if sources.size:
            first = (ty + y) * image.shape[1] + tx
            for x in range(box.size):
                if not keep[x]:
                    sources[box.y0 + y, box.x0 + x] = first + x
