"""Ensembles for tests of metrics: given images as realizations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim import Ensemble, Grid, HardData, Parameters, TrainingImage


def ensemble_of(
    image: TrainingImage, indices: NDArray[np.integer], sources: NDArray[np.int32] | None = None
) -> Ensemble:
    """Return maps or volumes, as indices of facies, as realizations of a training image."""
    n, grid = len(indices), Grid.of(indices.shape[1:])
    study = image, grid, Parameters(), HardData(), 0
    run = np.ones(n), 1.0, np.zeros((n, 0), np.int16), np.arange(n), sources
    return Ensemble(*study, indices.astype(np.uint8), *run)
