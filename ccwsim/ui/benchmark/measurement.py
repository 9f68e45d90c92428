"""State and run of the page Benchmark: the user's choices, the measured cases, the thread."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from ccwsim import CCWSIMError, Parameters
from ccwsim.experiments import timing
from ccwsim.experiments.timing import level_of
from ccwsim.experiments.trials import Trial, TrialResult
from ccwsim.jobs.job import Job, server_queue
from ccwsim.jobs.limits import Demand
from ccwsim.model.arrays import Shape, describe_shape
from ccwsim.model.parameters import METHODS, fitted
from ccwsim.model.sizes import levels
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import RunState, State
from ccwsim.ui.study.trials import TrialsRun

Kind = Literal["grids", "data"]
SIDES = (256, 512, 1000, 2000, 3000, 5000)
"""Sides of the square grids in Fig. 13, in cells; the last grid has 25 million cells."""
DATA_SIDES = (256, 512, 1000)
VOLUME_SIDES = (48, 64, 100, 160, 256)
"""Sides of the layers of timed volumes, which have as many layers as the study's grid."""
DATA_SIDES_VOLUME = (64, 100, 160)
NUMBERS = (0, 100, 400, 1000, 2000, 4000)
TIMED_METHODS = tuple(method for method in METHODS if method != "ccsim")
"""Methods with levels; CCSIM is not included, because CCSIM is level 0 of CCWSIM."""
BYTES_PER_CELL = 10  # number of bytes of memory that a run needs per cell, including a margin
MAX_SHARE_OF_MEMORY = 0.5
FINEST, COARSEST = 0, 3


