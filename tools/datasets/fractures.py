"""Two sets of fractures; younger fractures end at older ones."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray
from scipy.spatial import KDTree

from tools.datasets.curves import Curve, painted
from tools.datasets.fields import wave, without_specks

CLOSEST = 9.0


def fractures(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw open fractures (1) in tight rock (0)."""
    area = (shape[0] + 80) * (shape[1] + 80)
    older = _fracture_set(int(area / 1100), 18, (60, 220), shape, rng)
    drawn = painted(older, shape)
    younger = _fracture_set(int(area / 700), 112, (30, 110), shape, rng)
    drawn |= painted([_stopped_at(drawn, fracture, shape) for fracture in younger], shape)
    return without_specks(drawn.astype(np.uint8), 25)


def _fracture_set(
    n: int, azimuth: float, lengths: tuple[float, float], shape: tuple[int, int], rng: RandomState
) -> list[Curve]:
    """Return n nearly parallel fractures with thin tips; short fractures are more frequent."""
    fractures: list[Curve] = []
    for _ in range(n):
        fracture = _fracture(azimuth, lengths, shape, rng)
        if not _is_crowded(fracture, fractures):
            fractures.append(fracture)
    return fractures


def _fracture(
    azimuth: float, lengths: tuple[float, float], shape: tuple[int, int], rng: RandomState
) -> Curve:
    short, long = lengths
    length = int(short * (long / short) ** rng.uniform())
    heading = np.radians(azimuth + 6 * rng.standard_normal())
    heading = heading + np.radians(7) * wave(length, 80, 0.5, rng)
    x, y = np.cumsum(np.cos(heading)), np.cumsum(np.sin(heading))
    x += rng.uniform(-40, shape[1] + 40) - x[length // 2]
    y += rng.uniform(-40, shape[0] + 40) - y[length // 2]
    taper = np.sin(np.linspace(0.12, np.pi - 0.12, length)) ** 0.4
    return Curve(x, y, rng.uniform(1.3, 2.1) * taper)


def _is_crowded(fracture: Curve, others: list[Curve]) -> bool:
    """Return whether a fracture is too close to other fractures; new ones rarely form there."""
    if not others:
        return False
    points = np.concatenate([np.column_stack([other.x, other.y]) for other in others])
    nearest, _ = KDTree(points).query(np.column_stack([fracture.x, fracture.y]))
    return bool(np.mean(nearest < CLOSEST) > 0.06)


def _stopped_at(drawn: NDArray[np.bool_], fracture: Curve, shape: tuple[int, int]) -> Curve:
    """Return the middle part of a fracture, up to the drawn fractures on both sides."""
    rows = np.clip(np.rint(fracture.y), 0, shape[0] - 1).astype(int)
    columns = np.clip(np.rint(fracture.x), 0, shape[1] - 1).astype(int)
    met = np.flatnonzero(drawn[rows, columns])
    middle = len(rows) // 2
    before, after = met[met < middle], met[met >= middle]
    first = before[-1] if len(before) else 0
    last = after[0] if len(after) else len(rows) - 1
    if last - first < 2:
        first, last = middle, min(middle + 2, len(rows) - 1)
    return Curve(*(part[first : last + 1] for part in fracture))
