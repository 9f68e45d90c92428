"""Seam repair by changing the facies of single cells (not in the paper).

Unseen patterns are patterns that are absent from the training image. At seams, single cells cause
many unseen patterns, for example a notch in a boundary. For each unseen pattern, the change of one
cell that leaves the fewest unseen patterns is chosen. If no single change helps, a tabu search
(Glover 1989) changes several cells one after another, even if unseen patterns increase at first.
The changes up to the best state are retained. Cells with data do not change.
"""

from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np

from ccwsim.engine.corrections.resimulation import Target
from ccwsim.engine.corrections.seam_repair import has_data
from ccwsim.engine.corrections.unseen_patterns import (
    Patterns,
    is_known,
    number_patterns,
    number_run,
)
from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.engine.stages.candidates import draw_index, location_of_number
from ccwsim.engine.stages.path import UNKNOWN, Box, Triple
from ccwsim.model import UNWATCHED, Bytes, Integers, Ints, Mask, UInt32s, UInt64s, Watch

PART_SHAPE, PART_SHAPE_VOLUME = (1, 64, 512), (16, 32, 128)
"""Layers, rows and columns of a part of a grid. A part fits into the processor's cache."""
PARTS_PER_CALL = 64
FURTHER, FURTHER_VOLUME = 3, 14
"""Number of unseen patterns, in excess of the best state, at which a tabu search ends."""
TABU_PATIENCE, TABU_PATIENCE_VOLUME = 20, 40
"""Number of changes without a new best state after which a tabu search ends."""
FURTHER_DATA, TABU_PATIENCE_DATA, SHARE_OF_DATA = 200, 2000, 0.001
"""Values of FURTHER and TABU_PATIENCE for tabu searches that start at data of a volume, if at most
SHARE_OF_DATA of the cells have data. The values are high because few changes suit both image and
data. With more data the values decrease to FURTHER_VOLUME and TABU_PATIENCE_VOLUME."""
STAYS = 4
"""Number of further changes in a tabu search for which a changed cell is tabu, unless changing the
cell again leads to a new best state."""
MAX_CHANGES = 4000
"""Maximum number of changes in a tabu search, and maximum number of unseen patterns that it
lists."""


class RepairedPart(NamedTuple):
    """A part of a grid, raveled, with margins as wide as the reach of patterns.

    Arrays without a documented shape have one element per cell. The index of a pattern is the index
    of the first cell of the pattern.
    """

    shape: Triple  # shape including the margin
    facies: Bytes  # UNKNOWN beyond the grid
    is_free: Mask  # True if a cell may change: no datum, not in the margin
    is_inside: Bytes  # 1 if all cells of a pattern are in the grid
    rows: UInt32s  # numbers that identify rows of patterns
    line: UInt32s  # workspace of `number_run`
    numbers: UInt32s  # numbers that identify patterns
    is_unseen: Bytes  # 1 for an unseen pattern
    unseen: UInt32s  # indices of the unseen patterns
    n_unseen: Bytes  # number of unseen patterns that contain a cell
    was_tried: Mask  # True if no other facies of a cell helps
    stays: Integers  # number of changes before which a cell must not change again
    near: UInt64s  # shape (MAX_CHANGES,): patterns among which a tabu search chooses
    changed: UInt64s  # shape (MAX_CHANGES,): cells that a tabu search changed, in order
    before: Bytes  # shape (MAX_CHANGES,): facies of these cells before the change
    trials: Ints  # shape (1,): number of changes that may still be tried
    aside: UInt64s  # shape (n_neighbours,): index steps to neighbours, modulo 2⁶⁴
    steps: UInt64s  # shape (n,): index steps from the first to each cell of a pattern
    weights: UInt32s  # shape (n,): factors of these cells in a pattern's number


