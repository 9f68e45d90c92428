"""Statistics over realizations, computed at once or updated realization by realization."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ccwsim import Grid
from ccwsim.metrics.connectivity import connectivity
from ccwsim.metrics.etype import EType, add_counts, etype_of_counts, proportions
from ccwsim.metrics.lags import Direction, DirectionName, Lags, axes_of, lags_that_fit
from ccwsim.metrics.stack import Codes, Fraction, Images, as_image, checked_codes, index_of
from ccwsim.metrics.variograms import variogram, variogram_of_values
from ccwsim.model.arrays import (
    ArrayLike,
    Floats,
    Ints,
    Shape,
    as_floats,
    as_integers,
    check_int,
    ratio,
)
from ccwsim.model.errors import CCWSIMError, refused, shown

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
            raise refused("bins_of_curves", n_points=n_points, n_bins=n_bins, low=low, high=high)
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
        counted = n > 0
        mean = ratio(self._sums, n)
        smallest, largest = (
            np.where(counted, extreme, np.nan) for extreme in (self._smallest, self._largest)
        )
        lower, median, upper = (
            np.clip(self._quantile(p, n), smallest, largest) for p in (low, 0.5, high)
        )
        return Band(
            mean=mean, low=lower, median=median, high=upper, smallest=smallest, largest=largest
        )

    def _quantile(self, p: float, n: Ints) -> Floats:
        """Return the quantile p of each point, interpolated between the centres of bins."""
        ranks = p * np.maximum(n - 1, 0)
        below = np.floor(ranks)
        cumulated = self._counts.cumsum(axis=1)
        first, second = (
            (cumulated <= rank[:, None]).sum(axis=1) for rank in (below, np.ceil(ranks))
        )
        bins = first + (ranks - below) * (second - first)
        return self._low + (bins + 0.5) * self._width


@dataclass(frozen=True, eq=False)
class RunningSummary:
    """Statistics of the first n realizations."""

    n: int
    etype: EType
    proportions: Band
    """Band of the share of each facies, shape (n_facies,)."""
    lags: Ints
    variograms: dict[tuple[int, DirectionName], Band]
    """Bands of γ(h) by (facies code, direction), over the lags that fit the images."""
    connectivity: dict[tuple[int, DirectionName], Band]
    """Bands of τ(h), with the same keys as `variograms`."""


class RunningStatistics:
    """Statistics of realizations that are added one by one, in constant memory.

    E-type, entropy, means and extremes are exact; quantiles of curves are accurate to 1/2048 (γ) or
    1/1024 (proportions, τ). An object must not be used by several threads at a time.

    Curves are those of the codes `facies`, by default all facies, or the second of two; along
    `directions`, by default "E-W", "N-S" and, in volumes, "vertical"; and up to the lag `max_lag`,
    reduced to fit realizations of (layers,) rows and columns `shape`.

    Examples
    --------
    >>> running = RunningStatistics((3, 4), [0, 1], max_lag=2)
    >>> for image in (np.zeros((3, 4), int), np.ones((3, 4), int)):
    ...     running.add(image)
    >>> summary = running.summary()
    >>> summary.n, float(summary.etype.entropy.min()), summary.proportions.mean
    (2, 1.0, array([0.5, 0.5]))
    """

    def __init__(
        self,
        shape: Shape,
        codes: Codes,
        facies: Sequence[int] | None = None,
        directions: Sequence[DirectionName] | None = None,
        max_lag: int = 100,
        neighbours: int | None = None,
    ) -> None:
        self.codes = checked_codes(codes)
        n_facies = len(self.codes)
        usual = self.codes if n_facies != 2 else self.codes[1:]
        followed = as_integers(usual if facies is None else facies, "facies").tolist()
        for code in followed:
            index_of(self.codes, code)
        self.shape, self.n = Grid.of(shape).shape, 0
        max_lag = check_int("max_lag", max_lag, 0)
        self._neighbours = neighbours
        self._lags = np.arange(min(max_lag, min(self.shape[-2:]) - 1) + 1)
        if directions is None:
            directions = axes_of(self.shape)
        self._counts = np.zeros((n_facies, *self.shape), np.int32)
        self._shares = RunningCurves(n_facies, 0.0, 1.0)
        self._fitting: dict[DirectionName, Ints] = {
            way: lags_that_fit(self.shape, way, self._lags) for way in directions
        }
        n_lags: dict[tuple[int, DirectionName], int] = {
            (code, way): len(lags) for code in followed for way, lags in self._fitting.items()
        }
        self._gamma = {key: RunningCurves(n, 0.0, 0.5) for key, n in n_lags.items()}
        self._tau = {key: RunningCurves(n, 0.0, 1.0) for key, n in n_lags.items()}

    @property
    def nbytes(self) -> int:
        """Memory in bytes, independent of the number of realizations."""
        curves = [self._shares, *self._gamma.values(), *self._tau.values()]
        return self._counts.nbytes + sum(c.nbytes for c in curves)

    def add(self, realization: Images) -> None:
        """Add one realization of facies codes."""
        stack = as_image(realization, self.codes, len(self.shape))
        if stack.shape != self.shape:
            raise CCWSIMError(f"a realization of shape {self.shape} is needed, not {stack.shape}")
        gammas, taus = {}, {}  # computed before anything is added: cancelling adds nothing
        for code, way in self._gamma:
            lags = self._fitting[way]
            gammas[code, way] = variogram(stack, code, way, lags).gamma[0]
            taus[code, way] = connectivity(stack, code, way, lags, self._neighbours).tau[0]
        for key, gamma in gammas.items():
            self._gamma[key].add(gamma)
            self._tau[key].add(taus[key])
        add_counts(stack.indices[0], self._counts)
        self._shares.add(proportions(stack)[0])
        self.n += 1

    def summary(self, low: float = 0.1, high: float = 0.9) -> RunningSummary:
        """Return the statistics of added realizations; bands extend from quantile `low` to `high`.

        Raises `CCWSIMError` if no realization was added yet.
        """
        return RunningSummary(
            n=self.n,
            etype=etype_of_counts(self._counts, self.codes),
            proportions=self._shares.band(low, high),
            lags=self._lags.copy(),
            variograms={key: c.band(low, high) for key, c in self._gamma.items()},
            connectivity={key: c.band(low, high) for key, c in self._tau.items()},
        )
