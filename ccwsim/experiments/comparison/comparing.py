"""Simulate settings alike and compare them, the cheap parts first."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

from ccwsim.experiments.comparison.curves import compared_curves
from ccwsim.experiments.comparison.result import Comparison
from ccwsim.metrics import anodi
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate
from ccwsim.system.workers import Progress

FEWEST, MOST = 2, 4
SIMULATED, CURVED = 0.7, 0.85
"""Shares of the progress at which simulation and curves are finished; patterns take the rest."""

SoFar = Callable[[Comparison], None]
"""Called with what is known so far, each time there is more."""


def compare(
    training_image: TrainingImage,
    grid_shape: tuple[int, int] | Grid,
    settings: Mapping[str, Parameters],
    hard_data: HardData | None = None,
    n_realizations: int = 10,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Callable[[], bool] | None = None,
    facies: int | None = None,
    so_far: SoFar | None = None,
) -> Comparison:
    """Simulate two to four settings alike and compare them.

    Parameters
    ----------
    training_image : TrainingImage
    grid_shape : pair of int or Grid
    settings : mapping of str to Parameters
        From 2 to 4, by name.
    hard_data : HardData, optional
    n_realizations, seed : int
        The same for all settings.
    progress : callable, optional
        Called as progress(fraction, n_done) over all of it; n_done counts realizations.
    cancel : callable, optional
        Asked as often; returns True to stop.
    facies : int, optional
        Place in the codes of the facies whose curves are compared; the last where left out.
    so_far : callable, optional
        Called with what is known: after each setting, then with curves, then with patterns.

    Raises
    ------
    CCWSIMError
        For another number of settings, or one that does not fit; nothing is simulated then.
    Cancelled
        Where `cancel` returned True.

    Examples
    --------
    >>> import numpy as np
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> both = {"coarse": p, "cells": Parameters(16, 4, method="ccsim")}
    >>> compare(stripes, (40, 50), both, n_realizations=2).ratios[0].name
    'cells'
    """
    data, grid = hard_data or HardData(), Grid.of(grid_shape)
    _check(training_image, grid, settings, data, seed)
    course = Course(progress, cancel, len(settings) * n_realizations)
    tell = so_far or (lambda _: None)
    found = Comparison((), ())
    for k, (name, parameters) in enumerate(settings.items()):
        course.check()
        ensemble = simulate(
            training_image, grid, parameters, data, n_realizations, seed, cancel=cancel,
            progress=partial(course.simulating, k, len(settings), n_realizations),
        )  # fmt: skip
        found = Comparison((*found.names, name), (*found.ensembles, ensemble))
        tell(found)
    first = training_image.n_facies - 1 if facies is None else facies
    found = _with_curves(found, first, course, SIMULATED, CURVED)
    tell(found)
    found = _with_patterns(found, course, CURVED, 1.0)
    tell(found)
    return found


def add_curves(
    comparison: Comparison,
    facies: int,
    progress: Progress | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Comparison:
    """Return a comparison with the curves of one more facies (a place in the codes)."""
    n = sum(e.n for e in comparison.ensembles)
    return _with_curves(comparison, facies, Course(progress, cancel, n), 0.0, 1.0)


@dataclass(frozen=True)
class Course:
    """Progress and cancel over all steps."""

    progress: Progress | None
    cancel: Callable[[], bool] | None
    n: int

    def simulating(self, k: int, n_settings: int, each: int, share: float, n_done: int) -> None:
        if self.progress:
            self.progress(SIMULATED * (k + share) / n_settings, k * each + n_done)

    def check(self) -> None:
        if self.cancel and self.cancel():
            raise Cancelled("the comparison was stopped")

    def at(self, low: float, high: float, share: float) -> None:
        self.check()
        if self.progress:
            self.progress(low + share * (high - low), self.n)


def _check(
    image: TrainingImage, grid: Grid, settings: Mapping[str, Parameters], data: HardData, seed: int
) -> None:
    if not FEWEST <= len(settings) <= MOST:
        raise CCWSIMError(f"{len(settings)} settings were given; compare {FEWEST} to {MOST}")
    for name, parameters in settings.items():
        try:
            Study(image, grid, parameters, data, seed)
        except CCWSIMError as error:
            raise CCWSIMError(f"setting {name}: {error}") from None


def _with_curves(
    found: Comparison, facies: int, course: Course, low: float, high: float
) -> Comparison:
    more = compared_curves(found.ensembles, facies, partial(course.at, low, high))
    return replace(found, curves={**found.curves, **more})


def _with_patterns(found: Comparison, course: Course, low: float, high: float) -> Comparison:
    image = found.ensembles[0].training_image
    stacks = {n: e.indices for n, e in zip(found.names, found.ensembles, strict=True)}
    try:
        report = partial(course.at, low, high)
        patterns = anodi(stacks, image.indices, image.n_facies, progress=report)
    except Cancelled:
        raise
    except CCWSIMError as error:  # an image too small for its patterns: the rest still holds
        return replace(found, problem=str(error))
    return replace(found, anodi=patterns, scaling=patterns.scaling())
