"""Compare two to four settings that are simulated with equal seeds."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise, product
from typing import Any

import numpy as np

from ccwsim import Ensemble, Grid, Parameters, Secondary, TrainingImage
from ccwsim.experiments.trials import Trial, run_trials
from ccwsim.metrics import Anodi, Band, Fit, Scaling, anodi, band, fit_curve
from ccwsim.metrics.bands import STATISTICS, curves_of
from ccwsim.metrics.lags import axes_of, max_lag
from ccwsim.model import (
    MAX_SETTINGS,
    MIN_SETTINGS,
    ArrayLike,
    Cancel,
    Cancelled,
    CCWSIMError,
    Floats,
    Ints,
    Progress,
    Shape,
    Watch,
    refused,
)

SIMULATED, CURVES_DONE = 0.7, 0.85  # share of work finished after simulation, and after curves
LOW_QUANTILE, HIGH_QUANTILE = 0.05, 0.95  # quantiles that bound the bands of curves of a setting
MIN_ERRORS = 2.0  # a difference between settings counts if it exceeds these standard errors


@dataclass(frozen=True, eq=False)
class ComparedCurves:
    """Curves of one statistic of one facies along one direction."""

    lags: Ints  # shape (m,): distances in cells
    reference: Floats  # shape (m,): the training image's curve
    bands: tuple[Band, ...]  # per setting: quantiles 5, 50, 95 % over realizations
    fits: tuple[Fit | None, ...]  # per setting: fit to crops of the training image


def _compared_curves(
    ensembles: Sequence[Ensemble], facies: int | str, watch: Watch
) -> dict[tuple[int, str, str], ComparedCurves]:
    """Return the curves of a facies by (facies code, statistic, direction)."""
    image, shape = ensembles[0].training_image, ensembles[0].study.whole_shape
    code = image.code_of(facies)
    wanted = list(product(STATISTICS, axes_of(shape)))
    ends = pairwise(np.linspace(0, 1, len(wanted) * len(ensembles) + 1).tolist())
    curves: dict[tuple[int, str, str], ComparedCurves] = {}
    for statistic, way in wanted:
        lags = np.arange(max_lag(way, image.shape, shape) + 1)
        bands, fits = [], []
        for ensemble in ensembles:
            low, high = next(ends)
            part = watch.part(low, high)
            each = curves_of(statistic, ensemble, code, way, lags, progress=part.tell)
            bands.append(band(each, LOW_QUANTILE, HIGH_QUANTILE))
            fits.append(fit_curve(ensemble, statistic, code, way))
        reference = curves_of(statistic, image, code, way, lags)[0]
        curves[code, statistic, way] = ComparedCurves(lags, reference, tuple(bands), tuple(fits))
    return curves


@dataclass(frozen=True)
class PairRatio:
    """ANODI ratios of the setting `name` to the setting `other` (Tan et al. 2014)."""

    name: str
    other: str
    between: float  # above 1 if `name` is more varied
    within: float  # above 1 if `name` is farther from the training image
    ratio: float  # between / within, above 1 if `name` is better
    errors: tuple[float, float, float]  # standard errors of the logarithms of the three ratios

    @property
    def grades(self) -> tuple[int, int, int]:
        """Whether each ratio is below 1 (−1), above 1 (1) or close to 1 (0) by standard errors."""
        with np.errstate(divide="ignore"):
            logs = np.log([self.between, self.within, self.ratio])
        told = np.abs(logs) > MIN_ERRORS * np.array(self.errors)  # False where NaN
        between, within, ratio = np.where(told, np.sign(logs), 0).astype(int).tolist()
        return between, within, ratio


@dataclass(frozen=True, eq=False)
class Comparison:
    """Result for settings simulated with the same training image, data, grid and seed."""

    names: tuple[str, ...]
    ensembles: tuple[Ensemble, ...]  # by setting; realizations r have equal seeds
    # keys: facies code, statistic of `STATISTICS`, direction; only for requested facies
    curves: Mapping[tuple[int, str, str], ComparedCurves] = field(default_factory=dict)
    anodi: Anodi | None = None  # None until computed, or if `problem` gives a reason
    # positions of the training image (first) and of the realizations, ordered by setting
    scaling: Scaling | None = None
    problem: str = ""

    @property
    def first(self) -> Ensemble:
        """The realizations of the first setting; all settings have its image, grid and data."""
        return self.ensembles[0]

    @property
    def by_name(self) -> dict[str, Ensemble]:
        """The realizations of each setting, by name."""
        return dict(zip(self.names, self.ensembles, strict=True))

    @cached_property
    def cpu_seconds(self) -> Floats:
        """Mean CPU time of a realization of each setting."""
        return np.array([e.cpu_seconds.mean() for e in self.ensembles])

    @cached_property
    def proportions(self) -> tuple[Floats, ...]:
        """Facies proportions of each setting's realizations, shape (n, n_facies)."""
        return tuple(e.proportions for e in self.ensembles)

    @cached_property
    def distances(self) -> tuple[Floats, ...]:
        """Divergence of each realization from the training image, in bits, for all resolutions."""
        if self.anodi is None:
            return ()
        mixed = self.anodi.weights @ self.anodi.divergence[:, 0]
        return tuple(mixed[self.anodi.owner == k] for k in range(len(self.names)))

    @property
    def distance(self) -> Floats:
        """Mean divergence of each setting from the training image, in bits, for all resolutions."""
        return self._mixed("within")

    @property
    def variety(self) -> Floats:
        """Mean divergence between realizations of each setting, in bits, for all resolutions."""
        return self._mixed("between")

    def _mixed(self, kind: str) -> Floats:
        if self.anodi is None:
            return np.full(len(self.names), np.nan)
        return getattr(self.anodi, kind) @ self.anodi.weights

    @property
    def ratios(self) -> list[PairRatio]:
        """Ratios of each setting to each earlier setting; empty while `anodi` is None."""
        if self.anodi is None:
            return []
        pairs = [(a, b) for k, a in enumerate(self.names) for b in self.names[:k]]
        return [self.ratio_of(a, b) for a, b in pairs]

    def ratio_of(self, name: str, other: str) -> PairRatio:
        """Return the ratios of the setting `name` to `other`, if `anodi` is computed."""
        assert self.anodi is not None
        between, within, ratio = self.anodi.relative(name, other)
        errors = self.anodi.relative_errors(name, other)
        return PairRatio(name, other, between, within, ratio=ratio, errors=errors)


