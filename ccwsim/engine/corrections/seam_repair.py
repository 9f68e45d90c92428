"""Seam repair: windows with unseen patterns are re-simulated (not in the paper).

Even the best cut between two patches can cause unseen patterns: dead ends and shapes that are
absent from the training image. A window around unseen patterns is replaced by a patch that fits the
surroundings, if this patch reduces the number of unseen patterns. The patch is cut into the grid on
all sides. If the grid honours a datum in the window, the patch also honours the datum.
"""

from math import prod
from typing import NamedTuple

import numpy as np

from ccwsim.engine.corrections.refinement import refine_place
from ccwsim.engine.corrections.resimulation import (
    MIN_WINDOW_LAYERS,
    Honouring,
    Target,
    fitting_windows,
    has_unknown,
    layers_around,
    make_honouring,
)
from ccwsim.engine.corrections.unseen_patterns import (
    PasteWorkspace,
    Patterns,
    box_within_reach,
    known_patterns,
    make_trial,
    n_unseen_around,
    n_unseen_with,
    unseen_places,
)
from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.engine.stages.bits import Strips, make_strips, take_strips
from ccwsim.engine.stages.candidates import (
    Ranking,
    best_places,
    draw_index,
    location_of_number,
    make_ranking,
)
from ccwsim.engine.stages.cut import CutWorkspace, keep_old, make_cut, paste
from ccwsim.engine.stages.path import ABOVE, BELOW, BOTTOM, LEFT, RIGHT, TOP, UNKNOWN, Box, Triple
from ccwsim.engine.stages.pyramid import build_pyramid
from ccwsim.engine.stages.similarity import (
    Terms,
    box_sums,
    legal_spans,
    make_terms,
    overlap_terms,
    running_sums,
    score_places,
    score_type,
    summed_squares,
)
from ccwsim.model import UNWATCHED, Array, Bytes, Floats, Integers, Ints, Mask, Watch

N_BEST_TRIED = 2  # number of best locations that are tried for a window
N_BEST_TRIED_DATA = 8  # number of best locations that are tried for a window in a volume with data
MIN_UNSEEN, MIN_UNSEEN_VOLUME = 3, 4  # minimum number of unseen patterns in a repaired window
MAX_COMPARED_WITH_DATA = 500
"""Maximum number of locations, all honouring the data, that are compared for a window with data."""
LOCATIONS = 12_500  # approximate number of locations in a volume that are compared for each window
CHANGE = 0.25
"""Cost, in unseen patterns, of each cell by which seam repair changes the number of cells of a
facies; a change that restores the number has a negative cost. See `facies_weights`."""
MAX_WEIGHT = 20.0  # maximum factor of this cost for a rare facies
WINDOWS_A_TILE, WINDOWS_A_TILE_DATA = 0.125, 1.0
"""Maximum number of repaired windows per tile of a map, without and with data. Windows with the
most unseen patterns are repaired first. In volumes, all windows of ordinary images are repaired."""
WINDOWS_PER_CALL = 256


class Repair(NamedTuple):
    """Inputs of seam repair: the training image prepared for windows of one size."""

    patterns: Patterns
    side_by_side: Patterns  # patterns of adjacent cells
    window: Triple
    ring: Triple  # width of the overlap of a window, along each axis
    block: Triple
    shift_block: Triple  # block for refinement of locations: equal lengths along y and x
    running: Integers  # made by `running_sums`
    energy: Array  # shape (nz, ny, nx) of locations: ΣA² of the ring
    spans: Ints  # made by `legal_spans`
    least: int  # minimum number of unseen patterns in a window
    weights: Floats  # shape (n_facies,): made by `facies_weights`


class RepairWorkspace(NamedTuple):
    """Workspace for seam repair, which all windows share."""

    scores: Array  # shape (nz, ny, nx) of the compared locations
    terms: Terms
    ranking: Ranking
    best: Ints  # shape (n, 4): misfit, layer, row and column of locations to try
    no_data: Ints  # shape (0, 4): for `refine_place`
    honouring: Honouring
    strips: Strips
    cut: CutWorkspace
    best_mask: Mask  # shape of a window: the mask of the best cut
    trial: PasteWorkspace


