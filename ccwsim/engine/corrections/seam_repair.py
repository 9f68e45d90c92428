"""Seam repair: windows are simulated anew where patches are joined as the image never has it.

Not in the paper. A cut joins two patches as well as it can; what it cannot join ends dead or in
shapes that no place of the training image has. Windows around such patterns take a patch that fits
what is around them, cut in on all sides, if that leaves fewer of them. The patch honours every
datum in its window, and what stays did so before.
"""

from __future__ import annotations

from collections.abc import Callable
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.corrections.resimulation import (
    THIN,
    Honouring,
    Target,
    fitting_windows,
    make_honouring,
)
from ccwsim.engine.corrections.unseen_patterns import (
    Patterns,
    known_patterns,
    n_unseen,
    unseen_places,
)
from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.engine.stages.bits import Strips, make_strips, n_different, take_strips
from ccwsim.engine.stages.box import ABOVE, BELOW, BOTTOM, LEFT, RIGHT, TOP, Box
from ccwsim.engine.stages.candidates import best_places, draw_index, n_segments, place_of
from ccwsim.engine.stages.cut import UNKNOWN, CutWorkspace, keep_old, make_cut, paste
from ccwsim.engine.stages.path import Triple
from ccwsim.engine.stages.pyramid import build_pyramid
from ccwsim.engine.stages.similarity import (
    Terms,
    box_sums,
    make_terms,
    overlap_terms,
    running_sums,
    score_places,
    score_type,
    summed_up,
)

N_BEST = 2
"""So many of the best locations are tried."""
N_BEST_DATA = 8
"""The same in windows of volumes with data, which leave fewer locations that fit well."""
LEAST, LEAST_VOLUME = 3, 4
"""A window has at least so many unseen patterns."""
MAX_COMPARED = 500
"""At most so many locations that honour the data of a window are compared."""
LOCATIONS = 12_500
"""About so many locations of a volume are compared for a window."""
CHANGE = 0.1
"""Unseen patterns that a cell counts by which a facies becomes more or less."""
WINDOWS_A_TILE, WINDOWS_A_TILE_DATA = 0.125, 1.0
"""At most so many windows of a map are repaired without data and with them, the worst ones: those
after them change little. In volumes, where seams are surfaces, all are."""
WINDOWS_PER_CALL = 256


class Repair(NamedTuple):
    """A training image as windows of one size are sought in it."""

    patterns: Patterns
    side_by_side: Patterns  # of cells without others between them
    window: Triple
    ring: Triple  # what a window has in common with the grid, along each axis
    block: Triple
    running: NDArray[np.unsignedinteger[Any]]  # from `running_sums`
    energy: NDArray[np.number[Any]]  # shape (nz, ny, nx) of locations: ΣA² of the ring
    least: int  # a window has at least so many unseen patterns


class Workspace(NamedTuple):
    """Arrays for one window after another."""

    scores: NDArray[np.number[Any]]
    terms: Terms
    minima: NDArray[np.number[Any]]
    segments: NDArray[np.int64]
    found: NDArray[np.int64]
    found_scores: NDArray[np.number[Any]]
    places: NDArray[np.int64]
    # shape (n, 4): misfit, layer, row and column of the locations that are tried
    best: NDArray[np.int64]
    honouring: Honouring
    strips: Strips
    cut: CutWorkspace
    kept: NDArray[np.bool_]  # the mask of the best cut
    trial: NDArray[np.uint8]  # the window with what patterns reach around it
    rows: NDArray[np.uint32]  # shape (layers, rows, columns): the numbers of rows of patterns
    numbers: NDArray[np.uint32]
    counts: NDArray[np.int64]  # shape (n_facies,): how many cells of each facies a patch adds
    no_sources: NDArray[np.int32]  # empty


