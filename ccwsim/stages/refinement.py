"""Shift a drawn place to where it fits best at full resolution.

The search at level J knows only places at multiples of 2^J cells; shifting by up to 2^J − 1 cells
closes the gaps of that lattice.
"""

from __future__ import annotations

from ccwsim.kernels import kernel
from ccwsim.stages.conditioning import SPARSE
from ccwsim.stages.cut import UNKNOWN
from ccwsim.stages.similarity import LEFT, TOP


@kernel
def refine_place(image, grid, data, has_data, y0, x0, template, overlap, shape, unit, ty, tx):
    """Return the row and column of the TI, near (ty, tx), whose patch fits best.

    Parameters
    ----------
    image, grid : ndarray of uint8
        Training image and simulation grid in the path frame.
    data : ndarray of uint8, shape of `grid`
        Facies of the data, UNKNOWN elsewhere; looked at only where `has_data`.
    y0, x0, template, overlap, shape
        The tile and its overlap, in cells.
    unit : int
        2^J.
    ty, tx : int
        First cell of the drawn place.
    """
    best_y, best_x = ty, tx
    best = _misfit(image, grid, data, has_data, y0, x0, template, overlap, shape, ty, tx, 1 << 60)
    stride = unit // 2
    while stride > 0:
        middle_y, middle_x = best_y, best_x
        for sy in range(middle_y - stride, middle_y + stride + 1, stride):
            for sx in range(middle_x - stride, middle_x + stride + 1, stride):
                inside = 0 <= sy <= image.shape[0] - template
                if not inside or not 0 <= sx <= image.shape[1] - template:
                    continue
                misfit = _misfit(
                    image, grid, data, has_data, y0, x0, template, overlap, shape, sy, sx, best
                )
                if misfit < best:
                    best, best_y, best_x = misfit, sy, sx
        stride //= 2
    return best_y, best_x


@kernel
def _misfit(image, grid, data, has_data, y0, x0, template, overlap, shape, ty, tx, limit):
    """Count wrong cells in the overlap and missed data; stop where `limit` is reached."""
    wrong = 0
    for y in range(template):
        in_top = (shape & TOP) and y < overlap
        width = template if in_top else (overlap if shape & LEFT else 0)
        if width == 0 and not has_data:
            break
        old = grid[y0 + y]
        new = image[ty + y]
        for x in range(width):
            wrong += old[x0 + x] != new[tx + x]
        if has_data:
            known = data[y0 + y]
            for x in range(template):
                datum = known[x0 + x]
                missed = datum != UNKNOWN and new[tx + x] != datum
                if missed and (x >= width or old[x0 + x] != datum):
                    wrong += SPARSE.missed
        if wrong >= limit:
            return wrong
    return wrong
