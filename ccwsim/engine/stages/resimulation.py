"""Local re-simulation: windows around data that the raster pass missed are simulated anew.

Not in the paper. The window takes a patch of the training image that honours *every* datum in it,
and is cut into the grid on all four sides. As old or new cell is right at each datum, a window
never breaks another one. Where no patch fits well the window is halved.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.engine.stages.bits import Strips, make_strips, n_bits, n_different, take_strips
from ccwsim.engine.stages.box import BOTTOM, LEFT, RIGHT, TOP, Box
from ccwsim.engine.stages.candidates import draw_index
from ccwsim.engine.stages.cut import UNKNOWN, CutWorkspace, keep_old, make_cut, paste
from ccwsim.model.ensemble import FORCED

MIN_SIZE = 4
"""Side of the smallest window, in cells."""
MIN_SIZE_ISOLATED = 8
"""Side of the smallest window around an isolated datum, in cells."""
TOLERANCE = 0.12
"""Share of the ring of a window that may be wrong."""
TOLERANCE_SMALLEST = 0.5
"""The same for the smallest window: the cell is forced where it does not fit."""
TOLERANCE_ISOLATED = 0.18
"""The same for windows around an isolated datum."""
RARE = 0.002
"""A datum is isolated if it has fewer cells of its facies around it than all but this share of the
training image."""
MAX_COMPARED = 3000
"""At most so many locations that honour the data are compared, chosen at random."""
N_BEST = 4
"""The patch is drawn from so many of the best."""
DENSE = 0.75
"""Share of cells with data from which patterns of data are looked up first."""
PATTERN_BITS = 20
"""Bits of the number of a pattern; two may share one, which only costs a look at all locations."""
HASH = 0x9E3779B1
"""An odd number without a pattern of its own."""
LOCATIONS_PER_CALL = 10_000_000
"""Locations of windows compared between two looks at cancel: some hundredths of a second."""


class Target(NamedTuple):
    """What is simulated anew, and from what; `grid` and `sources` change in place."""

    image: NDArray[np.uint8]  # shape (my, mx): training image, facies indices
    bits: NDArray[np.uint64]  # shape (n_planes, my, n_words): the same as `to_bits` gives it
    # shape (ny, nx): all data, from `data_grid`: every window honours all that are in it
    data: NDArray[np.uint8]
    grid: NDArray[np.uint8]  # shape (ny, nx): the realization
    # shape (ny, nx) or (0, 0): flat index in the TI of each cell, kept up to date where it is not
    # empty; −1 where a cell is forced
    sources: NDArray[np.int32]


class Workspace(NamedTuple):
    """Arrays for windows of at most one size."""

    mask: NDArray[np.uint64]  # shape (my, n_words): the bits of locations
    patterns: NDArray[np.bool_]  # from `known_patterns`; empty where data are not dense
    best: NDArray[np.int64]
    strips: Strips
    cut: CutWorkspace
    counts: NDArray[np.int64]


def resimulate(
    target: Target,
    cells: NDArray[np.int64],
    template: int,
    rng: np.random.Generator,
    isolated_below: NDArray[np.float64] | None = None,
    report: Callable[[float], None] = lambda share: None,
    on_window: Callable[[int, int, bool], None] | None = None,
) -> NDArray[np.int16]:
    """Honour the data of a realization, in place; return the status of each datum.

    Three steps: windows around what is wrong, halved from the template down; forced cells where
    even the smallest fits nowhere; larger windows again around the data that are left isolated,
    with fewer cells of their own facies around them than the training image ever has, which needs
    `isolated_below`. `report` is called now and then with the share of the windows that are done,
    and may raise to stop; `on_window` is called with (datum, size, fits) after each window, and
    with size 1 for each forced cell.

    Returns the data status, shape (n,), as `Ensemble.data_status` has it.
    """
    image, grid, sources = target.image, target.grid, target.sources
    rows, columns = cells.T
    facies = target.data[rows, columns]
    data_status = np.zeros(len(cells), np.int16)
    max_size = min(template, *image.shape, *grid.shape)
    work = Workspace(
        np.empty(target.bits.shape[1:], np.uint64),
        known_patterns(image) if len(cells) > DENSE * grid.size else np.empty(0, np.bool_),
        np.empty((N_BEST, 3), np.int64),
        make_strips(target.bits, max_size),
        make_cut(max_size, max(1, max_size // 4)),
        np.zeros(0, np.int64),  # cells by facies are not counted here
    )

    sizes, larger = _halved(max_size, MIN_SIZE), _halved(max_size, MIN_SIZE_ISOLATED)
    n_steps = len(sizes) + (0 if isolated_below is None else len(larger))

    def windows(
        step: int, which: NDArray[np.bool_], size: int, tolerance: float, anyway: bool
    ) -> None:
        chosen = rng.permutation(np.flatnonzero(which))
        at_once = 1 if on_window else max(LOCATIONS_PER_CALL // image.size, 1)
        for first in range(0, len(chosen), at_once):
            report((step + first / len(chosen)) / n_steps)
            some = chosen[first : first + at_once]
            fits = np.zeros(len(some), np.bool_)
            resimulate_windows(target, cells[some], size, tolerance, anyway, rng, work, fits)
            data_status[some[fits]] = size
            if on_window:
                on_window(int(some[0]), size, bool(fits[0]))

    for step, size in enumerate(sizes):
        tolerance = TOLERANCE if size > MIN_SIZE else TOLERANCE_SMALLEST
        windows(step, grid[rows, columns] != facies, size, tolerance, anyway=False)
    wrong = grid[rows, columns] != facies
    grid[rows[wrong], columns[wrong]] = facies[wrong]
    data_status[wrong] = FORCED
    if sources.size:
        sources[rows[wrong], columns[wrong]] = -1
    if on_window:
        for datum in np.flatnonzero(wrong):
            on_window(int(datum), 1, True)
    if isolated_below is None:
        return data_status
    for step, size in enumerate(larger, len(sizes)):
        isolated = own_counts(grid, cells) < isolated_below[facies]
        windows(step, isolated, size, TOLERANCE_ISOLATED, anyway=True)
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
    """Return, by facies index up to 255, the `own_counts` below which a datum is isolated."""
    flat = np.arange(image.size)
    if image.size > 10**6:
        flat = np.random.default_rng(0).integers(0, image.size, 10**6)
    rows, columns = np.divmod(flat, image.shape[1])
    counts = own_counts(image, np.stack([rows, columns], axis=1))
    facies = image[rows, columns]
    thresholds = np.zeros(256)
    for index in np.unique(facies):
        thresholds[index] = np.quantile(counts[facies == index], RARE)
    return thresholds


def own_counts(grid: NDArray[np.uint8], cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Count the cells of a cell's own facies among the 5 × 5 around it (the edge is repeated)."""
    wide = np.pad(grid, 2, mode="edge")
    rows, columns = cells.T
    facies, first = grid[rows, columns], rows * wide.shape[1] + columns
    counts = np.zeros(len(cells), np.uint8)
    for dy, dx in np.ndindex(5, 5):
        counts += wide.ravel()[first + (dy * wide.shape[1] + dx)] == facies
    return counts.astype(np.int64)


