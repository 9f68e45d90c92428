"""Find patterns of a realization that are absent from the training image (not in the paper).

Each pattern has a number, and a table of bits marks the numbers of the image's patterns. The
search of a realization is therefore a single pass, and the search of a window takes a microsecond.
"""

from math import prod
from typing import NamedTuple

import numpy as np

from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.engine.stages.cut import paste
from ccwsim.engine.stages.path import LEFT, TOP, Box, Triple
from ccwsim.engine.stages.similarity import box_sums
from ccwsim.model import UNWATCHED, Bytes, Floats, Int32s, Ints, Mask, Shape, UInt32s, Watch

UNSEEN_SIDE, UNSEEN_SPACING = 4, 2
UNSEEN_SIDE_VOLUME, UNSEEN_SPACING_VOLUME = 3, 1
"""Sides of patterns in maps and in volumes, and spacings of the cells in a pattern."""
NUMBER_BITS, NUMBER_BITS_VOLUME = 22, 24
"""Number of bits of a pattern number. If there are more possible patterns than numbers, patterns
share numbers, and an unseen pattern may be overlooked."""
HASH, HASH_OF_ROWS, HASH_OF_LABELS = 0x9E3779B1, 0x85EBCA6B, 0xC2B2AE35
"""Factors of the hash of a pattern: odd numbers with irregular bits."""
ROW_SPACING = 2  # distance between searched rows of patterns of a map. Dead ends span several rows
IMAGE_ROWS_AT_ONCE = 64  # number of rows of the training image whose patterns are marked together
STRIPS_PER_CALL = 64


class Patterns(NamedTuple):
    """The patterns of the training image, and the factors that give a pattern its number."""

    known_bits: Bytes  # bit n % 8 of byte n // 8 is set if the image has pattern n
    size: Triple  # number of cells of a pattern along each axis
    spacing: int  # distance from cell to cell
    reach: Triple  # distance from the first cell to the last cell along each axis
    labels: UInt32s  # shape (256,): labels of facies, in order of first occurrence
    base: np.uint32  # base of the number whose digits are the cells of a row
    row_base: np.uint32  # base of a pattern's number, whose digits are rows
    shift: int  # right shift of the number of a pattern


NO_UNKNOWN = np.zeros((0, 0, 0), np.int32)
NO_PATTERNS = Patterns(
    known_bits=np.empty(0, np.uint8),
    size=(1, 1, 1),
    spacing=1,
    reach=(0, 0, 0),
    labels=np.empty(0, np.uint32),
    base=np.uint32(0),
    row_base=np.uint32(0),
    shift=0,
)
"""Placeholder for kernels that do not use patterns."""


class PasteWorkspace(NamedTuple):
    """Workspace to paste patches beside the grid and count the unseen patterns that they leave."""

    facies: Bytes  # facies of a patch and of the cells within reach of its patterns
    rows: UInt32s  # shape of `facies`: numbers of rows of patterns
    numbers: UInt32s  # numbers of the patterns of a layer
    counts: Ints  # shape (n_facies,): cells of each facies that a patch adds
    no_sources: Int32s  # empty


def make_trial(patch: Triple, patterns: Patterns, n_facies: int) -> PasteWorkspace:
    """Return the workspace to try patches of at most `patch` cells."""
    wide = tuple(n + 2 * r for n, r in zip(patch, patterns.reach, strict=True))
    numbers, no_sources = np.zeros(wide[1] * wide[2], np.uint32), np.zeros((0, 0, 0), np.int32)
    counts = np.zeros(n_facies, np.int64)
    return PasteWorkspace(
        np.zeros(wide, np.uint8), np.zeros(wide, np.uint32), numbers, counts, no_sources
    )


