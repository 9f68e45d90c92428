"""A river delta: a trunk channel that divides repeatedly towards the sea."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from tools.datasets.curves import Curve, ease, painted
from tools.datasets.fields import Floats, gaussian_field, smoothed, wave, without_specks

SPREAD = 0.9
"""Half of the angle of the fan, in radians."""


@dataclass(frozen=True)
class Reach:
    """A channel from one fork to the next, with the start in polar coordinates and the sector."""

    radius: float
    angle: float
    sector: tuple[float, float]
    half_width: float


def delta(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw mud (0), distributary channels (1) and mouth bars (2); the sea lies to the east."""
    size = float(min(shape))
    apex = np.array([0.13 * shape[1], 0.5 * shape[0]])
    curves = [_trunk(apex, 0.028 * size, rng)]
    tips: list[tuple[float, float]] = []
    open_reaches = [Reach(0.0, 0.0, (-SPREAD, SPREAD), 0.028 * size)]
    while open_reaches:
        reach = open_reaches.pop()
        course, ahead = _grown(reach, 0.74 * shape[1], rng)
        curves.append(_on_map(course, apex))
        open_reaches += ahead
        if not ahead:
            tips.append((course.x[-1], course.y[-1]))
    facies = _mouth_bars(tips, apex, shape, rng).astype(np.uint8) * 2
    facies[painted(curves, shape)] = 1
    return without_specks(smoothed(facies, 0.7), 30)


def _trunk(apex: Floats, half_width: float, rng: RandomState) -> Curve:
    x = np.arange(-20.0, apex[0] + 1)
    swing = 6 * wave(len(x), 70, 0.3, rng) * ease((apex[0] - x) / 25)
    return Curve(x, apex[1] + swing, np.full(len(x), half_width))


def _grown(reach: Reach, front: float, rng: RandomState) -> tuple[Curve, list[Reach]]:
    """Return the course of a reach (angle as x, radius as y), and the reaches that fork off."""
    low, high = reach.sector
    end = reach.radius + front * rng.uniform(0.12, 0.20)
    is_last = end > 0.86 * front
    if is_last:
        end = front * rng.uniform(0.92, 1.06)
    radius = np.arange(reach.radius, end, 1.0)
    share = np.linspace(0, 1, len(radius))
    target = 0.5 * (low + high) + 0.12 * (high - low) * rng.uniform(-1, 1)
    room = min(7.0, 0.12 * (high - low) * end)
    sway = room * np.sin(np.pi * share) * wave(len(radius), 60, 0.3, rng) / np.maximum(radius, 25)
    angle = reach.angle + (target - reach.angle) * ease(share) + sway
    taper = 1 - 0.45 * share**3 if is_last else 1 - 0.1 * share
    course = Curve(angle, radius, reach.half_width * taper)
    return course, [] if is_last else _forked(reach, end, target, rng)


def _forked(reach: Reach, radius: float, angle: float, rng: RandomState) -> list[Reach]:
    """Return two channels that share the sector, or sometimes one channel."""
    low, high = reach.sector
    width = 0.9 * reach.half_width
    if radius > 80 and rng.uniform() < 0.12:
        return [Reach(radius, angle, reach.sector, width)]
    share = rng.uniform(0.38, 0.62)
    middle = low + share * (high - low)
    return [
        Reach(radius, angle, (low, middle), width * (0.45 + 0.8 * share)),
        Reach(radius, angle, (middle, high), width * (0.45 + 0.8 * (1 - share))),
    ]


def _on_map(course: Curve, apex: Floats) -> Curve:
    x = apex[0] + course.y * np.cos(course.x)
    y = apex[1] + course.y * np.sin(course.x)
    return Curve(x, y, course.half_width)


def _mouth_bars(
    tips: list[tuple[float, float]], apex: Floats, shape: tuple[int, int], rng: RandomState
) -> NDArray[np.bool_]:
    """Return the mask of the mouth bars: lobes at the ends of the channels, in the sea."""
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    ragged = 0.22 * gaussian_field(shape, 8, rng)
    bars = np.zeros(shape, bool)
    for angle, radius in tips:
        east, north = columns - apex[0], rows - apex[1]
        along = east * np.cos(angle) + north * np.sin(angle) - radius - 2
        across = north * np.cos(angle) - east * np.sin(angle)
        length, width = rng.uniform(12, 18), rng.uniform(8, 12)
        bars |= np.hypot(along / length, across / width) + ragged < 1
    return bars
