"""The K best places and the random draw among them (Algorithm 1, lines 7 and 8)."""

from __future__ import annotations

import numpy as np

from ccwsim.kernels import kernel


@kernel
def draw_index(rng, n):
    """Return a whole number from 0 to n − 1, all equally likely."""
    return min(int(rng.random() * n), n - 1)


@kernel
def kth_best(scores, k, row_best):
    """Return the k-th smallest score and leave the smallest of each row in `row_best`.

    Rows whose smallest score cannot be among the k best are passed over after one look.
    """
    ny, nx = scores.shape
    heap = np.empty(k, np.int64)  # the k smallest so far, the largest of them on top
    size = 0
    for py in range(ny):
        row = scores[py]
        best = row[0]
        for x in range(1, nx):
            best = min(best, row[x])
        row_best[py] = best
        if size == k and best >= heap[0]:
            continue
        for x in range(nx):
            value = np.int64(row[x])
            if size < k:
                at = size
                size += 1
                while at > 0 and heap[(at - 1) // 2] < value:
                    heap[at] = heap[(at - 1) // 2]
                    at = (at - 1) // 2
                heap[at] = value
            elif value < heap[0]:
                _sift_down(heap, size, value)
    return heap[0]


@kernel
def _sift_down(heap, size, value):
    """Put `value` in the place of the top of the heap."""
    at = 0
    while 2 * at + 1 < size:
        child = 2 * at + 1
        if child + 1 < size and heap[child + 1] > heap[child]:
            child += 1
        if heap[child] <= value:
            break
        heap[at] = heap[child]
        at = child
    heap[at] = value


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
