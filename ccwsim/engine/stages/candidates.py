"""The K best locations and the random choice (section 4.4, Fig. 3 e; Algorithm 1, lines 11, 12).

Not in the paper: Locations are excluded if their score is much worse than the best score. Without
data, locations are also excluded if they only continue the copy of the training image in a
neighbouring patch. Locations are numbered by layer, row and column.
"""

from typing import Any, NamedTuple

import numpy as np

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.model import Array, Ints

SEGMENT = 32
"""Number of scores in a segment. Segment minima are stored, so most scores are read only once. Each
of n segments has every n-th score, so vector instructions process many segments at once."""
COUNTED = 2**14
"""Maximum number of scores counted at once; the count fits into the smallest type of scores."""


class Ranking(NamedTuple):
    """Workspace to select the K best of at most n scores."""

    minima: Array  # shape (n_segments,), in the type of the scores
    segments: Ints  # shape (n_segments,): segments with good scores
    good: Ints  # shape (n,): numbers of the locations with good scores
    values: Array  # shape (n,): scores of these locations
    places: Ints  # shape (K,): numbers of the K best locations


def make_ranking(n: int, k: int, kind: Any) -> Ranking:
    """Return the workspace to select the k best of n scores of a type."""
    segments = np.zeros(-(-n // SEGMENT), np.int64)
    good, places = np.zeros(n, np.int64), np.zeros(k, np.int64)
    return Ranking(segments.astype(kind), segments, good, good.astype(kind), places)


@part_of_kernel
def draw_index(rng, n):
    """Return a uniformly distributed random integer from 0 to n − 1."""
    return min(np.int64(rng.random() * n), n - 1)


@part_of_kernel
def kth_smallest(values, n, k):
    """Return the k-th smallest of the first n values, which must be integers.

    The range of values is bisected repeatedly, and the values in half of the range are counted.
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
    """Count the values of `row` that are at most `limit`; `limit` must fit into the type of `row`.

    At most COUNTED values at a time are counted, in the type of `row`, because vector instructions
    process fewer values at once if their type is wider.
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
    """Fill `minima` with the minimum of each segment of raveled scores."""
    n, step = np.uint64(len(scores)), np.uint64(len(minima))
    for s in range(step):
        minima[s] = scores[s]
    for first in range(step, n, step):
        for s in range(min(step, n - first)):
            score, least = scores[first + s], minima[s]
            minima[s] = score if score < least else least  # `min` would return a wider type


@part_of_kernel
def best_places(scores, rng, ranking):
    """Fill `ranking.places` with the K best locations; break ties for the last ranks at random.

    Always using the first of many equal locations would favour one corner of the training image.
    `scores`, shape (n,), are raveled. Locations with a better score than the K-th best location are
    listed first.
    """
    _, segments, good, values, places = ranking
    k, n_parts = len(places), -(-len(scores) // SEGMENT)
    minima = ranking.minima[:n_parts]
    segment_minima(scores, minima)
    # k segments have a minimum of at most this value, so the k-th best score is not higher
    least = kth_smallest(minima, n_parts, min(k, n_parts))
    if n_parts < k:
        for x in range(len(scores)):
            least = max(least, np.int64(scores[x]))
    limit = scores.dtype.type(least)
    n_chosen = n = 0
    for s in range(n_parts):
        segments[n_chosen] = s
        n_chosen += np.int64(minima[s] <= limit)
    for first in range(0, len(scores), n_parts):  # visits locations in increasing order
        for i in range(n_chosen):
            x = first + segments[i]
            if x < len(scores) and scores[x] <= limit:
                good[n] = x
                values[n] = scores[x]
                n += 1
    last = values.dtype.type(kth_smallest(values, n, k))
    better = 0
    for i in range(n):
        if values[i] < last:
            places[better] = good[i]
            better += 1
    ties = 0
    n_free = k - better
    for i in range(n):
        if values[i] != last:
            continue
        ties += 1
        rank = ties - 1 if ties <= n_free else draw_index(rng, ties)
        if rank < n_free:
            places[better + rank] = good[i]


@part_of_kernel
def keep_within(scores, places, slack):
    """Move the locations within `slack` of the best score to the front; return their number.

    If few locations fit hard data, the K-th best location may be much worse than the best location.
    Choosing the K-th best location would then break shapes.
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
def location_of_number(number, n_places, block):
    """Return layer, row and column, in cells, of the location with a number.

    `n_places` has the numbers of rows and columns of locations.
    """
    ny, nx = n_places
    layer_row = number // nx
    return (
        (layer_row // ny) * block[0],
        (layer_row % ny) * block[1],
        (number - layer_row * nx) * block[2],
    )


@part_of_kernel
def rule_out_continuations(box, before, patches, locations, block, reach, layer, scores):
    """Set the worst score for locations that continue a neighbouring patch almost verbatim.

    Otherwise the training image would be copied patch after patch, because continuations fit best.
    `before`, shape (4,), has the numbers of the neighbouring patches, −1 for none. `patches`, shape
    (n, 10), and `locations`, shape (n, 3), include all patches of the realization. `scores` begin
    with layer `layer` of locations.
    """
    worst = scores.dtype.type(2 ** (8 * scores.itemsize - 1) - 1)
    for number in before:
        if number < 0:
            continue
        z = (locations[number, 0] + box.z0 - patches[number, 0]) // block[0] - layer
        y = (locations[number, 1] + box.y0 - patches[number, 1]) // block[1]
        x = (locations[number, 2] + box.x0 - patches[number, 2]) // block[2]
        last_z = z + reach[0] + min(reach[0], 1) + 1
        for pz in range(max(z - reach[0], 0), min(last_z, scores.shape[0])):
            for py in range(max(y - reach[1], 0), min(y + reach[1] + 2, scores.shape[1])):
                for px in range(max(x - reach[2], 0), min(x + reach[2] + 2, scores.shape[2])):
                    scores[pz, py, px] = worst
