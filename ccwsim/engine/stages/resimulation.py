"""Mend what the raster left wrong: simulate a window around each missed datum anew.

The window takes a patch of the training image that honours *every* datum in it, and is cut into the
grid on all four sides. As old or new cell is right at each datum, mending never breaks another one.
Where no patch fits well the window is halved.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.engine.stages.bits import make_strips, take_strips
from ccwsim.engine.stages.candidates import draw_index
from ccwsim.engine.stages.cut import keep_old, paste_sources
from ccwsim.engine.stages.windows import (
    BOTTOM,
    LEFT,
    RIGHT,
    TOP,
    best_windows,
    honouring_places,
)
from ccwsim.model.ensemble import FORCED

SMALLEST = 4
"""Side of the smallest window that mends, in cells."""
SMALLEST_HEALING = 8
"""Side of the smallest window that heals a scar, in cells."""
TOLERANCE = 0.12
"""Share of the ring of a window that may be wrong."""
TOLERANCE_SMALLEST = 0.5
"""The same for the smallest window: what it cannot mend is set by force."""
TOLERANCE_HEALING = 0.18
"""The same for windows that heal a scar."""
RARE = 0.002
"""A datum with fewer cells of its facies around it than all but this share of the TI is a scar."""
N_LOOKED = 3000
"""At most so many places that honour the data are compared, drawn at random."""
N_DRAWN = 4
"""The patch is drawn from so many of the best."""
PLACES_A_CALL = 10_000_000
"""Places of windows looked at between two looks at cancel: some hundredths of a second."""


def resimulate(
    image: NDArray[np.uint8],
    bits: NDArray[np.uint64],
    data: NDArray[np.uint8],
    cells: NDArray[np.int64],
    template: int,
    rng: np.random.Generator,
    grid: NDArray[np.uint8],
    sources: NDArray[np.int32],
    rare: NDArray[np.float64] | None = None,
    check: Callable[[], None] = lambda: None,
    note: Callable[[int, int, bool], None] | None = None,
) -> NDArray[np.int16]:
    """Mend a realization in place until it honours the data; return how each was met.

    Three steps: windows around what is wrong, halved from the template down; cells set by force
    where even the smallest fits nowhere; larger windows again around the scars that are left,
    data with fewer cells of their own facies around them than the training image ever has.

    Parameters
    ----------
    image : ndarray of uint8, shape (my, mx)
        Training image, facies indices.
    bits : ndarray of uint64, shape (n_planes, my, n_words)
        The same as `to_bits` gives it.
    data : ndarray of uint8, shape (ny, nx)
        All data, from `data_grid`: every window honours all that lie in it.
    cells : ndarray of int64, shape (n, 2)
        Row and column of the data to mend.
    template : int
        Side of the first windows in cells.
    rng : numpy.random.Generator
    grid : ndarray of uint8, shape (ny, nx)
        The realization.
    sources : ndarray of int32, shape (ny, nx) or (0, 0)
        Flat index in the TI of each cell, kept up to date where it is not empty; −1 where a cell
        is set by force.
    rare : ndarray, shape (256,), optional
        From `isolated_datum_thresholds`; scars are left where it is not given.
    check : callable
        Called now and then; may raise to stop.
    note : callable, optional
        Called as note(datum, size, mended) after each window, and with size 1 for each cell set by
        force.

    Returns
    -------
    ndarray of int16, shape (n,)
        As `Ensemble.data_status` has it.
    """
    rows, columns = cells.T
    facies = data[rows, columns]
    data_status = np.zeros(len(cells), np.int16)

    def windows(which: NDArray[np.bool_], size: int, tolerance: float, anyway: bool) -> None:
        chosen = rng.permutation(np.flatnonzero(which))
        at_once = 1 if note else max(PLACES_A_CALL // image.size, 1)
        for first in range(0, len(chosen), at_once):
            check()
            some = chosen[first : first + at_once]
            done = resimulate_windows(
                image, bits, data, cells[some], size, tolerance, anyway, rng, grid, sources
            )
            data_status[some[done]] = size
            if note:
                note(int(some[0]), size, bool(done[0]))

    largest = min(template, *image.shape, *grid.shape)
    for size in _halved(largest, SMALLEST):
        tolerance = TOLERANCE if size > SMALLEST else TOLERANCE_SMALLEST
        windows(grid[rows, columns] != facies, size, tolerance, anyway=False)
    wrong = grid[rows, columns] != facies
    grid[rows[wrong], columns[wrong]] = facies[wrong]
    data_status[wrong] = FORCED
    if sources.size:
        sources[rows[wrong], columns[wrong]] = -1
    if note:
        for datum in np.flatnonzero(wrong):
            note(int(datum), 1, True)
    if rare is None:
        return data_status
    for size in _halved(largest, SMALLEST_HEALING):
        scarred = own_counts(grid, cells) < rare[facies]
        windows(scarred, size, TOLERANCE_HEALING, anyway=True)
    return data_status


def _halved(size: int, smallest: int) -> list[int]:
    """Return `size`, its half and so on, down to `smallest`.

    Examples
    --------
    >>> _halved(32, 4), _halved(20, 8), _halved(3, 4)
    ([32, 16, 8, 4], [20, 10, 8], [])
    """
    sizes = []
    while size > smallest:
        sizes.append(size)
        size //= 2
    return sizes + [smallest] * (bool(sizes) or size == smallest)


def isolated_datum_thresholds(image: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return, for each facies index up to 255, the count of `own_counts` that is rare in the TI."""
    flat = np.arange(image.size)
    if image.size > 10**6:
        flat = np.random.default_rng(0).integers(0, image.size, 10**6)
    rows, columns = np.divmod(flat, image.shape[1])
    counts = own_counts(image, np.stack([rows, columns], axis=1))
    facies = image[rows, columns]
    rare = np.zeros(256)
    for index in np.unique(facies):
        rare[index] = np.quantile(counts[facies == index], RARE)
    return rare