def repair_cells(
    target: Target,
    patterns: Patterns,
    rng: np.random.Generator,
    walks: bool,
    watch: Watch = UNWATCHED,
    trials_a_cell: int = 1 << 20,
    active: Mask | None = None,
) -> int:
    """Change single cells of a realization, in place; return the number of changes.

    If `walks` is true, tabu searches start at unseen patterns for which no single change helps;
    only tabu searches use `rng`. `patterns` must be patterns of adjacent cells. The source of a
    changed cell continues the source of a neighbour if the training image has the new facies at
    that location; otherwise the source is −1. `watch` gets the finished share of the work and may
    stop it. About `trials_a_cell` changes per cell are tried in each part of the grid; the rest of
    a part stays as it is. Parts without `active` cells, shape of the grid, are not changed.
    """
    shape = target.grid.shape
    if any(r >= n for r, n in zip(patterns.reach, shape, strict=True)):
        return 0
    volume = patterns.size[0] > 1
    most = PART_SHAPE_VOLUME if volume else PART_SHAPE
    share = float(np.mean(target.data != UNKNOWN)) if volume and walks else 0.0
    ends, ends_at_data = ends_of_walks(volume, 0.0), ends_of_walks(volume, share)
    begin, end = np.zeros(3, int), np.array(shape)
    if active is not None:  # the parts begin at the first active column
        columns = np.flatnonzero(active.any(axis=(0, 1)))
        begin[2], end[2] = columns[0], columns[-1] + 1
    lengths = tuple(np.minimum(most, end - begin).tolist())
    firsts = list(product(*map(range, begin, end, lengths)))
    if active is not None:
        parts = [tuple(slice(k, k + m) for k, m in zip(f, most, strict=True)) for f in firsts]
        firsts = [f for f, cells in zip(firsts, parts, strict=True) if active[cells].any()]
    part, n_changed = make_part(patterns, lengths), 0  # type: ignore[arg-type]
    for k in range(0, len(firsts), PARTS_PER_CALL):
        watch.tell(k / len(firsts))
        batch, n_trials = np.array(firsts[k : k + PARTS_PER_CALL]), trials_a_cell * prod(lengths)
        n_changed += change_cells(
            target, patterns, batch, lengths, part, rng, walks, ends, ends_at_data, n_trials
        )
    return n_changed


def ends_of_walks(volume: bool, share: float) -> tuple[int, int]:
    """Return the values of `FURTHER` and `TABU_PATIENCE` for tabu searches in a map or a volume.

    For searches that start at data, `share` is the share of cells with data; otherwise it is 0.
    """
    if not volume:
        return FURTHER, TABU_PATIENCE
    part = min(SHARE_OF_DATA / share, 1) if share > 0 else 0
    further, patience = round(part * FURTHER_DATA), round(part * TABU_PATIENCE_DATA)
    return max(further, FURTHER_VOLUME), max(patience, TABU_PATIENCE_VOLUME)


def make_part(patterns: Patterns, lengths: Triple) -> RepairedPart:
    """Return the arrays for parts of a grid."""
    nz, ny, nx = (n + 2 * r for n, r in zip(lengths, patterns.reach, strict=True))
    n = nz * ny * nx
    steps = [(z * ny + y) * nx + x for z, y, x in np.ndindex(patterns.size)]
    strides = [s for s, r in zip((1, nx, ny * nx), patterns.reach[::-1], strict=True) if r > 0]
    return RepairedPart(
        shape=(nz, ny, nx),
        facies=np.zeros(n, np.uint8),
        is_free=np.zeros(n, np.bool_),
        is_inside=np.zeros(n, np.uint8),
        rows=np.zeros(n, np.uint32),
        line=np.zeros(n, np.uint32),
        numbers=np.zeros(n, np.uint32),
        is_unseen=np.zeros(n, np.uint8),
        unseen=np.zeros(n, np.uint32),
        n_unseen=np.zeros(n, np.uint8),
        was_tried=np.zeros(n, np.bool_),
        stays=np.zeros(n, np.uint16),
        near=np.zeros(MAX_CHANGES, np.uint64),
        changed=np.zeros(MAX_CHANGES, np.uint64),
        before=np.zeros(MAX_CHANGES, np.uint8),
        trials=np.zeros(1, np.int64),
        aside=np.array([step for s in strides for step in (-s, s)], np.int64).astype(np.uint64),
        steps=np.array(steps, np.uint64),
        weights=cell_weights(patterns),
    )


def cell_weights(patterns: Patterns) -> UInt32s:
    """Return the factor of each cell's label in the number of a pattern, raveled."""
    (nz, ny, nx), size = patterns.size, 2**32
    of_rows = [pow(int(patterns.row_base), nz * ny - 1 - k, size) for k in range(nz * ny)]
    in_row = [pow(int(patterns.base), nx - 1 - k, size) for k in range(nx)]
    return np.array([a * b % size for a in of_rows for b in in_row], np.uint32)


