"""Where in the training image a window fits that must honour its data (used by mending)."""

from __future__ import annotations

from ccwsim.kernels import kernel
from ccwsim.stages.candidates import draw_index
from ccwsim.stages.cut import UNKNOWN

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
                row = image[py + dy]
                marks = mask[py]
                for px in range(nx):
                    marks[px] &= row[px + dx] == facies
    n = 0
    for py in range(ny):  # mask.sum() would take long to compile
        for px in range(nx):
            n += mask[py, px]
    return n


@kernel
def ring_cells(size, ring, sides):
    """Return how many cells of a window lie in the strips along `sides`."""
    inner_x = size - ring * ((sides & LEFT > 0) + (sides & RIGHT > 0))
    inner_y = size - ring * ((sides & TOP > 0) + (sides & BOTTOM > 0))
    return size * size - inner_x * inner_y


@kernel
def best_windows(image, grid, mask, y0, x0, size, ring, sides, share, limit, rng, best):
    """Fill `best` with (misfit, row, column) of the places whose ring fits best; return how many.

    Only marked places with at most `limit` wrong cells count, each looked at with chance `share`.
    The first of equal places are kept, so the look round begins at a random place.
    """
    rows, columns = mask.shape
    first_y, first_x = draw_index(rng, rows), draw_index(rng, columns)
    n = 0
    worst = limit + 1
    for i in range(rows):
        py = (first_y + i) % rows
        for j in range(columns):
            px = (first_x + j) % columns
            if not mask[py, px] or (share < 1 and rng.random() >= share):
                continue
            misfit = ring_misfit(image, grid, y0, x0, py, px, size, ring, sides, worst)
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


@kernel
def ring_misfit(image, grid, y0, x0, ty, tx, size, ring, sides, limit):
    """Count the wrong cells of a ring, row by row, until `limit` is reached."""
    wrong = 0
    left = ring if sides & LEFT else 0
    right = size - ring if sides & RIGHT else size
    for y in range(size):
        old = grid[y0 + y, x0 : x0 + size]
        new = image[ty + y, tx : tx + size]
        across = (sides & TOP and y < ring) or (sides & BOTTOM and y >= size - ring)
        if across:
            for x in range(size):
                wrong += old[x] != new[x]
        else:
            for x in range(left):
                wrong += old[x] != new[x]
            for x in range(right, size):
                wrong += old[x] != new[x]
        if wrong >= limit:
            return limit
    return wrong
