"""Estimate and measure the CPU time of a realization by grid size and number of data."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from math import prod

import numpy as np

from ccwsim import CCWSIMError, Grid, Parameters, TrainingImage
from ccwsim.datasets.sampling import sample_random
from ccwsim.engine.copies import n_cells_of_copies
from ccwsim.engine.corrections.resimulation import MAX_COMPARED_LOCATIONS
from ccwsim.engine.stages.conditioning import MAX_PATCH_DATA
from ccwsim.experiments.plan import value_of
from ccwsim.experiments.trials import Trial, TrialResult, run_trials
from ccwsim.model import (
    Cancel,
    Floats,
    Integers,
    Progress,
    Shape,
    Watch,
    check_int,
    frozen,
    refused,
)

CELLS_AT_ONCE = 32_000_000  # maximum cells of realizations in memory; a cell takes one byte


def data_trials(
    training_image: TrainingImage,
    grid_shape: Shape,
    numbers: Sequence[int],
    parameters: Sequence[Parameters],
    seed: int = 0,
) -> list[Trial]:
    """Return a trial for each number of data and each setting, small numbers first (Table 2).

    Raises `CCWSIMError` for more data than cells.
    """
    grid = Grid.of(grid_shape)
    for n in numbers:
        if not 0 <= n <= grid.n_cells:
            raise refused("too_many_data_to_time", n_data=n, n_cells=grid.n_cells)
    return [
        Trial(training_image, grid, p, seed=seed, n_sampled=n)
        for n in sorted(map(int, numbers))
        for p in parameters
    ]


def time_trial(
    trial: Trial,
    n_realizations: int = 3,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> TrialResult:
    """Measure the CPU time of realizations of a trial on one thread; no realization is stored."""
    n = check_int("n_realizations", n_realizations, 1)
    batch = max(min(CELLS_AT_ONCE // trial.grid.n_cells, n), 1)
    seconds, wrong = [], []
    for first in range(0, n, batch):
        size = min(batch, n - first)
        part = Watch(progress, cancel).part(first / n, (first + size) / n, first)
        ensemble = trial.simulate(
            size,
            n_workers=1,
            progress=part.progress,
            cancel=part.cancel,
            first_realization=first,
        )
        seconds.append(ensemble.cpu_seconds)
        wrong.append(ensemble.n_mismatched)
    return TrialResult(trial, frozen(np.concatenate(seconds)), frozen(np.concatenate(wrong)))


def time_trials(
    trials: Sequence[Trial],
    n_realizations: int = 3,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Iterator[TrialResult]:
    """Measure and yield the times of each trial, in the order of `trials`.

    Data are sampled from an unconditional realization (section 5.2): all trials on one grid use the
    same data, and larger sets contain the smaller. `progress` is called with the fraction of the
    expected time and the number of finished trials.
    """
    fields: dict[Shape, Integers] = {}

    def timed(trial: Trial, part: Watch) -> TrialResult:
        if n_data := trial.n_sampled:
            shape = trial.grid.shape
            if shape not in fields:
                fields[shape] = _field_to_sample(trial)
            trial = replace(trial, hard_data=sample_random(fields[shape], n_data, trial.seed))
        return time_trial(trial, n_realizations, part.progress, part.cancel)

    yield from run_trials(trials, timed, [*map(typical, trials)], Watch(progress, cancel))


def _field_to_sample(trial: Trial) -> Integers:
    """Return the field from which data are sampled; timed realizations have other seeds."""
    p = trial.parameters
    plain = Parameters(p.template_size, p.overlap_size, p.level)
    other = trial.seed + 1 if trial.seed < 2**31 else trial.seed - 1
    return replace(trial, parameters=plain, seed=other).simulate(1, n_workers=1).realizations[0]


def growth(sizes: Floats, seconds: Floats) -> float:
    """Return the exponent of a power law of the CPU time in a size; 1 means linear growth."""
    if len(np.unique(sizes)) < 2:
        raise CCWSIMError("growth needs CPU times for at least two sizes")
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def expected_seconds(
    trials: Iterable[Trial],
    n_realizations: int = 1,
    measured: Sequence[TrialResult] = (),
    judged: bool = False,
) -> float:
    """Return the expected CPU seconds of trials, scaled by the most similar measured trials."""
    each = (typical(trial, judged) * _slowdown(trial, measured) for trial in trials)
    return n_realizations * sum(each)


def _slowdown(trial: Trial, measured: Sequence[TrialResult]) -> float:
    """Return the ratio of measured to expected time of the most similar measured trial."""
    if not measured:
        return 1.0

    def unlike(result: TrialResult) -> tuple[bool, bool, bool, int, int, float]:
        other, p, parameters = result.trial, result.parameters, trial.parameters
        return (
            other.grid.n_dimensions != trial.grid.n_dimensions,
            p.method != parameters.method,
            bool(other.n_data) != bool(trial.n_data),
            abs(value_of(p, "wavelet_level") - value_of(parameters, "wavelet_level")),
            abs(other.n_data - trial.n_data),
            abs(np.log(other.grid.n_cells / trial.grid.n_cells)),
        )

    nearest = min(measured, key=unlike)
    return nearest.seconds / typical(nearest.trial)


def typical(trial: Trial, judged: bool = False) -> float:
    """Return the approximate CPU seconds to simulate, and judge, a realization of a trial.

    Secondary information adds the preparation of its maps and of turned, scaled and further images.
    """
    image, grid = trial.training_image, trial.grid
    seconds = typical_seconds(
        trial.parameters,
        image.shape,
        grid.shape,
        image.n_facies,
        trial.n_data,
        judged=judged,
        disorder=image.disorder,
    )
    if trial.secondary is None:
        return seconds
    guides = trial.secondary.fitted(grid, image)
    copied = n_cells_of_copies(replace(trial, secondary=guides)) - image.indices.size
    n_maps = len(guides.auxiliary) + (guides.probabilities is not None) * (image.n_facies - 1)
    guided = n_maps * (image.indices.size + grid.n_cells)
    active = 1.0 if guides.active is None else float(guides.active.mean())
    return active * seconds + copied * PER_COPIED_CELL + guided * PER_GUIDED_CELL


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
# half of the mean over the first four realizations (channels, 256² cells, angles and scales),
# because the four orientations are prepared once
PER_COPIED_CELL = 1e-8  # seconds to prepare and search a cell of turned, scaled or further images
PER_GUIDED_CELL = 1.5e-8  # seconds per cell of image and grid for each map of guides
PER_JUDGED_CELL = 1.6e-7  # seconds to judge a cell of a realization, including copied pieces


def typical_seconds(
    parameters: Parameters,
    image_shape: Shape,
    grid_shape: Shape,
    n_facies: int = 2,
    n_data: int = 0,
    judged: bool = False,
    disorder: float = 0.0,
) -> float:
    """Return the CPU seconds, within a factor of three, to simulate and judge a realization."""
    p = parameters
    repair = prod(grid_shape) * PER_DISORDERED_CELL * disorder if p.repair_seams else 0.0
    if len(grid_shape) == 3:
        return repair + _seconds_of_volume(p, image_shape, grid_shape, n_data, judged)
    size, overlap, level = (along_x for _, _, along_x in p.along(grid_shape))
    block_size, step = 2**level, size - overlap
    n_cells, locations = grid_shape[0] * grid_shape[1], 1.0
    for side in image_shape:
        locations *= max(side - size, 0) // block_size + 1
    tiles = max(n_cells / step**2, 1.0)
    dense = n_data * size**2 / (n_cells * MAX_PATCH_DATA)
    patches = tiles * min(max(dense, 1.0), (step // overlap) ** 2)
    planes = 1 if n_facies <= 2 else n_facies
    products = planes * (2 * size - overlap) * overlap / block_size**2
    seen = n_data * (p.co_template * size / step) ** 2 * tiles / patches
    return (
        repair
        + n_cells * (PER_CELL + (PER_JUDGED_CELL if judged else 0.0))
        + patches * locations * (PER_LOCATION + products * PER_PRODUCT)
        + image_shape[0] * image_shape[1] * PER_IMAGE_CELL
        + seen * locations * PER_DATUM_SEEN
        + min(n_data, N_MISSED * tiles) * MAX_COMPARED_LOCATIONS * size * PER_WINDOW_ROW
    )


def _seconds_of_volume(
    parameters: Parameters, image_shape: Shape, grid_shape: Shape, n_data: int, judged: bool
) -> float:
    """Return the CPU seconds of a volume; at level 0, the search takes most of the time."""
    lengths, n_cells = parameters.along(grid_shape), prod(grid_shape)
    sides = zip(image_shape, lengths.template, lengths.level, strict=True)
    locations = prod(max(side - size, 0) // 2**level + 1 for side, size, level in sides)
    steps = (t - overlap for t, overlap in zip(lengths.template, lengths.overlap, strict=True))
    tiles = max(n_cells / prod(steps), 1.0)
    return (
        n_cells * (PER_CELL_OF_VOLUME + (PER_JUDGED_CELL if judged else 0.0))
        + tiles * locations * PER_LOCATION_OF_VOLUME
        + n_data * PER_DATUM_OF_VOLUME
    )
