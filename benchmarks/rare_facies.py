"""Images with a rare facies, drawn at random: `python -m benchmarks.fidelity --rare N`.

No setting was chosen on images whose seed is at least 2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy import ndimage

from ccwsim import TrainingImage

Codes = NDArray[np.uint8]


def rare_images(n: int) -> Iterator[tuple[str, TrainingImage]]:
    """Yield n images of each kind, with the names of the kinds."""
    for seed, draw in product(range(1, 1 + n), KINDS):
        yield f"{draw.__name__} {seed}", TrainingImage(draw(np.random.default_rng(seed)))


def discs(rng: Generator) -> Codes:
    """Draw discs that cover 2 % of a map."""
    image, (y, x) = np.zeros((256, 256), np.uint8), np.mgrid[:256, :256]
    while image.mean() < 0.02:
        r, row, column = rng.uniform(3, 6), rng.uniform(0, 256), rng.uniform(0, 256)
        image[(y - row) ** 2 + (x - column) ** 2 < r * r] = 1
    return image


def clasts(rng: Generator) -> Codes:
    """Draw bands that contain small clasts (1.5 %)."""
    field = _smooth((256, 256), (6, 30), rng)
    image, (y, x) = (field > np.quantile(field, 0.7)).astype(np.uint8), np.mgrid[:256, :256]
    inner = np.argwhere(ndimage.binary_erosion(image, iterations=3))
    while (image == 2).mean() < 0.015:
        row, column = inner[rng.integers(len(inner))]
        (wide, high), angle = rng.uniform(1.5, 3.5, 2), rng.uniform(0, np.pi)
        u = (x - column) * np.cos(angle) + (y - row) * np.sin(angle)
        v = (y - row) * np.cos(angle) - (x - column) * np.sin(angle)
        image[(abs(u) < wide) & (abs(v) < high)] = 2
    return image


def clusters(rng: Generator) -> Codes:
    """Draw broad bodies with clusters of a third facies (4 %) at their edges."""
    field = _smooth((300, 300), (18, 18), rng)
    level = np.quantile(field, 0.65)
    image, other = (field > level).astype(np.uint8), _smooth((300, 300), (4, 4), rng)
    other[abs(field - level) >= 0.25] = -9
    image[other > np.quantile(other, 0.96)] = 2
    return image


def balls(rng: Generator) -> Codes:
    """Draw balls (3.2 %) in a volume of elongated bodies."""
    field = _smooth(VOLUME, (3, 5, 25), rng)
    image = (field > np.quantile(field, 0.7)).astype(np.uint8)
    return _with_ellipsoids(image, 2, 0.032, (3, 6), (1.6, 1, 1), rng)


def lentils(rng: Generator) -> Codes:
    """Draw flat lenses (6 %) in a volume."""
    return _with_ellipsoids(np.zeros(VOLUME, np.uint8), 1, 0.06, (6, 12), (4, 1, 0.7), rng)


VOLUME = (40, 120, 120)
KINDS: tuple[Callable[[Generator], Codes], ...] = (discs, clasts, clusters, balls, lentils)


def _with_ellipsoids(
    image: Codes,
    facies: int,
    share: float,
    radii: tuple[float, float],
    scales: tuple[float, ...],
    rng: Generator,
) -> Codes:
    """Add ellipsoids to an image until they cover a share; axis k has a radius of r / scales[k]."""
    axes = np.ogrid[tuple(slice(n) for n in image.shape)]
    while (image == facies).mean() < share:
        r, middle = rng.uniform(*radii), [rng.uniform(0, n) for n in image.shape]
        terms = ((k * (a - m)) ** 2 for k, a, m in zip(scales, axes, middle, strict=True))
        image[sum(terms, np.zeros(image.shape)) < r * r] = facies
    return image


def _smooth(shape: tuple[int, ...], widths: tuple[float, ...], rng: Generator) -> NDArray:
    """Return a Gaussian field with a variance of 1."""
    field = ndimage.gaussian_filter(rng.standard_normal([n + 120 for n in shape]), widths)
    field = field[tuple(slice(60, 60 + n) for n in shape)]
    return field / field.std()
