"""The spread of curves over an ensemble."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.model.arrays import as_floats
from ccwsim.model.errors import CCWSIMError, shown


@dataclass(frozen=True, eq=False)
class Band:
    """Mean and quantiles of curves over realizations, each of the shape of one curve.

    Attributes
    ----------
    mean, low, median, high, smallest, largest : ndarray
        NaN where no realization has a value.
    """

    mean: NDArray[np.float64]
    low: NDArray[np.float64]
    median: NDArray[np.float64]
    high: NDArray[np.float64]
    smallest: NDArray[np.float64]
    largest: NDArray[np.float64]


def band(curves: ArrayLike, low: float = 0.1, high: float = 0.9) -> Band:
    """Return the band of curves, one a realization, such as `Variogram.gamma`.

    Parameters
    ----------
    curves : array_like, shape (n, ...)
        NaN counts as missing.
    low, high : float
        Probabilities of the lower and the upper quantile.

    Raises
    ------
    CCWSIMError
        For no curves, or probabilities that are not 0 ≤ low ≤ high ≤ 1.

    Examples
    --------
    >>> band([[0.0, 1.0], [0.0, 3.0]]).mean
    array([0., 2.])
    """
    values = as_floats(curves, "curves")
    if values.ndim < 2 or not len(values):
        raise CCWSIMError(f"curves of shape (n, n_lags) are needed, not {values.shape}")
    limits = as_floats([low, high], "quantiles")
    if limits.shape != (2,) or not 0 <= limits[0] <= limits[1] <= 1:
        raise CCWSIMError(
            f"quantiles {shown(low)} and {shown(high)} must be probabilities in ascending order"
        )
    known = ~np.isnan(values).all(axis=0)
    shape = values.shape[1:]
    rows = np.full((6, *shape), np.nan)
    if known.any():
        there = values[:, known]
        rows[0, known] = np.nanmean(there, axis=0)
        rows[1:, known] = np.nanquantile(there, [low, 0.5, high, 0.0, 1.0], axis=0)
    return Band(*rows)