def known_patterns(
    image: Bytes,
    spacing: int | None = None,
    volume: bool | None = None,
    unknown: Int32s = NO_UNKNOWN,
) -> Patterns:
    """Return the patterns of an image of shape (nz, ny, nx).

    Neighbouring cells of a pattern are `spacing` cells apart; by default as in seam repair. If
    `volume` is false, layers are maps; by default it is true for several layers. `unknown` are the
    running numbers of unknown cells (see `Target`), whose index is the largest one.
    """
    volume = len(image) > 1 if volume is None else volume
    side, usual = (
        (UNSEEN_SIDE_VOLUME, UNSEEN_SPACING_VOLUME) if volume else (UNSEEN_SIDE, UNSEEN_SPACING)
    )
    spacing = usual if spacing is None else spacing
    shape = image.shape if volume else (1, *image.shape[1:])
    size = tuple(side if (side - 1) * spacing < n else 1 for n in shape)
    bits = NUMBER_BITS_VOLUME if volume else NUMBER_BITS
    n_facies = int(image.max()) + (0 if unknown.size else 1)
    exact = n_facies ** prod(size) <= 2**bits
    # Labels make results independent of the numbering of facies, even if patterns share numbers
    first = [int(np.argmax(image.ravel() == facies)) for facies in range(n_facies)]
    labels, numbers = np.zeros(256, np.uint32), np.arange(n_facies, dtype=np.uint32)
    labels[np.argsort(first)] = numbers * np.uint32(1 if exact else HASH_OF_LABELS)
    reach = tuple((n - 1) * spacing for n in size)
    patterns = Patterns(
        known_bits=np.zeros(2 ** (bits - 3), np.uint8),
        size=size,  # type: ignore[arg-type]
        spacing=spacing,
        reach=reach,  # type: ignore[arg-type]
        labels=labels,
        base=np.uint32(n_facies if exact else HASH),
        row_base=np.uint32(n_facies ** size[2] if exact else HASH_OF_ROWS),
        shift=0 if exact else 32 - bits,
    )
    strip = 1, min(IMAGE_ROWS_AT_ONCE, image.shape[1]), image.shape[2]
    extent = tuple(n + 1 for n in reach)
    n_unknown = box_sums(unknown, extent) if unknown.size else unknown  # type: ignore[arg-type]
    rows, line = _pattern_buffers(patterns, strip)
    mark_known(image, patterns, n_unknown > 0, rows, line)
    return patterns


def mean_thickness(image: Bytes) -> Floats:
    """Return the mean thickness of each facies in cells, shape (n_facies,).

    The thickness of a straight band is its number of cells divided by half of its boundary edges.
    """
    n = int(image.max()) + 1
    edges = np.zeros(n)
    for axis in range(image.ndim):
        low, high = (np.delete(image, end, axis) for end in (-1, 0))
        for facies in (low[low != high], high[low != high]):
            edges += np.bincount(facies, minlength=n)
    return 2 * np.bincount(image.ravel(), minlength=n) / np.maximum(edges, 1)


def _pattern_buffers(patterns: Patterns, shape: Shape) -> tuple[UInt32s, UInt32s]:
    """Return workspace for the numbers of all rows and patterns that begin in a box of `shape`."""
    wide = [n + r for n, r in zip(shape, patterns.reach, strict=True)]
    return np.zeros(wide, np.uint32), np.zeros(wide[2], np.uint32)


