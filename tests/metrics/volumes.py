"""Volumes for tests: random ones with features."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter


def a_volume(seed, shape=(7, 11, 13), codes=(0, 1), smooth=1.0):
    """A volume of connected features, each of the facies with about the same share."""
    field = gaussian_filter(np.random.default_rng(seed).normal(size=shape), smooth)
    limits = np.quantile(field, np.linspace(0, 1, len(codes) + 1)[1:-1])
    return np.array(codes)[np.digitize(field, limits)]
