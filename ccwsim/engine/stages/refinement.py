"""Shift a drawn place to where it fits best at full resolution.

The search at level J knows only places at multiples of 2^J cells; shifting by up to 2^J − 1 cells
closes the gaps of that lattice.
"""

from __future__ import annotations

import numpy as np

from ccwsim.engine.kernels import kernel
from ccwsim.engine.stages.bits import n_different, take_strips
from ccwsim.engine.stages.conditioning import SPARSE
from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.stages.similarity import LEFT, TOP


@kernel
def refine_place(
    image, bits, grid, data, y0, x0, template, overlap, shape, unit, ty, tx, strips
):  # fmt: skip
    """Return the row and column of the TI, near (ty, tx), whose patch fits best.

    Parameters
    ----------
    image, grid : ndarray of uint8
        Training image and simulation grid in the path frame.
    bits : ndarray of uint64
        Of the image, from `to_bits`.
    data : PlacedData
    y0, x0, template, overlap, shape
        The tile and its overlap, in cells.
    unit : int
        2^J.
    ty, tx : int
        First cell of the drawn place.
    strips : Strips
        Room for the overlap.
    """
    left, top = overlap if shape & LEFT else 0, overlap if shape & TOP else 0
    none = np.int64(0)  # a 0 written out would be a type of its own to the compiler
    take_strips(grid, y0, x0, template, left, top, none, none, strips)
    must = data_at_stake(grid, data, y0, x0, template, left, top)
    best_y, best_x = ty, tx
    best = _misfit(image, bits, must, ty, tx, template, strips, 1 << 60)
    stride = unit // 2
    while stride > 0:
        middle_y, middle_x = best_y, best_x
        for sy in range(middle_y - stride, middle_y + stride + 1, stride):
            for sx in range(middle_x - stride, middle_x + stride + 1, stride):
                inside = 0 <= sy <= image.shape[0] - template
                if not inside or not 0 <= sx <= image.shape[1] - template:
                    continue
                misfit = _misfit(image, bits, must, sy, sx, template, strips, best)
                if misfit < best:
                    best, best_y, best_x = misfit, sy, sx
        stride //= 2
    return best_y, best_x


@kernel
def data_at_stake(grid, data, y0, x0, template, left, top):
    """Return the data of a tile that the cut cannot keep: row and column in the tile, facies.

    Shape (n, 3). Those in the overlap that are right already are not among them.
    """
    last = min(y0 + template, len(data.first) - 1)
    must = np.empty((data.first[last] - data.first[y0], 3), np.int64)
    n = 0
    for y in range(y0, last):
        width = template if y < y0 + top else left
        for i in range(data.first[y], data.first[y + 1]):
            x = data.columns[i] - x0
            if x < 0 or x >= template:
                continue
            facies = data.kept[y, x0 + x]
            if facies != UNKNOWN and (x >= width or grid[y, x0 + x] != facies):
                must[n, 0], must[n, 1], must[n, 2] = y - y0, x, facies
                n += 1
    return must[:n]


@kernel
def _misfit(image, bits, must, ty, tx, template, strips, limit):
    """Count wrong cells in the overlap and missed data; no further than to `limit`."""
    wrong = 0
    for i in range(len(must)):
        wrong += SPARSE.missed * (image[ty + must[i, 0], tx + must[i, 1]] != must[i, 2])
    if wrong >= limit:
        return wrong
    return wrong + n_different(bits, ty, tx, template, strips, limit - wrong)
