"""Paths of deviated wells, computed by the minimum curvature method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

STRAIGHT = 1e-6
"""Minimum bend between two stations in radians; with a smaller bend, the path is straight."""


class Stations(NamedTuple):
    """Survey stations: depths along a well with a known direction."""

    depths: NDArray[np.float64]  # depths along the well from 0, shape (n,)
    directions: NDArray[np.float64]  # unit vectors along x, y and z, shape (n, 3)


def positions(
    collar: NDArray[np.float64], stations: Stations, depths: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the positions, shape (n, 3), at given depths along a well, by minimum curvature.

    Between two stations, the path is an arc of length L and bend β, with end tangents t₁ and t₂. At
    length f L, the offset is L / (β sin β) · ([cos (1 − f)β − cos β] t₁ + [1 − cos fβ] t₂).
    """
    starts = [collar]
    for k in range(1, len(stations.depths)):
        start, end = stations.depths[k - 1 : k + 1]
        starts.append(starts[-1] + _gone(stations, k - 1, np.array([end - start]))[0])
    which = np.maximum(np.searchsorted(stations.depths, depths, side="right") - 1, 0)
    places = np.empty((len(depths), 3))
    for k in np.unique(which):
        after_k = which == k
        places[after_k] = starts[k] + _gone(stations, k, depths[after_k] - stations.depths[k])
    return places


def _gone(stations: Stations, k: int, along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the offsets of the path from station k at given lengths after this station."""
    first = stations.directions[k]
    if k + 1 == len(stations.depths):
        return along[:, None] * first
    second, length = stations.directions[k + 1], stations.depths[k + 1] - stations.depths[k]
    bend = bend_between(first, second)
    if bend < STRAIGHT:
        return along[:, None] * first
    share = along / length
    by_first = np.cos((1 - share) * bend) - np.cos(bend)
    by_second = 1 - np.cos(share * bend)
    sums = by_first[:, None] * first + by_second[:, None] * second
    return length / (bend * np.sin(bend)) * sums


def bend_between(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Return the angle between two directions in radians; small angles are accurate, too."""
    return 2 * float(np.arcsin(min(float(np.linalg.norm(second - first)) / 2, 1.0)))
