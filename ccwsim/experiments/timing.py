"""CPU time of a realization: against the size of the grid, and against the number of data."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.datasets.sampling import sample_random
from ccwsim.experiments.timing_case import TimingCase, data_cases, grid_cases, usual_seconds
from ccwsim.model.arrays import check_int, frozen
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate
from ccwsim.system.workers import Progress

CELLS_AT_ONCE = 32_000_000
"""Cells of realizations that are kept at a time, one byte each."""


@dataclass(frozen=True, eq=False)
class Timing:
    """What one setting took.

    Attributes
    ----------
    parameters : Parameters
    grid_shape : tuple of int
        Rows and columns.
    n_data : int
        Hard data.
    cpu_seconds : ndarray, shape (n,)
        CPU seconds of each realization, on one thread.
    n_mismatched : ndarray of int, shape (n,)
        Hard data that each realization does not honour.
    """

    parameters: Parameters
    grid_shape: tuple[int, int]
    n_data: int
    cpu_seconds: NDArray[np.float64]
    n_mismatched: NDArray[np.int64]

    @property
    def seconds(self) -> float:
        """The median: one interruption by other work does not change it."""
        return float(np.median(self.cpu_seconds))

    @property
    def n_cells(self) -> int:
        """Cells of the grid."""
        return self.grid_shape[0] * self.grid_shape[1]

    @property
    def case(self) -> TimingCase:
        """What was timed."""
        return TimingCase(self.parameters, self.grid_shape, self.n_data)


def time_study(
    training_image: TrainingImage,
    grid_shape: tuple[int, int] | Grid,
    parameters: Parameters,
    hard_data: HardData | None = None,
    n_realizations: int = 3,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Timing:
    """Measure the CPU time of realizations of a study on one thread.

    Kernels are compiled before the clock starts. The realizations are not kept; few are in memory
    at a time. Turning the training image to a new orientation of the path counts.

    Raises
    ------
    CCWSIMError
        As `simulate`.
    Cancelled
        Where `cancel` returned True; nothing is returned of a setting that is not finished.

    Examples
    --------
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> time_study(stripes, (40, 50), p, n_realizations=2).cpu_seconds.shape
    (2,)
    """
    grid, n = Grid.of(grid_shape), check_int("n_realizations", n_realizations, 1)
    batch = max(min(CELLS_AT_ONCE // (grid.ny * grid.nx), n), 1)
    seconds, wrong = [], []
    for first in range(0, n, batch):

        def report(fraction: float, n_done: int, first: int = first) -> None:
            if progress:
                progress((first + fraction * min(batch, n - first)) / n, first + n_done)

        ensemble = simulate(
            training_image, grid, parameters, hard_data, min(batch, n - first), seed,
            n_workers=1, progress=report, cancel=cancel, first_realization=first,
        )  # fmt: skip
        seconds.append(ensemble.cpu_seconds)
        wrong.append(ensemble.n_mismatched)
    n_data = hard_data.n if hard_data else 0
    measured = frozen(np.concatenate(seconds)), frozen(np.concatenate(wrong))
    return Timing(parameters, grid.shape, n_data, *measured)


def time_grids(
    training_image: TrainingImage,
    sides: Sequence[int],
    parameters: Sequence[Parameters],
    n_realizations: int = 3,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Iterator[Timing]:
    """Yield the times of unconditional runs on square grids, small ones first (Fig. 13).

    Examples
    --------
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> [t.n_cells for t in time_grids(stripes, [40, 20], [p], n_realizations=1)]
    [400, 1600]
    """
    cases = grid_cases(sides, parameters)
    yield from time_cases(training_image, cases, n_realizations, seed, progress, cancel)


def time_data(
    training_image: TrainingImage,
    numbers: Sequence[int],
    parameters: Sequence[Parameters],
    grid_shape: tuple[int, int] = (512, 512),
    n_realizations: int = 3,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Iterator[Timing]:
    """Yield the times of runs with so many data, few first (Table 2).

    The data are sampled from an unconditional realization, as section 5.2 of the paper has it; all
    parameters get the same data, and more data contain fewer ones.

    Examples
    --------
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> [t.n_data for t in time_data(stripes, [9, 0], [p], (40, 50), n_realizations=1)]
    [0, 9]
    """
    cases = data_cases(numbers, parameters, grid_shape)
    yield from time_cases(training_image, cases, n_realizations, seed, progress, cancel)


def time_cases(
    training_image: TrainingImage,
    cases: Sequence[TimingCase],
    n_realizations: int = 3,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Iterator[Timing]:
    """Yield what each case took, in their order; `progress` gets the share of all the work.

    Raises
    ------
    CCWSIMError
        For more data than cells, and as `simulate`.
    Cancelled
        Where `cancel` returned True; what was yielded before stays good.
    """
    seed = check_int("seed", seed, 0)
    for case in cases:
        if not 0 <= case.n_data <= case.n_cells:
            raise CCWSIMError(
                f"{case.n_data} data do not fit a grid of {case.n_cells} cells: ask for fewer"
            )
    work = [usual_seconds(training_image, case) for case in cases]
    done, total, truths = 0.0, sum(work), {}
    for number, case in enumerate(cases):
        if cancel and cancel():
            raise Cancelled(f"stopped after {number} of {len(cases)} settings")

        def report(fraction: float, _: int, number: int = number, done: float = done) -> None:
            if progress:
                progress((done + fraction * work[number]) / total, number)

        if case.n_data and case.grid_shape not in truths:
            truths[case.grid_shape] = _truth(training_image, case, seed)
        data = sample_random(truths[case.grid_shape], case.n_data, seed) if case.n_data else None
        yield time_study(
            training_image, case.grid_shape, case.parameters, data, n_realizations, seed,
            report, cancel,
        )  # fmt: skip
        done += work[number]
        if progress:
            progress(done / total, number + 1)


def _truth(training_image: TrainingImage, case: TimingCase, seed: int) -> NDArray[np.integer]:
    """Return the realization that data are read off; its seed is not that of those timed."""
    level = case.parameters.level
    p = Parameters(case.parameters.template_size, case.parameters.overlap_size, level)
    other = seed + 1 if seed < 2**31 else seed - 1
    return simulate(training_image, case.grid_shape, p, seed=other, n_workers=1).realizations[0]
