"""Quality of an ensemble in a few numbers, for comparing settings and methods."""

from dataclasses import dataclass
from math import nan
from typing import cast

import numpy as np

from ccwsim import Ensemble
from ccwsim.jobs.workers import check_stop
from ccwsim.metrics.connectivity import connectivity
from ccwsim.metrics.copying import copying
from ccwsim.metrics.etype import facies_counts, proportions
from ccwsim.metrics.lags import VERTICAL, Direction, axes_of, max_lag
from ccwsim.metrics.patterns import pattern_distance
from ccwsim.metrics.reference_band import moments
from ccwsim.metrics.stack import Codes, Images, Stack, as_stack
from ccwsim.model import Array, Ints

CELLS_COMPARED = 1_000_000  # number of cells of each realization that are compared at a time


@dataclass(frozen=True)
class Quality:
    """Similarity of an ensemble to the training image, match with the data, and CPU time.

    `Ensemble` defines the counts of hard data; `Quality` contains their means over realizations.
    Spreads are standard deviations between realizations, and NaN for one realization.
    """

    n: int
    pattern_distances: tuple[float, float, float]
    """Mean Jensen–Shannon divergence in bits of the patterns of realizations from the training
    image, at full, half and third resolution. Patterns have 4 × 4 or 3 × 3 × 3 cells."""
    pattern_spread: float
    """Spread of the realizations' divergences, each a mean over the three resolutions."""
    tau_errors: tuple[float, ...]
    """|mean τ(h) of the realizations − τ(h) of the training image|, averaged over lags with both
    values, along E–W, N–S and, in volumes, vertically. NaN if no lag has both values. Realizations
    with inactive cells count in `Study.whole_window`, because inactive cells cut geobodies."""
    facies: int
    """Code of the facies whose τ(h) is compared."""
    differing: float
    """Share of the cells in which two realizations differ, mean of all pairs; NaN for one."""
    n_resimulated: float
    n_forced: float
    n_mismatched: float
    cpu_seconds: float
    """Median CPU time of a realization in seconds."""
    proportion_error: float = nan
    """Largest relative error of the mean proportion of a facies; −0.4 is 40 % less than in the
    image."""
    proportion_facies: int = 0
    """Code of the facies with the largest relative error of the proportion."""
    proportion_spread: float = nan
    tau_spreads: tuple[float, ...] = (nan, nan)
    """Spread of τ(h), averaged over the lags, along each axis of `tau_errors`."""
    largest_copied: float = nan
    """Mean size in cells of the largest piece copied from the image; NaN without sources."""
    copied_spread: float = nan

    @property
    def pattern_distance(self) -> float:
        """Mean of `pattern_distances` over the three resolutions, in bits."""
        return float(np.mean(self.pattern_distances))

    @property
    def tau_error(self) -> float:
        """Largest of `tau_errors`."""
        return self._of_worse_axis(self.tau_errors)

    @property
    def tau_spread(self) -> float:
        """Spread of τ(h) along the axis with the largest error."""
        return self._of_worse_axis(self.tau_spreads)

    def _of_worse_axis(self, values: tuple[float, ...]) -> float:
        return values[int(np.argmax(np.nan_to_num(self.tau_errors, nan=-1.0)))]


