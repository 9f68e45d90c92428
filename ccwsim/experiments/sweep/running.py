"""Simulate and judge setting after setting."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.experiments.sweep.cost import expected_seconds
from ccwsim.metrics import Quality, judge
from ccwsim.model.arrays import check_int
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate
from ccwsim.system.workers import Progress

ERRORS = {
    "patterns": lambda quality: quality.pattern_distance,
    "connection": lambda quality: quality.tau_error,
    "mended": lambda quality: quality.n_resimulated + quality.n_forced,
}
"""What a setting may be blamed for, as numbers of its `Quality`; less is better."""


@dataclass(frozen=True, eq=False)
class Row:
    """One setting of a sweep, and what came out.

    Attributes
    ----------
    parameters : Parameters
    quality : Quality
    realizations : ndarray of uint8, shape (n_kept, ny, nx)
        The first few, as facies indices.
    """

    parameters: Parameters
    quality: Quality
    realizations: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Sweep:
    """What a sweep found.

    Attributes
    ----------
    rows : tuple of Row
        The settings that were finished, in the order they were asked for.
    failed : tuple of (Parameters, str)
        Settings that could not be simulated, and why.
    n_asked : int
        How many settings were asked for.
    image_shape : pair of int
        Of the training image.
    """

    rows: tuple[Row, ...]
    failed: tuple[tuple[Parameters, str], ...]
    n_asked: int
    image_shape: tuple[int, int]

    @property
    def stopped(self) -> bool:
        """Whether it was cancelled before all settings were tried."""
        return len(self.rows) + len(self.failed) < self.n_asked

    @property
    def times(self) -> NDArray[np.float64]:
        """CPU seconds of a realization, by setting."""
        return np.array([row.quality.cpu_seconds for row in self.rows])

    def errors(self, kind: str = "patterns") -> NDArray[np.float64]:
        """Return one of `ERRORS`, by setting."""
        return np.array([ERRORS[kind](row.quality) for row in self.rows], dtype=float)


def sweep(
    training_image: TrainingImage,
    grid_shape: tuple[int, int] | Grid,
    settings: Sequence[Parameters],
    hard_data: HardData | None = None,
    n_realizations: int = 4,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Callable[[], bool] | None = None,
    found: Callable[[Row], None] | None = None,
    n_kept: int = 2,
    facies: int | None = None,
) -> Sweep:
    """Simulate each setting from the same seed, on one thread for fair times, and judge it.

    Parameters
    ----------
    training_image, grid_shape, hard_data, seed
        As in `simulate`.
    settings : sequence of Parameters
        As `settings` gives them.
    n_realizations : int
        Of each setting.
    progress : callable, optional
        Called as progress(fraction, n_done), n_done settings of all; the fraction is of the
        expected time.
    cancel : callable, optional
        Returns True to stop; what is finished by then is returned.
    found : callable, optional
        Called with each `Row` as it comes.
    n_kept : int
        How many realizations of each setting are kept.
    facies : int, optional
        Place of the facies whose connection is judged.

    Raises
    ------
    CCWSIMError
        Where there is no setting.

    Examples
    --------
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> tried = [Parameters(8, 2, 1), Parameters(16, 4, 1)]
    >>> sweep(stripes, (40, 50), tried, n_realizations=2).errors().shape
    (2,)
    """
    if not len(settings):
        raise CCWSIMError("there is no setting to try: give ranges that fit together")
    n, grid = check_int("n_realizations", n_realizations, 1), Grid.of(grid_shape)
    data = HardData() if hard_data is None else hard_data
    sizes = training_image.shape, grid.shape, training_image.n_facies, data.n
    ahead = np.cumsum([0.0, *(expected_seconds(p, *sizes) for p in settings)])
    rows: list[Row] = []
    failed: list[tuple[Parameters, str]] = []
    for k, parameters in enumerate(settings):
        if cancel and cancel():
            break

        def report(share: float, _: int, k: int = k) -> None:
            if progress:
                progress((ahead[k] + share * (ahead[k + 1] - ahead[k])) / ahead[-1], k)

        try:
            ensemble = simulate(
                training_image, grid, parameters, data, n, seed, n_workers=1, progress=report,
                cancel=cancel,
            )  # fmt: skip
            row = Row(parameters, judge(ensemble, facies), _first(ensemble.indices, n_kept))
        except Cancelled:
            break
        except CCWSIMError as error:
            failed.append((parameters, str(error)))
            continue
        rows.append(row)
        if found:
            found(row)
        report(1.0, n, k)
    if progress and len(rows) + len(failed) == len(settings):
        progress(1.0, len(settings))
    return Sweep(tuple(rows), tuple(failed), len(settings), training_image.shape)


def _first(indices: NDArray[np.uint8], n: int) -> NDArray[np.uint8]:
    """Return a read-only copy of the first n, so that the others can be given back."""
    kept = indices[: max(n, 1)].copy()
    kept.setflags(write=False)
    return kept