def compare(
    training_image: TrainingImage | ArrayLike,
    grid_shape: Shape | Grid,
    settings: Mapping[str, Parameters | Ensemble],
    hard_data: Any = None,
    n_realizations: int = 10,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
    facies: int | str | None = None,
    on_partial: Callable[[Comparison], None] | None = None,
    secondary: Secondary | None = None,
) -> Comparison:
    """Simulate two to four settings with the same seeds, as by `simulate`, and compare them.

    Realization r has the same random numbers in all settings. Bands of variograms and connectivity
    functions are compared with the training image's curve; pattern histograms are compared by ANODI
    (Tan et al. 2014). If images are too small for patterns, `problem` gives the reason.
    Raises `CCWSIMError` before simulating if there are not 2 to 4 settings, a setting does not fit,
    or the training image lacks the facies.

    A setting can be an ensemble of another method with the same image and grid; it is compared
    without simulation. `facies` is the code of the facies whose curves are compared; by default
    the last.
    `on_partial` is called with the partial result after each setting, curves and patterns.

    Examples
    --------
    >>> import numpy as np
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> both = {"coarse": p, "cells": Parameters(16, 4, method="ccsim")}
    >>> compare(stripes, (40, 50), both, n_realizations=2).ratios[0].name
    'cells'
    """
    base = Trial.of(training_image, grid_shape, None, hard_data, seed=seed, secondary=secondary)
    image = base.training_image
    if facies is not None:
        facies = image.code_of(facies)
    if not MIN_SETTINGS <= len(settings) <= MAX_SETTINGS:
        raise refused("number_of_settings", n=len(settings), low=MIN_SETTINGS, high=MAX_SETTINGS)

    def simulated(trial: Trial | Ensemble, part: Watch) -> Ensemble:
        if isinstance(trial, Ensemble):
            return trial
        return trial.simulate(n_realizations, progress=part.progress, cancel=part.cancel)

    report, n_done = on_partial or (lambda _: None), len(settings) * n_realizations
    watch = Watch(progress, cancel)
    comparison = Comparison((), ())
    ensembles = run_trials(
        [_checked(base, name, setting) for name, setting in settings.items()],
        simulated,
        seconds=[1.0] * len(settings),
        watch=watch.part(0.0, SIMULATED),
        n_pieces=n_realizations,
    )
    for name, ensemble in zip(settings, ensembles, strict=True):
        comparison = Comparison((*comparison.names, name), (*comparison.ensembles, ensemble))
        report(comparison)
    code = int(image.codes[-1]) if facies is None else facies
    comparison = _with_curves(comparison, code, watch.part(SIMULATED, CURVES_DONE, n_done))
    report(comparison)
    comparison = _with_patterns(comparison, watch.part(CURVES_DONE, 1.0, n_done))
    report(comparison)
    return comparison


def add_curves(
    comparison: Comparison,
    facies: int | str,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Comparison:
    """Return a comparison that also has the curves of another facies, given by code or name."""
    n = sum(e.n for e in comparison.ensembles)
    return _with_curves(comparison, facies, Watch(progress, cancel).part(0.0, 1.0, n))


def _checked(base: Trial, name: str, setting: Parameters | Ensemble) -> Trial | Ensemble:
    """Return an ensemble, or the trial of a setting, which must fit."""
    if isinstance(setting, Ensemble):
        return setting
    trial = replace(base, parameters=setting)
    try:
        trial.fitting()
    except CCWSIMError as error:
        raise CCWSIMError(f"setting {name}: {error}") from None
    return trial


def _with_curves(comparison: Comparison, facies: int | str, watch: Watch) -> Comparison:
    more = _compared_curves(comparison.ensembles, facies, watch)
    return replace(comparison, curves={**comparison.curves, **more})


def _with_patterns(comparison: Comparison, watch: Watch) -> Comparison:
    try:
        patterns = anodi(comparison.by_name, comparison.first.training_image, progress=watch.tell)
    except Cancelled:
        raise
    except CCWSIMError as error:  # images are too small for patterns; other results are valid
        return replace(comparison, problem=str(error))
    return replace(comparison, anodi=patterns, scaling=patterns.scaling())
