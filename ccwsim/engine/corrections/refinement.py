"""Shift a drawn location to where it fits best at full resolution (not in the paper).

The search at level J knows only locations at multiples of 2^J cells; shifting by up to 2^J − 1
cells closes the gaps of that lattice.
"""

from __future__ import annotations

import numpy as np

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.bits import n_different, take_strips
from ccwsim.engine.stages.box import inside_overlap
from ccwsim.engine.stages.demand import UNKNOWN

MIDDLE = 13
"""Of 3 × 3 × 3 places, the one that they are around."""


@part_of_kernel
def refine_place(image, square_bits, grid, data, missed, box, block, place, strips, at_stake):
    """Return the layer, row and column of the TI, near `place`, whose patch fits best.

    After its misfit: wrong cells of overlap, and `missed` for each missed datum. `at_stake`, shape
    (n, 4), is workspace for the data that the cut cannot keep.
    """
    take_strips(grid, box, square_bits, strips)
    n = data_at_stake(grid, data, box, at_stake)
    best_z, best_y, best_x = place
    words, shape = square_bits.reshape(-1), square_bits.shape
    best = _misfit(image, words, shape, at_stake, n, missed, place, strips, np.int64(1 << 60))
    stride = max(block[0], block[1], block[2]) // 2
    while stride > 0:
        middle_z, middle_y, middle_x = best_z, best_y, best_x
        dz = stride if stride <= block[0] // 2 else 0
        dy = stride if stride <= block[1] // 2 else 0
        dx = stride if stride <= block[2] // 2 else 0
        for k in range(0 if dz else 9, 27 if dz else 18):
            i, j, m = k // 9 - 1, k // 3 % 3 - 1, k % 3 - 1
            if (j and not dy) or (m and not dx) or k == MIDDLE:
                continue
            z, y, x = middle_z + i * dz, middle_y + j * dy, middle_x + m * dx
            if (
                0 <= z <= image.shape[0] - box.nz
                and 0 <= y <= image.shape[1] - box.ny
                and 0 <= x <= image.shape[2] - box.nx
            ):
                near = z, y, x
                misfit = _misfit(image, words, shape, at_stake, n, missed, near, strips, best)
                if misfit < best:
                    best, best_z, best_y, best_x = misfit, z, y, x
        stride //= 2
    return best, best_z, best_y, best_x


@part_of_kernel
def data_at_stake(grid, data, box, at_stake):
    """Fill `at_stake` with the data of a box that the cut cannot keep; return how many.

    Layer, row and column in the box, and facies. Data in the overlap that the grid honours are left
    out.
    """
    low_z, _, low_y, _, low_x, _ = inside_overlap(box)
    shape, n = data.facies.shape, 0
    for z in range(box.z0, min(box.z0 + box.nz, shape[0])):
        for y in range(box.y0, min(box.y0 + box.ny, shape[1])):
            across = z < box.z0 + low_z or y < box.y0 + low_y
            width = box.nx if across else low_x
            own_row = z * shape[1] + y
            for i in range(data.first[own_row], data.first[own_row + 1]):
                x = data.columns[i] - box.x0
                if x < 0 or x >= box.nx:
                    continue
                facies = data.required[z, y, box.x0 + x]
                if facies != UNKNOWN and (x >= width or grid[z, y, box.x0 + x] != facies):
                    at_stake[n, 0], at_stake[n, 1] = z - box.z0, y - box.y0
                    at_stake[n, 2], at_stake[n, 3] = x, facies
                    n += 1
    return n


@part_of_kernel
def _misfit(image, words, shape, at_stake, n, missed, place, strips, limit):
    """Count wrong cells in the overlap and missed data; no further than to `limit`."""
    tz, ty, tx = place
    wrong = np.int64(0)
    for i in range(n):
        facies = image[tz + at_stake[i, 0], ty + at_stake[i, 1], tx + at_stake[i, 2]]
        wrong += missed * (facies != at_stake[i, 3])
    if wrong >= limit:
        return wrong
    return wrong + n_different(words, shape, place, strips, limit - wrong)
