"""The minimum error boundary cut (section 2) and pasting (section 4.4; Algorithm 1, line 14).

Maps are cut strip by strip by dynamic programming. Cutting a volume slice by slice would cause
steps between slices; volumes therefore use the exact minimum cut (see `minimum_cut`).
"""

from typing import NamedTuple

import numpy as np

from ccwsim.engine.corrections.minimum_cut import FlowWorkspace, make_flow, minimum_cut
from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.bits import n_bits
from ccwsim.engine.stages.path import BOTTOM, LEFT, RIGHT, TOP, UNKNOWN, Triple
from ccwsim.model import Ints, Mask, UInt64s

# cost of a datum that the cut does not honour; it exceeds any cost without data
MISSED_DATUM_COST = 1 << 16
RANK_DATUM_COST = 8  # cost of a datum of a continuous variable, per rank, relative to a cell
MAX_BIT_COST = 32
"""Cost of a boundary below which bits represent all boundaries of a line at once in the search."""


class CutWorkspace(NamedTuple):
    """Workspace to cut a patch, large enough for the overlap on each side."""

    keep_mask: Mask  # shape (nz, ny, nx): cells of the grid that stay old
    # shape (size,): cells that differ between old and new, for each line of cells across the
    # boundary; bit c % 64 is the cell at a distance of c cells from the side
    error: UInt64s
    # shape (size, overlap): cost of a boundary beside each cell, where old and new differ
    off: Ints
    # shape (size, overlap): by how much the new cell honours a datum worse than the old one
    loss: Ints
    cost: Ints  # shape (size, overlap + 1): minimum cost up to each boundary
    # shape (MAX_BIT_COST + 2, size + 1): bit c of row k is set if boundary c of a line can be
    # reached with a cost of k − 2
    reached: UInt64s
    path: Ints  # shape (size,): the chosen boundary of each line
    flow: FlowWorkspace | None  # None for maps, to omit the code for volumes


def make_cut(template: Triple, overlap: Triple) -> CutWorkspace:
    """Return the workspace for boxes of at most `template` cells, with strips `overlap` wide."""
    size, width = max(template[1:]), max(overlap[1:])
    return CutWorkspace(
        keep_mask=np.zeros(template, np.bool_),
        error=np.zeros(size, np.uint64),
        off=np.zeros((size, width), np.int64),
        loss=np.zeros((size, width), np.int64),
        cost=np.zeros((size, width + 1), np.int64),
        reached=np.zeros((MAX_BIT_COST + 2, size + 1), np.uint64),
        path=np.zeros(size, np.int64),
        flow=make_flow(template) if template[0] > 1 else None,
    )


@part_of_kernel
def boundary(cut, n, m):
    """Fill `cut.path` with the boundary of minimum cost through n lines of m cells.

    With boundary c of a line, 0 … m, cells before c stay old and cells from c on become new. The
    cost of a boundary is `cut.off` of the two cells next to the boundary, plus the loss of all new
    cells, except for a constant. Boundaries of neighbouring lines differ by at most one cell. The
    method is dynamic programming.
    """
    off, cost, path = cut.off, cut.cost, cut.path
    for i in range(n):
        kept = np.int64(0)
        for c in range(m + 1):
            if c > 0:
                kept -= cut.loss[i, c - 1]
            total = off[i, max(c - 1, 0)] + off[i, min(c, m - 1)] + kept
            if i > 0:
                best = cost[i - 1, c]
                if c > 0:
                    best = min(best, cost[i - 1, c - 1])
                if c < m:
                    best = min(best, cost[i - 1, c + 1])
                total += best
            cost[i, c] = total
    end = 0
    for c in range(1, m + 1):
        if cost[n - 1, c] < cost[n - 1, end]:
            end = c
    path[n - 1] = end
    for i in range(n - 2, -1, -1):
        best = end
        if end > 0 and cost[i, end - 1] < cost[i, best]:
            best = end - 1
        if end < m and cost[i, end + 1] < cost[i, best]:
            best = end + 1
        end = best
        path[i] = end