def judge(ensemble: Ensemble, facies: int | str | None = None) -> Quality:
    """Judge an ensemble by patterns, connectivity, proportions, copying, data and CPU time.

    Measuring copied pieces needs an ensemble with `sources`. τ(h) is computed for `facies`, by
    default the last facies. Raises `CCWSIMError` for a grid smaller than a pattern.

    Examples
    --------
    >>> from ccwsim import Parameters, simulate
    >>> stripes = np.tile([[0], [0], [1], [1]], (16, 64))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> quality = judge(simulate(stripes, (40, 50), p, n_realizations=2))
    >>> quality.tau_errors, quality.n_mismatched
    ((0.0, 0.0), 0.0)
    """
    image = ensemble.training_image
    code = int(image.codes[-1 if facies is None else image.index_of(facies)])
    each = pattern_distance(ensemble, image)
    tau = [_tau_error(ensemble, code, way) for way in axes_of(image.shape)]
    relative = proportions(ensemble) / image.proportions - 1
    worst = int(np.abs(relative.mean(axis=0)).argmax())
    sources = () if ensemble.sources is None else ensemble.sources
    # sources in other images do not count
    positions = [np.where(one < image.indices.size, one, -1) for one in sources]
    copied = np.array([copying(one, image.shape).largest_block for one in positions], float)
    return Quality(
        n=ensemble.n,
        pattern_distances=cast(tuple[float, float, float], tuple(each.mean(axis=0).tolist())),
        pattern_spread=_spread(each.mean(axis=1)),
        tau_errors=tuple(error for error, _ in tau),
        facies=code,
        differing=differing_share(ensemble),
        n_resimulated=float(ensemble.n_resimulated.mean()),
        n_forced=float(ensemble.n_forced.mean()),
        n_mismatched=float(ensemble.n_mismatched.mean()),
        cpu_seconds=float(np.median(ensemble.cpu_seconds)),
        proportion_error=float(relative[:, worst].mean()),
        proportion_facies=int(image.codes[worst]),
        proportion_spread=_spread(relative[:, worst]),
        tau_spreads=tuple(spread for _, spread in tau),
        largest_copied=float(copied.mean()) if len(copied) else nan,
        copied_spread=_spread(copied),
    )


def _spread(each: Array) -> float:
    """Return the standard deviation between realizations; NaN for fewer than two."""
    return float(each.std(ddof=1)) if len(each) > 1 else nan


def differing_share(images: Images, codes: Codes | None = None) -> float:
    """Return the share of cells in which two realizations differ, averaged over all pairs.

    If c realizations have a facies in a cell, c (c − 1) / 2 pairs of realizations agree in this
    cell. The numbers of pairs are summed over facies. Unknown cells do not count. The share is NaN
    for a single realization.

    Examples
    --------
    >>> differing_share([[[0, 1]], [[1, 1]]])
    0.5
    """
    stack = as_stack(images, codes)
    n, nx = len(stack), stack.shape[-1]
    if n < 2:
        return nan
    lines = stack.indices.reshape(n, -1, nx)
    rows, agree, n_pairs = max(CELLS_COMPARED // nx, 1), 0, 0
    for first in range(0, lines.shape[1], rows):
        check_stop()
        counts = facies_counts(Stack(lines[:, first : first + rows], stack.codes)).astype(np.int64)
        agree += int((counts * (counts - 1)).sum())
        n_pairs += int((counts.sum(axis=0) * (counts.sum(axis=0) - 1)).sum())
    return 1 - agree / n_pairs if n_pairs else nan


def lags_of(ensemble: Ensemble, way: Direction = "E-W") -> Ints:
    """Return the lags at which τ(h) is compared: 1 to the largest useful lag of grid and image."""
    grid_shape = ensemble.study.whole_shape
    image_shape = ensemble.training_image.array.shape
    directions = (VERTICAL,) if way == VERTICAL else ("E-W", "N-S")
    return np.arange(1, min(max_lag(way, grid_shape, image_shape) for way in directions) + 1)


def _tau_error(ensemble: Ensemble, facies: int, way: Direction) -> tuple[float, float]:
    """Return the error of the mean τ(h) and the spread of τ(h), both averaged over the lags."""
    lags = lags_of(ensemble, way)
    if not len(lags):
        return nan, nan
    reference = connectivity(ensemble.training_image, facies, way, lags).tau[0]
    whole = ensemble.indices[(slice(None), *ensemble.study.whole_window)]
    tau = connectivity(Stack(whole, ensemble.training_image.codes), facies, way, lags).tau
    mean, spreads = moments(tau)
    errors, several = np.abs(mean - reference), ~np.isnan(spreads)
    if np.isnan(errors).all():
        return nan, nan
    spread = float(spreads[several].mean()) if several.any() else nan
    return float(np.nanmean(errors)), spread
