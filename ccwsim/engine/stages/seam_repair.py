"""Seam repair: where the realization has patterns that the training image never has.

Not in the paper. A cut joins two patches as well as it can; what it cannot join ends dead or in
shapes that no place of the training image has. Windows around such patterns take a patch that fits
what is around them, cut in on all sides, if that leaves fewer of them. Every datum in a window is
honoured as before: the cut takes what is right.
"""

from __future__ import annotations

from collections.abc import Callable
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.engine.stages.bits import Strips, make_strips, n_different, take_strips
from ccwsim.engine.stages.box import ABOVE, BELOW, BOTTOM, LEFT, RIGHT, TOP, Box
from ccwsim.engine.stages.candidates import best_places, draw_index, n_segments, place_of
from ccwsim.engine.stages.cut import UNKNOWN, CutWorkspace, keep_old, make_cut, n_of, paste
from ccwsim.engine.stages.path import Triple, overlap_cells
from ccwsim.engine.stages.pyramid import build_pyramid
from ccwsim.engine.stages.resimulation import Target, fitting_windows
from ccwsim.engine.stages.similarity import (
    Sums,
    box_sums,
    make_sums,
    overlap_terms,
    score_places,
    score_type,
    summed_up,
)

SIDE, SPACING = 4, 2
"""Patterns of a map have 4 × 4 cells, every second one: wide enough to see an end from its side."""
SIDE_VOLUME, SPACING_VOLUME = 3, 1
"""Those of a volume have 3 × 3 × 3 cells side by side."""
NUMBER_BITS, NUMBER_BITS_VOLUME = 22, 24
"""Bits of the numbers of patterns, of which a table says which the image has: where there are more
patterns some share a number, and are taken for known ones."""
HASH, HASH_OF_ROWS = 0x9E3779B1, 0x85EBCA6B
"""Odd numbers without a pattern of their own."""
N_BEST = 2
"""So many of the best locations are tried."""
LEAST, LEAST_VOLUME = 3, 2
"""A window has at least so many unseen patterns."""
MAX_COMPARED = 500
"""At most so many locations that honour the data of a window are compared."""
LOCATIONS = 25_000
"""About so many locations of a volume are compared for a window."""
CHANGE = 0.1
"""Unseen patterns that a cell counts by which a facies becomes more or less."""
WINDOWS_A_TILE, WINDOWS_A_TILE_DATA = 0.125, 0.5
"""At most so many windows of a map are repaired without data and with them, the worst ones: those
after them change little. In volumes, where seams are surfaces, all are."""
EVERY = 2
"""Rows of patterns of a map that are looked at to find the windows: ends have several."""
ROWS_AT_ONCE = 64
"""Rows of the training image whose patterns are noted together."""
STRIPS_PER_CALL = 64
WINDOWS_PER_CALL = 256


class Patterns(NamedTuple):
    """Which patterns the training image has."""

    known: NDArray[np.uint8]  # bit n % 8 of byte n // 8 is set where it has pattern n
    cells: Triple  # of a pattern along each axis
    spacing: int
    labels: NDArray[np.uint32]  # shape (256,): of facies, in the order in which the image has them
    base: np.uint32  # a row of cells is a number to this base, and so are rows
    shift: int  # the number of a pattern is shifted right by so much


class Repair(NamedTuple):
    """A training image as windows of one size are sought in it."""

    patterns: Patterns
    window: Triple
    ring: Triple  # what a window has in common with the grid, along each axis
    block: Triple
    sums: NDArray[np.integer[Any]]  # block sums, from `build_pyramid`
    energy: NDArray[np.number[Any]]  # shape (nz, ny, nx) of locations: ΣA² of the ring
    least: int  # a window has at least so many unseen patterns


