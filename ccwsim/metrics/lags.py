"""Lags h of two-point statistics, along a direction."""

from collections.abc import Sequence
from typing import Literal, TypeGuard

import numpy as np

from ccwsim.metrics.stack import N_AXES
from ccwsim.model import (
    MAX_LAG,
    CCWSIMError,
    Floats,
    Integers,
    Ints,
    Shape,
    as_array,
    as_integers,
    shown,
)

DirectionName = Literal["E-W", "N-S", "NE-SW", "NW-SE", "vertical"]
DIRECTION_STEPS: dict[DirectionName, tuple[int, int]] = {
    "E-W": (0, 1),
    "N-S": (1, 0),
    "NE-SW": (1, 1),
    "NW-SE": (1, -1),
}
"""Offset of one step in each named direction: rows to the north, columns to the east."""

VERTICAL: DirectionName = "vertical"  # name of the upward direction in volumes, one layer a step

MAX_LAG_STEPS = 1_000_000  # maximum lag in steps

Direction = DirectionName | float | tuple[int, ...]
"""A direction: a name in `DIRECTION_STEPS` or "vertical", an azimuth in degrees from north, or one
step."""

Lags = int | Sequence[int] | Integers
"""Lags of a curve: the largest lag, or a list of lags; by default 0 … 100, as far as they fit."""


def axes_of(shape: Shape) -> tuple[DirectionName, ...]:
    """Return the directions along the axes of a map or volume.

    Examples
    --------
    >>> axes_of((100, 200)), axes_of((48, 100, 200))
    (('E-W', 'N-S'), ('E-W', 'N-S', 'vertical'))
    """
    axes: tuple[DirectionName, ...] = ("E-W", "N-S", VERTICAL)
    return axes[: len(shape)]


def lag_offsets(direction: Direction, lags: Integers, n_axes: int = 2) -> Ints:
    """Return the offset (layers,) rows, columns from x to x + h of each lag."""
    if _is_azimuth(direction):
        angle = np.deg2rad(float(direction))
        offsets = np.rint(np.outer(lags, [np.cos(angle), np.sin(angle)])).astype(np.int64)
    else:
        offsets = np.outer(lags, _step(direction, n_axes))
    return np.pad(offsets, ((0, 0), (n_axes - offsets.shape[1], 0)))


def _is_azimuth(direction: Direction) -> TypeGuard[float]:
    is_number = isinstance(direction, (int, float, np.integer, np.floating))
    if is_number and (isinstance(direction, bool) or not abs(direction) < MAX_LAG_STEPS):
        raise CCWSIMError(f"direction {shown(direction)} must be an azimuth in degrees")
    return is_number


def _step(direction: Direction, n_axes: int) -> Ints:
    """Return one step along a direction as (rows, columns) or (layers, rows, columns)."""
    if isinstance(direction, str):
        if direction == VERTICAL and n_axes < N_AXES:
            raise CCWSIMError('direction "vertical" needs volumes, shape (n, nz, ny, nx)')
        steps = DIRECTION_STEPS if n_axes < N_AXES else {**DIRECTION_STEPS, VERTICAL: (1, 0, 0)}
        if direction not in steps:
            names = ", ".join(steps)
            raise CCWSIMError(f"direction {shown(direction)} must be one of {names}, or an azimuth")
        return np.array(steps[direction])
    step = as_array(direction, "direction")
    if step.shape not in ((2,), (n_axes,)) or step.dtype.kind not in "ui" or not step.any():
        several = "two whole numbers, not both 0"
        if n_axes == N_AXES:
            several = "(rows, columns) or (layers, rows, columns), whole numbers, not all 0"
        raise CCWSIMError(f"direction {shown(direction)} must be {several}")
    return as_integers(step, "direction", -MAX_LAG_STEPS, MAX_LAG_STEPS)


def max_lag(direction: Direction, *shapes: tuple[int, ...]) -> int:
    """Return the largest useful lag: half of the smallest side along a direction, at most 100."""
    sides = np.min(shapes, axis=0)
    step = np.ones(2, int) if _is_azimuth(direction) else np.abs(_step(direction, len(sides)))
    halves = sides[-len(step) :] // 2
    return min(MAX_LAG, int((halves[step > 0] // step[step > 0]).min()))


def distinct_lags(direction: Direction, n_lags: int) -> tuple[Ints, Floats]:
    """Return the lags from 0 to n_lags that have different offsets, and their distances."""
    offsets = lag_offsets(direction, np.arange(n_lags + 1), N_AXES)
    _, first = np.unique(offsets, axis=0, return_index=True)
    lags = np.sort(first)
    return lags, np.hypot.reduce(offsets[lags].astype(float), axis=1)


def lags_within(shape: Shape, direction: Direction, lags: Lags | None) -> tuple[Ints, Ints]:
    """Return the lags, by default as far as they fit up to 100, and their offsets, (n_lags, 3)."""
    if lags is None:
        steps = lags_that_fit(shape, direction, np.arange(MAX_LAG + 1))
    else:
        array = as_array(lags, "lags")
        if array.dtype.kind not in "ui" or array.ndim > 1 or array.size == 0:
            raise CCWSIMError(f"lags = {shown(lags)} must be whole numbers of steps, at least 0")
        steps = as_integers(array, "lags", 0, MAX_LAG_STEPS)
        steps = np.arange(int(steps) + 1) if array.ndim == 0 else steps
    offsets = lag_offsets(direction, steps, len(shape))
    far = np.flatnonzero((np.abs(offsets) >= shape).any(axis=1))
    if len(far):
        *layers, rows, columns = offsets[far[0]]
        across = f"{layers[0]} layers, " if layers else ""
        raise CCWSIMError(
            f"lag no. {far[0]} ({across}{rows} rows and {columns} columns) does not fit an image "
            f"of {' × '.join(map(str, shape))}; reduce the largest lag"
        )
    return steps, np.pad(offsets, ((0, 0), (N_AXES - len(shape), 0)))


def lags_that_fit(shape: Shape, direction: Direction, lags: Ints) -> Ints:
    """Return the lags at which an image has pairs of cells."""
    return lags[(np.abs(lag_offsets(direction, lags, len(shape))) < shape).all(axis=1)]


def count_pairs(shape: Shape, offsets: Ints) -> Ints:
    """Return the number of pairs x, x + h in an image for each offset of `lags_within`."""
    return np.prod(np.array(shape) - np.abs(offsets[:, N_AXES - len(shape) :]), axis=1)