@kernel
def own_counts(grid, cells):
    """Count the cells of a cell's own facies among the 5 × 5 around it (the edge is repeated)."""
    ny, nx = grid.shape
    counts = np.zeros(len(cells), np.int64)
    for i in range(len(cells)):
        facies = grid[cells[i, 0], cells[i, 1]]
        for dy in range(-2, 3):
            for dx in range(-2, 3):
                y = min(max(cells[i, 0] + dy, 0), ny - 1)
                x = min(max(cells[i, 1] + dx, 0), nx - 1)
                counts[i] += grid[y, x] == facies
    return counts


@kernel
def first_cell(middle, size, length):
    """Return where a window of `size` cells around `middle` begins, inside of `length` cells."""
    return min(max(middle - size // 2, 0), length - size)


@kernel
def resimulate_windows(image, bits, data, cells, size, tolerance, anyway, rng, grid, sources):
    """Simulate windows of one size around data anew.

    Parameters
    ----------
    image : ndarray of uint8, shape (my, mx)
        Training image.
    bits : ndarray of uint64
        The same as `to_bits` gives it.
    data : ndarray of uint8, shape (ny, nx)
        Facies of the data, UNKNOWN elsewhere.
    cells : ndarray of int64, shape (n, 2)
        Row and column of the data to mend.
    size : int
        Side of the window in cells.
    tolerance : float
        Share of the ring that may be wrong.
    anyway : bool
        Also where the datum is right by now, by the window of another one.
    rng : numpy.random.Generator
    grid : ndarray of uint8, shape (ny, nx)
        The realization; mended in place.
    sources : ndarray of int32, shape (ny, nx) or (0, 0)
        Flat index in the TI of each cell.

    Returns
    -------
    ndarray of bool, shape (n,)
        Which data a window of this size brought.
    """
    ny, nx = grid.shape
    ring = max(1, size // 4)
    mended = np.zeros(len(cells), np.bool_)
    mask = np.empty((image.shape[0] - size + 1, image.shape[1] - size + 1), np.bool_)
    kept = np.empty((size, size + 1), np.bool_)[:, :size]  # a view, as for tiles: compiled once
    best = np.empty((N_DRAWN, 3), np.int64)
    strips = make_strips(bits, size)
    for i in range(len(cells)):
        y, x = cells[i]
        if grid[y, x] == data[y, x] and not anyway:
            mended[i] = True
            continue
        y0, x0 = first_cell(y, size, ny), first_cell(x, size, nx)
        left, top = ring if x0 > 0 else 0, ring if y0 > 0 else 0
        right, bottom = ring if x0 + size < nx else 0, ring if y0 + size < ny else 0
        n_places = honouring_places(image, data, y0, x0, size, mask)
        if n_places == 0:
            continue
        share = min(1.0, N_LOOKED / n_places)
        limit = int(tolerance * (size * size - (size - left - right) * (size - top - bottom)))
        take_strips(grid, y0, x0, size, left, top, right, bottom, strips)
        n = best_windows(bits, mask, size, strips, share, limit, rng, best)
        if n == 0:
            continue
        drawn = draw_index(rng, n)
        ty, tx = best[drawn, 1], best[drawn, 2]
        patch = image[ty : ty + size, tx : tx + size]
        sides = (LEFT if left else 0) | (TOP if top else 0)
        sides |= (RIGHT if right else 0) | (BOTTOM if bottom else 0)
        keep_old(grid, data, patch, y0, x0, ring, sides, kept)
        for wy in range(size):
            for wx in range(size):
                if not kept[wy, wx]:
                    grid[y0 + wy, x0 + wx] = patch[wy, wx]
        if sources.size:
            paste_sources(ty, tx, image.shape[1], kept, y0, x0, sources)
        mended[i] = True
    return mended
