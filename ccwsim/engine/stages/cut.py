"""The minimum error boundary cut (section 2) and the paste (section 4.4; Algorithm 1, line 14).

Maps are cut strip by strip by dynamic programming. In volumes strips leave steps from slice to
slice, so the exact minimum cut is taken there (see `minimum_cut`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.box import BOTTOM, LEFT, RIGHT, TOP
from ccwsim.engine.stages.demand import KEEP_OLD, TAKE_NEW, UNKNOWN, wanted
from ccwsim.engine.stages.minimum_cut import FlowWorkspace, make_flow, minimum_cut
from ccwsim.engine.stages.path import Triple

BROKEN = 1 << 16
"""What a cut pays for each datum it would drop: more than any path without one."""


class CutWorkspace(NamedTuple):
    """Arrays for the cuts of one patch, large enough for each of its sides."""

    keep_mask: NDArray[np.bool_]  # shape (nz, ny, nx): where the grid stays as it is
    # shape (size, overlap): 1 where old and new cells differ; lines along the boundary, cells
    # across
    error: NDArray[np.uint8]
    # shape (size, overlap): KEEP_OLD or TAKE_NEW where only that honours a datum, else 0
    demand: NDArray[np.uint8]
    cost: NDArray[np.int64]  # shape (size, overlap + 1): cost of the best path to each boundary
    path: NDArray[np.int64]  # shape (size,): the chosen boundary of each line
    flow: FlowWorkspace  # of the cut of a volume; empty for maps


def make_cut(template: Triple, overlap: Triple) -> CutWorkspace:
    """Return the workspace for boxes of at most `template` cells and `overlap` wide strips."""
    size, width = max(template[1:]), max(overlap[1:])
    return CutWorkspace(
        np.zeros(template, np.bool_),
        np.zeros((size, width), np.uint8),
        np.zeros((size, width), np.uint8),
        np.zeros((size, width + 1), np.int64),
        np.zeros(size, np.int64),
        make_flow(template if template[0] > 1 else (0, 0, 0)),
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
def keep_old(grid, data, image, place, box, cut):
    """Mark in `cut.keep_mask` the cells of a box where the grid stays as it is."""
    keep_mask = cut.keep_mask
    for z in range(box.nz):
        for y in range(box.ny):
            for x in range(box.nx):
                keep_mask[z, y, x] = False
    if len(cut.flow.cells):
        minimum_cut(grid, data, image, place, box, cut.flow, keep_mask)
    else:
        _cut_strips(grid[box.z0], data[box.z0], image[place[0]], place, box, cut, keep_mask[0])


@part_of_kernel
def _cut_strips(grid, data, image, place, box, cut, keep_mask):
    """Cut a layer strip by strip: what one keeps is old for the next, so that they meet in corners.

    `grid`, `data`, `image` and `keep_mask` are the layers of the box.
    """
    _, ty, tx = place
    for side in (LEFT, TOP, RIGHT, BOTTOM):
        if not box.sides & side:
            continue
        upright, far = side & (LEFT | RIGHT) != 0, side & (RIGHT | BOTTOM) != 0
        n, m, end = (box.ny, box.ox, box.nx) if upright else (box.nx, box.oy, box.ny)
        for i in range(n):
            for c in range(m):
                inwards = end - 1 - c if far else c
                y, x = (i, inwards) if upright else (inwards, i)
                old, new = grid[box.y0 + y, box.x0 + x], image[ty + y, tx + x]
                same = keep_mask[y, x] or old == new
                cut.error[i, c] = 0 if same else 1
                datum = data[box.y0 + y, box.x0 + x]
                cut.demand[i, c] = 0 if same else wanted(old, new, datum)
        boundary(cut, n, m)
        for i in range(n):
            for c in range(cut.path[i]):
                inwards = end - 1 - c if far else c
                y, x = (i, inwards) if upright else (inwards, i)
                keep_mask[y, x] = True


@part_of_kernel
def paste(image, place, box, keep_mask, counts, grid, sources):
    """Paste the patch at a place of the image where the grid is not kept.

    `counts` (cells by facies) and `sources` (flat indices in the image) are kept up to date where
    they are not empty.
    """
    tz, ty, tx = place
    for z in range(box.nz):
        for y in range(box.ny):
            row = grid[box.z0 + z, box.y0 + y, box.x0 : box.x0 + box.nx]
            new, keep = image[tz + z, ty + y, tx : tx + box.nx], keep_mask[z, y]
            if len(counts):
                for x in range(box.nx):
                    if not keep[x]:
                        counts[new[x]] += 1
                        if row[x] != UNKNOWN:
                            counts[row[x]] -= 1
            for x in range(box.nx):
                row[x] = row[x] if keep[x] else new[x]
            if sources.size:
                first = ((tz + z) * image.shape[1] + ty + y) * image.shape[2] + tx
                for x in range(box.nx):
                    if not keep[x]:
                        sources[box.z0 + z, box.y0 + y, box.x0 + x] = first + x