@kernel
def change_cells(target, patterns, firsts, lengths, part, rng, walks, ends, ends_at_data, n_trials):
    """Change cells in parts of the grid; return the number of changes.

    `firsts`, shape (n, 3), are the first cells of the parts. `lengths` are the lengths of a part;
    parts at the end of the grid may be shorter. `ends_at_data` are the limits of tabu searches that
    start at data, `ends` the limits of other tabu searches. About `n_trials` changes are tried in
    each part.
    """
    n_changed = 0
    for i in range(len(firsts)):
        reach = patterns.reach
        origin = firsts[i, 0] - reach[0], firsts[i, 1] - reach[1], firsts[i, 2] - reach[2]
        copy_part(target.grid, target.data, origin, lengths, patterns, part)
        part.trials[0] = n_trials
        n_found = find_unseen_patterns(patterns, part)
        for k in range(n_found):
            first = np.uint64(part.unseen[k])
            while part.is_unseen[first] and part.trials[0] > 0:
                cell, facies = best_change(first, target.balance, patterns, part)
                if facies == UNKNOWN:
                    break
                change_cell(cell, facies, 0, patterns, part)
                forget_tried(cell, patterns, part)
                part.changed[0] = cell
                n_changed += write_back(1, target, origin, part)
        for k in range(n_found if walks else 0):
            first = np.uint64(part.unseen[k])
            if part.is_unseen[first] and part.trials[0] > 0:
                with_datum = has_data(target.data, pattern_box(first, origin, patterns, part))
                limits = ends_at_data if with_datum else ends
                n = tabu_search(first, limits, target.balance, patterns, part, rng)
                n_changed += write_back(n, target, origin, part)
    return n_changed


@part_of_kernel
def pattern_box(first, origin, patterns, part):
    """Return the box of grid cells that a pattern of a part covers."""
    z, y, x = location_of_number(np.int64(first), (part.shape[1], part.shape[2]), (1, 1, 1))
    nz, ny, nx = patterns.size
    return Box(origin[0] + z, origin[1] + y, origin[2] + x, nz, ny, nx, 0, 0, 0, 0)


@part_of_kernel
def write_back(n, target, origin, part):
    """Copy the first `n` changed cells of a part to the grid; return the number of differences.

    Some changed cells may equal the grid, because a tabu search may change a cell back.
    """
    _, ny, nx = part.shape
    n_different = 0
    for i in range(n):
        z, y, x = location_of_number(np.int64(part.changed[i]), (ny, nx), (1, 1, 1))
        place = origin[0] + z, origin[1] + y, origin[2] + x
        if target.grid[place] == part.facies[part.changed[i]]:
            continue
        target.balance[target.grid[place]] -= 1
        target.balance[part.facies[part.changed[i]]] += 1
        target.grid[place] = part.facies[part.changed[i]]
        n_different += 1
        if target.sources.size > 0:
            target.sources[place] = source_beside(target, place)
    return n_different


@part_of_kernel
def copy_part(grid, data, origin, lengths, patterns, part):
    """Copy a part and its margin from the grid; `origin` is the first cell of the margin."""
    nz, ny, nx = part.shape
    (reach_z, reach_y, reach_x), (z0, y0, x0) = patterns.reach, origin
    facies, is_free, is_inside = part.facies, part.is_free, part.is_inside
    of_grid, of_data, size = grid.reshape(-1), data.reshape(-1), np.uint64(len(part.facies))
    for u in range(size):
        facies[u] = UNKNOWN
    for u in range(size):
        is_free[u] = False
    for u in range(size):
        is_inside[u] = 0
    low, high = np.uint64(max(-x0, 0)), np.uint64(min(nx, grid.shape[2] - x0))
    wide, has_unknown = np.uint64(reach_x), False
    for z in range(max(-z0, 0), min(nz, grid.shape[0] - z0)):
        for y in range(max(-y0, 0), min(ny, grid.shape[1] - y0)):
            to = np.uint64((z * ny + y) * nx)
            first = np.uint64(((z0 + z) * grid.shape[1] + y0 + y) * grid.shape[2] + x0)
            for x in range(low, high):
                facies[to + x] = of_grid[first + x]
                has_unknown |= of_grid[first + x] == UNKNOWN
            if reach_z <= z < reach_z + lengths[0] and reach_y <= y < reach_y + lengths[1]:
                for x in range(wide, min(wide + np.uint64(lengths[2]), high)):
                    free = (of_data[first + x] == UNKNOWN) & (of_grid[first + x] != UNKNOWN)
                    is_free[to + x] = free
            ends = z0 + z + reach_z < grid.shape[0] and y0 + y + reach_y < grid.shape[1]
            if ends and z < nz - reach_z and y < ny - reach_y:
                for x in range(low, high - wide):
                    is_inside[to + x] = 1
    if has_unknown:  # cells that are not simulated belong to no pattern
        for step in part.steps:
            for u in range(size - part.steps[-1]):
                is_inside[u] &= np.uint8(facies[u + step] != UNKNOWN)


