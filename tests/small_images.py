"""Small training images for tests of the engine, generated from a seed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage


def noise(shape: tuple[int, ...], n_facies: int, seed: int = 0) -> NDArray[np.uint8]:
    """Return independent random cells of all facies, so that large patches are unique."""
    rng = np.random.default_rng(seed)
    image = rng.integers(0, n_facies, shape).astype(np.uint8)
    image.flat[: min(n_facies, image.size)] = np.arange(min(n_facies, image.size))
    return image


def blobs(shape: tuple[int, ...], n_facies: int, seed: int = 0) -> NDArray[np.uint8]:
    """Return smooth bodies of all facies with about equal proportions."""
    rng = np.random.default_rng(seed)
    field = ndimage.gaussian_filter(rng.normal(size=shape), 2.5, mode="wrap")
    limits = np.quantile(field, np.arange(1, n_facies) / n_facies)
    return np.digitize(field, limits).astype(np.uint8)


def facies_at_edges() -> NDArray[np.uint8]:
    """Return 72 × 96 cells with three facies; facies 0 (18 %) is mostly at the edges."""
    field = ndimage.gaussian_filter(np.random.default_rng(6).normal(size=(72, 96)), 4)
    return np.digitize(field, [-0.05, 0.05]).astype(np.uint8)


def places_of(patch: NDArray, image: NDArray) -> NDArray[np.int64]:
    """Return row and column, shape (n, 2), of all locations where `image` contains `patch`."""
    windows = np.lib.stride_tricks.sliding_window_view(image, patch.shape)
    return np.argwhere((windows == patch).all(axis=(2, 3)))
