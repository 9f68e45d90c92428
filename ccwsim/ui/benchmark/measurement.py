"""State and run of the page Benchmark: the user's choices, the measured cases, the thread."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from ccwsim import CCWSIMError, Grid, Parameters
from ccwsim.experiments import timing
from ccwsim.experiments.timing import Timing, TimingCase
from ccwsim.jobs.job import Job, server_queue
from ccwsim.jobs.limits import Demand
from ccwsim.model.arrays import Shape
from ccwsim.model.parameters import METHODS
from ccwsim.model.study import Study
from ccwsim.ui.session.resolve import fitted, image_of, levels
from ccwsim.ui.session.state import State, start_page_run
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


@dataclass
class TimingRun(TrialsRun[TimingCase, Timing, None]):
    """Timed cases, in order; `disturbed` by other sessions that computed at the same time."""

    disturbed: bool = False

    def study_of(self, setting: TimingCase) -> Study:
        image = timing.image_of_case(self.training_image, setting)
        return Study(image, Grid.of(setting.grid_shape), setting.parameters)

    def n_kept(self, setting: TimingCase) -> int:
        return max(timing.CELLS_AT_ONCE // setting.n_cells, 1)

    def demand(self) -> Demand:
        """Return the resources that the largest case needs; one case runs at a time."""
        n_bytes = max((demand.n_bytes for demand in self.demands(n_workers=1)), default=0)
        n_cells = sum(case.n_cells for case in self.settings) * self.n_realizations
        return Demand(n_cells, max((case.n_data for case in self.settings), default=0), n_bytes)

    def work(self, job: Job) -> None:
        def report(fraction: float, n_done: int) -> None:
            self.disturbed = self.disturbed or server_queue().n_active > 1
            job.report(fraction, n_done)

        image, n = self.training_image, self.n_realizations
        run = image, self.settings, n, self.seed, report, job.is_cancelled
        for timed in timing.time_cases(*run):
            self.rows.append(timed)


@dataclass
class Benchmark:
    """The state of the page: the user's choices, the latest runs, and why a run did not start.

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
    grids: TimingRun | None = None
    data: TimingRun | None = None
    message: str = ""

    @property
    def runs(self) -> list[TimingRun]:
        """The latest run of each measurement that has begun."""
        return [run for run in (self.grids, self.data) if run]

    @property
    def running(self) -> TimingRun | None:
        """The current run, if any; two runs at a time would slow each other down."""
        return next((run for run in self.runs if run.going), None)


def start_timing(state: State, kind: Kind) -> None:
    """Start a measurement; if it cannot start, earlier results remain on the page."""
    page_state = state.page(Benchmark)
    image, n = image_of(state.choices.image), page_state.n_realizations
    seed = state.choices.seed
    start_page_run(page_state, kind, lambda: TimingRun(image, cases_of(state, kind), n, seed))


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


def cases_of(state: State, kind: Kind) -> list[TimingCase]:
    """Return the cases of a measurement by size; raise an error if a choice is missing."""
    own, nz = state.page(Benchmark), layers_of(state)
    if kind == "data":
        side = own.side if nz is None else own.side_volume
        numbers = [n for n in number_options(side, nz) if n in own.numbers]
        if not numbers:
            raise CCWSIMError("Choose at least one number of data.")
        chosen = timed_parameters(state, own.data_methods, own.data_levels)
        return timing.data_cases(numbers, chosen, (side, side) if nz is None else (nz, side, side))
    chosen = timed_parameters(state, own.grid_methods, own.grid_levels)
    if nz is None:
        return timing.grid_cases([side for side in SIDES if side <= own.largest], chosen)
    sides = [side for side in VOLUME_SIDES if side <= own.largest_volume]
    cases = [TimingCase(p, (nz, side, side)) for side in sides for p in chosen]
    if own.maps:
        layer = image_of(state.choices.image).shape[-2:]
        flat = timed_parameters(state, own.grid_methods, own.grid_levels, layer)
        cases += timing.grid_cases([round((nz * side * side) ** 0.5) for side in sides], flat)
    return sorted(cases, key=lambda case: case.n_cells)


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
    found = [
        fitted(p, shape, method=method, wavelet_level=level)
        for method in TIMED_METHODS
        for level in level_options(state)
        if method in methods and level in chosen_levels
    ]
    if not found:
        raise CCWSIMError("Choose at least one method and one level.")
    return found


def expected(state: State, cases: Sequence[TimingCase]) -> float:
    """Return the expected duration of a run in seconds, from measurements in this session."""
    page_state, image = state.page(Benchmark), image_of(state.choices.image)
    runs = [run for run in page_state.runs if run.training_image.digest == image.digest]
    known = [timed for run in runs for timed in run.rows]
    return timing.expected_seconds(image, cases, page_state.n_realizations, known)
