"""Estimate and measure the CPU time of a realization by grid size and number of data."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from math import prod

import numpy as np
from numpy.typing import NDArray

from ccwsim import CCWSIMError, Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.datasets.sampling import sample_random
from ccwsim.engine.corrections.resimulation import MAX_COMPARED
from ccwsim.engine.prepared_image import fresh_images
from ccwsim.engine.stages.conditioning import MAX_DATA
from ccwsim.experiments.trials import run_trials
from ccwsim.jobs.workers import Cancel, Progress, progress_of_part
from ccwsim.model.arrays import Shape, check_int, frozen
from ccwsim.model.errors import refused

CELLS_AT_ONCE = 32_000_000  # cells of realizations in memory at a time; a cell takes one byte
LINEAR = (0.9, 1.1)  # growth is called linear if the exponent of the cells is in this range


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


@fresh_images()
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
    """Measure the CPU time of realizations of a study on one thread; no realization is stored."""
    grid, n = Grid.of(grid_shape), check_int("n_realizations", n_realizations, 1)
    batch = max(min(CELLS_AT_ONCE // grid.n_cells, n), 1)
    seconds, wrong = [], []
    for first in range(0, n, batch):
        size = min(batch, n - first)
        report = progress_of_part(progress, first / n, (first + size) / n, first)
        study = training_image, grid, parameters, hard_data, size, seed
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
            raise refused("too_many_data_to_time", n_data=case.n_data, n_cells=case.n_cells)
    fields = {}

    def timed(case: TimingCase, report: Callable[..., None]) -> Timing:
        data, shape = None, case.grid_shape
        if case.n_data:
            if shape not in fields:
                fields[shape] = _sampled_field(training_image, case, seed)
            data = sample_random(fields[shape], case.n_data, seed)
        image = image_of_case(training_image, case)
        study = image, case.grid_shape, case.parameters, data, n_realizations, seed
        return time_study(*study, lambda share, _: report(share), cancel)

    work = [_typical(training_image, case) for case in cases]
    yield from run_trials(cases, timed, work, progress, cancel)


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


PER_CELL = 2.5e-8  # seconds to cut and paste a cell of the grid
PER_LOCATION = 4e-10  # seconds to visit one location of the training image in the search
PER_PRODUCT = 1e-12  # mean seconds per overlap coefficient and location
PER_IMAGE_CELL = 6e-9  # seconds to rotate and prepare a cell of the training image
PER_DATUM_SEEN = 5e-11  # seconds to compare a datum with a location
PER_WINDOW_ROW = 3e-10  # seconds to compare a row of a re-simulated window with a location
N_MISSED = 4  # maximum number of re-simulated data in a tile; tiles with more data are split
PER_CELL_OF_VOLUME = 2e-7  # seconds to cut, paste and repair a cell of a volume
PER_LOCATION_OF_VOLUME = 1e-8  # seconds to compare an overlap with a location, by block sums
PER_DATUM_OF_VOLUME = 3e-4  # seconds to honour a datum of a volume
PER_DISORDERED_CELL = 1.2e-5  # seconds to repair a cell of an image without structure, at most
PER_JUDGED_CELL = 1e-7  # seconds to judge a cell of a realization, including copied pieces


def typical_seconds(
    parameters: Parameters,
    image_shape: Shape,
    grid_shape: Shape,
    n_facies: int = 2,
    n_data: int = 0,
    judged: bool = False,
    disorder: float = 0.0,
) -> float:
    """Return about the CPU seconds (to a factor of three) to simulate, and judge, a realization."""
    p = parameters
    repair = prod(grid_shape) * PER_DISORDERED_CELL * disorder if p.repair_seams else 0.0
    if len(grid_shape) == 3:
        return repair + _seconds_of_volume(p, image_shape, grid_shape, n_data, judged)
    size, overlap, level = (along_x for _, _, along_x in p.along(grid_shape))
    block_size, step = 2**level, size - overlap
    cells, locations = grid_shape[0] * grid_shape[1], 1.0
    for side in image_shape:
        locations *= max(side - size, 0) // block_size + 1
    tiles = max(cells / step**2, 1.0)
    dense = n_data * size**2 / (cells * MAX_DATA)
    patches = tiles * min(max(dense, 1.0), (step // overlap) ** 2)
    planes = 1 if n_facies <= 2 else n_facies
    products = planes * (2 * size - overlap) * overlap / block_size**2
    seen = n_data * (p.co_template * size / step) ** 2 * tiles / patches
    return (
        repair
        + cells * (PER_CELL + (PER_JUDGED_CELL if judged else 0.0))
        + patches * locations * (PER_LOCATION + products * PER_PRODUCT)
        + image_shape[0] * image_shape[1] * PER_IMAGE_CELL
        + seen * locations * PER_DATUM_SEEN
        + min(n_data, N_MISSED * tiles) * MAX_COMPARED * size * PER_WINDOW_ROW
    )


def _seconds_of_volume(
    parameters: Parameters, image_shape: Shape, grid_shape: Shape, n_data: int, judged: bool
) -> float:
    """Return the CPU seconds of a volume; at level 0, the search takes most of the time."""
    lengths, cells = parameters.along(grid_shape), prod(grid_shape)
    sides = zip(image_shape, lengths.template, lengths.level, strict=True)
    locations = prod(max(side - size, 0) // 2**level + 1 for side, size, level in sides)
    steps = (t - overlap for t, overlap in zip(lengths.template, lengths.overlap, strict=True))
    tiles = max(cells / prod(steps), 1.0)
    return (
        cells * (PER_CELL_OF_VOLUME + (PER_JUDGED_CELL if judged else 0.0))
        + tiles * locations * PER_LOCATION_OF_VOLUME
        + n_data * PER_DATUM_OF_VOLUME
    )
