"""Shift a drawn location to where it fits best at full resolution (not in the paper).

The search at level J knows only locations at multiples of 2^J cells; shifting by up to 2^J − 1
cells closes the gaps of that lattice.
"""

from __future__ import annotations

import numpy as np

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.bits import n_different, take_strips
from ccwsim.engine.stages.box import LEFT, TOP
from ccwsim.engine.stages.conditioning import SPARSE
from ccwsim.engine.stages.cut import UNKNOWN


@part_of_kernel
def refine_place(image, bits, grid, data, box, block_size, ty, tx, strips, at_stake):
    """Return the row and column of the TI, near (ty, tx), whose patch fits best.

    `at_stake`, shape (n, 3), is workspace for the data that the cut cannot keep.
    """
    take_strips(grid, box, strips)
    n = data_at_stake(grid, data, box, at_stake)
    best_y, best_x, best = np.int64(ty), np.int64(tx), np.int64(1 << 60)
    best = _misfit(image, bits, at_stake, n, best_y, best_x, box.size, strips, best)
    stride = block_size // 2
    while stride > 0:
        middle_y, middle_x = best_y, best_x
        for k in range(9):
            sy, sx = middle_y + (k // 3 - 1) * stride, middle_x + (k % 3 - 1) * stride
            if 0 <= sy <= image.shape[0] - box.size and 0 <= sx <= image.shape[1] - box.size:
                misfit = _misfit(image, bits, at_stake, n, sy, sx, box.size, strips, best)
                if misfit < best:
                    best, best_y, best_x = misfit, sy, sx
        stride //= 2
    return best_y, best_x


@part_of_kernel
def data_at_stake(grid, data, box, at_stake):
    """Fill `at_stake` with the data of a box that the cut cannot keep; return how many.

    Row and column in the box, and facies. Data in the overlap that the grid honours are left out.
    """
    left = box.overlap if box.sides & LEFT else 0
    top = box.overlap if box.sides & TOP else 0
    n = 0
    for y in range(box.y0, min(box.y0 + box.size, len(data.first) - 1)):
        width = box.size if y < box.y0 + top else left
        for i in range(data.first[y], data.first[y + 1]):
            x = data.columns[i] - box.x0
            if x < 0 or x >= box.size:
                continue
            facies = data.required[y, box.x0 + x]
            if facies != UNKNOWN and (x >= width or grid[y, box.x0 + x] != facies):
                at_stake[n, 0], at_stake[n, 1], at_stake[n, 2] = y - box.y0, x, facies
                n += 1
    return n


@part_of_kernel
def _misfit(image, bits, at_stake, n, ty, tx, size, strips, limit):
    """Count wrong cells in the overlap and missed data; no further than to `limit`."""
    wrong = np.int64(0)
    for i in range(n):
        wrong += SPARSE.missed * (image[ty + at_stake[i, 0], tx + at_stake[i, 1]] != at_stake[i, 2])
    if wrong >= limit:
        return wrong
    return wrong + n_different(bits, ty, tx, size, strips, limit - wrong)
