"""Centrelines of channels and fractures, and the cells that they cover."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray
from scipy.spatial import KDTree

from tools.datasets.fields import Floats, wave


class Curve(NamedTuple):
    """A centreline: points about a cell apart, and the half width at each point, in cells."""

    x: Floats
    y: Floats
    half_width: Floats


def ease(t: Floats) -> Floats:
    """Return a smooth step from 0 at t = 0 to 1 at t = 1, with zero slope at both ends."""
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)


def varied_width(n: int, half_width: float, variation: float, rng: RandomState) -> Floats:
    """Return slowly varying half widths of n points, with the relative variation `variation`."""
    return half_width * (1 + variation * np.clip(wave(n, 60, 0.6, rng), -2, 2))


def meander(
    n: int, wavelength: float, swing: float, rng: RandomState
) -> tuple[Floats, Floats, Floats]:
    """Return x, y and direction of n unit steps of a river that meanders eastwards from (0, 0).

    The direction stays within `swing` degrees (below 90) of the east, so the river never crosses
    itself.
    """
    direction = np.radians(swing) * np.tanh(1.1 * wave(n, wavelength, 0.12, rng))
    return np.cumsum(np.cos(direction)), np.cumsum(np.sin(direction)), direction


def distance_to(curves: Iterable[Curve], shape: tuple[int, int], reach: float = 2.0) -> Floats:
    """Return the distance of each cell to the nearest bank, negative inside a curve.

    Parameters
    ----------
    curves : iterable of Curve
        Centrelines with widths.
    shape : tuple of int
        Rows and columns.
    reach : float
        Maximum distance to compute; the result is infinite in cells farther away.

    Examples
    --------
    >>> straight = Curve(np.array([-5.0, 9.0]), np.array([2.0, 2.0]), np.array([1.5, 1.5]))
    >>> distance_to([straight], (5, 4))[:, 1] < 0
    array([False,  True,  True,  True, False])
    """
    distance = np.full(shape, np.inf)
    for curve in curves:
        far = float(curve.half_width.max()) + reach
        rows = _window(curve.y, far, shape[0])
        columns = _window(curve.x, far, shape[1])
        cells = np.mgrid[rows, columns]
        if cells[0].size == 0:
            continue
        x, y, half_width = _resampled(curve)
        points = np.column_stack([y, x])
        nearest, which = KDTree(points).query(
            np.moveaxis(cells, 0, -1).astype(float), distance_upper_bound=far
        )
        bank = nearest - np.append(half_width, 0.0)[which]
        np.minimum(distance[rows, columns], bank, out=distance[rows, columns])
    return distance


def painted(curves: Iterable[Curve], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the mask of the cells inside any of the curves."""
    return distance_to(curves, shape) < 0


def _window(values: Floats, far: float, size: int) -> slice:
    low, high = int(values.min() - far), int(values.max() + far) + 2
    return slice(min(max(low, 0), size), min(max(high, 0), size))


def _resampled(curve: Curve) -> Curve:
    """Return a curve with a point every half cell, so that banks are smooth."""
    steps = np.hypot(np.diff(curve.x), np.diff(curve.y))
    along = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = np.linspace(0, along[-1], int(2 * along[-1]) + 2)
    return Curve(*(np.interp(wanted, along, part) for part in curve))