@part_of_kernel
def find_unseen_patterns(patterns, part):
    """Number all patterns of a part, list the unseen patterns, and return their count."""
    numbers, rows, steps = part.numbers, part.rows, part.steps
    is_unseen, n_unseen, was_tried = part.is_unseen, part.n_unseen, part.was_tried
    size, n_cells = np.uint64(len(numbers)), np.uint64(len(steps))
    n = size - steps[-1]
    number_run(part.facies, 0, rows, 0, len(rows) - patterns.reach[2], patterns, part.line)
    number_patterns(rows.reshape(part.shape), 0, 0, n, patterns, numbers)
    for u in range(size):
        is_unseen[u] = 0
    n_found = np.int64(0)
    for u in range(n):
        is_unseen[u] = part.is_inside[u] & (1 - is_known(patterns, numbers[u]))
        part.unseen[n_found] = u
        n_found += is_unseen[u]
    if n_found == 0:
        return n_found
    for u in range(size):
        was_tried[u] = False
    for u in range(size):
        n_unseen[u] = 0
    for i in range(n_found):
        first = np.uint64(part.unseen[i])
        for k in range(n_cells):
            n_unseen[first + steps[k]] += np.uint8(1)
    return n_found


@part_of_kernel
def best_change(first, balance, patterns, part):
    """Return the change of one cell of a pattern that leaves the fewest unseen patterns.

    The cell gets the facies of a neighbour. Of equally good changes, the change is best that brings
    `balance`, shape (n_facies,), closer to 0. The new facies is UNKNOWN if no change reduces the
    number of unseen patterns.
    """
    facies_of, aside = part.facies, part.aside
    n_aside = np.uint64(len(aside))
    gain, best, best_facies, best_excess = np.int64(1), first, np.uint8(UNKNOWN), np.int64(1 << 60)
    for step in part.steps:
        cell = first + step
        n = np.int64(part.n_unseen[cell])
        if n < gain or part.was_tried[cell] or not part.is_free[cell]:
            continue
        old = latest = facies_of[cell]
        for a in range(n_aside):
            facies = facies_of[cell + aside[a]]
            is_new = facies != old and facies != latest
            if is_new and facies != UNKNOWN:
                latest = facies
                part.trials[0] -= 1
                n_after = n_unseen_after(cell, facies, n - gain + 1, patterns, part)
                excess = balance[facies] - balance[old]
                if n - n_after > gain or (n - n_after == gain and excess < best_excess):
                    gain, best, best_facies, best_excess = n - n_after, cell, facies, excess
        if best_facies == UNKNOWN:
            part.was_tried[cell] = True
    return best, best_facies


@part_of_kernel
def tabu_search(first, ends, balance, patterns, part, rng):
    """Run a tabu search from an unseen pattern; return the number of retained changes.

    The retained changes are listed first in `part.changed`; they reduce unseen patterns.
    """
    further, patience = ends
    near, changed, before = part.near, part.changed, part.before
    near[0], n_near = first, np.int64(1)
    more = least = n_changed = n_kept = np.int64(0)
    while n_near > 0 and n_changed < min(n_kept + patience, MAX_CHANGES) and part.trials[0] > 0:
        k = draw_index(rng, n_near)
        if not part.is_unseen[near[k]]:
            n_near -= 1
            near[k] = near[n_near]
            continue
        better = least - more
        cell, facies, added = next_change(near[k], n_changed, better, balance, patterns, part, rng)
        if facies == UNKNOWN or more + added > least + further:
            break
        changed[n_changed], before[n_changed] = cell, part.facies[cell]
        n_near = change_cell(cell, facies, n_near, patterns, part)
        n_changed += 1
        part.stays[cell] = n_changed + STAYS
        more += added
        if more < least:
            least, n_kept = more, n_changed
    for i in range(n_changed):
        part.stays[changed[i]] = 0
    for i in range(n_changed - 1, n_kept - 1, -1):
        change_cell(changed[i], before[i], MAX_CHANGES, patterns, part)
    return n_kept


