"""The K best places and the random draw among them (Algorithm 1, lines 7 and 8)."""

from __future__ import annotations

import numpy as np

from ccwsim.engine.kernels import kernel


@kernel
def draw_index(rng, n):
    """Return a whole number from 0 to n − 1, all equally likely."""
    return min(int(rng.random() * n), n - 1)


@kernel
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


@kernel
def n_up_to(row, limit):
    """Count the scores of a row that are at most `limit`, which their type must hold."""
    limit = row.dtype.type(limit)
    n = np.int32(0)
    for x in range(len(row)):
        n += np.int32(row[x] <= limit)
    return n


@kernel
def best_places(scores, k, rng, row_best, places):
    """Fill `places` with the k best places; equal scores at the end are drawn at random.

    Taking the first of many equal places would favour one corner of the training image.

    Parameters
    ----------
    scores : ndarray of integers, shape (ny, nx)
        Smaller is better.
    k : int
        How many, at most ny · nx.
    rng : numpy.random.Generator
    row_best : ndarray of int64, shape (ny,)
        Room to work in.
    places : ndarray of int64, shape (k, 2)
        Row and column of each; in no order.
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
    room = k - better
    for py in range(ny):
        if row_best[py] > last:
            continue
        for px in range(nx):
            if scores[py, px] != last:
                continue
            ties += 1
            at = ties - 1 if ties <= room else draw_index(rng, ties)
            if at < room:
                places[better + at, 0] = py
                places[better + at, 1] = px


@kernel
def keep_within(scores, places, slack):
    """Move the places within `slack` of the best to the front of `places`; return how many.

    Hard data leave few places that fit them. The K-th best may then be far worse than the best, and
    drawing it would break shapes without making the realizations more varied where it matters.
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
