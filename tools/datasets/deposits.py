"""Images from thresholds of fields and from stacking: barchans, dunes and sand lenses."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from tools.datasets.fields import Floats, gaussian_field, ridge_field, smoothed, without_specks


def barchans(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw interdune (0), slip faces (1) and sand (2); the wind blows to the north-east."""
    pad, lee = 24, (9, 8)
    wide = (shape[0] + pad, shape[1] + pad)
    sand = gaussian_field(wide, 20, rng, ratio=0.62, azimuth=125)
    sand += 0.3 * gaussian_field(wide, 9, rng) + 0.08 * gaussian_field(wide, 3, rng)
    high = sand > np.quantile(sand, 0.66)
    moved = np.roll(high, lee, axis=(0, 1))
    facies = np.where(moved, 1, 0)
    facies[high & ~np.roll(moved, lee, axis=(0, 1))] = 2
    facies = smoothed(facies[pad:, pad:], 1.3)
    return without_specks(facies, 60)


def dunes(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw interdune (0), dune sand (1) and slip faces (2)."""
    pad = 16
    wide = (shape[0] + pad, shape[1] + pad)
    relief = ridge_field(wide, 30, 20, 11, rng) + 0.12 * gaussian_field(wide, 4, rng)
    relief += 0.2 * gaussian_field(wide, 60, rng)
    crest = relief > np.quantile(relief, 0.66)
    lee = np.roll(crest, (-5, 2), axis=(0, 1)) & ~crest
    facies = np.where(crest, 1, np.where(lee, 2, 0))
    facies = smoothed(facies[:-pad, pad:], 1.2)
    return without_specks(facies, 50)


def lenses(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw shale (0), sand (1) and basal gravel (2) in a section; younger lenses cut older ones."""
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
    """Cut one lens into the facies: a nearly flat top, a deeper base, and gravel at the thalweg."""
    t = np.clip(across, -1, 1)
    body = (1 - t**2) * (1 + skew * t)
    base = -thick * body
    roof = 0.25 * thick * body
    inside = (np.abs(across) < 1) & (above > base) & (above < roof)
    facies[inside] = 1
    facies[inside & (above < base + 0.42 * thick * body - 0.08 * thick)] = 2
