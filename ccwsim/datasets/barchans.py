"""Crescent sand bodies, each with a slip face on its lee side."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from ccwsim.datasets.fields import gaussian_field, smoothed, without_specks


def barchans(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw interdune (0), slip faces (1) and sand bodies (2); the wind blows to the north-east."""
    pad, lee = 24, (9, 8)
    wide = (shape[0] + pad, shape[1] + pad)
    bodies = gaussian_field(wide, 20, rng, ratio=0.62, azimuth=125)
    bodies += 0.3 * gaussian_field(wide, 9, rng) + 0.08 * gaussian_field(wide, 3, rng)
    high = bodies > np.quantile(bodies, 0.66)
    moved = np.roll(high, lee, axis=(0, 1))
    facies = np.where(moved, 1, 0)
    facies[high & ~np.roll(moved, lee, axis=(0, 1))] = 2
    facies = smoothed(facies[pad:, pad:], 1.3)
    return without_specks(facies, 60)