def window_lengths(template: Triple, room: Triple) -> tuple[Triple, Triple, Triple]:
    """Return window, ring and block for a template, in `room` that image and grid have.

    Windows of a map are half as long as the template, rings a quarter of that. Those of a volume
    have two layers, and three eighths of the rows and columns: the thinner, the more fit. Blocks
    fill both. Axes with few cells are taken whole, without a ring.

    Examples
    --------
    >>> window_lengths((1, 32, 32), (1, 200, 200))
    ((1, 16, 16), (0, 4, 4), (1, 4, 4))
    >>> window_lengths((16, 32, 32), (48, 100, 100))
    ((2, 12, 12), (0, 2, 2), (2, 2, 2))
    """
    volume = template[0] > 1
    n_layers = min(THIN if volume else 1, room[0])
    found = [(n_layers, 0, n_layers)]
    for t, most in zip(template[1:], room[1:], strict=True):
        side, wide, large = (3 * t / 8, 1 / 6, 16) if volume else (t / 2, 1 / 4, 12)
        block = 4 if side >= large else 2
        window = min(max(round(side / block) * block, 8), most // block * block)
        ring = max(round(side * wide / block) * block, block)
        if window <= 2 * ring:
            window, ring, block = min(t, most), 0, 1
        found.append((window, ring, block))
    window, ring, block = zip(*found, strict=True)
    return window, ring, block


def prepare_repair(
    image: NDArray[np.uint8], template: Triple, grid_shape: Triple, n_facies: int
) -> Repair:
    """Return what windows are sought in; `image` is in layers and not oriented."""
    room = tuple(min(a, b) for a, b in zip(image.shape, grid_shape, strict=True))
    window, ring, block = window_lengths(template, room)  # type: ignore[arg-type]
    level = tuple(n.bit_length() - 1 for n in block)
    planes = 1 if n_facies <= 2 else n_facies
    sums = build_pyramid(image, level, planes).sums  # type: ignore[arg-type]
    size = tuple(n // b for n, b in zip(window, block, strict=True))
    wide = tuple(n // b for n, b in zip(ring, block, strict=True))
    inner = tuple(n - b for n, b in zip(size, wide, strict=True))
    table = summed_up(np.square(sums.astype(np.int64)).sum(axis=0))
    energy = box_sums(table, size, (0, 0, 0), size) - box_sums(table, size, wide, inner)  # type: ignore[arg-type]
    both = tuple(2 * n for n in ring)
    kind = score_type(level, window, both)  # type: ignore[arg-type]
    running = running_sums(sums, level, window)  # type: ignore[arg-type]
    least = LEAST_VOLUME if len(image) > 1 else LEAST
    patterns = known_patterns(image)
    near = patterns if patterns.spacing == 1 else known_patterns(image, 1)
    return Repair(patterns, near, window, ring, block, running, energy.astype(kind), least)


def make_workspace(repair: Repair, target: Target, n_facies: int) -> Workspace:
    """Return the arrays for the windows of a realization."""
    nz, ny, nx = repair.energy.shape
    shape = min(nz, max(LOCATIONS // (ny * nx), 1)), ny, nx
    kind, n, window = repair.energy.dtype, prod(shape), repair.window
    both = tuple(2 * n for n in repair.ring)
    wide = tuple(w + 2 * r for w, r in zip(window, repair.patterns.reach, strict=True))
    return Workspace(
        scores=np.zeros(shape, kind),
        terms=make_terms(repair.running, window, both, repair.block),  # type: ignore[arg-type]
        minima=np.zeros(n_segments(n), kind),
        segments=np.zeros(n_segments(n), np.int64),
        found=np.zeros(n, np.int64),
        found_scores=np.zeros(n, kind),
        places=np.zeros(min(N_BEST, n), np.int64),
        best=np.zeros((N_BEST_DATA if window[0] > 1 else N_BEST, 4), np.int64),
        honouring=make_honouring(target.bits),
        strips=make_strips(target.square_bits, window),
        cut=make_cut(window, repair.ring),
        kept=np.zeros(window, np.bool_),
        trial=np.zeros(wide, np.uint8),
        rows=np.zeros(wide, np.uint32),
        numbers=np.zeros(wide[1] * wide[2], np.uint32),
        counts=np.zeros(n_facies, np.int64),
        no_sources=np.zeros((0, 0, 0), np.int32),
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
    patterns, window = repair.patterns, repair.window
    places = unseen_places(target.grid, patterns, window, repair.least, report)[:most]
    n_changed = 0
    if any(n > m for n, m in zip(window, target.grid.shape, strict=True)):
        places = places[:0]  # a smaller grid than what it was prepared for
    work = make_workspace(repair, target, n_facies)
    for first in range(0, max(len(places), 1), WINDOWS_PER_CALL):  # compiled also without any
        report(first / max(len(places), 1))
        some = places[first : first + WINDOWS_PER_CALL]
        n_changed += repair_windows(target, repair, some, forced, rng, work)
    return n_changed


@kernel
def repair_windows(target, repair, places, forced, rng, work):
    """Repair windows around places, shape (n, 3), one after another; return how many changed."""
    image, _, _, data, grid, sources, _ = target
    nz, ny, nx = repair.window
    oz, oy, ox = repair.ring
    patterns, n_changed, volume = repair.patterns, 0, grid.shape[0] > 1
    for i in range(len(places)):
        z0 = min(max(places[i, 0] - nz // 2, 0), grid.shape[0] - nz)
        y0 = min(max(places[i, 1] - ny // 2, 0), grid.shape[1] - ny)
        x0 = min(max(places[i, 2] - nx // 2, 0), grid.shape[2] - nx)
        sides = (LEFT | RIGHT if ox else 0) | (TOP | BOTTOM if oy else 0)
        sides |= BELOW | ABOVE if oz else 0
        box = Box(z0, y0, x0, nz, ny, nx, sides, oz, oy, ox)
        if has_any(forced, box):
            continue
        first_z, first_y, first_x, tz, ty, tx = surroundings(grid, box, patterns, work.trial)
        inside = Box(z0 - first_z, y0 - first_y, x0 - first_x, nz, ny, nx, sides, oz, oy, ox)
        before = n_unseen(work.trial, tz, ty, tx, patterns, work.rows, work.numbers, 1 << 30)
        if before < repair.least:
            continue
        if has_data(data, box):
            limit = np.int64(nz * ny * nx)
            n = fitting_windows(
                target, box, limit, MAX_COMPARED, rng, work.honouring, work.strips, work.best
            )
        else:
            n = well_fitting_windows(target, box, repair, rng, work)
        least, chosen = float(before), (np.int64(-1), np.int64(0), np.int64(0))
        for number in range(n):
            if volume and work.best[number, 0] > before:
                continue  # a ring that differs so much hardly ever leaves fewer
            place = work.best[number, 1], work.best[number, 2], work.best[number, 3]
            keep_old(grid, data, image, place, box, work.cut)
            mask, change = work.cut.keep_mask, 0
            for k in range(len(work.counts)):
                work.counts[k] = 0
            surroundings(grid, box, patterns, work.trial)
            paste(image, place, inside, mask, work.counts, work.trial, work.no_sources)
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
    cells = data.reshape(-1)
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
    image, _, square_bits, _, grid, _, _ = target
    running, scores, places = repair.running, work.scores, work.places
    n_groups = overlap_terms(grid, box, repair.block, running, work.terms)
    n_layers = len(scores)
    layer = draw_index(rng, len(repair.energy) - n_layers + 1)
    for k in range(work.terms.ends[n_groups - 1] if n_groups > 0 else 0):
        work.terms.offsets[k] += layer * running.shape[3] * running.shape[4]
    energy = repair.energy[layer : layer + n_layers]
    score_places(running, work.terms, n_groups, energy, scores)
    flat, n, found = scores.reshape(-1), len(places), work.found
    best_places(flat, n, rng, work.minima, work.segments, found, work.found_scores, places)
    take_strips(grid, box, square_bits, work.strips)
    words, n_places = square_bits.reshape(-1), (scores.shape[1], scores.shape[2])
    for k in range(len(places)):
        z, y, x = place_of(places[k], n_places, repair.block)
        place = z + layer * repair.block[0], y, x
        misfit, z, y, x = shifted(place, repair, image.shape, words, square_bits.shape, work.strips)
        work.best[k, 0], work.best[k, 1], work.best[k, 2], work.best[k, 3] = misfit, z, y, x
    return len(places)


@part_of_kernel
def surroundings(grid, box, patterns, trial):
    """Copy a box with all cells that patterns in it reach; return its first cell and lengths."""
    reach_z, reach_y, reach_x = patterns.reach
    z0, y0, x0 = max(box.z0 - reach_z, 0), max(box.y0 - reach_y, 0), max(box.x0 - reach_x, 0)
    nz = min(box.z0 + box.nz + reach_z, grid.shape[0]) - z0
    ny = min(box.y0 + box.ny + reach_y, grid.shape[1]) - y0
    nx = min(box.x0 + box.nx + reach_x, grid.shape[2]) - x0
    flat, cells = trial.reshape(-1), grid.reshape(-1)
    for z in range(nz):
        for y in range(ny):
            to = np.uint64((z * trial.shape[1] + y) * trial.shape[2])
            first = np.uint64(((z0 + z) * grid.shape[1] + y0 + y) * grid.shape[2] + x0)
            for x in range(np.uint64(nx)):
                flat[to + x] = cells[first + x]
    return z0, y0, x0, nz, ny, nx


@part_of_kernel
def shifted(place, repair, shape, words, words_shape, strips):
    """Return the location near `place`, within a block, whose ring fits best, after its misfit."""
    best_z, best_y, best_x = place
    best = n_different(words, words_shape, place, strips, np.int64(1 << 60))
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
                    wrong = n_different(words, words_shape, near, strips, best)
                    if wrong < best:
                        best, best_z, best_y, best_x = wrong, z, y, x
        stride //= 2
    return best, best_z, best_y, best_x