@dataclass(kw_only=True)
class TimingRun(TrialsRun[TrialResult, None]):
    """Timed trials, in order; `disturbed` is whether other sessions computed at the same time."""

    disturbed: bool = False

    @property
    def main(self) -> Trial:
        """A trial on the study's image; maps timed beside volumes use only its middle layer."""
        return max(self.trials, key=lambda trial: trial.grid.n_dimensions)

    def n_kept(self, trial: Trial) -> int:
        return max(timing.CELLS_AT_ONCE // trial.grid.n_cells, 1)

    def demand(self) -> Demand:
        """Return the resources that the largest trial needs; one trial runs at a time."""
        n_bytes = max((demand.n_bytes for demand in self.demands(n_workers=1)), default=0)
        n_cells = sum(trial.grid.n_cells for trial in self.trials) * self.n_realizations
        return Demand(n_cells, max((trial.n_data for trial in self.trials), default=0), n_bytes)

    def label(self) -> str:
        """Return the number of timed settings and the name of the setting being timed."""
        text, to_come = self.n_finished, self.trials[len(self.rows) :]
        if to_come:
            trial = to_come[0]
            data = f", {trial.n_data} data" if trial.n_data else ""
            text += (
                f" · now {size_text(trial.grid.shape)}, level {level_of(trial.parameters)}{data}"
            )
        return text

    def work(self, job: Job) -> None:
        def report(fraction: float, n_done: int) -> None:
            self.disturbed = self.disturbed or server_queue().n_active > 1
            job.report(fraction, n_done)

        for timed in timing.time_trials(self.trials, self.n_realizations, report, job.is_cancelled):
            self.rows.append(timed)


@dataclass
class Benchmark:
    """The state of the page: the user's choices, and the latest runs.

    `largest` is the side of the largest map, and `side` is the side of the map with data.
    `largest_volume` and `side_volume` are the corresponding sides of the layers of volumes. `maps`
    tells whether maps are timed in addition to volumes. Unknown methods are ignored.
    """

    largest: int = 2000
    largest_volume: int = 100
    side_volume: int = 64
    maps: bool = True
    grid_levels: list[int] = field(default_factory=lambda: [1, 2, 3])
    grid_methods: list[str] = field(default_factory=lambda: ["ccwsim"])
    side: int = 512
    numbers: list[int] = field(default_factory=lambda: [0, 1000, 2000])
    data_levels: list[int] = field(default_factory=lambda: [1, 3])
    data_methods: list[str] = field(default_factory=lambda: ["ccwsim", "ms-ccsim"])
    n_realizations: int = 3
    grids: RunState[TimingRun] = field(default_factory=RunState[TimingRun])
    data: RunState[TimingRun] = field(default_factory=RunState[TimingRun])

    def of(self, kind: Kind) -> RunState[TimingRun]:
        """Return the state of a measurement."""
        return self.grids if kind == "grids" else self.data

    @property
    def runs(self) -> list[TimingRun]:
        """The latest run of each measurement that has begun."""
        return [part.run for part in (self.grids, self.data) if part.run]

    @property
    def running(self) -> TimingRun | None:
        """The current run, if any; two runs at a time would slow each other down."""
        return next((run for run in self.runs if run.going), None)


def start_timing(state: State, kind: Kind) -> None:
    """Start a measurement; if it cannot start, earlier results remain on the page."""
    page_state = state.page(Benchmark)
    page_state.of(kind).start(
        lambda: TimingRun(trials=trials_of(state, kind), n_realizations=page_state.n_realizations)
    )


def level_options(state: State) -> list[int]:
    """Return the levels that the study's training image allows."""
    allowed = levels(image_of(state.choices.image).shape)
    return [level for level in allowed if FINEST <= level <= COARSEST]


def side_options(free_bytes: int | None) -> list[int]:
    """Return the grid sides offered to the user: at least two, and more if memory allows."""
    available = float("inf") if free_bytes is None else MAX_SHARE_OF_MEMORY * free_bytes
    return [s for s in SIDES[1:] if s == SIDES[1] or s * s * BYTES_PER_CELL <= available]


def number_options(side: int, nz: int | None = None) -> list[int]:
    """Return the numbers of data that the user can choose, at most a quarter of the cells."""
    return [n for n in NUMBERS if 4 * n <= side * side * (nz or 1)]


def trials_of(state: State, kind: Kind) -> list[Trial]:
    """Return the trials of a measurement by size; raise an error if a choice is missing."""
    page_state, nz, seed = state.page(Benchmark), layers_of(state), state.choices.seed
    image = image_of(state.choices.image)
    if kind == "data":
        shape = shape_of_data(state)
        numbers = [n for n in number_options(shape[-1], nz) if n in page_state.numbers]
        if not numbers:
            raise CCWSIMError("Choose at least one number of data.")
        chosen = timed_parameters(state, page_state.data_methods, page_state.data_levels)
        return timing.data_trials(image, shape, numbers, chosen, seed)
    largest, offered = (
        (page_state.largest, SIDES) if nz is None else (page_state.largest_volume, VOLUME_SIDES)
    )
    sides = [side for side in offered if side <= largest]
    chosen = timed_parameters(state, page_state.grid_methods, page_state.grid_levels)
    trials = timing.grid_trials(image, [shape_of(side, nz) for side in sides], chosen, seed)
    if nz is not None and page_state.maps:
        flat = timed_parameters(
            state, page_state.grid_methods, page_state.grid_levels, image.shape[-2:]
        )
        shapes = [shape_of(round((nz * side * side) ** 0.5)) for side in sides]
        trials += timing.grid_trials(image, shapes, flat, seed)
    return sorted(trials, key=lambda trial: trial.grid.n_cells)


def shape_of(side: int, nz: int | None = None) -> Shape:
    """Return the shape of a square map, or of a volume with square layers."""
    return (side, side) if nz is None else (nz, side, side)


def shape_of_data(state: State) -> Shape:
    """Return the shape of the grid that is timed with data."""
    page_state, nz = state.page(Benchmark), layers_of(state)
    return shape_of(page_state.side if nz is None else page_state.side_volume, nz)


def size_text(shape: Shape) -> str:
    """Return the size of a square map, or of a volume, as text."""
    return f"{shape[0]}²" if len(shape) == 2 else describe_shape(shape)


def layers_of(state: State) -> int | None:
    """Return the number of layers of timed volumes, or None if the study simulates maps."""
    image = image_of(state.choices.image)
    if image.n_dimensions == 2:
        return None
    return state.choices.grid.nz or image.shape[0]


def timed_parameters(
    state: State,
    methods: Sequence[str],
    chosen_levels: Sequence[int],
    image_shape: Shape | None = None,
) -> list[Parameters]:
    """Return the study's parameters by method and level, with sizes that fit an image's shape."""
    p, shape = state.choices.parameters, image_shape or image_of(state.choices.image).shape
    settings = [
        fitted(p, shape, method=method, wavelet_level=level)
        for method in TIMED_METHODS
        for level in level_options(state)
        if method in methods and level in chosen_levels
    ]
    if not settings:
        raise CCWSIMError("Choose at least one method and one level.")
    return settings


def expected(state: State, trials: Sequence[Trial]) -> float:
    """Return the expected duration of a run in seconds, from measurements in this session."""
    page_state, image = state.page(Benchmark), image_of(state.choices.image)
    runs = [run for run in page_state.runs if run.main.training_image.digest == image.digest]
    timings = [timed for run in runs for timed in run.rows]
    return timing.expected_seconds(trials, page_state.n_realizations, timings)
