"""Volumes for tests: random ones with features, and the nouns that hold them."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from ccwsim import Ensemble, Grid, HardData, Parameters, TrainingImage
from ccwsim.model.arrays import frozen


def a_volume(seed, shape=(7, 11, 13), codes=(0, 1), smooth=1.0):
    """A volume of connected features, each of the facies with about the same share."""
    field = gaussian_filter(np.random.default_rng(seed).normal(size=shape), smooth)
    limits = np.quantile(field, np.linspace(0, 1, len(codes) + 1)[1:-1])
    return np.array(codes)[np.digitize(field, limits)]


def training_image_of(volume):
    """A training image of (nz, ny, nx)."""
    image = TrainingImage(np.reshape(volume, (-1, volume.shape[-1])))
    image.array = frozen(image.array.reshape(volume.shape))
    image.indices = frozen(image.indices.reshape(volume.shape))
    return image


def hard_data_of(cells, facies):
    """Hard data in (layer, row, column)."""
    data = HardData([[k, 0] for k in range(len(cells))], facies)
    data.cells = frozen(np.array(cells, np.int64))
    return data


def ensemble_of(training_image, volumes, sources=None):
    """An ensemble of (n, nz, ny, nx)."""
    n, nz, ny, nx = volumes.shape
    indices = np.searchsorted(training_image.codes, volumes).astype(np.uint8)
    ensemble = Ensemble(
        training_image,
        Grid(nz * ny, nx),
        Parameters(),
        HardData(np.empty((0, 2), int), []),
        1,
        frozen(indices),
        np.ones(n),
        1.0,
        np.zeros((n, 0), np.int16),
        np.arange(n),
        sources,
    )
    ensemble.__dict__["n_mismatched"] = np.zeros(n, int)  # it has no data
    return ensemble