def first_cell(middle: int, size: int, length: int) -> int:
    """Return where a window of `size` cells around `middle` begins, inside of `length` cells."""
    return min(max(middle - size // 2, 0), length - size)


@kernel
def resimulate_windows(target, cells, size, tolerance, anyway, rng, work, fits):
    """Simulate windows of one size around data anew.

    A share of the ring up to `tolerance` may be wrong. With `anyway` also data that the grid
    honours by now are taken. `fits`, shape (n,), becomes True where the grid honours the datum.
    """
    image, bits, data, grid, sources = target
    ny, nx = grid.shape
    ring = max(1, size // 4)
    for i in range(len(cells)):
        y, x = cells[i, 0], cells[i, 1]
        if grid[y, x] == data[y, x] and not anyway:
            fits[i] = True
            continue
        y0, x0 = min(max(y - size // 2, 0), ny - size), min(max(x - size // 2, 0), nx - size)
        sides = (LEFT if x0 > 0 else 0) | (TOP if y0 > 0 else 0)
        sides |= (RIGHT if x0 + size < nx else 0) | (BOTTOM if y0 + size < ny else 0)
        box = Box(y0, x0, size, sides, ring)
        if len(work.patterns) > 0 and is_unknown(data, box, y, x, work.patterns):
            continue
        n_places = honouring_places(bits, data, box, image.shape, work.mask)
        if n_places == 0:
            continue
        share = min(1.0, MAX_COMPARED / n_places)
        width = size - ring * (x0 > 0) - ring * (x0 + size < nx)
        height = size - ring * (y0 > 0) - ring * (y0 + size < ny)
        limit = np.int64(tolerance * (size * size - width * height))
        take_strips(grid, box, work.strips)
        rows, columns = image.shape[0] - size + 1, image.shape[1] - size + 1
        n = best_windows(
            bits, work.mask, rows, columns, size, work.strips, share, limit, rng, work.best
        )
        if n == 0:
            continue
        drawn = draw_index(rng, n)
        ty, tx = work.best[drawn, 1], work.best[drawn, 2]
        keep_old(grid, data, image, ty, tx, box, work.cut)
        paste(image, ty, tx, box, work.cut.keep_mask, work.counts, grid, sources)
        fits[i] = True


def known_patterns(image: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which numbers the patterns of 4 × 4 cells of an image have."""
    ny, nx = (length - MIN_SIZE + 1 for length in image.shape)
    known = np.zeros(2**PATTERN_BITS, np.bool_)
    number = np.zeros((max(ny, 0), max(nx, 0)), np.uint32)  # products go round, as a hash may
    for dy, dx in np.ndindex(MIN_SIZE, MIN_SIZE):
        number = number * np.uint32(HASH) + image[dy : dy + ny, dx : dx + nx] + np.uint32(1)
    known[number.ravel() >> np.uint32(32 - PATTERN_BITS)] = True
    return known


@part_of_kernel
def is_unknown(data, box, y, x, patterns):
    """Return whether the 4 × 4 cells around a datum of a box all have data as the TI never has."""
    y0 = min(max(y - MIN_SIZE // 2, box.y0), box.y0 + box.size - MIN_SIZE)
    x0 = min(max(x - MIN_SIZE // 2, box.x0), box.x0 + box.size - MIN_SIZE)
    number = np.uint64(0)
    for dy in range(MIN_SIZE):
        for dx in range(MIN_SIZE):
            facies = data[y0 + dy, x0 + dx]
            if facies == UNKNOWN:
                return False
            number = (number * np.uint64(HASH) + facies + np.uint64(1)) & np.uint64(0xFFFFFFFF)
    return not patterns[number >> np.uint64(32 - PATTERN_BITS)]


@part_of_kernel
def honouring_places(bits, data, box, shape, mask):
    """Mark in `mask` the locations of the TI whose window honours all data; return how many.

    `bits` are those of the TI, of `shape`; location (y, x) is bit x % 64 of word x // 64 of row y.
    Of many data few are looked at: hardly any location honours the first of them.
    """
    n_planes, full = len(bits), ~np.uint64(0)
    ny, nx = shape[0] - box.size + 1, shape[1] - box.size + 1
    n_words = (nx + 63) >> 6
    for y in range(ny):
        for w in range(n_words):
            mask[y, w] = full
        mask[y, n_words - 1] = full >> np.uint64(-nx & 63)
    left = full
    for dy in range(box.size):
        for dx in range(box.size):
            facies = data[box.y0 + dy, box.x0 + dx]
            if facies == UNKNOWN or not left:
                continue
            first, shift = dx >> 6, np.uint64(dx & 63)
            back, left = np.uint64(63) - shift, np.uint64(0)
            for y in range(ny):
                for w in range(n_words):
                    honours = mask[y, w]
                    for plane in range(n_planes):
                        near = bits[plane, y + dy, first + w]
                        far = bits[plane, y + dy, first + w + 1]
                        word = near >> shift | far << np.uint64(1) << back
                        honours &= word if facies >> plane & 1 else ~word
                    mask[y, w] = honours
                    left |= honours
    n = np.int64(0)
    if left:
        for y in range(ny):
            for w in range(n_words):
                n += n_bits(mask[y, w])
    return n


@part_of_kernel
def best_windows(bits, mask, rows, columns, size, strips, share, limit, rng, best):
    """Fill `best` with (misfit, row, column) of the locations whose ring fits best.

    Return how many. Only marked locations with at most `limit` wrong cells count, each looked at
    with chance `share`. The first of equal ones are kept, so the search begins at a random one.
    """
    first_y, first_x = draw_index(rng, rows), draw_index(rng, columns)
    n, one = 0, np.uint64(1)
    worst = limit + 1
    for turn_y in range(rows):
        py = first_y + turn_y - (rows if first_y + turn_y >= rows else 0)
        marks = mask[py]
        for turn_x in range(columns):
            px = first_x + turn_x - (columns if first_x + turn_x >= columns else 0)
            if not marks[px >> 6] >> np.uint64(px & 63) & one or (
                share < 1 and rng.random() >= share
            ):
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
