"""Joins of geobodies between squares of a map: unions of bodies, loops, and ends.

A map is divided into squares, which are added row by row. A piece of a geobody in a square may
touch earlier squares: it then unites bodies, or it closes a loop, which is a hole that extends over
several squares. Patches of a simulation join bodies in the same way.
"""

import numpy as np

from ccwsim import Ensemble
from ccwsim.metrics.connectivity import connected_geobodies, geobody_statistics
from ccwsim.metrics.reference_band import Fit, fit_values
from ccwsim.metrics.stack import Stack
from ccwsim.model import Mask

JOINS_SIDE, JOINS_MARGIN = 28, 9
"""Side of a square, and width of the margin that an end crosses, in cells."""


def fit_joins(ensemble: Ensemble, facies: int) -> Fit | None:
    """Compare unions, loops and ends of geobodies per 100 squares with crops of the image.

    A square has 28 × 28 cells. A *union* joins two geobodies, a *loop* joins a geobody to itself,
    and an *end* is a piece of a geobody that reaches the middle of a square and crosses the border
    of the square once. The result is None for volumes, and if crops are too small.

    Examples
    --------
    >>> from ccwsim import datasets, simulate
    >>> fit_joins(simulate(datasets.load("channels"), (128, 128)), facies=1).fits
    True
    """
    image = ensemble.training_image
    index = image.index_of(facies)

    def values(images: Stack) -> np.ndarray:
        return 100 * np.array([joins_per_square(each == index) for each in images.indices])

    if image.n_dimensions > 2:
        return None
    return fit_values(
        ensemble,
        ("joins", index),
        np.arange(3.0),
        values,
        min_gap=2.0,
        min_spread=4.0,  # crops may have no loops
        n_errors=3.0,
    )


def joins_per_square(inside: Mask) -> tuple[float, float, float]:
    """Return the unions, loops and ends per square of a map; NaN if no square fits into the map."""
    n, (rows, columns) = JOINS_SIDE, (side // JOINS_SIDE for side in inside.shape)
    n_squares = rows * columns
    if not n_squares:
        return np.nan, np.nan, np.nan
    whole = inside[: rows * n, : columns * n]
    squares = whole.reshape(rows, n, columns, n).swapaxes(1, 2).reshape(-1, n, n)
    apart = np.pad(squares, ((0, 0), (0, 1), (0, 0))).reshape(-1, n)  # an empty row between squares
    bodies, pieces = geobody_statistics(whole, 1), geobody_statistics(apart, 1)
    loops = bodies.n_geobodies - bodies.euler_number - pieces.n_geobodies + pieces.euler_number
    labels, n_pieces = connected_geobodies(apart, 1)
    labels = labels.reshape(-1, n + 1, n)[:, :n]
    on_map = labels.reshape(rows, columns, n, n).swapaxes(1, 2).reshape(whole.shape)
    joins_earlier = np.zeros(n_pieces + 1, bool)  # label 0 is outside the facies
    # columns of squares are compared like rows; squares to the north-west are later
    for later, earlier, corner in ((on_map, whole, -1), (on_map.T, whole.T, n - 1)):
        line = np.pad(earlier[n - 1 : -1 : n], ((0, 0), (1, 1)))
        ahead = line[:, 2:] & (np.arange(earlier.shape[1]) % n != corner)
        joins_earlier[later[n::n][line[:, :-2] | line[:, 1:-1] | ahead]] = True
    unions = n_pieces - np.count_nonzero(joins_earlier[1:]) - bodies.n_geobodies
    border = np.concatenate(
        [labels[:, 0], labels[:, 1:, -1], labels[:, -1, -2::-1], labels[:, -2:0:-1, 0]], axis=1
    )
    crossings = np.bincount(border[border != np.roll(border, 1, axis=1)], minlength=n_pieces + 1)
    crossings[0] = 0
    inner = slice(JOINS_MARGIN, n - JOINS_MARGIN)
    ends = np.count_nonzero(crossings[np.unique(labels[:, inner, inner])] == 1)
    return unions[0] / n_squares, loops[0] / n_squares, ends / n_squares
