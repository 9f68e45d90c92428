"""Measure the CPU time of a realization as a function of grid size and of number of data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from math import prod

import numpy as np
from numpy.typing import NDArray

from ccwsim.datasets.sampling import sample_random
from ccwsim.experiments.cost import typical_seconds
from ccwsim.jobs.workers import Cancel, Progress
from ccwsim.model.arrays import Shape, check_int, frozen
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate

CELLS_AT_ONCE = 32_000_000
"""Maximum total number of cells of the realizations in memory; a cell takes one byte."""
LINEAR = (0.9, 1.1)
"""Growth is called linear if the exponent of the number of cells is in this range."""


@dataclass(frozen=True)
class TimingCase:
    """One setting to time; for a map, a 3D training image is replaced by its middle layer."""

    parameters: Parameters
    grid_shape: Shape  # (rows, columns) or (layers, rows, columns)
    n_data: int = 0  # number of hard data; 0 for an unconditional run

    def __post_init__(self) -> None:
        object.__setattr__(self, "grid_shape", Grid.of(self.grid_shape).shape)

    @property
    def n_cells(self) -> int:
        """Number of cells of the grid."""
        return prod(self.grid_shape)


def grid_cases(sides: Sequence[int], parameters: Sequence[Parameters]) -> list[TimingCase]:
    """Return a case for each square grid and each setting, small grids first (Fig. 13)."""
    return [TimingCase(p, (side, side)) for side in sorted(sides) for p in parameters]


def data_cases(
    numbers: Sequence[int], parameters: Sequence[Parameters], grid_shape: Shape
) -> list[TimingCase]:
    """Return a case for each number of data and each setting, small numbers first (Table 2)."""
    return [TimingCase(p, grid_shape, n) for n in sorted(numbers) for p in parameters]


@dataclass(frozen=True, eq=False)
class Timing(TimingCase):
    """The CPU times of a case, one for each realization."""

    cpu_seconds: NDArray[np.float64] = field(kw_only=True)  # CPU seconds on one thread
    n_mismatched: NDArray[np.int64] = field(kw_only=True)  # number of hard data not honoured

    @property
    def seconds(self) -> float:
        """Median CPU time; it hardly changes if other processes interrupt one realization."""
        return float(np.median(self.cpu_seconds))


def time_study(
    training_image: TrainingImage,
    grid_shape: Shape | Grid,
    parameters: Parameters,
    hard_data: HardData | None = None,
    n_realizations: int = 3,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Timing:
    """Measure the CPU time of realizations of a study on one thread, as `simulate` takes it.

    No realization is stored. Times include the preparation of the image for a new orientation.
    """
    grid, n = Grid.of(grid_shape), check_int("n_realizations", n_realizations, 1)
    batch = max(min(CELLS_AT_ONCE // grid.n_cells, n), 1)
    seconds, wrong = [], []
    for first in range(0, n, batch):

        def report(fraction: float, n_done: int, first: int = first) -> None:
            if progress:
                progress((first + fraction * min(batch, n - first)) / n, first + n_done)

        study = training_image, grid, parameters, hard_data, min(batch, n - first), seed
        ensemble = simulate(
            *study, n_workers=1, progress=report, cancel=cancel, first_realization=first
        )
        seconds.append(ensemble.cpu_seconds)
        wrong.append(ensemble.n_mismatched)
    n_data = hard_data.n if hard_data else 0
    return Timing(
        *(parameters, grid.shape, n_data),
        cpu_seconds=frozen(np.concatenate(seconds)),
        n_mismatched=frozen(np.concatenate(wrong)),
    )


def time_cases(
    training_image: TrainingImage,
    cases: Sequence[TimingCase],
    n_realizations: int = 3,
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Iterator[Timing]:
    """Measure and yield the times of each case, in the order of `cases`.

    Data are sampled from an unconditional realization (section 5.2): all cases on one grid use the
    same data, and larger sets contain the smaller. `progress` is called with the fraction of the
    expected time and the number of finished cases. Raises `CCWSIMError` for more data than cells.
    """
    seed = check_int("seed", seed, 0)
    for case in cases:
        if not 0 <= case.n_data <= case.n_cells:
            raise CCWSIMError(
                f"{case.n_data} data do not fit a grid of {case.n_cells} cells: use fewer data"
            )
    work = [_typical(training_image, case) for case in cases]
    ends, fields = list(accumulate(work, initial=0.0)), {}
    for number, case in enumerate(cases):
        if cancel and cancel():
            raise Cancelled(f"stopped after {number} of {len(cases)} settings")

        def report(fraction: float, _: int, number: int = number) -> None:
            if progress:
                progress((ends[number] + fraction * work[number]) / ends[-1], number)

        data, shape = None, case.grid_shape
        if case.n_data:
            if shape not in fields:
                fields[shape] = _sampled_field(training_image, case, seed)
            data = sample_random(fields[shape], case.n_data, seed)
        image = image_of_case(training_image, case)
        study = image, case.grid_shape, case.parameters, data, n_realizations, seed
        yield time_study(*study, report, cancel)
        if progress:
            progress(ends[number + 1] / ends[-1], number + 1)


def image_of_case(training_image: TrainingImage, case: TimingCase) -> TrainingImage:
    """Return the training image of a case; if only the grid is 2D, return the middle layer."""
    if training_image.n_dimensions == len(case.grid_shape):
        return training_image
    middle = training_image.array[training_image.shape[0] // 2]
    return TrainingImage(middle, name=f"middle layer of {training_image.name}")


def _sampled_field(image: TrainingImage, case: TimingCase, seed: int) -> NDArray[np.integer]:
    """Return the field from which data are sampled; timed realizations have other seeds."""
    p = case.parameters
    p = Parameters(p.template_size, p.overlap_size, p.level)
    other = seed + 1 if seed < 2**31 else seed - 1
    return simulate(
        image_of_case(image, case), case.grid_shape, p, seed=other, n_workers=1
    ).realizations[0]


def level_of(p: Parameters) -> int:
    """Return the wavelet level of parameters; in volumes, return the level within layers."""
    return p.level[-1] if isinstance(p.level, tuple) else p.level


@dataclass(frozen=True)
class Growth:
    """Growth of the CPU time with the number of grid cells."""

    # CPU seconds per million cells (least squares of relative errors)
    seconds_per_million: float
    exponent: float  # exponent of the number of cells in a power law; 1 means linear growth

    @property
    def linear(self) -> bool:
        """Whether twice the number of cells takes about twice the time."""
        return LINEAR[0] <= self.exponent <= LINEAR[1]


def growth(timings: Sequence[Timing]) -> Growth:
    """Return how one setting's time grows with the number of grid cells (Fig. 13)."""
    cells = np.array([t.n_cells for t in timings], float)
    seconds = np.array([max(t.seconds, 1e-9) for t in timings])
    if len(np.unique(cells)) < 2:
        raise CCWSIMError("growth needs CPU times for at least two grid sizes")
    exponent = np.polyfit(np.log(cells), np.log(seconds), 1)[0]
    rate = cells / seconds
    return Growth(1e6 * float(rate.sum() / (rate**2).sum()), float(exponent))


