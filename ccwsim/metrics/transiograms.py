"""Transition probabilities between facies: transiograms along a direction and as a map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.metrics.directions import Direction, as_lags, check_offsets, lag_offsets
from ccwsim.metrics.lag_maps import lags_of_map, overlap_sums, product_sums
from ccwsim.metrics.stack import Fraction, as_indices, as_stack, map_parallel


@dataclass(frozen=True, eq=False)
class Transiograms:
    """Transition probabilities between all facies.

    Attributes
    ----------
    lags : ndarray of int, shape (n_lags,)
        In steps of the direction.
    probability : ndarray, shape (n, n_facies, n_facies, n_lags)
        [image, tail, head, lag]: P(x + h in head | x in tail); NaN where no x is in the tail.
    """

    lags: NDArray[np.int64]
    probability: NDArray[np.float64]


def transiograms(
    images: ArrayLike,
    n_facies: int,
    direction: Direction = "E-W",
    lags: int | Sequence[int] | NDArray[np.integer] = 100,
    progress: Fraction | None = None,
) -> Transiograms:
    """Return P(x + h in head | x in tail) for all pairs of facies (Li 2007).

    x + h lies to the east or the north of x, so the matrix of a lag need not be symmetric.

    Parameters
    ----------
    images : array_like, shape (ny, nx) or (n, ny, nx)
        Facies indices.
    n_facies : int
    direction, lags, progress
        As in `variogram`.

    Raises
    ------
    CCWSIMError
        For lags larger than the image or an unknown direction.

    Examples
    --------
    >>> transiograms([[0, 0, 1, 1]], 2, lags=[1]).probability[0, :, :, 0]
    array([[0.5, 0.5],
           [0. , 1. ]])
    """
    stack = as_indices(images, n_facies)
    steps = as_lags(lags)
    offsets = lag_offsets(direction, steps)
    check_offsets(offsets, stack.shape[1:])
    counted = map_parallel(
        lambda k: _count_transitions(stack[k], n_facies, offsets), len(stack), progress
    )
    counts = np.moveaxis(np.array(counted, dtype=float), 1, 3)
    tails = counts.sum(axis=2, keepdims=True)
    return Transiograms(steps, _ratio(counts, np.broadcast_to(tails, counts.shape)))


def transition_map(
    images: ArrayLike, tail: int, head: int, max_lag: int = 50, progress: Fraction | None = None
) -> NDArray[np.float64]:
    """Return P(x + h in head | x in tail) for all lags up to max_lag, exact, by FFT.

    Parameters
    ----------
    images : array_like, shape (ny, nx) or (n, ny, nx)
        Facies codes or indices.
    tail, head : int
        Which values of the images.
    max_lag : int
    progress : callable, optional
        Called with the share that is done.

    Returns
    -------
    ndarray, shape (n, 2 max_lag + 1, 2 max_lag + 1)
        Rows to the north, columns to the east, lag 0 in the middle.

    Examples
    --------
    >>> transition_map(np.eye(3, dtype=int), 1, 1, 1)[0, 2].tolist()
    [0.0, 0.0, 1.0]
    """
    stack = as_stack(images)
    lags_of_map(max_lag, stack.shape[1:])

    def one(k: int) -> NDArray[np.float64]:
        start = stack[k] == tail
        pairs = product_sums(start, stack[k] == head, max_lag)
        return _ratio(pairs, overlap_sums(start, max_lag))

    return np.array(map_parallel(one, len(stack), progress))


def _ratio(counts: NDArray, totals: NDArray) -> NDArray[np.float64]:
    return np.divide(counts, totals, out=np.full(counts.shape, np.nan), where=totals > 0)


@kernel
def _count_transitions(image, n_facies, offsets):
    """Return how many pairs go from each facies to each, shape (n_lags, n_facies, n_facies)."""
    ny, nx = image.shape
    counts = np.zeros((len(offsets), n_facies, n_facies), np.int64)
    for lag in range(len(offsets)):
        dy, dx = offsets[lag]
        first, last = max(0, -dx), nx - max(0, dx)
        for i in range(max(0, -dy), ny - max(0, dy)):
            for j in range(first, last):
                counts[lag, image[i, j], image[i + dy, j + dx]] += 1
    return counts
