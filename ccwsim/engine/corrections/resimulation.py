"""Local re-simulation around data that the raster pass did not honour (not in the paper).

A window is replaced by a patch of the training image that honours *every* datum in the window and
is cut into the grid on all sides. A datum that the grid honours stays honoured, because the patch
also honours the datum. If no patch fits well, the window is halved. In a volume the number of
layers is reduced first, because the data of a well are aligned along z.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ccwsim.engine.corrections.unseen_patterns import (
    NO_PATTERNS,
    Patterns,
    is_known,
    known_patterns,
)
from ccwsim.engine.kernels import allocating_kernel, kernel, part_of_kernel
from ccwsim.engine.stages.bits import Strips, make_strips, n_bits, n_different, nth_bit, take_strips
from ccwsim.engine.stages.candidates import draw_index
from ccwsim.engine.stages.cut import CutWorkspace, keep_old, make_cut, paste
from ccwsim.engine.stages.path import (
    ABOVE,
    BELOW,
    BOTTOM,
    LEFT,
    RIGHT,
    TOP,
    UNKNOWN,
    Box,
    Triple,
    inside_overlap,
)
from ccwsim.model import (
    FORCED,
    UNWATCHED,
    Bytes,
    Floats,
    Int16s,
    Int32s,
    Ints,
    Mask,
    Shape,
    UInt64s,
    Watch,
)

MIN_SIZE = 4  # side, in cells, of the smallest re-simulated window
MIN_SIZE_ISOLATED = 8  # side, in cells, of the smallest window around an isolated datum
# maximum share of wrong cells in the ring (the overlap on all sides) of a window
RING_TOLERANCE = 0.12
RING_TOLERANCE_SMALLEST = 0.5
"""Maximum share of wrong cells in the ring of the smallest window. If no patch fits, the cell of
the datum is forced to the facies of the datum."""
TOLERANCE_ISOLATED = 0.18
"""Maximum share of wrong cells in the ring of a window around an isolated datum."""
ISOLATED_SHARE = 0.002
"""Share of a facies' cells in the training image that count as isolated, because few cells around
them have the same facies."""
MAX_COMPARED_LOCATIONS = 3000
"""Maximum number of compared locations, chosen at random among locations that honour the data."""
MAX_COMPARED_LOCATIONS_VOLUME = 1000
"""Maximum number of compared locations in a volume. When this number is reached, the rest of the
image is not searched."""
LOCATIONS_AT_ONCE = 100_000
"""Number of locations of a volume that are searched between two counts of the locations that honour
the data."""
MIN_WINDOW_LAYERS = 2  # minimum number of layers of a window, unless the volume has fewer layers
N_BEST_LOCATIONS = 4  # number of best locations from which the patch is chosen at random
MAX_DATA_SHARE = 0.75
"""Maximum share of cells with data for a search around data that form an unseen pattern."""
LOCATIONS_PER_CALL = 10_000_000
"""Number of locations compared between two checks for a stop, some hundredths of a second apart."""
OnWindow = Callable[[int, Triple, bool], None]
"""Function called as on_window(datum, lengths, fits) after each window. For a forced cell, all
lengths are 1."""


class Target(NamedTuple):
    """A realization to correct, and its training image; `grid` and `sources` change in place.

    All arrays have three axes, z, y and x; in a map the first axis has length 1.
    """

    image: Bytes  # shape (mz, my, mx): training image, facies indices
    bits: UInt64s  # shape (n_planes, mz, my, n_words): made by `to_bits`
    square_bits: UInt64s  # shape of `bits`: made by `to_square_bits`
    data: Bytes  # shape (nz, ny, nx): all data, from `data_grid`
    grid: Bytes  # shape (nz, ny, nx): the realization
    # shape (nz, ny, nx) or empty: flat index in the TI for each cell; −1 for a single changed cell
    sources: Int32s
    # shape (n_facies,): cells of each facies that seam repair has added so far
    balance: Ints
    # if True, each location is compared with a fixed probability (as in the published draw); if
    # False, one location out of each group of a few is compared
    by_chance: bool = False
    # shape (mz + 1, my + 1, mx + 1): running numbers of unknown cells of the image; empty if all
    # cells are known
    unknown: Int32s = np.zeros((0, 0, 0), np.int32)
    # shape (n_kinds, 2): first layer and number of layers of each kind of copies (see `Copies`)
    layers: Ints = np.zeros((0, 2), np.int64)
    # shape of the grid, or empty without copies
    kinds: Bytes = np.zeros((0, 0, 0), np.uint8)
    volume: bool = False  # whether layers of the image are layers of a volume


class Honouring(NamedTuple):
    """The locations that honour all data of a window."""

    mask: UInt64s  # shape (mz, my, n_words), with one bit for each location
    # shape (64 * mask.size,): numbers of the locations to compare, from `sample_locations`
    numbers: Int32s


class WindowWorkspace(NamedTuple):
    """Workspace for windows up to a maximum size."""

    honouring: Honouring
    patterns: Patterns  # patterns of adjacent cells, or NO_PATTERNS if data are not dense
    best: Ints  # shape (N_BEST_LOCATIONS, 4): misfit, layer, row and column of a location
    strips: Strips
    cut: CutWorkspace
    counts: Ints


def resimulate(
    target: Target,
    cells: Ints,
    template: Triple,
    rng: np.random.Generator,
    isolated_below: Floats | None = None,
    watch: Watch = UNWATCHED,
    on_window: OnWindow | None = None,
) -> Int16s:
    """Honour the data of a realization, in place; return the data status, shape (n,).

    First, windows around data that are not honoured are re-simulated; window sizes decrease from
    the size of the template. Second, if no patch fits the smallest window, the cell of the datum is
    forced to the facies of the datum. Third, larger windows around isolated data are re-simulated.
    A datum is isolated if fewer than `isolated_below[facies]` cells around the datum have its
    facies. `watch` gets the finished share of the windows and may stop the work. `cells` has the
    shape (n, 3); `Ensemble.data_status` documents the status.
    """
    image, grid, sources = target.image, target.grid, target.sources
    places = tuple(cells.T)
    facies = target.data[places]
    data_status = np.zeros(len(cells), np.int16)
    nz, ny, nx = largest_window(template, image.shape, grid.shape)
    volume = nz > 1 or target.volume
    dense = len(cells) > MAX_DATA_SHARE * grid.size and not volume
    work = WindowWorkspace(
        honouring=make_honouring(target.bits),
        patterns=known_patterns(image, 1, False, target.unknown) if dense else NO_PATTERNS,
        best=np.empty((N_BEST_LOCATIONS, 4), np.int64),
        strips=make_strips(target.square_bits, (nz, ny, nx)),
        cut=make_cut((nz, ny, nx), (max(1, nz // 4), max(1, ny // 4), max(1, nx // 4))),
        counts=np.zeros(0, np.int64),  # cells of each facies are not counted
    )
    most = MAX_COMPARED_LOCATIONS_VOLUME if volume else MAX_COMPARED_LOCATIONS
    sizes = _halved((nz, ny, nx), MIN_SIZE)
    larger = _halved((nz, ny, nx), MIN_SIZE_ISOLATED)
    n_steps = len(sizes) + (0 if isolated_below is None else len(larger))

    def resimulate_marked(
        step: int, marked: Mask, size: Triple, tolerance: float, anyway: bool
    ) -> None:
        chosen = rng.permutation(np.flatnonzero(marked))
        at_once = 1 if on_window else max(LOCATIONS_PER_CALL // image.size, 1)
        for first in range(0, len(chosen), at_once):
            watch.tell((step + first / len(chosen)) / n_steps)
            batch = chosen[first : first + at_once]
            fits = np.zeros(len(batch), np.bool_)
            resimulate_windows(target, cells[batch], size, tolerance, anyway, most, rng, work, fits)
            data_status[batch[fits]] = max(size)
            if on_window:
                on_window(int(batch[0]), size, bool(fits[0]))

    for step, size in enumerate(sizes):
        tolerance = RING_TOLERANCE if max(size) > MIN_SIZE else RING_TOLERANCE_SMALLEST
        resimulate_marked(step, grid[places] != facies, size, tolerance, anyway=False)
    wrong = grid[places] != facies
    missed = tuple(cells[wrong].T)
    grid[missed] = facies[wrong]
    data_status[wrong] = FORCED
    if sources.size:
        sources[missed] = -1
    if on_window:
        for datum in np.flatnonzero(wrong):
            on_window(int(datum), (1, 1, 1), True)
    if isolated_below is None:
        return data_status
    for step, size in enumerate(larger, len(sizes)):
        isolated = own_counts(grid, cells, int(target.volume)) < isolated_below[facies]
        resimulate_marked(step, isolated, size, TOLERANCE_ISOLATED, anyway=True)
    return data_status


def make_honouring(bits: UInt64s) -> Honouring:
    """Return uninitialized arrays for all locations of an image."""
    mask = np.empty(bits.shape[1:], np.uint64)
    return Honouring(mask, np.empty(64 * mask.size, np.int32))


def largest_window(template: Triple, image_shape: Shape, grid_shape: Shape) -> Triple:
    """Return the lengths of the first window: a square template that fits into image and grid."""
    side = min((*template[1:], *image_shape[1:], *grid_shape[1:]))
    return min(template[0], image_shape[0], grid_shape[0]), side, side


def _halved(size: Triple, smallest: int) -> list[Triple]:
    """Return the sizes of windows, halved repeatedly down to `smallest` rows and columns.

    If a window has many layers, their number is divided by 4 before rows and columns are halved.
    """
    nz, side = size[0], size[1]
    sizes: list[Triple] = []
    while side > smallest:
        sizes.append((nz, side, side))
        if nz > MIN_WINDOW_LAYERS and 2 * nz >= side:
            nz = max(MIN_WINDOW_LAYERS, nz // 4)
            continue
        nz, side = max(nz // 2, min(nz, MIN_WINDOW_LAYERS)), side // 2
    return sizes + [(nz, smallest, smallest)] * (bool(sizes) or side == smallest)


def isolated_datum_thresholds(image: Bytes) -> Floats:
    """Return, by facies index, the thresholds of `own_counts` below which data are isolated."""
    thresholds = np.zeros(256)
    for index in range(int(image.max()) + 1):
        marked = image == index
        if marked.any():
            counts = _counts_around(marked, int(len(image) > 1))
            thresholds[index] = np.quantile(counts[marked], ISOLATED_SHARE)
    return thresholds


def _counts_around(marked: Mask, layers: int) -> Bytes:
    """Return `own_counts` for all cells of one facies by summing along each axis in turn."""
    counts = marked.astype(np.uint8)
    for axis, reach in enumerate((layers, 2, 2)):
        wide = np.pad(counts, [(reach * (a == axis),) * 2 for a in range(3)], mode="edge")
        lines, counts = np.moveaxis(wide, axis, 0), np.zeros_like(counts)
        total = np.moveaxis(counts, axis, 0)
        for k in range(2 * reach + 1):
            total += lines[k : k + len(total)]
    return counts


@allocating_kernel
def own_counts(grid, cells, layers=0):
    """Count the cells of the same facies around each of the `cells`, shape (n, 3).

    Cells are counted in a square of 5 × 5 cells, in the layer of the cell and in `layers` layers
    below and above. Beyond the grid, the edge of the grid is repeated.
    """
    last_z, last_y, last_x = grid.shape[0] - 1, grid.shape[1] - 1, grid.shape[2] - 1
    counts = np.zeros(len(cells), np.int64)
    for i in range(len(cells)):
        middle_z, middle_y, middle_x = cells[i]
        facies, n = grid[middle_z, middle_y, middle_x], np.int64(0)
        for dz in range(-layers, layers + 1):
            z = min(max(middle_z + dz, 0), last_z)
            for dy in range(-2, 3):
                y = min(max(middle_y + dy, 0), last_y)
                for dx in range(-2, 3):
                    n += grid[z, y, min(max(middle_x + dx, 0), last_x)] == facies
        counts[i] = n
    return counts


@kernel
def resimulate_windows(target, cells, size, tolerance, anyway, most, rng, work, fits):
    """Re-simulate windows of one size around the data at `cells`, shape (n, 3).

    `tolerance` is the maximum share of wrong cells in the ring; about `most` locations are
    compared. If `anyway` is false, data that the grid honours are skipped. `fits`, shape (n,), is
    set to True if a patch fits the window or the grid already honours the datum.
    """
    image, data, grid, sources = target.image, target.data, target.grid, target.sources
    for i in range(len(cells)):
        z, y, x = cells[i]
        if grid[z, y, x] == data[z, y, x] and not anyway:
            fits[i] = True
            continue
        box = window_around(z, y, x, size, grid.shape)
        if len(work.patterns.known_bits) > 0 and is_unknown(data[0], box, y, x, work.patterns):
            continue
        low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
        inside = (high_z - low_z) * (high_y - low_y) * (high_x - low_x)
        limit = np.int64(tolerance * (box.nz * box.ny * box.nx - inside))
        n = fitting_windows(target, box, limit, most, rng, work.honouring, work.strips, work.best)
        if n == 0:
            continue
        drawn = draw_index(rng, n)
        place = work.best[drawn, 1], work.best[drawn, 2], work.best[drawn, 3]
        keep_old(grid, data, image, place, box, work.cut)
        paste(image, place, box, work.cut.keep_mask, work.counts, grid, sources)
        fits[i] = True


@part_of_kernel
def fitting_windows(target, box, limit, most, rng, honouring, strips, best):
    """Fill `best`, shape (n, 4), with the best locations that honour all data in a box.

    Return the number of locations in `best`. At most `limit` cells of the ring may be wrong; at
    most about `most` locations are compared; `honouring` and `strips` are workspace.
    """
    shape, layers = target.image.shape, layers_around(target, box)
    rows = (layers[1] - box.nz + 1) * (shape[1] - box.ny + 1)
    at_once, start = rows, np.int64(0)
    if layers[1] > 1:
        at_once = min(rows, 1 + LOCATIONS_AT_ONCE // shape[2])
        start = draw_index(rng, rows)
    n_rows, n_places = np.int64(0), np.int64(0)
    while n_rows < rows and n_places < most:
        part = start + n_rows, min(at_once, rows - n_rows)
        n_places += honouring_places(
            target.bits, target.data, box, shape, layers, part, honouring.mask
        )
        n_rows += part[1]
    if n_places == 0:
        return 0
    take_strips(target.grid, box, target.square_bits, strips)
    sample, part, bits = (n_places, most, target.by_chance), (start, n_rows), target.square_bits
    return best_windows(
        bits, shape, layers, honouring, box, part, strips, sample, limit, target.unknown, rng, best
    )


@part_of_kernel
def layers_around(target, box):
    """Return the first layer and the number of layers of the image that suit a box of the grid."""
    if len(target.layers) == 0:
        return np.int64(0), np.int64(target.image.shape[0])
    kind = target.kinds[box.z0 + box.nz // 2, box.y0 + box.ny // 2, box.x0 + box.nx // 2]
    return target.layers[kind, 0], target.layers[kind, 1]


@part_of_kernel
def window_around(z, y, x, size, shape):
    """Return a window around a cell, with an overlap on each side that is inside the grid."""
    nz, ny, nx = size
    z0, y0 = first_cell(z, nz, shape[0]), first_cell(y, ny, shape[1])
    x0 = first_cell(x, nx, shape[2])
    sides = (LEFT if x0 > 0 else 0) | (TOP if y0 > 0 else 0) | (BELOW if z0 > 0 else 0)
    sides |= (RIGHT if x0 + nx < shape[2] else 0) | (BOTTOM if y0 + ny < shape[1] else 0)
    sides |= ABOVE if z0 + nz < shape[0] else 0
    oz = max(1, nz // 4) if nz > 2 else 0  # otherwise no cell would be inside the ring
    return Box(z0, y0, x0, nz, ny, nx, sides, oz, max(1, ny // 4), max(1, nx // 4))


@part_of_kernel
def first_cell(middle, size, length):
    """Return the first cell of a window of `size` cells around `middle` on an axis."""
    return min(max(middle - size // 2, 0), length - size)


@part_of_kernel
def is_unknown(data, box, y, x, patterns):
    """Return whether the 4 × 4 data around a datum in a box form an unseen pattern.

    `data` has the shape (ny, nx). Return False unless all 16 cells have data.
    """
    y0 = min(max(y - MIN_SIZE // 2, box.y0), box.y0 + box.ny - MIN_SIZE)
    x0 = min(max(x - MIN_SIZE // 2, box.x0), box.x0 + box.nx - MIN_SIZE)
    number = np.uint32(0)
    for dy in range(MIN_SIZE):
        row = np.uint32(0)
        for dx in range(MIN_SIZE):
            facies = data[y0 + dy, x0 + dx]
            if facies == UNKNOWN:
                return False
            row = np.uint32(row * patterns.base + patterns.labels[facies])
        number = np.uint32(number * patterns.row_base + row)
    return not is_known(patterns, number)


@part_of_kernel
def honouring_places(bits, data, box, shape, layers, part, mask):
    """Mark in `mask` the TI locations whose patch honours all data; return the number of marks.

    `bits`, shape (n_planes, mz, my, n_words), are the bits of the TI, whose shape is `shape`;
    `layers` come from `layers_around`. Location (z, y, x) is bit x % 64 of word x // 64 of row y of
    layer z. `part` has the first row of locations to search and the number of rows. Rows are
    numbered through all layers and wrap after the last row. The search ends as soon as no location
    is marked, usually after a few data.
    """
    n_planes, full = len(bits), ~np.uint64(0)
    ny, nx = shape[1] - box.ny + 1, shape[2] - box.nx + 1
    n_words, nz = (nx + 63) >> 6, (layers[0], layers[1] - box.nz + 1)
    first_row, n_rows = part
    z, y = row_of(first_row, nz, ny)
    for _ in range(n_rows):
        for w in range(n_words):
            mask[z, y, w] = full
        mask[z, y, n_words - 1] = full >> np.uint64(-nx & 63)
        z, y = next_row(z, y, nz, ny)
    any_marked = full  # bits of words in which any location is marked
    for dz in range(box.nz):
        for dy in range(box.ny):
            for dx in range(box.nx):
                facies = data[box.z0 + dz, box.y0 + dy, box.x0 + dx]
                if facies == UNKNOWN or not any_marked:
                    continue
                first, shift = dx >> 6, np.uint64(dx & 63)
                back, any_marked = np.uint64(63) - shift, np.uint64(0)
                z, y = row_of(first_row, nz, ny)
                for _ in range(n_rows):
                    for w in range(n_words):
                        honours = mask[z, y, w]
                        for plane in range(n_planes):
                            near = bits[plane, z + dz, y + dy, first + w]
                            far = bits[plane, z + dz, y + dy, first + w + 1]
                            word = near >> shift | far << np.uint64(1) << back
                            honours &= word if facies >> plane & 1 else ~word
                        mask[z, y, w] = honours
                        any_marked |= honours
                    z, y = next_row(z, y, nz, ny)
    n = np.int64(0)
    if any_marked:
        z, y = row_of(first_row, nz, ny)
        for _ in range(n_rows):
            for w in range(n_words):
                n += n_bits(mask[z, y, w])
            z, y = next_row(z, y, nz, ny)
    return n


@part_of_kernel
def row_of(number, layers, rows):
    """Return layer and row of a numbered row of locations; numbers wrap after the last row.

    `layers` are the first layer and the number of layers of locations.
    """
    number %= layers[1] * rows
    return layers[0] + number // rows, number % rows


@part_of_kernel
def next_row(z, y, layers, rows):
    """Return layer and row of the next row of locations, without the slow division of `row_of`."""
    if y + 1 < rows:
        return z, y + 1
    return (z + 1 if z + 1 < layers[0] + layers[1] else layers[0]), np.int64(0)


@part_of_kernel
def best_windows(
    square_bits, shape, layers, honouring, box, part, strips, sample, limit, unknown, rng, best
):
    """Fill `best` with the misfit, layer, row and column of the locations whose ring fits best.

    Return the number of locations in `best`. Only marked locations with at most `limit` wrong cells
    are used. `sample` is documented in `sample_locations`, `layers` and `part` in
    `honouring_places`, and `unknown` in `Target`. Of equally good locations, the first one compared
    is used; the search therefore begins at a random location.
    """
    mask, numbers = honouring
    layers = layers[0], layers[1] - box.nz + 1
    rows, columns = shape[1] - box.ny + 1, shape[2] - box.nx + 1
    first_row, n_rows = part
    start_row, first_x = draw_index(rng, n_rows), draw_index(rng, columns)
    n_numbers = sample_locations(rng, sample, numbers)
    n, one, words = 0, np.uint64(1), square_bits.reshape(-1)
    worst = limit + 1
    passed, n_compared = np.int64(0), np.int64(0)  # numbers of marked and compared locations
    for k in range(n_rows):
        pz, py = row_of(first_row + (start_row + k) % n_rows, layers, rows)
        for half in range(2):
            start = first_x if half == 0 else np.int64(0)
            end = columns if half == 0 else first_x
            for w in range(start >> 6, (end + 63) >> 6):
                word = mask[pz, py, w]
                if w == start >> 6:
                    word &= ~np.uint64(0) << np.uint64(start & 63)
                if end < 64 * (w + 1):
                    word &= (one << np.uint64(end - 64 * w)) - one
                end_of_word = passed + n_bits(word)
                while n_compared < n_numbers and numbers[n_compared] < end_of_word:
                    px = 64 * w + nth_bit(word, numbers[n_compared] - passed)
                    n_compared += 1
                    place = pz, py, px
                    if has_unknown(unknown, place, box):
                        continue
                    misfit = n_different(words, square_bits.shape, place, strips, worst)
                    if misfit < worst:
                        n, worst = _take(best, n, worst, misfit, pz, py, px)
                passed = end_of_word
    return n


@part_of_kernel
def has_unknown(unknown, place, box):
    """Return whether the patch at a location of the image has unknown cells; see `Target`."""
    if unknown.size == 0:
        return False
    n, (z, y, x) = np.int64(0), place
    for layer, sign in ((z + box.nz, 1), (z, -1)):
        n += sign * (unknown[layer, y + box.ny, x + box.nx] - unknown[layer, y, x + box.nx])
        n -= sign * (unknown[layer, y + box.ny, x] - unknown[layer, y, x])
    return n > 0


@part_of_kernel
def sample_locations(rng, sample, numbers):
    """Fill `numbers` with the marked locations to compare; return the count of these locations.

    `sample` has the number of marked locations, the approximate number of locations to compare, and
    `by_chance` (see `Target`). If `by_chance` is true, a random number is drawn for each marked
    location; otherwise only for each location to compare, which is faster.
    """
    n_places, most, by_chance = sample
    n, chosen, share = np.int64(0), np.int64(0), most / n_places
    if n_places <= most:
        for k in range(n_places):
            numbers[k] = k
        return n_places
    if by_chance:
        for k in range(n_places):
            numbers[n] = k  # overwritten by the next location if this location is not chosen
            n += np.int64(rng.random() < share)
        return n
    while True:
        chosen = max(np.int64((n + rng.random()) * (n_places / most)), chosen)
        if chosen >= n_places:
            return n
        numbers[n] = chosen
        n, chosen = n + 1, chosen + 1


@part_of_kernel
def _take(best, n, worst, misfit, pz, py, px):
    """Add a location to `best`; return the length of `best` and the smallest rejected misfit."""
    row = n
    if n < len(best):
        n += 1
    else:
        row = 0
        for k in range(1, n):
            if best[k, 0] > best[row, 0]:
                row = k
    best[row] = misfit, pz, py, px
    if n == len(best):
        worst = best[0, 0]
        for k in range(1, n):
            worst = max(worst, best[k, 0])
    return n, worst