class Workspace(NamedTuple):
    """Arrays for one window after another."""

    scores: NDArray[np.number[Any]]
    sums: Sums
    minima: NDArray[np.number[Any]]
    found: NDArray[np.int64]
    found_scores: NDArray[np.number[Any]]
    places: NDArray[np.int64]
    best: NDArray[np.int64]  # shape (N_BEST, 4): misfit, layer, row and column of locations
    mask: NDArray[np.uint64]  # the bits of locations
    offsets: NDArray[np.int64]
    weights: NDArray[np.number[Any]]
    of_block: NDArray[np.int64]
    strips: Strips
    cut: CutWorkspace
    kept: NDArray[np.bool_]  # the mask of the best cut
    trial: NDArray[np.uint8]  # the window with what patterns reach around it
    rows: NDArray[np.uint32]  # shape (layers, rows, columns): the numbers of rows of patterns
    numbers: NDArray[np.uint32]
    counts: NDArray[np.int64]  # shape (n_facies,)


def window_lengths(template: Triple, room: Triple) -> tuple[Triple, Triple, Triple]:
    """Return window, ring and block for a template, in `room` that image and grid have.

    Windows are half as long as the template, those of volumes a quarter, rings a quarter of that,
    blocks fill both. Axes with few cells are taken whole, without a ring.

    Examples
    --------
    >>> window_lengths((1, 32, 32), (1, 200, 200))
    ((1, 16, 16), (0, 4, 4), (1, 4, 4))
    >>> window_lengths((16, 32, 32), (48, 100, 100))
    ((6, 8, 8), (2, 2, 2), (2, 2, 2))
    """
    found, volume = [], template[0] > 1
    for axis, (t, most) in enumerate(zip(template, room, strict=True)):
        side, smallest = (t / 4, 6 if axis == 0 else 8) if volume else (t / 2, 8)
        block = 4 if side >= 12 else 2
        window = min(max(round(side / block) * block, smallest), most // block * block)
        ring = max(round(side / 4 / block) * block, block)
        if window <= 2 * ring:
            window, ring, block = min(t, most), 0, 1
        found.append((window, ring, block))
    window, ring, block = zip(*found, strict=True)
    return window, ring, block


def known_patterns(image: NDArray[np.uint8]) -> Patterns:
    """Return which patterns an image in layers has."""
    volume = len(image) > 1
    side, spacing = (SIDE_VOLUME, SPACING_VOLUME) if volume else (SIDE, SPACING)
    cells = tuple(side if (side - 1) * spacing < n else 1 for n in image.shape)
    bits = NUMBER_BITS_VOLUME if volume else NUMBER_BITS
    n_facies = int(image.max()) + 1
    exact = n_facies ** prod(cells) <= 2**bits
    known = np.zeros(2 ** (bits - 3), np.uint8)
    base = np.uint32(n_facies if exact else HASH)
    # Which patterns share a number must not depend on how facies are numbered.
    facies, first = np.unique(image, return_index=True)
    labels = np.zeros(256, np.uint32)
    labels[facies[np.argsort(first)]] = np.arange(len(facies))
    shift = 0 if exact else 32 - bits
    patterns = Patterns(known, cells, spacing, labels, base, shift)  # type: ignore[arg-type]
    strip = 1, min(ROWS_AT_ONCE, image.shape[1]), image.shape[2]
    mark_known(image, patterns, *_pattern_buffers(patterns, strip))
    return patterns


def _pattern_buffers(
    patterns: Patterns, shape: tuple[int, ...]
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Return the arrays for patterns that begin in one row of cells, of arrays of a shape."""
    reach = [(n - 1) * patterns.spacing for n in patterns.cells]
    return (
        np.zeros((shape[0] + reach[0], shape[1] + reach[1], shape[2] + reach[2]), np.uint32),
        np.zeros(shape[2] + reach[2], np.uint32),
    )


def prepare_repair(
    image: NDArray[np.uint8], template: Triple, grid_shape: Triple, n_facies: int
) -> Repair:
    """Return what windows are sought in; `image` is in layers and not oriented."""
    room = tuple(min(a, b) for a, b in zip(image.shape, grid_shape, strict=True))
    window, ring, block = window_lengths(template, room)  # type: ignore[arg-type]
    level = tuple(n.bit_length() - 1 for n in block)
    planes = 1 if n_facies <= 2 else n_facies
    # of one type, whatever the block is, so that few kernels are compiled
    sums = build_pyramid(image, level, planes).sums.astype(np.int16)  # type: ignore[arg-type]
    size = tuple(n // b for n, b in zip(window, block, strict=True))
    wide = tuple(n // b for n, b in zip(ring, block, strict=True))
    inner = tuple(n - b for n, b in zip(size, wide, strict=True))
    table = summed_up(np.square(sums.astype(np.int64)).sum(axis=0))
    energy = box_sums(table, size, (0, 0, 0), size) - box_sums(table, size, wide, inner)  # type: ignore[arg-type]
    both = tuple(2 * n for n in ring)
    kind = score_type(level, window, both)  # type: ignore[arg-type]
    least = LEAST_VOLUME if len(image) > 1 else LEAST
    return Repair(known_patterns(image), window, ring, block, sums, energy.astype(kind), least)


def make_workspace(repair: Repair, bits: NDArray[np.uint64], n_facies: int) -> Workspace:
    """Return the arrays for the windows of a realization."""
    nz, ny, nx = repair.energy.shape
    shape = min(nz, max(LOCATIONS // (ny * nx), 1)), ny, nx
    kind, n, window = repair.energy.dtype, prod(shape), repair.window
    both = tuple(2 * n for n in repair.ring)
    n_terms = len(repair.sums) * overlap_cells(window, both) // prod(repair.block)  # type: ignore[arg-type]
    reach = [(k - 1) * repair.patterns.spacing for k in repair.patterns.cells]
    wide = tuple(w + 2 * r for w, r in zip(window, reach, strict=True))
    return Workspace(
        scores=np.zeros(shape, kind),
        sums=make_sums(repair.sums, repair.block, repair.energy.shape[2], n_terms, kind.type),
        minima=np.zeros(n_segments(n), kind),
        found=np.zeros(n, np.int64),
        found_scores=np.zeros(n, kind),
        places=np.zeros(min(N_BEST, n), np.int64),
        best=np.zeros((N_BEST, 4), np.int64),
        mask=np.zeros(bits.shape[1:], np.uint64),
        offsets=np.zeros(n_terms, np.int64),
        weights=np.zeros(n_terms, repair.sums.dtype),
        of_block=np.zeros(n_facies + 1, np.int64),
        strips=make_strips(bits, window),
        cut=make_cut(window, repair.ring),
        kept=np.zeros(window, np.bool_),
        trial=np.zeros(wide, np.uint8),
        rows=np.zeros(wide, np.uint32),
        numbers=np.zeros(wide[2], np.uint32),
        counts=np.zeros(n_facies, np.int64),
    )


def repair_seams(
    target: Target,
    repair: Repair,
    n_facies: int,
    most: int,
    forced: NDArray[np.int64],
    rng: np.random.Generator,
    report: Callable[[float], None] = lambda share: None,
) -> int:
    """Repair at most so many windows of a realization, in place; return how many were changed.

    Windows with `forced` cells, shape (n, 3), stay as they are. `report` is called now and then
    with the share that is done, and may raise to stop.
    """
    places, n_changed = unseen_places(target.grid, repair, report)[:most], 0
    if any(n > m for n, m in zip(repair.window, target.grid.shape, strict=True)):
        places = places[:0]  # a smaller grid than what it was prepared for
    work = make_workspace(repair, target.bits, n_facies)
    for first in range(0, max(len(places), 1), WINDOWS_PER_CALL):  # compiled also without any
        report(first / max(len(places), 1))
        some = places[first : first + WINDOWS_PER_CALL]
        n_changed += repair_windows(target, repair, some, forced, rng, work)
    return n_changed


def unseen_places(
    grid: NDArray[np.uint8], repair: Repair, report: Callable[[float], None]
) -> NDArray[np.int64]:
    """Return the middle of the unseen patterns of each part of a grid, shape (n, 3).

    Parts are half as long as a window; those with most unseen patterns come first.
    """
    patterns, part = repair.patterns, tuple(max(n // 2, 1) for n in repair.window)
    reach = tuple((n - 1) * patterns.spacing for n in patterns.cells)
    ends = tuple(n - r for n, r in zip(grid.shape, reach, strict=True))
    if min(ends) <= 0:
        return np.zeros((0, 3), np.int64)
    n_parts = tuple(-(-n // p) for n, p in zip(ends, part, strict=True))
    found = np.zeros((prod(n_parts), 4), np.int64)
    rows, numbers = _pattern_buffers(patterns, (part[0], part[1], grid.shape[2]))
    n_strips = n_parts[0] * n_parts[1]
    every = EVERY if grid.shape[0] == 1 else 1
    for first in range(0, n_strips, STRIPS_PER_CALL):
        report(0.0)
        last = min(first + STRIPS_PER_CALL, n_strips)
        find_unseen(grid, patterns, part, n_parts, every, first, last, rows, numbers, found)
    bad = found[every * found[:, 0] >= repair.least]
    bad = bad[np.argsort(-bad[:, 0], kind="stable")]
    middle = np.array([r // 2 for r in reach])
    return bad[:, 1:] // bad[:, :1] + middle


@part_of_kernel
def number_rows(cells, z0, y0, x0, nz, ny, nx, patterns, rows, line):
    """Fill `rows` with the numbers of the rows of cells of all patterns that begin in a box.

    `line` is workspace for a row of cells.
    """
    spacing, n = patterns.spacing, patterns.cells[2]
    flat, own, n_cells = cells.ravel(), rows.ravel(), nx + (n - 1) * spacing
    for z in range(nz + (patterns.cells[0] - 1) * spacing):
        for y in range(ny + (patterns.cells[1] - 1) * spacing):
            first = np.uint64(((z0 + z) * cells.shape[1] + y0 + y) * cells.shape[2] + x0)
            to = np.uint64((z * rows.shape[1] + y) * rows.shape[2])
            for x in range(np.uint64(n_cells)):
                line[x] = patterns.labels[flat[first + x]]
            for x in range(np.uint64(nx)):
                own[to + x] = line[x]
            for k in range(1, n):
                ahead = np.uint64(k * spacing)
                for x in range(np.uint64(nx)):
                    own[to + x] = own[to + x] * patterns.base + line[x + ahead]


@part_of_kernel
def number_patterns(rows, z, y, nx, patterns, numbers):
    """Fill `numbers` with those of the patterns whose first row is row y of layer z."""
    own, spacing = rows.ravel(), patterns.spacing
    base = patterns.base
    factor = np.uint32(1)
    for _ in range(patterns.cells[2]):
        factor *= base
    if patterns.shift > 0:
        factor = np.uint32(HASH_OF_ROWS)
    for x in range(np.uint64(nx)):
        numbers[x] = 0
    for i in range(patterns.cells[0]):
        for j in range(patterns.cells[1]):
            layer, row = z + i * spacing, y + j * spacing
            first = np.uint64((layer * rows.shape[1] + row) * rows.shape[2])
            if patterns.shift == 0:
                for x in range(np.uint64(nx)):
                    numbers[x] = numbers[x] * factor + own[first + x]
            else:
                for x in range(np.uint64(nx)):
                    number = (numbers[x] ^ own[first + x]) * factor
                    numbers[x] = number ^ number >> np.uint32(15)
    shift = np.uint32(patterns.shift)
    for x in range(np.uint64(nx)):
        numbers[x] >>= shift


@part_of_kernel
def is_known(known, number):
    """Return whether the image has a pattern."""
    return known[number >> np.uint32(3)] >> (number & np.uint32(7)) & 1


@kernel
def mark_known(image, patterns, rows, numbers):
    """Note all patterns of an image; `rows` and `numbers` are workspace."""
    reach_z, reach_y, reach_x = (
        (patterns.cells[0] - 1) * patterns.spacing,
        (patterns.cells[1] - 1) * patterns.spacing,
        (patterns.cells[2] - 1) * patterns.spacing,
    )
    nz, ny, nx = image.shape[0] - reach_z, image.shape[1] - reach_y, image.shape[2] - reach_x
    known, at_once = patterns.known, rows.shape[1] - reach_y
    for z in range(nz):
        for first in range(0, ny, at_once):
            n = min(at_once, ny - first)
            number_rows(image, z, first, 0, 1, n, nx, patterns, rows, numbers)
            for y in range(n):
                number_patterns(rows, 0, y, nx, patterns, numbers)
                for x in range(nx):
                    number = numbers[x]
                    known[number >> np.uint32(3)] |= np.uint8(1) << (number & np.uint32(7))


@kernel
def find_unseen(grid, patterns, part, n_parts, every, first, last, rows, numbers, found):
    """Count the unseen patterns of the parts of strips `first` to `last` − 1 of a grid.

    A strip has all parts along x; each `every`-th row of patterns is looked at. `found`, shape
    (n_parts, 4), gets their number and the sums of their layers, rows and columns.
    """
    end_z = grid.shape[0] - (patterns.cells[0] - 1) * patterns.spacing
    end_y = grid.shape[1] - (patterns.cells[1] - 1) * patterns.spacing
    nx = grid.shape[2] - (patterns.cells[2] - 1) * patterns.spacing
    for strip in range(first, last):
        z0, y0 = strip // n_parts[1] * part[0], strip % n_parts[1] * part[1]
        nz, ny = min(part[0], end_z - z0), min(part[1], end_y - y0)
        number_rows(grid, z0, y0, 0, nz, ny, nx, patterns, rows, numbers)
        for z in range(nz):
            for y in range(0, ny, every):
                number_patterns(rows, z, y, nx, patterns, numbers)
                for x in range(nx):
                    if not is_known(patterns.known, numbers[x]):
                        at = strip * n_parts[2] + x // part[2]
                        found[at, 0] += 1
                        found[at, 1] += z0 + z
                        found[at, 2] += y0 + y
                        found[at, 3] += x


@part_of_kernel
def n_unseen(cells, nz, ny, nx, patterns, rows, numbers, limit):
    """Count the unseen patterns of a box of cells from its corner; counting may end at `limit`."""
    nz -= (patterns.cells[0] - 1) * patterns.spacing
    ny -= (patterns.cells[1] - 1) * patterns.spacing
    nx -= (patterns.cells[2] - 1) * patterns.spacing
    number_rows(cells, 0, 0, 0, nz, ny, nx, patterns, rows, numbers)
    n = 0
    for z in range(nz):
        for y in range(ny):
            number_patterns(rows, z, y, nx, patterns, numbers)
            for x in range(nx):
                n += 1 - is_known(patterns.known, numbers[x])
            if n >= limit:
                return n
    return n


@kernel
def repair_windows(target, repair, places, forced, rng, work):
    """Repair windows around places, shape (n, 3), one after another; return how many changed."""
    image, _, data, grid, sources = target
    nz, ny, nx = repair.window
    oz, oy, ox = repair.ring
    patterns, n_changed = repair.patterns, 0
    cells, cells_new = grid.ravel(), image.ravel()
    for i in range(len(places)):
        z0 = min(max(places[i, 0] - nz // 2, 0), grid.shape[0] - nz)
        y0 = min(max(places[i, 1] - ny // 2, 0), grid.shape[1] - ny)
        x0 = min(max(places[i, 2] - nx // 2, 0), grid.shape[2] - nx)
        sides = (LEFT | RIGHT if ox else 0) | (TOP | BOTTOM if oy else 0)
        sides |= BELOW | ABOVE if oz else 0
        box = Box(z0, y0, x0, nz, ny, nx, sides, oz, oy, ox)
        if has_any(forced, box):
            continue
        around = surroundings(grid, box, patterns, work.trial)
        inside = z0 - around[0], y0 - around[1], x0 - around[2]
        tz, ty, tx = around[3], around[4], around[5]
        before = n_unseen(work.trial, tz, ty, tx, patterns, work.rows, work.numbers, 1 << 30)
        if before < repair.least:
            continue
        if has_data(data, box):
            limit = np.int64(nz * ny * nx)
            n = fitting_windows(
                target, box, limit, MAX_COMPARED, rng, work.mask, work.strips, work.best
            )
        else:
            n = well_fitting_windows(target, box, repair, rng, work)
        least, chosen = float(before), (np.int64(-1), np.int64(0), np.int64(0))
        for k in range(n):
            place = work.best[k, 1], work.best[k, 2], work.best[k, 3]
            keep_old(grid, data, image, place, box, work.cut)
            mask, change = work.cut.keep_mask, 0
            for k in range(len(work.counts)):
                work.counts[k] = 0
            keep, trial = mask.ravel(), work.trial.ravel()
            for z in range(nz):
                for y in range(ny):
                    row = (
                        (inside[0] + z) * work.trial.shape[1] + inside[1] + y
                    ) * work.trial.shape[2]
                    own, to = np.uint64((z * ny + y) * nx), np.uint64(row + inside[2])
                    old = np.uint64(((z0 + z) * grid.shape[1] + y0 + y) * grid.shape[2] + x0)
                    row = ((place[0] + z) * image.shape[1] + place[1] + y) * image.shape[2]
                    new = np.uint64(row + place[2])
                    for x in range(np.uint64(nx)):
                        trial[to + x] = cells[old + x] if keep[own + x] else cells_new[new + x]
                    for k in range(1, len(work.counts)):
                        work.counts[k] += n_of(trial, to, nx, k) - n_of(cells, old, nx, k)
            for k in range(1, len(work.counts)):
                work.counts[0] -= work.counts[k]
            for k in range(len(work.counts)):
                change += abs(work.counts[k])
            limit = np.int64(np.ceil(least))
            after = n_unseen(work.trial, tz, ty, tx, patterns, work.rows, work.numbers, limit)
            cost = after + CHANGE * change / 2
            if cost < least and after < before:
                least, chosen = cost, place
                for z in range(nz):
                    for y in range(ny):
                        for x in range(nx):
                            work.kept[z, y, x] = mask[z, y, x]
        if chosen[0] >= 0:
            n_changed += 1
            paste(image, chosen, box, work.kept, work.counts[:0], grid, sources)
    return n_changed


@part_of_kernel
def has_any(cells, box):
    """Return whether any of some cells, shape (n, 3), is in a box."""
    for i in range(len(cells)):
        z, y, x = cells[i, 0] - box.z0, cells[i, 1] - box.y0, cells[i, 2] - box.x0
        if 0 <= z < box.nz and 0 <= y < box.ny and 0 <= x < box.nx:
            return True
    return False


@part_of_kernel
def has_data(data, box):
    """Return whether any cell of a box has a datum."""
    cells = data.ravel()
    for z in range(box.z0, box.z0 + box.nz):
        for y in range(box.y0, box.y0 + box.ny):
            first, n = np.uint64((z * data.shape[1] + y) * data.shape[2] + box.x0), np.uint8(0)
            for x in range(np.uint64(box.nx)):
                n |= np.uint8(cells[first + x] != UNKNOWN)
            if n:
                return True
    return False


@part_of_kernel
def well_fitting_windows(target, box, repair, rng, work):
    """Fill `work.best` with the locations whose ring fits best by blocks, shifted; return how many.

    As the search for a patch, but for an overlap on all sides; in as many layers of the image, from
    a random one on, as `work.scores` has.
    """
    image, bits, _, grid, _ = target
    sums, scores, places = repair.sums, work.scores, work.places
    n = overlap_terms(grid, box, repair.block, sums, work.of_block, work.offsets, work.weights)
    n_layers = len(scores)
    layer = draw_index(rng, len(repair.energy) - n_layers + 1)
    for k in range(n):
        work.offsets[k] += layer * sums.shape[2] * sums.shape[3]
    energy = repair.energy[layer : layer + n_layers]
    score_places(sums, work.offsets, work.weights, n, energy, work.sums, scores)
    best_places(
        scores.ravel(), len(places), rng, work.minima, work.found, work.found_scores, places
    )
    take_strips(grid, box, bits, work.strips)
    words, n_places = bits.ravel(), (scores.shape[1], scores.shape[2])
    for k in range(len(places)):
        z, y, x = place_of(places[k], n_places, repair.block)
        place = z + layer * repair.block[0], y, x
        work.best[k, 1], work.best[k, 2], work.best[k, 3] = shifted(
            place, repair, image.shape, words, bits.shape, work.strips
        )
    return len(places)


@part_of_kernel
def surroundings(grid, box, patterns, trial):
    """Copy a box with all cells that patterns in it reach; return its first cell and lengths."""
    reach_z = (patterns.cells[0] - 1) * patterns.spacing
    reach_y = (patterns.cells[1] - 1) * patterns.spacing
    reach_x = (patterns.cells[2] - 1) * patterns.spacing
    z0, y0, x0 = max(box.z0 - reach_z, 0), max(box.y0 - reach_y, 0), max(box.x0 - reach_x, 0)
    nz = min(box.z0 + box.nz + reach_z, grid.shape[0]) - z0
    ny = min(box.y0 + box.ny + reach_y, grid.shape[1]) - y0
    nx = min(box.x0 + box.nx + reach_x, grid.shape[2]) - x0
    flat, cells = trial.ravel(), grid.ravel()
    for z in range(nz):
        for y in range(ny):
            to = np.uint64((z * trial.shape[1] + y) * trial.shape[2])
            first = np.uint64(((z0 + z) * grid.shape[1] + y0 + y) * grid.shape[2] + x0)
            for x in range(np.uint64(nx)):
                flat[to + x] = cells[first + x]
    return z0, y0, x0, nz, ny, nx


@part_of_kernel
def shifted(place, repair, shape, words, bits_shape, strips):
    """Return the location near `place`, within a block, whose ring fits best at full resolution."""
    best_z, best_y, best_x = place
    best = n_different(words, bits_shape, place, strips, np.int64(1 << 60))
    last_z, last_y = shape[0] - repair.window[0], shape[1] - repair.window[1]
    last_x = shape[2] - repair.window[2]
    stride = max(repair.block[0], repair.block[1], repair.block[2]) // 2
    while stride > 0:
        middle_z, middle_y, middle_x = best_z, best_y, best_x
        dz = stride if stride <= repair.block[0] // 2 else 0
        for z in range(max(middle_z - dz, 0), min(middle_z + dz, last_z) + 1, max(dz, 1)):
            for y in range(max(middle_y - stride, 0), min(middle_y + stride, last_y) + 1, stride):
                for x in range(
                    max(middle_x - stride, 0), min(middle_x + stride, last_x) + 1, stride
                ):
                    near = z, y, x
                    wrong = n_different(words, bits_shape, near, strips, best)
                    if wrong < best:
                        best, best_z, best_y, best_x = wrong, z, y, x
        stride //= 2
    return best_z, best_y, best_x
