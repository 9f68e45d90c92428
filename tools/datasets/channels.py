"""Anastomosing channels (they wind, split and rejoin) along a straight course or a bend."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from tools.datasets.curves import Curve, ease, painted, varied_width
from tools.datasets.fields import Floats, wave, without_specks

MARGIN = 60
SPACING = 41.0
CLOSEST = 20.0
ROOM_FOR_LOOP = 32.0
HALF_WIDTH = 3.7
FINEST, COARSEST = 0.55, 1.75
"""Scale of the channel network on the inside and on the outside of the bend."""


def channels(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw sand channels (1) in mud (0) that run from west to east."""
    drawn = painted(channel_network(shape, rng), shape)
    return without_specks(drawn.astype(np.uint8), 40)


def bend(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw sand channels (1) in mud (0) that enter from the north and leave to the east.

    The complex exponential bends a straight network around a pivot north-east of the image. The
    exponential preserves angles, and bends look natural. Channels are thin and dense on the inside
    of the bend, and wide and sparse on the outside.
    """
    size = float(max(shape))
    inner = 0.75 * size
    per_cell = FINEST / inner
    across = int(np.log(COARSEST / FINEST) / per_cell)
    around = int(0.55 * np.pi / per_cell)
    pivot_x, pivot_y = shape[1] + 0.55 * inner, shape[0] + 0.55 * inner
    curves = []
    for flat in channel_network((across, around), rng):
        radius = inner * np.exp(per_cell * flat.y)
        angle = 0.975 * np.pi + per_cell * flat.x
        x, y = pivot_x + radius * np.cos(angle), pivot_y + radius * np.sin(angle)
        curves.append(Curve(x, y, flat.half_width * per_cell * radius))
    return without_specks(painted(curves, shape).astype(np.uint8), 40)


def channel_network(shape: tuple[int, int], rng: RandomState) -> list[Curve]:
    """Return the threads of an anastomosing river, and the branches between threads."""
    x = np.arange(-MARGIN, shape[1] + MARGIN, dtype=float)
    threads = _threads(shape[0], x, rng)
    courses = [(x, y) for y in threads]
    for lower, upper in pairwise(threads):
        courses += _branches(x, lower, upper, rng)
    return [Curve(cx, cy, varied_width(len(cx), HALF_WIDTH, 0.08, rng)) for cx, cy in courses]


def _threads(ny: int, x: Floats, rng: RandomState) -> list[Floats]:
    """Return the courses y(x) of channels, from south to north, with a minimum distance."""
    threads: list[Floats] = []
    for lane in np.arange(-SPACING / 2, ny + SPACING, SPACING):
        bends = 8.5 * wave(len(x), rng.uniform(75, 115), 0.22, rng)
        drift = 7.0 * wave(len(x), 320, 0.5, rng)
        course = lane + rng.uniform(-5, 5) + bends + drift
        if threads:
            course = threads[-1] + CLOSEST + _soft_positive(course - threads[-1] - CLOSEST, 6.0)
        threads.append(course)
    return threads


def _soft_positive(values: Floats, scale: float) -> Floats:
    return scale * np.logaddexp(0, values / scale)


def _branches(
    x: Floats, lower: Floats, upper: Floats, rng: RandomState
) -> list[tuple[Floats, Floats]]:
    """Return branches in the gap between two neighbouring channels, from west to east.

    Most branches connect both channels; if there is room, some leave and rejoin the same channel,
    around an island.
    """
    branches = []
    at = int(rng.uniform(0, 90))
    while at < len(x) - 30:
        gap = upper[at : at + 40] - lower[at : at + 40]
        is_loop = gap.min() > ROOM_FOR_LOOP and rng.uniform() < 0.4
        length = int(rng.uniform(44, 60) if is_loop else 1.35 * gap.mean() + rng.uniform(4, 24))
        here = slice(at, at + length)
        along = np.linspace(0, 1, len(x[here]))
        if is_loop:
            near, side = (lower, 1) if rng.uniform() < 0.5 else (upper, -1)
            course = near[here] + side * rng.uniform(15, 18) * np.sin(np.pi * along) ** 1.2
        else:
            share = ease(along if rng.uniform() < 0.5 else 1 - along)
            course = (1 - share) * lower[here] + share * upper[here]
        branches.append((x[here], course))
        at += length + int(rng.uniform(35, 160))
    return branches