@part_of_kernel
def next_change(first, n_changed, better, balance, patterns, part, rng):
    """Return a cell to change, its new facies, and the number of added unseen patterns.

    The change is chosen at random among the changes that add the fewest unseen patterns (a number
    that may be negative) and, of these, best restore `balance` (`best_change`). A recently changed
    cell changes only if the change adds fewer than `better` unseen patterns; `better` is at most 0.
    The facies is UNKNOWN if no cell can change.
    """
    facies_of, aside = part.facies, part.aside
    n_aside, n_equal = np.uint64(len(aside)), 0
    least, best, best_facies = np.int64(1 << 20), first, np.uint8(UNKNOWN)
    least_excess = np.int64(0)
    for step in part.steps:
        cell = first + step
        if not part.is_free[cell]:
            continue
        n, old = np.int64(part.n_unseen[cell]), facies_of[cell]
        latest = old
        limit = n + better if part.stays[cell] > n_changed else np.int64(1 << 20)
        for a in range(n_aside):
            facies = facies_of[cell + aside[a]]
            is_new = facies != old and facies != latest
            if not is_new or facies == UNKNOWN:
                continue
            latest = facies
            most = min(n + least + 1, limit)
            part.trials[0] -= 1
            n_after = n_unseen_after(cell, facies, most, patterns, part)
            if n_after >= most:
                continue
            excess, is_equal = balance[facies] - balance[old], n_after - n == least
            if is_equal and excess > least_excess:
                continue
            n_equal = n_equal + 1 if is_equal and excess == least_excess else 1
            if n_equal == 1 or draw_index(rng, n_equal) == 0:
                least, best, best_facies, least_excess = n_after - n, cell, facies, excess
    return best, best_facies, least


@part_of_kernel
def n_unseen_after(cell, facies, limit, patterns, part):
    """Count the unseen patterns that contain a cell after a change; counting may end at `limit`."""
    change = np.uint32(patterns.labels[facies] - patterns.labels[part.facies[cell]])
    numbers, is_inside, steps, weights = part.numbers, part.is_inside, part.steps, part.weights
    n = np.int64(0)
    for k in range(np.uint64(len(steps))):
        first = cell - steps[k]
        number = np.uint32(numbers[first] + change * weights[k])
        n += is_inside[first] & (1 - is_known(patterns, number))
        if n >= limit:
            break
    return n


@part_of_kernel
def change_cell(cell, facies, n_near, patterns, part):
    """Change the facies of a cell of a part, and update the unseen patterns.

    Append new unseen patterns to the first `n_near` entries of `part.near`; return the new length.
    """
    numbers, is_unseen, n_unseen, steps = part.numbers, part.is_unseen, part.n_unseen, part.steps
    change = np.uint32(patterns.labels[facies] - patterns.labels[part.facies[cell]])
    part.facies[cell] = facies
    n_steps = np.uint64(len(steps))
    for k in range(n_steps):
        first = cell - steps[k]
        number = np.uint32(numbers[first] + change * part.weights[k])
        numbers[first] = number
        now = np.uint8(part.is_inside[first] & (1 - is_known(patterns, number)))
        if now == is_unseen[first]:
            continue
        more = np.uint8(now - is_unseen[first])  # 1, or 255 for −1 modulo 256
        is_unseen[first] = now
        for i in range(n_steps):
            n_unseen[first + steps[i]] += more
        if now and n_near < MAX_CHANGES:
            part.near[n_near] = first
            n_near += 1
    return n_near


@part_of_kernel
def forget_tried(cell, patterns, part):
    """Reset `was_tried` of the cells that share a pattern with a cell or its neighbours."""
    (nz, ny, nx), (reach_z, reach_y, reach_x) = part.shape, patterns.reach
    z, y, x = location_of_number(np.int64(cell), (ny, nx), (1, 1, 1))
    for near_z in range(max(z - reach_z - 1, 0), min(z + reach_z + 2, nz)):
        for near_y in range(max(y - reach_y - 1, 0), min(y + reach_y + 2, ny)):
            first = (near_z * ny + near_y) * nx
            for near_x in range(max(x - reach_x - 1, 0), min(x + reach_x + 2, nx)):
                part.was_tried[first + near_x] = False


@part_of_kernel
def source_beside(target, place):
    """Return a source that continues a neighbour's source; −1 if the facies would differ."""
    image, sources, (z, y, x) = target.image, target.sources, place
    (mz, my, mx), (nz, ny, nx) = image.shape, sources.shape
    for a in range(6):
        step = 2 * (a % 2) - 1
        dz, dy, dx = step * (a // 2 == 2), step * (a // 2 == 1), step * (a // 2 == 0)
        if not (0 <= z + dz < nz and 0 <= y + dy < ny and 0 <= x + dx < nx):
            continue
        source = np.int64(sources[z + dz, y + dy, x + dx])
        if source < 0:
            continue
        tz, ty, tx = source // (my * mx) - dz, source // mx % my - dy, source % mx - dx
        inside = 0 <= tz < mz and 0 <= ty < my and 0 <= tx < mx
        if inside and image[tz, ty, tx] == target.grid[z, y, x]:
            return np.int32((tz * my + ty) * mx + tx)
    return np.int32(-1)
