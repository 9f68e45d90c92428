"""What a comparison of settings gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccwsim.experiments.comparison.curves import ComparedCurves
from ccwsim.metrics import Anodi, Scaling
from ccwsim.model.ensemble import Ensemble


@dataclass(frozen=True)
class PairRatio:
    """One row of the table of ANODI ratios: a setting against another (Tan et al. 2014).

    Attributes
    ----------
    name, other : str
    between : float
        Above 1 where `name` is the more varied one.
    within : float
        Above 1 where `name` lies farther from the training image.
    ratio : float
        between / within: above 1 where `name` is the better one.
    """

    name: str
    other: str
    between: float
    within: float
    ratio: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Settings simulated on one training image, data, grid and seed.

    Attributes
    ----------
    names : tuple of str
    ensembles : tuple of Ensemble
        One a setting; realization r of each has the same random numbers.
    curves : mapping of (facies, statistic, direction) to ComparedCurves
        Of the facies (places in the codes) asked for; a statistic is one of `STATISTICS`, a
        direction one of `DIRECTIONS`.
    anodi : Anodi or None
        None until it is worked out, and where `problem` says why it cannot be.
    scaling : Scaling or None
        Positions of the training image (first) and of all realizations, setting after setting.
    problem : str
    """

    names: tuple[str, ...]
    ensembles: tuple[Ensemble, ...]
    curves: Mapping[tuple[int, str, str], ComparedCurves] = field(default_factory=dict)
    anodi: Anodi | None = None
    scaling: Scaling | None = None
    problem: str = ""

    @cached_property
    def cpu_seconds(self) -> NDArray[np.float64]:
        """Mean CPU time of a realization, by setting."""
        return np.array([e.cpu_seconds.mean() for e in self.ensembles])

    @cached_property
    def proportions(self) -> tuple[NDArray[np.float64], ...]:
        """Facies proportions of the realizations of each setting, shape (n, n_facies)."""
        return tuple(e.proportions for e in self.ensembles)

    @cached_property
    def distances(self) -> tuple[NDArray[np.float64], ...]:
        """Divergence of each realization from the training image in bits, over resolutions."""
        if self.anodi is None:
            return ()
        mixed = self.anodi.weights @ self.anodi.divergence[:, 0]
        return tuple(mixed[self.anodi.owner == k] for k in range(len(self.names)))

    @property
    def distance(self) -> NDArray[np.float64]:
        """Mean divergence from the training image by setting, in bits, over resolutions."""
        return self._mixed(None if self.anodi is None else self.anodi.within)

    @property
    def variety(self) -> NDArray[np.float64]:
        """Mean divergence between realizations by setting, in bits, over resolutions."""
        return self._mixed(None if self.anodi is None else self.anodi.between)

    def _mixed(self, values: NDArray[np.float64] | None) -> NDArray[np.float64]:
        if self.anodi is None or values is None:
            return np.full(len(self.names), np.nan)
        return values @ self.anodi.weights

    @property
    def ratios(self) -> list[PairRatio]:
        """Every setting against each one before it; none while `anodi` is None."""
        if self.anodi is None:
            return []
        pairs = [(a, b) for k, a in enumerate(self.names) for b in self.names[:k]]
        return [PairRatio(a, b, *self.anodi.relative(a, b)) for a, b in pairs]
