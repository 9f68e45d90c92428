"""The K best locations and the draw among them (section 4.4; Algorithm 1, lines 11 and 12).

Two options of this program change the choice: `location_weight` and `match_proportions`.
"""

from __future__ import annotations

import numpy as np

from ccwsim.engine.kernels import part_of_kernel

N_COMPARED = 3
"""Candidates drawn to choose from by proportions: more match them faster and vary less."""


@part_of_kernel
def draw_index(rng, n):
    """Return a whole number from 0 to n − 1, all equally likely."""
    return min(np.int64(rng.random() * n), n - 1)


@part_of_kernel
def kth_best(scores, k, row_best):
    """Return the k-th smallest score and leave the smallest of each row in `row_best`.

    The range it lies in is halved by counting, which takes no branch on a score; rows whose
    smallest score is above the middle of the range are passed over.
    """
    ny, nx = scores.shape
    for py in range(ny):
        row = scores[py]
        best = row[0]
        for x in range(1, nx):
            best = min(best, row[x])
        row_best[py] = best
    low = high = row_best[0]
    for py in range(ny):
        low, high = min(low, row_best[py]), max(high, row_best[py])
    if ny < k:
        for py in range(ny):
            row = scores[py]
            for x in range(nx):
                high = max(high, np.int64(row[x]))
    while low < high:
        middle = (low + high) >> 1
        n = 0
        for py in range(ny):
            if row_best[py] <= middle:
                n += n_up_to(scores[py], middle)
                if n >= k:
                    break
        if n >= k:
            high = middle
        else:
            low = middle + 1
    return low


@part_of_kernel
def n_up_to(row, limit):
    """Count the scores of a row that are at most `limit`, which their type must hold."""
    limit = row.dtype.type(limit)
    n = np.int32(0)
    for x in range(len(row)):
        n += np.int32(row[x] <= limit)
    return n


@part_of_kernel
def best_places(scores, k, rng, row_best, places):
    """Fill `places` with the k best locations; equal scores at the end are drawn at random.

    Taking the first of many equal ones would favour one corner of the training image. `places` gets
    row and column of each, shape (k, 2), in no order; `row_best` the smallest score of each row.
    """
    last = kth_best(scores, k, row_best)
    ny, nx = scores.shape
    better = 0
    for py in range(ny):
        if row_best[py] < last:
            for px in range(nx):
                if scores[py, px] < last:
                    places[better, 0] = py
                    places[better, 1] = px
                    better += 1
    ties = 0
    n_free = k - better
    for py in range(ny):
        if row_best[py] > last:
            continue
        for px in range(nx):
            if scores[py, px] != last:
                continue
            ties += 1
            at = ties - 1 if ties <= n_free else draw_index(rng, ties)
            if at < n_free:
                places[better + at, 0] = py
                places[better + at, 1] = px


@part_of_kernel
def keep_within(scores, places, slack):
    """Move the locations within `slack` of the best to the front of `places`; return how many.

    Hard data leave few locations that fit them. The K-th best may then be far worse than the best,
    and drawing it would break shapes without more variation where it matters.
    """
    limit = scores[places[0, 0], places[0, 1]]
    for k in range(1, len(places)):
        limit = min(limit, scores[places[k, 0], places[k, 1]])
    limit += slack
    n = 0
    for k in range(len(places)):
        py, px = places[k, 0], places[k, 1]
        if scores[py, px] <= limit:
            places[k, 0], places[k, 1] = places[n, 0], places[n, 1]
            places[n, 0], places[n, 1] = py, px
            n += 1
    return n


@part_of_kernel
def add_location(box, shape, cost, totals):
    """Add `cost` times the squared distance from a box's own location to the score of each.

    For images that are not stationary, which section 5.9 names as a limit of the method: both the
    box in the grid and a location in the image are measured as shares of the way from one end to
    the other. The cost is thus that of a location at the other end of one axis.
    """
    ny, nx = totals.shape
    row = box.y0 / max(shape[0] - box.size, 1) * (ny - 1)
    column = box.x0 / max(shape[1] - box.size, 1) * (nx - 1)
    for py in range(ny):
        down = (py - row) / max(ny - 1, 1)
        for px in range(nx):
            along = (px - column) / max(nx - 1, 1)
            totals[py, px] += np.int64(cost * (down * down + along * along))


@part_of_kernel
def closest_to_target(image, candidates, block_size, size, proportions, counts, after, rng):
    """Draw a few candidates and return the index of the one that corrects the proportions best.

    The candidates, shape (k, 2), are in blocks of `block_size` cells; `counts` has the cells that
    are simulated by facies, and `after` is workspace of the same shape.
    """
    chosen = np.int64(0)
    smallest = np.inf
    for _ in range(N_COMPARED):
        at = draw_index(rng, len(candidates))
        ty, tx = candidates[at, 0] * block_size, candidates[at, 1] * block_size
        for k in range(len(counts)):
            after[k] = counts[k]
        for y in range(ty, ty + size):
            for x in range(tx, tx + size):
                after[image[y, x]] += 1
        n, off = 0, 0.0
        for k in range(len(after)):  # array expressions would take long to compile
            n += after[k]
        for k in range(len(after)):
            off += abs(after[k] - proportions[k] * n)
        if off < smallest:
            chosen, smallest = at, off
    return chosen
