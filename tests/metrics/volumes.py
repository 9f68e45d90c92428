"""Volumes for tests: random volumes with connected features, and ensembles of given volumes."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from ccwsim import Ensemble, Grid
from ccwsim.model.arrays import frozen
from ccwsim.model.study import Study


def a_volume(seed, shape=(7, 11, 13), codes=(0, 1), smooth=1.0):
    """Return a volume of connected features, with about equal proportions of all facies."""
    field = gaussian_filter(np.random.default_rng(seed).normal(size=shape), smooth)
    limits = np.quantile(field, np.linspace(0, 1, len(codes) + 1)[1:-1])
    return np.array(codes)[np.digitize(field, limits)]


def ensemble_of(training_image, volumes, sources=None):
    """Return an ensemble of the volumes in an array (n, nz, ny, nx)."""
    n, nz, ny, nx = volumes.shape
    indices = np.searchsorted(training_image.codes, volumes).astype(np.uint8)
    return Ensemble(
        Study(training_image, Grid(ny, nx, nz=nz), seed=1, checked=False),
        frozen(indices),
        np.ones(n),
        1.0,
        np.zeros((n, 0), np.int16),
        np.arange(n),
        sources,
    )
