"""Curves of realizations, and their bands over realizations."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ccwsim.metrics.connectivity import connectivity
from ccwsim.metrics.lags import Direction, Lags
from ccwsim.metrics.stack import Fraction, Images
from ccwsim.metrics.variograms import variogram, variogram_of_values
from ccwsim.model import ArrayLike, CCWSIMError, Floats, as_floats, refused, shown

Statistic = Literal["variogram", "connectivity", "values"]
STATISTICS: tuple[Statistic, ...] = ("variogram", "connectivity")
"""The statistics of a facies; "values" is the variogram of a continuous variable."""


def curves_of(
    statistic: Statistic,
    images: Images,
    facies: int,
    direction: Direction,
    lags: Lags,
    progress: Fraction | None = None,
) -> Floats:
    """Return γ(h) or τ(h) of a facies, or γ(h) of values, with one row for each image."""
    if statistic == "values":
        return variogram_of_values(images, direction, lags, progress).gamma
    if statistic == "variogram":
        return variogram(images, facies, direction, lags, progress).gamma
    return connectivity(images, facies, direction, lags, progress=progress).tau


@dataclass(frozen=True, eq=False)
class Band:
    """Mean and quantiles of curves over realizations; each array has the shape of one curve.

    Values are NaN at points that are missing in all realizations.
    """

    mean: Floats
    low: Floats
    median: Floats
    high: Floats
    smallest: Floats
    largest: Floats


def band(curves: ArrayLike, low: float = 0.1, high: float = 0.9) -> Band:
    """Return the band of the curves of realizations, such as `Variogram.gamma`.

    `curves` has shape (n, …); missing values are NaN. `low` and `high` are the probabilities of
    the lower and the upper quantile; `CCWSIMError` is raised unless 0 ≤ low ≤ high ≤ 1.

    Examples
    --------
    >>> band([[0.0, 1.0], [0.0, 3.0]]).mean
    array([0., 2.])
    """
    values = as_floats(curves, "curves")
    if values.ndim < 2 or not len(values):
        raise CCWSIMError(f"curves of shape (n, n_lags) are needed, not {values.shape}")
    _check_quantiles(low, high)
    valid = ~np.isnan(values).all(axis=0)
    rows = np.full((6, *values.shape[1:]), np.nan)
    if valid.any():
        present = values[:, valid]
        rows[0, valid] = np.nanmean(present, axis=0)
        quantile = np.nanquantile if np.isnan(present).any() else np.quantile  # 20 × faster
        rows[1:, valid] = quantile(present, [low, 0.5, high, 0.0, 1.0], axis=0)
    mean, lower, median, upper, smallest, largest = rows
    return Band(mean=mean, low=lower, median=median, high=upper, smallest=smallest, largest=largest)


def _check_quantiles(low: float, high: float) -> None:
    limits = as_floats([low, high], "quantiles")
    if limits.shape != (2,) or not 0 <= limits[0] <= limits[1] <= 1:
        raise refused("quantiles", low=shown(low), high=shown(high))
