"""Statistics of an ensemble that are updated realization by realization."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics.bands import Band, RunningCurves
from ccwsim.metrics.connectivity import connectivity
from ccwsim.metrics.etype import EType, add_counts, etype_of_counts, proportions
from ccwsim.metrics.lags import DirectionName, axes_of, lags_that_fit
from ccwsim.metrics.stack import Codes, Images, as_image, checked_codes, index_of
from ccwsim.metrics.variograms import variogram
from ccwsim.model.arrays import as_integers, check_int
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid


@dataclass(frozen=True, eq=False)
class RunningSummary:
    """Statistics of the first n realizations."""

    n: int
    etype: EType
    proportions: Band
    """Band of the share of each facies, shape (n_facies,)."""
    lags: NDArray[np.int64]
    variograms: dict[tuple[int, DirectionName], Band]
    """Bands of γ(h) by (facies code, direction), over the lags that fit the images."""
    connectivity: dict[tuple[int, DirectionName], Band]
    """Bands of τ(h), with the same keys as `variograms`."""


class RunningStatistics:
    """Statistics of realizations that are added one by one, in constant memory.

    E-type, entropy, means and extremes are exact; quantiles of curves are accurate to 1/2048 (γ) or
    1/1024 (proportions, τ). An object must not be used by several threads at a time.

    Parameters
    ----------
    shape : tuple of int
        (Layers,) rows and columns of the realizations.
    codes : array_like of int
        The codes of all facies.
    facies : sequence of int, optional
        Codes of the facies with curves; by default all facies, or the second of two facies.
    directions : sequence of str, optional
        Directions of the curves; by default "E-W", "N-S" and, in volumes, "vertical".
    max_lag : int
        Largest lag of the curves, reduced to fit the images.

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
        shape: tuple[int, ...],
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
        self._fitting: dict[DirectionName, NDArray[np.int64]] = {
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
        image = as_image(realization, self.codes, len(self.shape))
        if image.shape != self.shape:
            raise CCWSIMError(f"a realization of shape {self.shape} is needed, not {image.shape}")
        curves = [  # computed before anything is added: cancelling adds no partial realization
            (
                key,
                variogram(image, *key, self._fitting[key[1]]).gamma[0],
                connectivity(image, *key, self._fitting[key[1]], self._neighbours).tau[0],
            )
            for key in self._gamma
        ]
        for key, gamma, tau in curves:
            self._gamma[key].add(gamma)
            self._tau[key].add(tau)
        add_counts(image.indices[0], self._counts)
        self._shares.add(proportions(image)[0])
        self.n += 1

    def summary(self, low: float = 0.1, high: float = 0.9) -> RunningSummary:
        """Return the statistics of all added realizations; bands are from quantile `low` to `high`.

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