def expected_seconds(
    training_image: TrainingImage,
    cases: Sequence[TimingCase],
    n_realizations: int = 1,
    measured: Sequence[Timing] = (),
) -> float:
    """Return the expected CPU seconds for timing the cases."""
    each = (
        _typical(training_image, case) * _slowdown(training_image, case, measured) for case in cases
    )
    return n_realizations * sum(each)


def _typical(training_image: TrainingImage, case: TimingCase) -> float:
    n_facies = training_image.n_facies
    image = training_image.shape[-len(case.grid_shape) :]
    return typical_seconds(case.parameters, image, case.grid_shape, n_facies, case.n_data)


def _slowdown(training_image: TrainingImage, case: TimingCase, measured: Sequence[Timing]) -> float:
    """Return the ratio of measured to expected time of the most similar measured case."""
    if not measured:
        return 1.0

    def unlike(timing: Timing) -> tuple[bool, bool, bool, int, int, float]:
        p, own = timing.parameters, case.parameters
        return (
            len(timing.grid_shape) != len(case.grid_shape),
            p.method != own.method,
            bool(timing.n_data) != bool(case.n_data),
            abs(level_of(p) - level_of(own)),
            abs(timing.n_data - case.n_data),
            abs(np.log(timing.n_cells / case.n_cells)),
        )

    nearest = min(measured, key=unlike)
    return nearest.seconds / _typical(training_image, nearest)
