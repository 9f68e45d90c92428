"""Probability of connection τ(h) along a direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from ccwsim.engine.kernels import kernel
from ccwsim.metrics.directions import Direction, as_lags, check_offsets, lag_offsets
from ccwsim.metrics.stack import Fraction, as_image, as_stack, in_pieces, map_parallel
from ccwsim.model.arrays import check_int
from ccwsim.model.errors import CCWSIMError, shown

_TOUCHING = {4: ndimage.generate_binary_structure(2, 1), 8: np.ones((3, 3), bool)}


@dataclass(frozen=True, eq=False)
class Connectivity:
    """Probability of connection of one facies.

    Attributes
    ----------
    lags : ndarray of int, shape (n_lags,)
        In steps of the direction.
    tau : ndarray, shape (n, n_lags)
        P(x and x + h in one body | both in the facies); NaN where no such pair exists.
    unconditional : ndarray, shape (n, n_lags)
        P(x and x + h in one body), over all pairs of cells.
    neighbours : int
        4 or 8: which cells count as touching.
    """

    lags: NDArray[np.int64]
    tau: NDArray[np.float64]
    unconditional: NDArray[np.float64]
    neighbours: int


def connected_geobodies(
    image: NDArray[np.integer], facies: int, neighbours: int = 8
) -> tuple[NDArray[np.int32], int]:
    """Number the connected bodies of a facies.

    Parameters
    ----------
    image : ndarray, shape (ny, nx)
        Facies codes or indices.
    facies : int
        Which value of the image.
    neighbours : int
        4 (sides) or 8 (sides and corners).

    Returns
    -------
    labels : ndarray of int32, shape (ny, nx)
        0 outside the facies, else the number of the body from 1 on.
    n_bodies : int

    Raises
    ------
    CCWSIMError
        For other neighbours than 4 or 8.

    Examples
    --------
    >>> connected_geobodies(np.eye(3, dtype=int), 1, neighbours=4)[1]
    3
    """
    if not isinstance(neighbours, (int, np.integer)) or neighbours not in _TOUCHING:
        raise CCWSIMError(f"neighbours = {shown(neighbours)} must be 4 or 8")
    inside = as_image(image) == check_int("facies", facies, -(2**31), 2**31)
    labels = np.empty(inside.shape, np.int32)
    ndimage.label(inside, _TOUCHING[neighbours], output=labels)
    return labels, int(labels.max())


def connectivity(
    images: ArrayLike,
    facies: int,
    direction: Direction = "E-W",
    lags: int | Sequence[int] | NDArray[np.integer] = 100,
    neighbours: int = 8,
    progress: Fraction | None = None,
) -> Connectivity:
    """Return the probability of connection τ(h) of a facies (Renard & Allard 2013).

    Two cells are connected where a chain of touching cells of the facies joins them anywhere in
    the image. Pairs are counted exactly; nothing is normalised to another image.

    Parameters
    ----------
    images : array_like, shape (ny, nx) or (n, ny, nx)
        Facies codes or indices.
    facies : int
        Which value of the images.
    direction : str, float or pair of int
        "E-W", "N-S", "NE-SW", "NW-SE", an azimuth in degrees from north, or one lag as
        (rows, columns).
    lags : int or sequence of int
        The largest lag, or the lags.
    neighbours : int
        4 or 8.
    progress : callable, optional
        Called with the share that is done.

    Raises
    ------
    CCWSIMError
        For lags larger than the image, an unknown direction, or other neighbours than 4 or 8.

    Examples
    --------
    >>> connectivity([[1, 1, 0, 1]], 1, lags=[1, 3]).tau
    array([[1., 0.]])
    """
    stack = as_stack(images)
    steps = as_lags(lags)
    offsets = lag_offsets(direction, steps)
    check_offsets(offsets, stack.shape[1:])

    def one(k: int) -> NDArray[np.integer]:
        labels = connected_geobodies(stack[k], facies, neighbours)[0]
        return in_pieces(lambda some: _count_pairs(labels, some), offsets, labels.size)

    counts = np.array(map_parallel(one, len(stack), progress), dtype=float)
    both, joined = counts[:, :, 0], counts[:, :, 1]
    tau = np.divide(joined, both, out=np.full(both.shape, np.nan), where=both > 0)
    ny, nx = stack.shape[1:]
    n_pairs = np.prod((ny, nx) - np.abs(offsets), axis=1)
    return Connectivity(steps, tau, joined / n_pairs, neighbours)


@kernel
def _count_pairs(labels, offsets):
    """Return how many pairs are both in the facies, and how many in one body, a lag a row."""
    ny, nx = labels.shape
    counts = np.zeros((len(offsets), 2), np.int64)
    for lag in range(len(offsets)):
        dy, dx = offsets[lag]
        first, last = max(0, -dx), nx - max(0, dx)
        for i in range(max(0, -dy), ny - max(0, dy)):
            here, there = labels[i, first:last], labels[i + dy, first + dx : last + dx]
            both, joined = np.int32(0), np.int32(0)
            for j in range(len(here)):
                both += np.int32((here[j] != 0) & (there[j] != 0))
                joined += np.int32((here[j] != 0) & (here[j] == there[j]))
            counts[lag, 0] += both
            counts[lag, 1] += joined
    return counts