def unseen_places(
    grid: Bytes,
    patterns: Patterns,
    window: Triple,
    least: int,
    watch: Watch = UNWATCHED,
    active: Mask | None = None,
) -> Ints:
    """Return the mean position of the unseen patterns in each part of a grid, shape (n, 3).

    Parts are half as long as a window. Parts with `least` or more unseen patterns are returned,
    sorted by decreasing number of unseen patterns, unless the position is not `active`, shape of
    the grid. `watch` may stop the search.
    """
    part = tuple(max(n // 2, 1) for n in window)
    ends = tuple(n - r for n, r in zip(grid.shape, patterns.reach, strict=True))
    if min(ends) <= 0:
        return np.zeros((0, 3), np.int64)
    n_parts = tuple(-(-n // p) for n, p in zip(ends, part, strict=True))
    sums = np.zeros((prod(n_parts), 4), np.int64)
    rows, numbers = _pattern_buffers(patterns, (part[0], part[1], grid.shape[2]))
    low, high, middle = 0, n_parts[0] * n_parts[1], np.array(patterns.reach) // 2
    if active is not None and n_parts[0] == 1:  # strips without active rows are left out
        rows_used = np.flatnonzero(active.any(axis=(0, 2)))
        low = max(rows_used[0] - middle[1], 0) // part[1]
        high = min(rows_used[-1] // part[1] + 1, high)
    every = ROW_SPACING if grid.shape[0] == 1 else 1
    for first in range(low, high, STRIPS_PER_CALL):
        watch.tell(0.0)
        last = min(first + STRIPS_PER_CALL, high)
        find_unseen(grid, patterns, part, n_parts, every, first, last, rows, numbers, sums)
    bad = sums[every * sums[:, 0] >= least]
    bad = bad[np.argsort(-bad[:, 0], kind="stable")]
    places = bad[:, 1:] // bad[:, :1] + middle
    return places if active is None else places[active[tuple(places.T)]]


@part_of_kernel
def number_rows(facies, box, patterns, rows, line):
    """Fill `rows` with the number of each row of a pattern that begins in a box.

    `facies` and `rows` have three axes; `line` is workspace for a row of cells.
    """
    flat, numbers = facies.reshape(-1), rows.reshape(-1)
    for z in range(box.nz + patterns.reach[0]):
        for y in range(box.ny + patterns.reach[1]):
            first = ((box.z0 + z) * facies.shape[1] + box.y0 + y) * facies.shape[2] + box.x0
            to = (z * rows.shape[1] + y) * rows.shape[2]
            number_run(flat, first, numbers, to, box.nx, patterns, line)


@part_of_kernel
def number_run(facies, first, rows, to, n, patterns, line):
    """Number the first rows of `n` adjacent patterns; `facies` and `rows` are raveled."""
    first, to = np.uint64(first), np.uint64(to)
    for x in range(np.uint64(n + patterns.reach[2])):
        line[x] = patterns.labels[facies[first + x]]
    for x in range(np.uint64(n)):
        rows[to + x] = line[x]
    for k in range(1, patterns.size[2]):
        ahead = np.uint64(k * patterns.spacing)
        for x in range(np.uint64(n)):
            rows[to + x] = rows[to + x] * patterns.base + line[x + ahead]


@part_of_kernel
def number_patterns(rows, z, y, nx, patterns, numbers):
    """Fill `numbers` with the numbers of all patterns that begin in row y of layer z."""
    flat, spacing, factor = rows.reshape(-1), patterns.spacing, patterns.row_base
    for x in range(np.uint64(nx)):
        numbers[x] = 0
    for i in range(patterns.size[0]):
        for j in range(patterns.size[1]):
            layer, row = z + i * spacing, y + j * spacing
            first = np.uint64((layer * rows.shape[1] + row) * rows.shape[2])
            for x in range(np.uint64(nx)):
                numbers[x] = numbers[x] * factor + flat[first + x]


@part_of_kernel
def is_known(patterns, number):
    """Return whether the image contains the pattern with this number."""
    n = number >> np.uint32(patterns.shift)
    return patterns.known_bits[n >> np.uint32(3)] >> (n & np.uint32(7)) & 1


@kernel
def mark_known(image, patterns, excluded, rows, numbers):
    """Mark all patterns of an image, shape (nz, ny, nx), that are not `excluded`.

    `excluded` has the shape of the first cells of patterns, or is empty; `rows` and `numbers` are
    workspace.
    """
    reach_z, reach_y, reach_x = patterns.reach
    nz, ny, nx = image.shape[0] - reach_z, image.shape[1] - reach_y, image.shape[2] - reach_x
    known_bits, at_once = patterns.known_bits, rows.shape[1] - reach_y
    for z in range(nz):
        for first in range(0, ny, at_once):
            n = min(at_once, ny - first)
            box = Box(z, first, 0, 1, n, nx, 0, 0, 0, 0)
            number_rows(image, box, patterns, rows, numbers)
            for y in range(n):
                number_patterns(rows, 0, y, nx, patterns, numbers)
                for x in range(nx):
                    if excluded.size and excluded[z, first + y, x]:
                        continue
                    number = numbers[x] >> np.uint32(patterns.shift)
                    known_bits[number >> np.uint32(3)] |= np.uint8(1) << (number & np.uint32(7))


@kernel
def find_unseen(grid, patterns, part, n_parts, every, first, last, rows, numbers, sums):
    """Count the unseen patterns of the parts of strips `first` to `last` − 1 of a grid.

    A strip is a row of parts along x. Only every n-th row of patterns (n = `every`) is searched.
    The columns of `sums`, shape (n_parts, 4), are the number of unseen patterns of a part and the
    sums of the layers, rows and columns of unseen patterns.
    """
    end_z = grid.shape[0] - patterns.reach[0]
    end_y = grid.shape[1] - patterns.reach[1]
    nx = grid.shape[2] - patterns.reach[2]
    for strip in range(first, last):
        z0, y0 = strip // n_parts[1] * part[0], strip % n_parts[1] * part[1]
        nz, ny = min(part[0], end_z - z0), min(part[1], end_y - y0)
        number_rows(grid, Box(z0, y0, 0, nz, ny, nx, 0, 0, 0, 0), patterns, rows, numbers)
        for z in range(nz):
            for y in range(0, ny, every):
                number_patterns(rows, z, y, nx, patterns, numbers)
                for x in range(nx):
                    if not is_known(patterns, numbers[x]):
                        row = strip * n_parts[2] + x // part[2]
                        sums[row, 0] += 1
                        sums[row, 1] += z0 + z
                        sums[row, 2] += y0 + y
                        sums[row, 3] += x


@part_of_kernel
def n_unseen(facies, box, patterns, rows, numbers, limit):
    """Count the unseen patterns in a box; `facies` is a copy of the grid around the box.

    Counting may end at `limit`. All rows of a layer are processed in one loop, because single rows
    of a window are short. `facies` and the workspace `rows` have the same shape; the workspace
    `numbers` has one layer.
    """
    n, width, nz, ny, nx = 0, facies.shape[2], box.nz, box.ny, box.nx
    run = (ny - 1 - patterns.reach[1]) * width + nx - patterns.reach[2]
    flat, flat_rows = facies.reshape(-1), rows.reshape(-1)
    layer, whole = facies.shape[1] * width, run + patterns.reach[1] * width
    for z in range(nz):
        number_run(flat, z * layer, flat_rows, z * layer, whole, patterns, numbers)
    for z in range(nz - patterns.reach[0]):
        number_patterns(rows, z, 0, run, patterns, numbers)
        for y in range(ny - patterns.reach[1]):
            for x in range(y * width, y * width + nx - patterns.reach[2]):
                n += 1 - is_known(patterns, numbers[x])
        if n >= limit:
            return n
    return n


@part_of_kernel
def box_within_reach(box, patterns, shape):
    """Return the box of all cells that share patterns with a box of a grid."""
    reach_z, reach_y, reach_x = patterns.reach
    z0, y0, x0 = max(box.z0 - reach_z, 0), max(box.y0 - reach_y, 0), max(box.x0 - reach_x, 0)
    nz = min(box.z0 + box.nz + reach_z, shape[0]) - z0
    ny = min(box.y0 + box.ny + reach_y, shape[1]) - y0
    nx = min(box.x0 + box.nx + reach_x, shape[2]) - x0
    return Box(z0, y0, x0, nz, ny, nx, 0, 0, 0, 0)


@part_of_kernel
def simulated_within_reach(box, patterns):
    """Return the box of a patch of a map and of all earlier cells that share patterns with it."""
    y0 = max(box.y0 - patterns.reach[1], 0) if box.sides & TOP else box.y0
    x0 = max(box.x0 - patterns.reach[2], 0) if box.sides & LEFT else box.x0
    return Box(box.z0, y0, x0, 1, box.y0 + box.ny - y0, box.x0 + box.nx - x0, 0, 0, 0, 0)


@part_of_kernel
def n_unseen_around(grid, around, patterns, trial):
    """Count the unseen patterns in the box `around` of a grid."""
    copy_box(grid, around, trial.facies)
    return n_unseen(trial.facies, around, patterns, trial.rows, trial.numbers, 1 << 30)


@part_of_kernel
def n_unseen_with(image, place, box, around, keep_mask, grid, patterns, limit, trial):
    """Count the unseen patterns in the box `around` if a patch is pasted; may end at `limit`.

    `trial.counts` gets the number of cells of each facies that the patch adds. The other arguments
    are documented in `paste`.
    """
    for k in range(len(trial.counts)):
        trial.counts[k] = 0
    copy_box(grid, around, trial.facies)
    z0, y0, x0 = box.z0 - around.z0, box.y0 - around.y0, box.x0 - around.x0
    inside = Box(z0, y0, x0, box.nz, box.ny, box.nx, box.sides, box.oz, box.oy, box.ox)
    paste(image, place, inside, keep_mask, trial.counts, trial.facies, trial.no_sources)
    return n_unseen(trial.facies, around, patterns, trial.rows, trial.numbers, limit)


@part_of_kernel
def copy_box(grid, box, facies):
    """Copy a box of the grid to the beginning of `facies`."""
    flat, of_grid = facies.reshape(-1), grid.reshape(-1)
    for z in range(box.nz):
        for y in range(box.ny):
            to = np.uint64((z * facies.shape[1] + y) * facies.shape[2])
            first = np.uint64(((box.z0 + z) * grid.shape[1] + box.y0 + y) * grid.shape[2] + box.x0)
            for x in range(np.uint64(box.nx)):
                flat[to + x] = of_grid[first + x]
