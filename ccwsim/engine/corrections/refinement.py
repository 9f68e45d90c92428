"""Shift a location so that its patch fits best at full resolution (not in the paper).

The search at level J compares only locations that are multiples of 2^J cells. Shifts of up to 2^J −
1 cells also reach the locations between them.
"""

import numpy as np

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.bits import n_different
from ccwsim.engine.stages.path import UNKNOWN, inside_overlap

NO_RANKS = np.zeros((0, 0, 0), np.uint8)  # of images of facies


@part_of_kernel
def refine_place(
    image,
    square_bits,
    box,
    block,
    place,
    strips,
    at_stake,
    missed,
    ranks=NO_RANKS,
    grid_ranks=NO_RANKS,
):
    """Return the misfit, layer, row and column of the best location near `place`.

    The misfit is the number of wrong cells in the overlap, plus `missed` for each datum in
    `at_stake` that the patch does not honour. `strips` come from `take_strips`; `at_stake`, shape
    (n, 4), comes from `data_at_stake`. `image` has the shape (mz, my, mx), `square_bits` (n_planes,
    mz, my, n_words). `place` and `block` are (z, y, x); `place` is a multiple of `block`. Shifts of
    half a block are tried first, then shorter shifts, halved each time, down to 1 cell. With
    `ranks` of the image, the misfit is the difference from `grid_ranks`, those of the grid, summed
    over the overlap and, times `missed`, over data.
    """
    best_z, best_y, best_x = place
    compared = image, square_bits, strips, ranks, grid_ranks
    best = _misfit(compared, box, place, at_stake, missed, np.int64(1 << 60))
    last_z, last_y = image.shape[0] - box.nz, image.shape[1] - box.ny
    last_x = image.shape[2] - box.nx
    stride = max(block[0], block[1], block[2]) // 2
    while stride > 0:
        middle_z, middle_y, middle_x = best_z, best_y, best_x
        dz = stride if stride <= block[0] // 2 else 0
        dy = stride if stride <= block[1] // 2 else 0
        dx = stride if stride <= block[2] // 2 else 0
        for z in range(max(middle_z - dz, 0), min(middle_z + dz, last_z) + 1, max(dz, 1)):
            for y in range(max(middle_y - dy, 0), min(middle_y + dy, last_y) + 1, max(dy, 1)):
                for x in range(max(middle_x - dx, 0), min(middle_x + dx, last_x) + 1, max(dx, 1)):
                    if z == middle_z and y == middle_y and x == middle_x:
                        continue
                    misfit = _misfit(compared, box, (z, y, x), at_stake, missed, best)
                    if misfit < best:
                        best, best_z, best_y, best_x = misfit, z, y, x
        stride //= 2
    return best, best_z, best_y, best_x


@part_of_kernel
def data_at_stake(grid, data, box, at_stake):
    """Fill `at_stake` with data of a box that only the patch can honour; return their number.

    The columns of `at_stake`, shape (n, 4), are layer, row and column in the box, and facies. Data
    that the grid already honours in the overlap are omitted, because the cut can keep these cells.
    """
    inside = inside_overlap(box)
    shape, n = data.facies.shape, 0
    for z in range(box.z0, min(box.z0 + box.nz, shape[0])):
        for y in range(box.y0, min(box.y0 + box.ny, shape[1])):
            across = z < box.z0 + inside.low_z or y < box.y0 + inside.low_y
            width = box.nx if across else inside.low_x
            row = z * shape[1] + y
            for i in range(data.first[row], data.first[row + 1]):
                x = data.columns[i] - box.x0
                if x < 0 or x >= box.nx:
                    continue
                facies = data.required[z, y, box.x0 + x]
                if facies != UNKNOWN and (x >= width or grid[z, y, box.x0 + x] != facies):
                    at_stake[n] = z - box.z0, y - box.y0, x, np.int64(facies)
                    n += 1
    return n


@part_of_kernel
def _misfit(compared, box, place, at_stake, missed, limit):
    """Return the misfit of a location (see `refine_place`); counting may end at `limit`."""
    image, square_bits, strips, ranks, grid_ranks = compared
    if ranks.size:
        return _misfit_of_ranks(ranks, grid_ranks, box, place, at_stake, missed)
    (tz, ty, tx), wrong = place, np.int64(0)
    for i in range(len(at_stake)):
        facies = image[tz + at_stake[i, 0], ty + at_stake[i, 1], tx + at_stake[i, 2]]
        wrong += missed * (facies != at_stake[i, 3])
    if wrong >= limit:
        return wrong
    words = square_bits.reshape(-1)
    return wrong + n_different(words, square_bits.shape, place, strips, limit - wrong)


@part_of_kernel
def _misfit_of_ranks(ranks, grid_ranks, box, place, at_stake, missed):
    """Return the misfit of a location of a map by ranks (see `refine_place`)."""
    _, ty, tx = place
    inside, misfit = inside_overlap(box), np.int64(0)
    of_image, of_grid = ranks.reshape(-1), grid_ranks.reshape(-1)
    for y in range(box.ny):
        new = np.uint64((ty + y) * ranks.shape[2] + tx)
        old = np.uint64((box.y0 + y) * grid_ranks.shape[2] + box.x0)
        across = y < inside.low_y or y >= inside.high_y
        for part in range(1 if across else 2):
            first = inside.high_x if part else 0
            last = box.nx if across or part else inside.low_x
            off = np.int32(0)
            for x in range(np.uint64(first), np.uint64(last)):
                off += abs(np.int32(of_image[new + x]) - np.int32(of_grid[old + x]))
            misfit += off
    for i in range(len(at_stake)):
        y, x, datum = at_stake[i, 1], at_stake[i, 2], at_stake[i, 3]
        off, old = abs(ranks[0, ty + y, tx + x] - datum), grid_ranks[0, box.y0 + y, box.x0 + x]
        misfit += missed * (off if old == UNKNOWN else min(off, abs(old - datum)))
    return misfit