@part_of_kernel
def bit_boundary(cut, n, m):
    """Fill `cut.path` like `boundary` without data, if the cost is less than MAX_BIT_COST.

    Return whether `cut.path` was filled. For each cost 0, 1, 2 …, the boundaries that can be
    reached with this cost are computed; the bits of a word are the boundaries of a line. m must be
    at most 63.
    """
    error, reached, path = cut.error, cut.reached, cut.path
    one, last, full = np.uint64(1), np.uint64(m - 1), ~np.uint64(0) >> np.uint64(63 - m)
    for i in range(n + 1):
        reached[0, i] = reached[1, i] = np.uint64(0)
    boundaries, cost = np.uint64(0), np.int64(1)
    while not boundaries and cost <= MAX_BIT_COST:
        cost += 1
        boundaries = reached[cost, 0] = full
        for i in range(n):
            before, after = _sides(error[i], last)
            boundaries = _next(boundaries) & ~(before | after) | _next(reached[cost - 2, i])
            boundaries = (boundaries | _next(reached[cost - 1, i]) & ~(before & after)) & full
            reached[cost, i + 1] = boundaries
    if not boundaries:
        return False
    c = np.uint64(n_bits((boundaries & (~boundaries + one)) - one))
    for i in range(n - 1, -1, -1):
        path[i] = c
        before, after = _sides(error[i], last)
        cost -= np.int64((before >> c & one) + (after >> c & one))
        boundaries = reached[cost, i]
        if not boundaries >> c & one:
            lower = c > 0 and boundaries >> (c - one) & one
            c = c - one if lower else c + one
    return True


@part_of_kernel
def _sides(error, last):
    """Return the error bits before and after each boundary of a line; `last` is the last cell."""
    one = np.uint64(1)
    return error << one | error & one, error | (error >> last) << (last + one)


@part_of_kernel
def _next(boundaries):
    """Return the boundaries of the next line that differ by at most one cell from `boundaries`."""
    return boundaries | boundaries << np.uint64(1) | boundaries >> np.uint64(1)


@part_of_kernel
def keep_old(grid, data, image, place, box, cut, by_rank=False):
    """Mark in `cut.keep_mask` the cells of a box that stay old.

    `data` comes from `data_grid`. `grid` and `data` have the shape (nz, ny, nx), `image` has the
    shape (mz, my, mx). If `by_rank`, all are maps of ranks of values, whose differences count.
    """
    _keep_old(grid, data, image, place, box, cut, cut.flow, by_rank)


@part_of_kernel
def _keep_old(grid, data, image, place, box, cut, flow, by_rank):
    """Implement `keep_old`; Numba omits a branch for None only if the argument itself is None."""
    keep_mask = cut.keep_mask
    if flow is not None:
        minimum_cut(grid, data, image, place, box, flow, keep_mask)
    else:
        for y in range(box.ny):
            for x in range(box.nx):
                keep_mask[0, y, x] = False
        of_grid, of_data, of_image = grid[box.z0], data[box.z0], image[place[0]]
        _cut_strips(of_grid, of_data, of_image, place, box, cut, keep_mask[0], by_rank)


@part_of_kernel
def _cut_strips(grid, data, image, place, box, cut, keep_mask, by_rank):
    """Cut a layer strip by strip; cells that stay old in a strip count as old in later strips.

    The cuts of two strips thus join in corners. `grid`, `data`, `image` and `keep_mask` are single
    layers with two axes.
    """
    for side in (LEFT, TOP, RIGHT, BOTTOM):
        if not box.sides & side:
            continue
        upright, far = side & (LEFT | RIGHT) != 0, side & (RIGHT | BOTTOM) != 0
        n, m = (box.ny, box.ox) if upright else (box.nx, box.oy)
        differ = has_data = True
        if not by_rank:
            differ, has_data = _compare(grid, data, image, place, box, upright, far, cut, keep_mask)
        if not differ:
            continue
        if has_data or m > 63 or not bit_boundary(cut, n, m):
            _demand(grid, data, image, place, box, upright, far, cut, keep_mask, by_rank)
            boundary(cut, n, m)
        for i in range(n):
            for c in range(cut.path[i]):
                y, x = _cell_of(i, c, box, upright, far)
                keep_mask[y, x] = True


