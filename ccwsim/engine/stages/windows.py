"""Where in the training image a window fits that must honour its data (used by mending)."""

from __future__ import annotations

from ccwsim.engine.kernels import kernel
from ccwsim.engine.stages.bits import n_different
from ccwsim.engine.stages.candidates import draw_index
from ccwsim.engine.stages.cut import UNKNOWN

LEFT, TOP, RIGHT, BOTTOM = 1, 2, 4, 8
"""The sides along which a window is compared and cut; none where it touches the grid's edge."""


@kernel
def honouring_places(image, data, y0, x0, size, mask):
    """Mark in `mask` the places of the TI whose window honours all data; return how many."""
    mask[:] = True
    ny, nx = mask.shape
    for dy in range(size):
        for dx in range(size):
            facies = data[y0 + dy, x0 + dx]
            if facies == UNKNOWN:
                continue
            for py in range(ny):
                row = image[py + dy, dx : dx + nx]
                marks = mask[py]
                for px in range(nx):
                    marks[px] &= row[px] == facies
    n = 0
    for py in range(ny):  # mask.sum() would take long to compile
        for px in range(nx):
            n += mask[py, px]
    return n


@kernel
def best_windows(bits, mask, size, strips, share, limit, rng, best):
    """Fill `best` with (misfit, row, column) of the places whose ring fits best; return how many.

    Only marked places with at most `limit` wrong cells count, each looked at with chance `share`.
    The first of equal places are kept, so the look round begins at a random place.
    """
    rows, columns = mask.shape
    first_y, first_x = draw_index(rng, rows), draw_index(rng, columns)
    n = 0
    worst = limit + 1
    for py in range(first_y - rows, first_y):
        py += rows if py < 0 else 0
        marks = mask[py]
        for px in range(first_x - columns, first_x):
            px += columns if px < 0 else 0
            if not marks[px] or (share < 1 and rng.random() >= share):
                continue
            misfit = n_different(bits, py, px, size, strips, worst)
            if misfit >= worst:
                continue
            if n < len(best):
                at = n
                n += 1
            else:
                at = 0
                for k in range(1, n):
                    if best[k, 0] > best[at, 0]:
                        at = k
            best[at, 0], best[at, 1], best[at, 2] = misfit, py, px
            if n == len(best):
                worst = best[0, 0]
                for k in range(1, n):
                    worst = max(worst, best[k, 0])
    return n
