"""A section through stacked sand lenses in shale, each with gravel at its base."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from ccwsim.datasets.fields import Floats, gaussian_field, smoothed, without_specks


def lenses(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw shale (0), sand (1) and basal gravel (2), north up the section; younger cuts older."""
    rows, columns = np.mgrid[: shape[0], : shape[1]].astype(float)
    rows += 5 * gaussian_field(shape, 90, rng, ratio=0.5) + 0.6 * gaussian_field(shape, 8, rng)
    facies = np.zeros(shape, np.uint8)
    n = int((shape[0] + 20) * (shape[1] + 80) / 900)
    for top in np.sort(rng.uniform(-5, shape[0] + 15, n)):
        middle = rng.uniform(-40, shape[1] + 40)
        width = 34 * np.exp(0.4 * rng.standard_normal())
        thick = width * rng.uniform(0.16, 0.26)
        _cut_in(facies, rows - top, (columns - middle) / width, thick, rng.uniform(-0.25, 0.25))
    return without_specks(smoothed(facies, 0.8), 25)


def _cut_in(facies: NDArray, above: Floats, across: Floats, thick: float, skew: float) -> None:
    """Cut one lens: a flat top that sags a little, a deeper base, gravel in the thalweg."""
    t = np.clip(across, -1, 1)
    body = (1 - t**2) * (1 + skew * t)
    base = -thick * body
    roof = 0.25 * thick * body
    inside = (np.abs(across) < 1) & (above > base) & (above < roof)
    facies[inside] = 1
    facies[inside & (above < base + 0.42 * thick * body - 0.08 * thick)] = 2
