"""Patterns and proportions by layer of realizations, compared with crops of their image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics.etype import vertical_proportions
from ccwsim.metrics.patterns import pattern_distance
from ccwsim.metrics.reference_band import (
    CURVE_ERRORS,
    MIN_GAP,
    Fit,
    band_of_crops,
    crop_shape,
    fit_shares,
    fit_values,
)
from ccwsim.metrics.stack import N_AXES, Stack
from ccwsim.model.arrays import check_int
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError

PATTERN_SIZES = (2, 3)
"""Sides of patterns in cells: 2 × 2 × 2 and 3 × 3 × 3 in volumes."""


def fit_patterns(ensemble: Ensemble, sizes: Sequence[int] = PATTERN_SIZES) -> Fit | None:
    """Compare the pattern distances of realizations and of crops from the training image.

    The result has Jensen–Shannon divergences in bits at full resolution, `at` the sizes; those of
    crops are due to their size only. It is None if the training image or the grid is too small for
    crops.

    Examples
    --------
    >>> from ccwsim import Parameters, simulate
    >>> stripes = np.tile([[0], [0], [1], [1]], (16, 64))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> fit_patterns(simulate(stripes, (40, 50), p)).at
    array([2., 3.])
    """
    image, sides = ensemble.training_image, [check_int("pattern size", s, 1) for s in sizes]

    def values(images: Stack) -> NDArray[np.float64]:
        each = (pattern_distance(images, image, None, side, (1,)) for side in sides)
        return np.column_stack([distances[:, 0] for distances in each])

    at, least = np.array(sides, float), np.zeros(len(sides))
    return fit_values(ensemble, ("patterns", *sides), at, values, least)


def fit_vertical_proportions(ensemble: Ensemble, facies: int) -> Fit | None:
    """Compare the share of a facies in each layer of volumes with that of the training image.

    `at` is the layer, 0 at the bottom; `reference` the share in the whole training image. The
    result is None if that has another number of layers, or is too small for crops. Raises
    `CCWSIMError` for maps.

    Examples
    --------
    >>> from ccwsim import Parameters, simulate
    >>> beds = np.tile([[[0]], [[0]], [[1]], [[1]]], (2, 32, 32))
    >>> p = Parameters(template_size=8, overlap_size=2, wavelet_level=1)
    >>> fit_vertical_proportions(simulate(beds, (8, 16, 16), p), 1).reference
    array([0., 0., 1., 1., 0., 0., 1., 1.])
    """
    image, grid = ensemble.training_image, ensemble.indices.shape[1:]
    index = image.index_of(facies)
    if image.n_dimensions != len(grid) or len(grid) != N_AXES:
        raise CCWSIMError("proportions by layer need volumes, not maps")
    shape = crop_shape(image.shape, grid)
    if shape is None or image.shape[0] != grid[0]:
        return None

    def values(images: Stack) -> NDArray[np.float64]:
        return vertical_proportions(images)[:, index]

    p, layers = float(image.proportions[index]), np.arange(float(grid[0]))
    least = np.full(grid[0], MIN_GAP * (p * (1 - p)) ** 0.5)
    crops = band_of_crops(image, ("layers", index), shape, layers, values, CURVE_ERRORS, least)
    own = vertical_proportions(ensemble)[:, index], vertical_proportions(image)[0, index]
    return fit_shares(ensemble, crops, *own)
