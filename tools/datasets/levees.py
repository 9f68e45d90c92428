"""Meandering rivers on a flood plain, with levees and crevasse splays."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from tools.datasets.curves import Curve, distance_to, meander, painted, varied_width
from tools.datasets.fields import Floats, gaussian_field, smoothed, wave, without_specks

SPACING = 105.0


def levees(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw flood plain (0), levees (1), crevasse splays (2) and channels (3) flowing eastwards."""
    facies = np.zeros(shape, np.uint8)
    for lane in np.arange(0.45 * SPACING, shape[0] - 0.3 * SPACING, SPACING):
        river, direction = _river(lane, shape[1], rng)
        splays = _splays(river, direction, rng)
        bank = distance_to([river], shape, reach=16)
        width = 4.5 + 1.6 * gaussian_field(shape, 22, rng) + 0.6 * gaussian_field(shape, 5, rng)
        facies[painted(splays, shape)] = 2
        facies[bank < width] = 1
        facies[bank < 0] = 3
    return without_specks(smoothed(facies, 0.8), 40)


def _river(lane: float, nx: int, rng: RandomState) -> tuple[Curve, Floats]:
    """Return a river along a lane across the entire image, and the river's direction."""
    x, y, direction = meander(3 * (nx + 200), 120, 80, rng)
    slow = np.convolve(np.pad(y, 150, mode="edge"), np.ones(301) / 301, mode="valid")
    y = lane + (y - slow) + 5 * wave(len(y), 400, 0.5, rng)
    return Curve(x - 100, y, varied_width(len(x), 4.6, 0.08, rng)), direction


def _splays(river: Curve, direction: Floats, rng: RandomState) -> list[Curve]:
    """Return fans of short lobes that break out of some outer banks."""
    turn = np.gradient(np.convolve(direction, np.ones(15) / 15, mode="same"))
    bends = np.flatnonzero(
        (np.abs(turn[1:-1]) >= np.abs(turn[:-2])) & (np.abs(turn[1:-1]) > np.abs(turn[2:]))
    )
    lobes: list[Curve] = []
    for at in bends[np.abs(turn[bends]) > 0.02]:
        if rng.uniform() > 0.3:
            continue
        outward = direction[at] - np.sign(turn[at]) * np.pi / 2
        n_lobes = rng.randint(3, 5)
        headings = outward + np.linspace(-0.7, 0.7, n_lobes) + rng.uniform(-0.1, 0.1, n_lobes)
        breach = float(river.x[at]), float(river.y[at])
        lobes += [_lobe(*breach, heading, rng) for heading in headings]
    return lobes


def _lobe(x: float, y: float, heading: float, rng: RandomState) -> Curve:
    """Return a lobe that is thin at the breach, widens, and has a round end."""
    length = int(rng.uniform(14, 27))
    bent = heading + 0.25 * wave(length, 30, 0.4, rng)
    half_width = 2.0 + rng.uniform(4.5, 6.0) * np.sin(np.linspace(0, 0.6 * np.pi, length))
    return Curve(x + np.cumsum(np.cos(bent)), y + np.cumsum(np.sin(bent)), half_width)
