"""Volumes: sinuous channels, stacked lenses and folded layers."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from tools.datasets.fields import gaussian_field

Shape = tuple[int, int, int]
SAND_SHARE, SHALE_SHARE = 0.27, 0.58
"""Target shares of sand and of shale; channels or lenses are added until a share is reached."""
BEDS_SEED = 8
DEEPEST_FOLD = 60
"""Number of cells by which beds extend below and above a volume."""


def sinuous_channels(shape: Shape, rng: RandomState) -> NDArray[np.uint8]:
    """Draw sand channels with flat tops and rounded bases, at random depths in mud."""
    nz, ny, nx = shape
    facies = np.zeros(shape, np.uint8)
    z, y, x = np.arange(nz)[:, None, None], np.arange(ny)[None, :, None], np.arange(nx)
    while facies.mean() < SAND_SHARE:
        half_width, depth = rng.uniform(5, 8), rng.uniform(4, 7)
        top, middle = rng.uniform(0, nz + depth), rng.uniform(-0.1, 1.1) * ny
        amplitude, length = rng.uniform(8, 16), rng.uniform(70, 110)
        wander = 5 * gaussian_field((1, nx), 40, rng)[0]
        angle = 2 * np.pi * (x / length + rng.uniform())
        centre = middle + rng.uniform(-0.15, 0.15) * (x - nx / 2) + amplitude * np.sin(angle)
        centre = centre + wander
        slope = np.gradient(centre)
        across = (y[0] - centre) / np.sqrt(1 + slope**2) / half_width
        bottom = top - depth * np.sqrt(np.maximum(1 - across**2, 0))
        facies[(z <= top) & (z > bottom) & (np.abs(across) < 1)] = 1
    return facies


def stacked_lenses(shape: Shape, rng: RandomState) -> NDArray[np.uint8]:
    """Draw sand lenses with flat bases, rounded tops and basal gravel; the lenses lie in shale."""
    nz, ny, nx = shape
    facies = np.zeros(shape, np.uint8)
    z, y, x = np.arange(nz)[:, None, None], np.arange(ny)[:, None], np.arange(nx)
    while (facies == 0).mean() > SHALE_SHARE:
        long, wide, high = rng.uniform(18, 32), rng.uniform(9, 15), rng.uniform(4, 8)
        angle = np.radians(rng.normal(25, 10))
        dy, dx = y - rng.uniform(0, ny), x - rng.uniform(0, nx)
        along, across = (
            dx * np.cos(angle) + dy * np.sin(angle),
            dy * np.cos(angle) - dx * np.sin(angle),
        )
        height = high * np.maximum(1 - (along / long) ** 2 - (across / wide) ** 2, 0)
        above = z - rng.uniform(-high, nz)
        inside = (above >= 0) & (above < height)
        facies[inside] = 1
        facies[inside & (above < 0.35 * height)] = 2
    return facies


def folded_layers(shape: Shape, rng: RandomState) -> NDArray[np.uint8]:
    """Draw a stack of beds of four facies that are folded and faulted together.

    All volumes have the same beds of one formation; folds and fault differ between volumes.
    """
    nz, ny, nx = shape
    fold = 7 * gaussian_field((ny, nx), 55, rng, ratio=0.5, azimuth=30)
    y, x = np.arange(ny)[:, None], np.arange(nx)
    fault = np.where(x - 0.4 * y > 0.45 * nx, 5.0, 0.0)
    depth = np.arange(nz)[:, None, None] + (fold + fault)[None]
    beds = RandomState(BEDS_SEED)
    tops, codes = [float(-DEEPEST_FOLD)], [int(beds.randint(4))]
    while tops[-1] < nz + DEEPEST_FOLD:
        tops.append(tops[-1] + beds.uniform(2.5, 6.5))
        codes.append((codes[-1] + 1 + int(beds.randint(3))) % 4)  # not the facies below
    return np.array(codes, np.uint8)[np.searchsorted(tops, depth)]
