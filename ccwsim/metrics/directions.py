"""Directions and lags: which cells x + h a statistic of two points compares with x."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccwsim.model.arrays import as_array
from ccwsim.model.errors import CCWSIMError, shown

STEPS = {"E-W": (0, 1), "N-S": (1, 0), "NE-SW": (1, 1), "NW-SE": (1, -1)}
"""One lag of each named direction in rows (to the north) and columns (to the east)."""

MOST = 1_000_000
"""No lag is longer."""

Direction = str | float | tuple[int, int]
"""A name of `STEPS`, an azimuth in degrees clockwise from north, or (rows, columns) of one lag."""


def lag_offsets(direction: Direction, lags: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the (rows, columns) from x to x + h for each lag, shape (n_lags, 2).

    A named direction and a pair (rows, columns) take `lag` whole steps; an azimuth goes `lag`
    cells far and is rounded to the nearest cell.

    Raises
    ------
    CCWSIMError
        For a direction that is none of these.

    Examples
    --------
    >>> lag_offsets("NE-SW", np.array([0, 2])).tolist()
    [[0, 0], [2, 2]]
    >>> lag_offsets(90.0, np.array([3])).tolist()
    [[0, 3]]
    """
    if isinstance(direction, str):
        if direction not in STEPS:
            known = ", ".join(STEPS)
            raise CCWSIMError(f"direction {shown(direction)} must be one of {known}, or an azimuth")
        return np.outer(lags, STEPS[direction]).astype(np.int64)
    if isinstance(direction, (int, float, np.integer, np.floating)):
        if isinstance(direction, bool) or not abs(direction) < MOST:
            raise CCWSIMError(f"direction {shown(direction)} must be an azimuth in degrees")
        angle = np.deg2rad(float(direction))
        return np.rint(np.outer(lags, [np.cos(angle), np.sin(angle)])).astype(np.int64)
    step = as_array(direction, "direction")
    if step.shape != (2,) or step.dtype.kind not in "ui" or not step.any():
        raise CCWSIMError(f"direction {shown(direction)} must be two whole numbers, not both 0")
    if max(abs(int(step[0])), abs(int(step[1]))) > MOST:
        raise CCWSIMError(f"direction {shown(direction)} must have numbers of at most {MOST}")
    return np.outer(lags, step.astype(np.int64))


def as_lags(lags: int | Sequence[int] | NDArray[np.integer]) -> NDArray[np.int64]:
    """Return 0 … lags for a number, or the given lags as an array.

    Raises
    ------
    CCWSIMError
        For lags that are not whole numbers from 0 on.

    Examples
    --------
    >>> as_lags(3), as_lags([1, 5])
    (array([0, 1, 2, 3]), array([1, 5]))
    """
    array = as_array(lags, "lags")
    if array.dtype.kind not in "ui" or array.ndim > 1 or array.size == 0 or array.min() < 0:
        raise CCWSIMError(f"lags = {shown(lags)} must be whole numbers of steps from 0 on")
    if array.max() > MOST:
        raise CCWSIMError(f"lags = {shown(lags)} must be at most {MOST} steps")
    return np.arange(int(array) + 1) if array.ndim == 0 else array.astype(np.int64)


def check_offsets(offsets: NDArray[np.int64], shape: tuple[int, int]) -> None:
    """Say which lag is longer than the image.

    Raises
    ------
    CCWSIMError
        Where no pair of cells is that far apart.
    """
    far = np.flatnonzero((np.abs(offsets) >= shape).any(axis=1))
    if len(far):
        rows, columns = offsets[far[0]]
        raise CCWSIMError(
            f"lag no. {far[0]} of {rows} rows and {columns} columns does not fit an image of "
            f"{shape[0]} × {shape[1]}; give a smaller largest lag"
        )