@part_of_kernel
def _compare(grid, data, image, place, box, upright, far, cut, keep_mask):
    """Fill `cut.error` for a strip; return whether cells differ and whether cells have data.

    A cell that an earlier strip marked as old causes no error, because it stays old anyway.
    """
    _, ty, tx = place
    n, m = (box.ny, box.ox) if upright else (box.nx, box.oy)
    y0 = box.ny - m if far and not upright else 0
    x0 = box.nx - m if far and upright else 0
    rows, columns = (n, m) if upright else (m, n)
    of_grid, of_image = grid.reshape(-1), image.reshape(-1)
    of_data, keep = data.reshape(-1), keep_mask.reshape(-1)
    error, end = cut.error, np.uint64(m - 1)
    differences, has_data = np.uint64(0), False
    for i in range(n):
        error[i] = 0
    for i in range(rows):
        y = y0 + i
        kept = np.uint64(y * keep_mask.shape[1] + x0)
        first = np.uint64((box.y0 + y) * grid.shape[1] + box.x0 + x0)
        datum = np.uint64((box.y0 + y) * data.shape[1] + box.x0 + x0)
        new = np.uint64((ty + y) * image.shape[1] + tx + x0)
        if upright:
            word = np.uint64(0)
            for x in range(np.uint64(columns)):
                differs = (of_grid[first + x] != of_image[new + x]) & (not keep[kept + x])
                c = end - x if far else x
                word |= np.uint64(differs) << (c & np.uint64(63))
            error[i] = word
            differences |= word
        else:
            c = m - 1 - i if far else i
            shift = np.uint64(c & 63)
            for x in range(np.uint64(columns)):
                differs = (of_grid[first + x] != of_image[new + x]) & (not keep[kept + x])
                word = np.uint64(differs) << shift
                error[x] |= word
                differences |= word
        for x in range(np.uint64(columns)):
            has_data |= of_data[datum + x] != UNKNOWN
    return differences != 0, has_data


@part_of_kernel
def _demand(grid, data, image, place, box, upright, far, cut, keep_mask, by_rank):
    """Fill `cut.off` and `cut.loss` for a strip; a cell that is marked stays old anyway."""
    _, ty, tx = place
    n, m = (box.ny, box.ox) if upright else (box.nx, box.oy)
    for i in range(n):
        for c in range(m):
            y, x = _cell_of(i, c, box, upright, far)
            old = np.int64(grid[box.y0 + y, box.x0 + x])
            new = np.int64(image[ty + y, tx + x])
            datum = np.int64(data[box.y0 + y, box.x0 + x])
            off, loss = np.int64(old != new), np.int64(new != datum) - np.int64(old != datum)
            cost, is_free = MISSED_DATUM_COST, not keep_mask[y, x]
            if by_rank:
                off, loss = abs(new - old), abs(new - datum) - abs(old - datum)
                cost, is_free = RANK_DATUM_COST, is_free and old != UNKNOWN
            cut.off[i, c] = off if is_free else 0
            cut.loss[i, c] = cost * loss if is_free and datum != UNKNOWN else 0


@part_of_kernel
def _cell_of(i, c, box, upright, far):
    """Return row and column of the cell of line i at a distance of c cells from a side."""
    if upright:
        return i, box.nx - 1 - c if far else c
    return (box.ny - 1 - c if far else c), i


@part_of_kernel
def count_facies(flat, first, n_cells, facies):
    """Count the cells of a facies in a row, with 16-bit counts for faster vector instructions."""
    n, facies = np.int16(0), np.uint8(facies)
    for x in range(np.uint64(n_cells)):
        n = np.int16(n + (flat[first + x] == facies))
    return np.int64(n)


@part_of_kernel
def paste(image, place, box, keep_mask, counts, grid, sources):
    """Paste the patch at a location of the image into a box, except in cells marked in `keep_mask`.

    `image` has the shape (mz, my, mx), `grid` (nz, ny, nx). `counts`, shape (n_facies,), is the
    number of cells of each facies. `sources` has the shape of the grid and contains flat indices in
    the image. `counts` and `sources` are updated unless they are empty.
    """
    tz, ty, tx = place
    of_grid, of_image, keep = grid.reshape(-1), image.reshape(-1), keep_mask.reshape(-1)
    for z in range(box.nz):
        for y in range(box.ny):
            old = np.uint64(((box.z0 + z) * grid.shape[1] + box.y0 + y) * grid.shape[2] + box.x0)
            new = np.uint64(((tz + z) * image.shape[1] + ty + y) * image.shape[2] + tx)
            kept = np.uint64((z * keep_mask.shape[1] + y) * keep_mask.shape[2])
            for k in range(len(counts)):
                counts[k] -= count_facies(of_grid, old, box.nx, k)
            for x in range(np.uint64(box.nx)):
                of_grid[old + x] = of_grid[old + x] if keep[kept + x] else of_image[new + x]
            for k in range(len(counts)):
                counts[k] += count_facies(of_grid, old, box.nx, k)
            if sources.size:
                for x in range(box.nx):
                    if not keep[kept + np.uint64(x)]:
                        sources[box.z0 + z, box.y0 + y, box.x0 + x] = np.int64(new) + x
