"""Mean and quantiles of curves over realizations, computed at once or curve by curve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.metrics.connectivity import connectivity
from ccwsim.metrics.lags import Direction, Lags
from ccwsim.metrics.stack import Fraction, Images
from ccwsim.metrics.variograms import variogram
from ccwsim.model.arrays import as_floats, ratio
from ccwsim.model.errors import CCWSIMError, shown

Statistic = Literal["variogram", "connectivity"]
STATISTICS: tuple[Statistic, ...] = get_args(Statistic)


def curves_of(
    statistic: Statistic,
    images: Images,
    facies: int,
    direction: Direction,
    lags: Lags,
    progress: Fraction | None = None,
) -> NDArray[np.float64]:
    """Return γ(h) or τ(h) of a facies along a direction, with one row for each image."""
    if statistic == "variogram":
        return variogram(images, facies, direction, lags, progress).gamma
    return connectivity(images, facies, direction, lags, progress=progress).tau


@dataclass(frozen=True, eq=False)
class Band:
    """Mean and quantiles of curves over realizations; each array has the shape of one curve.

    Values are NaN at points that are missing in all realizations.
    """

    mean: NDArray[np.float64]
    low: NDArray[np.float64]
    median: NDArray[np.float64]
    high: NDArray[np.float64]
    smallest: NDArray[np.float64]
    largest: NDArray[np.float64]


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
    known = ~np.isnan(values).all(axis=0)
    shape = values.shape[1:]
    rows = np.full((6, *shape), np.nan)
    if known.any():
        present = values[:, known]
        rows[0, known] = np.nanmean(present, axis=0)
        rows[1:, known] = np.nanquantile(present, [low, 0.5, high, 0.0, 1.0], axis=0)
    return Band(*rows)


def _check_quantiles(low: float, high: float) -> None:
    limits = as_floats([low, high], "quantiles")
    if limits.shape != (2,) or not 0 <= limits[0] <= limits[1] <= 1:
        raise CCWSIMError(
            f"quantiles {shown(low)} and {shown(high)} must be probabilities in ascending order"
        )


class RunningCurves:
    """A histogram of values for each point of a curve, updated as curves are added.

    Values must be from `low` to `high`. Mean, smallest and largest value are exact; quantiles are
    accurate to one bin, (high − low) / n_bins.

    Examples
    --------
    >>> curves = RunningCurves(2, 0.0, 1.0)
    >>> curves.add([0.25, 0.5])
    >>> curves.add([0.75, 0.5])
    >>> curves.band().mean
    array([0.5, 0.5])
    """

    def __init__(self, n_points: int, low: float, high: float, n_bins: int = 1024) -> None:
        if n_points < 1 or n_bins < 1 or not low < high:
            raise CCWSIMError(
                f"curves of {n_points} points in {n_bins} bins from {low} to {high} cannot be "
                "counted; give at least one point and bin, and low below high"
            )
        self._low, self._width = low, (high - low) / n_bins
        self._counts = np.zeros((n_points, n_bins), np.int64)
        self._sums = np.zeros(n_points)
        self._smallest = np.full(n_points, np.inf)
        self._largest = np.full(n_points, -np.inf)

    @property
    def nbytes(self) -> int:
        """Memory in bytes, independent of the number of curves."""
        arrays = (self._counts, self._sums, self._smallest, self._largest)
        return sum(array.nbytes for array in arrays)

    def add(self, curve: ArrayLike) -> None:
        """Add one curve, shape (n_points,); NaN stands for a missing value."""
        values = np.asarray(curve, dtype=float)
        if values.shape != self._sums.shape:
            raise CCWSIMError(f"a curve of {len(self._sums)} points is needed, not {values.shape}")
        points = np.flatnonzero(~np.isnan(values))
        present = values[points]
        n_bins = self._counts.shape[1]
        bins = np.floor((present - self._low) / self._width + 1e-9)
        if len(present) and (bins.min() < 0 or bins.max() > n_bins):
            raise CCWSIMError(
                f"a curve from {present.min():g} to {present.max():g} is not inside the bins from "
                f"{self._low:g} to {self._low + n_bins * self._width:g}"
            )
        self._counts[points, np.minimum(bins, n_bins - 1).astype(np.int64)] += 1
        self._sums[points] += present
        self._smallest[points] = np.minimum(self._smallest[points], present)
        self._largest[points] = np.maximum(self._largest[points], present)

    def band(self, low: float = 0.1, high: float = 0.9) -> Band:
        """Return the band of the curves added so far; NaN if no curve was added."""
        _check_quantiles(low, high)
        n = self._counts.sum(axis=1)
        known = n > 0
        mean = ratio(self._sums, n)
        smallest, largest = (
            np.where(known, extreme, np.nan) for extreme in (self._smallest, self._largest)
        )
        quantiles = [np.clip(self._quantile(p, n), smallest, largest) for p in (low, 0.5, high)]
        return Band(mean, quantiles[0], quantiles[1], quantiles[2], smallest, largest)

    def _quantile(self, p: float, n: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the quantile p of each point, interpolated between the centres of bins."""
        ranks = p * np.maximum(n - 1, 0)
        below = np.floor(ranks)
        cumulated = self._counts.cumsum(axis=1)
        first, second = (
            (cumulated <= rank[:, None]).sum(axis=1) for rank in (below, np.ceil(ranks))
        )
        bins = first + (ranks - below) * (second - first)
        return self._low + (bins + 0.5) * self._width
