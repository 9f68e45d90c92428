"""Variograms and connection of several settings against the training image."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics import Band, band, connectivity, variogram
from ccwsim.model.bounds import MAX_LAG
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError

LOW, HIGH = 0.05, 0.95
"""Quantiles of the bands."""
STATISTICS = ("variogram", "connection")
DIRECTIONS = ("E-W", "N-S")


@dataclass(frozen=True, eq=False)
class ComparedCurves:
    """One statistic of one facies along one direction.

    Attributes
    ----------
    lags : ndarray of int, shape (m,)
        In cells.
    reference : ndarray, shape (m,)
        The training image's curve.
    bands : tuple of Band
        One a setting: quantiles 5, 50 and 95 % over its realizations.
    """

    lags: NDArray[np.int64]
    reference: NDArray[np.float64]
    bands: tuple[Band, ...]

    @property
    def gaps(self) -> NDArray[np.float64]:
        """Mean distance of each setting's median from the training image's curve."""
        gaps = np.abs([b.median - self.reference for b in self.bands])
        known = ~np.isnan(gaps).all(axis=1)
        means = np.full(len(gaps), np.nan)
        means[known] = np.nanmean(gaps[known], axis=1)
        return means


def compared_curves(
    ensembles: Sequence[Ensemble], facies: int, progress: Callable[[float], None]
) -> dict[tuple[int, str, str], ComparedCurves]:
    """Return all curves of a facies (a place in the codes), by (facies, statistic, direction).

    Raises
    ------
    CCWSIMError
        For a facies that the training image does not have.
    """
    n_facies = ensembles[0].training_image.n_facies
    if not 0 <= facies < n_facies:
        raise CCWSIMError(f"facies {facies} must be from 0 to {n_facies - 1}")
    wanted = [(facies, s, d) for s in STATISTICS for d in DIRECTIONS]

    def part(k: int) -> Callable[[float], None]:
        return lambda share: progress((k + share) / len(wanted))

    return {key: _compared(ensembles, key, part(k)) for k, key in enumerate(wanted)}


def _compared(
    ensembles: Sequence[Ensemble], key: tuple[int, str, str], progress: Callable[[float], None]
) -> ComparedCurves:
    image, grid = ensembles[0].training_image, ensembles[0].grid
    axis = 1 if key[2] == "E-W" else 0
    side = min(image.shape[axis], grid.shape[axis])
    lags = np.arange(min(MAX_LAG, side // 2) + 1) if side > 1 else np.zeros(1, int)
    bands = []
    for k, ensemble in enumerate(ensembles):
        each = _curve(key, ensemble.indices, lags, _part(progress, k, len(ensembles)))
        bands.append(band(each, LOW, HIGH))
    return ComparedCurves(lags, _curve(key, image.indices, lags)[0], tuple(bands))


def _curve(key, images, lags, progress=None) -> NDArray[np.float64]:
    facies, statistic, direction = key
    if statistic == "variogram":
        return variogram(images, facies, direction, lags, progress).gamma
    return connectivity(images, facies, direction, lags, progress=progress).tau


def _part(progress: Callable[[float], None], k: int, n: int) -> Callable[[float], None]:
    return lambda share: progress((k + share) / n)
