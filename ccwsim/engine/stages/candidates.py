"""The K best locations and the draw among them (section 4.4; Algorithm 1, lines 11 and 12).

Two options of this program change the choice: `location_weight` and `match_proportions`. Locations
are numbered by layer, row and column.
"""

from __future__ import annotations

import numpy as np

from ccwsim.engine.kernels import part_of_kernel

N_COMPARED = 3
"""Candidates drawn to choose from by proportions: more match them faster and vary less."""
SEGMENT = 32
"""Scores whose smallest is kept, so that most are passed over once the K best lie in others."""
COUNTED = 2**14
"""Scores that the smallest type of scores can count."""


def n_segments(n: int) -> int:
    """Return how many segments n scores have."""
    return -(-n // SEGMENT)


@part_of_kernel
def draw_index(rng, n):
    """Return a whole number from 0 to n − 1, all equally likely."""
    return min(np.int64(rng.random() * n), n - 1)


@part_of_kernel
def kth_smallest(values, n, k):
    """Return the k-th smallest of the first n values, whole numbers.

    The range it lies in is halved by counting, which takes no branch on a value.
    """
    low = high = values[0]
    for i in range(n):
        low, high = min(low, values[i]), max(high, values[i])
    low, high = np.int64(low), np.int64(high)
    while low < high:
        middle = (low + high) >> 1
        if n_up_to(values[:n], middle) >= k:
            high = middle
        else:
            low = middle + 1
    return low


@part_of_kernel
def n_up_to(row, limit):
    """Count the scores of a row that are at most `limit`, which their type must hold.

    They are counted in their own type, COUNTED at once: a wider one would halve the vectors.
    """
    limit, total = row.dtype.type(limit), np.int64(0)
    for first in range(0, len(row), COUNTED):
        n = row.dtype.type(0)
        for x in range(np.uint64(first), np.uint64(min(first + COUNTED, len(row)))):
            n = row.dtype.type(n + (row[x] <= limit))
        total += n
    return total


@part_of_kernel
def segment_minima(scores, minima):
    """Fill `minima` with the smallest score of each segment."""
    n = len(scores)
    for s in range(n // SEGMENT):
        part = scores[s * SEGMENT : (s + 1) * SEGMENT]
        least = part[0]
        for x in range(SEGMENT):
            if part[x] < least:  # min would give a wider type
                least = part[x]
        minima[s] = least
    first = n - n % SEGMENT
    if first < n:
        least = scores[first]
        for x in range(first, n):
            least = min(least, scores[x])
        minima[n // SEGMENT] = least


@part_of_kernel
def best_places(scores, k, rng, minima, found, values, places):
    """Fill `places` with the k best locations; equal scores at the end are drawn at random.

    Taking the first of many equal ones would favour one corner of the training image. `scores` are
    raveled; `places` gets numbers of locations, those that are better than the k-th first.
    `minima`, `found` and `values` are workspace: as many as there are segments, and locations.
    """
    segment_minima(scores, minima)
    n_parts = len(minima)
    # k segments have a score up to the k-th smallest of their minima, so the k-th best is no larger
    least = kth_smallest(minima, n_parts, min(k, n_parts))
    if n_parts < k:
        for x in range(len(scores)):
            least = max(least, np.int64(scores[x]))
    limit = scores.dtype.type(least)
    n = 0
    for s in range(n_parts):
        if minima[s] <= limit:
            for x in range(s * SEGMENT, min((s + 1) * SEGMENT, len(scores))):
                if scores[x] <= limit:
                    found[n] = x
                    values[n] = scores[x]
                    n += 1
    last = values.dtype.type(kth_smallest(values, n, k))
    better = 0
    for i in range(n):
        if values[i] < last:
            places[better] = found[i]
            better += 1
    ties = 0
    n_free = k - better
    for i in range(n):
        if values[i] != last:
            continue
        ties += 1
        at = ties - 1 if ties <= n_free else draw_index(rng, ties)
        if at < n_free:
            places[better + at] = found[i]


@part_of_kernel
def keep_within(scores, places, slack):
    """Move the locations within `slack` of the best to the front of `places`; return how many.

    Hard data leave few locations that fit them. The K-th best may then be far worse than the best,
    and drawing it would break shapes without more variation where it matters.
    """
    limit = scores[places[0]]
    for k in range(1, len(places)):
        limit = min(limit, scores[places[k]])
    limit += slack
    n = 0
    for k in range(len(places)):
        place = places[k]
        if scores[place] <= limit:
            places[k], places[n] = places[n], place
            n += 1
    return n


@part_of_kernel
def add_location(box, shape, cost, axes, totals):
    """Add `cost` times the squared distance from a box's own location to the score of each.

    For images that are not stationary, which section 5.9 names as a limit of the method: both the
    box in the grid, of `shape`, and a location in the image are measured as shares of the way from
    one end to the other. The cost is thus that of a location at the other end of one axis; `axes`
    says how much each of them counts.
    """
    nz, ny, nx = totals.shape
    layer = box.z0 / max(shape[0] - box.nz, 1) * (nz - 1)
    row = box.y0 / max(shape[1] - box.ny, 1) * (ny - 1)
    column = box.x0 / max(shape[2] - box.nx, 1) * (nx - 1)
    for pz in range(nz):
        up = (pz - layer) / max(nz - 1, 1)
        for py in range(ny):
            down = (py - row) / max(ny - 1, 1)
            for px in range(nx):
                along = (px - column) / max(nx - 1, 1)
                far = axes[0] * up * up + axes[1] * down * down + axes[2] * along * along
                totals[pz, py, px] += np.int64(cost * far)


@part_of_kernel
def closest_to_target(image, candidates, box, block, n_places, proportions, counts, after, rng):
    """Draw a few candidates and return the index of the one that corrects the proportions best.

    The candidates are numbers of locations, of which the image has `n_places` rows and columns, in
    blocks; `counts` has the cells that are simulated by facies, and `after` is workspace of the
    same shape.
    """
    chosen = np.int64(0)
    smallest = np.inf
    for _ in range(N_COMPARED):
        at = draw_index(rng, len(candidates))
        tz, ty, tx = place_of(candidates[at], n_places, block)
        for k in range(len(counts)):
            after[k] = counts[k]
        for z in range(tz, tz + box.nz):
            for y in range(ty, ty + box.ny):
                for x in range(tx, tx + box.nx):
                    after[image[z, y, x]] += 1
        n, off = 0, 0.0
        for k in range(len(after)):  # array expressions would take long to compile
            n += after[k]
        for k in range(len(after)):
            off += abs(after[k] - proportions[k] * n)
        if off < smallest:
            chosen, smallest = at, off
    return chosen


@part_of_kernel
def place_of(number, n_places, block):
    """Return layer, row and column, in cells, of a location by its number."""
    ny, nx = n_places
    layer_row = number // nx
    return (
        (layer_row // ny) * block[0],
        (layer_row % ny) * block[1],
        (number - layer_row * nx) * block[2],
    )