def window_lengths(template: Triple, room: Triple) -> tuple[Triple, Triple, Triple]:
    """Return window, ring and block lengths for a template; `room` limits the window.

    In a map, windows are half as long as the template, and rings are a quarter as wide as a window.
    In a volume, windows have two layers and 3/8 of the rows and columns of the template, because
    more locations fit thin windows. Windows and rings consist of whole blocks. Along a short axis,
    the window includes all cells and has no ring.
    """
    volume = template[0] > 1
    n_layers = min(MIN_WINDOW_LAYERS if volume else 1, room[0])
    lengths = [(n_layers, 0, n_layers)]
    for t, most in zip(template[1:], room[1:], strict=True):
        side, wide, large = (3 * t / 8, 1 / 6, 16) if volume else (t / 2, 1 / 4, 12)
        block = 4 if side >= large else 2
        window = min(max(round(side / block) * block, 8), most // block * block)
        ring = max(round(side * wide / block) * block, block)
        if window <= 2 * ring:
            window, ring, block = min(t, most), 0, 1
        lengths.append((window, ring, block))
    window, ring, block = zip(*lengths, strict=True)
    return window, ring, block


def prepare_repair(
    image: Bytes, template: Triple, room: Triple, n_facies: int, volume: bool, unknown: Array
) -> Repair:
    """Return the inputs of seam repair; `image`, shape (nz, ny, nx), is in grid coordinates.

    Windows have at most the lengths `room`. `unknown` is documented in `Target`.
    """
    window, ring, block = window_lengths(template, room)
    level = tuple(n.bit_length() - 1 for n in block)
    planes = 1 if n_facies <= 2 else n_facies
    sums = build_pyramid(image, level, planes).sums  # type: ignore[arg-type]
    size = tuple(n // b for n, b in zip(window, block, strict=True))
    wide = tuple(n // b for n, b in zip(ring, block, strict=True))
    inner = tuple(n - b for n, b in zip(size, wide, strict=True))
    table = summed_squares(sums)
    energy = box_sums(table, size) - box_sums(table, size, wide, inner)  # type: ignore[arg-type]
    both = tuple(2 * n for n in ring)
    kind = score_type(level, window, both, excludes=unknown.size > 0)  # type: ignore[arg-type]
    running = running_sums(sums, level, window)  # type: ignore[arg-type]
    spans = np.zeros((0, 0, 2), np.int64)
    if unknown.size:
        blocks = tuple(slice(0, n * b, b) for n, b in zip(energy.shape, block, strict=True))
        illegal = box_sums(unknown, window)[blocks] > 0
        spans = legal_spans(illegal.astype(np.uint8))
        energy[illegal] = np.iinfo(kind).max
    least = MIN_UNSEEN_VOLUME if volume else MIN_UNSEEN
    patterns = known_patterns(image, None, volume, unknown)
    near = patterns if patterns.spacing == 1 else known_patterns(image, 1, volume, unknown)
    return Repair(
        patterns=patterns,
        side_by_side=near,
        window=window,
        ring=ring,
        block=block,
        shift_block=(block[0], max(block), max(block)),
        running=running,
        energy=energy.astype(kind),
        spans=spans,
        least=least,
        weights=facies_weights(np.bincount(image.ravel(), minlength=n_facies)[:n_facies]),
    )


def make_repair_workspace(repair: Repair, target: Target) -> RepairWorkspace:
    """Return the workspace for the windows of a realization."""
    nz, ny, nx = repair.energy.shape
    if len(target.layers) > 1:
        nz = int(target.layers[:, 1].min() - repair.window[0]) // repair.block[0] + 1
    shape = min(nz, max(LOCATIONS // (ny * nx), 1)), ny, nx
    kind, n, window = repair.energy.dtype, prod(shape), repair.window
    both = tuple(2 * n for n in repair.ring)
    return RepairWorkspace(
        scores=np.zeros(shape, kind),
        terms=make_terms(repair.running, window, both, repair.block),  # type: ignore[arg-type]
        ranking=make_ranking(n, min(N_BEST_TRIED, n), kind),
        best=np.zeros((N_BEST_TRIED_DATA if window[0] > 1 else N_BEST_TRIED, 4), np.int64),
        no_data=np.zeros((0, 4), np.int64),
        honouring=make_honouring(target.bits),
        strips=make_strips(target.square_bits, window),
        cut=make_cut(window, repair.ring),
        best_mask=np.zeros(window, np.bool_),
        trial=make_trial(window, repair.patterns, len(target.balance)),
    )


def facies_weights(counts: Ints) -> Floats:
    """Return the factor of `CHANGE` for each facies, shape (n_facies,), at most `MAX_WEIGHT`.

    The factor is larger for rare facies, because a cell has a larger relative effect on their
    proportion. `counts` are the numbers of cells of each facies in the image.
    """
    p = counts / counts.sum()
    return np.clip(0.25 / np.maximum(p * (1 - p), 1e-9), 1.0, MAX_WEIGHT)


def repair_seams(
    target: Target,
    repair: Repair,
    most: int,
    forced: Ints,
    rng: np.random.Generator,
    watch: Watch = UNWATCHED,
    active: Mask | None = None,
) -> int:
    """Repair at most `most` windows in place; return the number of replaced windows.

    Windows with `forced` cells, shape (n, 3), are not changed, nor windows whose middle is not
    `active`, shape of the grid. `watch` gets the finished share of the windows and may stop the
    work.
    """
    patterns, window = repair.patterns, repair.window
    places = unseen_places(target.grid, patterns, window, repair.least, watch, active=active)[:most]
    n_changed = 0
    if any(n > m for n, m in zip(window, target.grid.shape, strict=True)):
        places = places[:0]  # the grid is smaller than a window
    work = make_repair_workspace(repair, target)
    for first in range(0, max(len(places), 1), WINDOWS_PER_CALL):  # one call even without windows
        watch.tell(first / max(len(places), 1))
        batch = places[first : first + WINDOWS_PER_CALL]
        n_changed += repair_windows(target, repair, batch, forced, rng, work)
    return n_changed


@kernel
def repair_windows(target, repair, places, forced, rng, work):
    """Repair windows around `places`, shape (n, 3); return the number of replaced windows."""
    image, data, grid, balance = target.image, target.data, target.grid, target.balance
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
        around = box_within_reach(box, patterns, grid.shape)
        before = n_unseen_around(grid, around, patterns, work.trial)
        if before < repair.least:
            continue
        if has_data(data, box):
            limit = np.int64(nz * ny * nx)
            n = fitting_windows(
                target,
                box,
                limit,
                MAX_COMPARED_WITH_DATA,
                rng,
                work.honouring,
                work.strips,
                work.best,
            )
        else:
            n = well_fitting_windows(target, box, repair, rng, work)
        least, chosen = float(before), (np.int64(-1), np.int64(0), np.int64(0))
        for number in range(n):
            if volume and work.best[number, 0] > before:
                continue  # a location with this misfit hardly ever reduces unseen patterns
            place = work.best[number, 1], work.best[number, 2], work.best[number, 3]
            if has_unknown(target.unknown, place, box):
                continue
            keep_old(grid, data, image, place, box, work.cut)
            keep_mask = work.cut.keep_mask
            # at most `before`, because patches that restore the balance have negative costs
            limit = np.int64(before)
            after = n_unseen_with(
                image, place, box, around, keep_mask, grid, patterns, limit, work.trial
            )
            change, counts = 0.0, work.trial.counts
            for k in range(len(counts)):
                change += repair.weights[k] * (abs(balance[k] + counts[k]) - abs(balance[k]))
            cost = after + CHANGE * change / 2
            if cost < least and after < before:
                least, chosen = cost, place
                for z in range(nz):
                    for y in range(ny):
                        for x in range(nx):
                            work.best_mask[z, y, x] = keep_mask[z, y, x]
        if chosen[0] >= 0:
            n_changed += 1
            paste(image, chosen, box, work.best_mask, balance, grid, target.sources)
    return n_changed


@part_of_kernel
def has_any(cells, box):
    """Return whether a box contains any of the `cells`, shape (n, 3)."""
    for i in range(len(cells)):
        z, y, x = cells[i, 0] - box.z0, cells[i, 1] - box.y0, cells[i, 2] - box.x0
        if 0 <= z < box.nz and 0 <= y < box.ny and 0 <= x < box.nx:
            return True
    return False


@part_of_kernel
def has_data(data, box):
    """Return whether any cell of a box has a datum; `data` comes from `data_grid`."""
    flat = data.reshape(-1)
    for z in range(box.z0, box.z0 + box.nz):
        for y in range(box.y0, box.y0 + box.ny):
            first, n = np.uint64((z * data.shape[1] + y) * data.shape[2] + box.x0), np.uint8(0)
            for x in range(np.uint64(box.nx)):
                n |= np.uint8(flat[first + x] != UNKNOWN)
            if n:
                return True
    return False


@part_of_kernel
def well_fitting_windows(target, box, repair, rng, work):
    """Fill `work.best` with the locations whose ring fits best; return the number of locations.

    Locations are compared by block sums, then refined, like the locations of a patch with an
    overlap on all sides. The search starts at a random layer of locations and covers as many layers
    as `work.scores` has.
    """
    image, square_bits, grid = target.image, target.square_bits, target.grid
    running, scores, places = repair.running, work.scores, work.ranking.places
    n_groups = overlap_terms(grid, box, repair.block, running, work.terms)
    n_layers = len(scores)
    layer, end = np.int64(0), np.int64(len(repair.energy))
    if len(target.layers) > 1:
        layer, n = layers_around(target, box)
        layer, end = layer // repair.block[0], (layer + n - box.nz) // repair.block[0] + 1
    layer += draw_index(rng, end - layer - n_layers + 1)
    energy = repair.energy[layer : layer + n_layers]
    score_places(running, layer, repair.spans, work.terms, n_groups, energy, scores)
    best_places(scores.reshape(-1), rng, work.ranking)
    take_strips(grid, box, square_bits, work.strips)
    n_places, missed = (scores.shape[1], scores.shape[2]), np.int64(0)
    for k in range(len(places)):
        z, y, x = location_of_number(places[k], n_places, repair.block)
        near, block = (z + layer * repair.block[0], y, x), repair.shift_block
        misfit, z, y, x = refine_place(
            image, square_bits, box, block, near, work.strips, work.no_data, missed
        )
        work.best[k] = misfit, z, y, x
    return len(places)
