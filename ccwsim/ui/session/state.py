"""The state of a session, kept when the user changes the page, and the long runs of pages."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any, Generic, Self, TypeVar

import streamlit as st

from ccwsim import Ensemble, Grid, TrainingImage
from ccwsim.jobs.job import NO_DEMAND, Job
from ccwsim.jobs.limits import Demand, limits_of_environment
from ccwsim.metrics.lags import DirectionName
from ccwsim.sharing.choices import (
    Choices,
    CompareChoice,
    DataChoice,
    EMap,
    FlowChoice,
    GuideChoice,
    ImageChoice,
    SweepChoice,
)
from ccwsim.ui.session import resolve
from ccwsim.ui.session.uploads import size_of_all
from ccwsim.ui.widgets import problem_in

Result = TypeVar("Result")


class PageRun(Generic[Result]):
    """Work on a thread; subclasses are dataclasses of inputs, partial results and `n_pieces`."""

    unit = "realizations"
    job: Job[Result] | None = None

    @property
    def n_pieces(self) -> int:
        """Total number of pieces of work, or 0 if pieces are not counted."""
        return 0

    def work(self, job: Job[Result]) -> Result:
        """Do the work and return the result; this is called on the job's thread."""
        raise NotImplementedError

    def demand(self) -> Demand:
        """Return the resources that the run demands from the server."""
        return NO_DEMAND

    def start(self) -> Self:
        """Start the run; raise `CCWSIMError` if the server lacks the demanded resources."""
        self.job = Job(self.work, demand=self.demand(), n=self.n_pieces, unit=self.unit)
        return self

    @property
    def going(self) -> bool:
        """Whether the run has begun and not ended."""
        return self.job is not None and not self.job.finished

    @property
    def error(self) -> Exception | None:
        """The error with which the run ended, if any."""
        return self.job.error if self.job is not None else None

    @property
    def result(self) -> Result | None:
        """The result of the run; None until the run has ended."""
        return self.job.result if self.job is not None else None

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` and return whether the run has ended."""
        return self.job is not None and self.job.wait(seconds)

    def stop(self) -> None:
        """Ask the run to stop."""
        if self.job is not None:
            self.job.cancel()


Run = TypeVar("Run", bound=PageRun)


@dataclass
class RunState(Generic[Run]):
    """State of a page, or a part of a page: the latest run, and why no run was started."""

    run: Run | None = None
    message: str = ""

    @property
    def going(self) -> bool:
        """Whether a run is going."""
        return self.run is not None and self.run.going

    def start(self, make: Callable[[], Run]) -> bool:
        """Make and start a run; on an error, set `message`, keep the earlier run, return False."""

        def begin() -> None:
            self.run = make().start()

        self.message = problem_in(begin)
        return not self.message


KEY = "ccwsim"
MAX_RUNS = 12
MAX_UNDO = 30  # maximum number of changes that can be undone; old files are not kept for them
PageState = TypeVar("PageState")


@dataclass(frozen=True, eq=False)
class PastRun:
    """A finished run and, if there is one, the reference field of the hard data."""

    choices: Choices
    ensemble: Ensemble
    reference: TrainingImage | None = None
    ended: datetime = field(default_factory=lambda: datetime.now().astimezone())

    @property
    def key(self) -> str:
        """A key that is unique among the runs of a session."""
        return self.ended.isoformat()

    @property
    def nbytes(self) -> int:
        """Bytes of the realizations as facies indices and, if the codes differ, as codes."""
        ensemble = self.ensemble
        in_codes = ensemble.realizations
        bytes_in_codes = 0 if in_codes is ensemble.indices else in_codes.nbytes
        return ensemble.indices.nbytes + bytes_in_codes + ensemble.data_status.nbytes

    @property
    def files(self) -> list[bytes]:
        """Contents of the files uploaded for the study; runs of a study share these objects."""
        return files_of(self.choices)


def files_of(choices: Choices) -> list[bytes]:
    """Return the contents of the files uploaded for a study."""
    parts = choices.image, choices.data, choices.guides
    return [file.content for part in parts for file in part.files]


@dataclass
class PastRuns:
    """The latest runs, newest first; the total size of the runs is limited."""

    runs: list[PastRun] = field(default_factory=list)
    max_runs: int = MAX_RUNS
    max_bytes: int | None = None

    def remember(self, run: PastRun) -> None:
        """Store a run and drop old runs; replace the newest if only hand-placed data differ."""
        if self.runs and _but_for_placed(self.runs[0].choices) == _but_for_placed(run.choices):
            self.runs.pop(0)
        self.runs.insert(0, run)
        while len(self.runs) > 1 and (len(self.runs) > self.max_runs or self._too_large()):
            self.runs.pop()

    def _too_large(self) -> bool:
        limit = self.max_bytes
        limit = limits_of_environment().history if limit is None else limit
        files = [file for run in self.runs for file in run.files]
        return sum(run.nbytes for run in self.runs) + size_of_all(files) > limit


def _but_for_placed(choices: Choices) -> Choices:
    return replace(choices, data=replace(choices.data, placed=None))


@dataclass
class State:
    """The state of a session."""

    choices: Choices = field(default_factory=Choices)  # the present study, whose files are readable
    # choices that are not usable yet: a file is broken or needs an answer
    image_draft: ImageChoice | None = None
    visit_import: bool = False  # whether the study column opens the page Import for a new file
    data_draft: DataChoice | None = None
    guides_draft: GuideChoice | None = None
    # requested and used values of parameters that are too large for the image (see `refitted`)
    moved: dict[str, tuple[Any, Any]] = field(default_factory=dict)
    live: bool | None = None  # whether every change starts a run; None if short runs do
    job: Job[Ensemble] | None = None  # the current simulation
    needs_confirmation: bool = False  # ask before a long run, because a link or project was opened
    last_attempt: Choices | None = None  # choices of the latest run, even if the run failed
    ensemble: Ensemble | None = None  # the latest results
    ensemble_choices: Choices | None = None  # choices with which `ensemble` was simulated
    message: str = ""  # error or stop message, shown above the results
    shown: int = 0  # index of the realization that the page shows large
    realization_to_restore: int = 0  # value of `shown` when the latest run started
    facies: int = 1  # index of the facies in curves and probability maps
    facies_image: str = ""  # digest of the image for which `facies` was chosen
    shows_across: bool = False  # whether connectivity is shown in the second of two directions
    axis: DirectionName = "E-W"  # direction of the curves of a volume
    e_type: EMap = "probability"  # the statistic in the uncertainty map
    threshold: float | None = None  # of a continuous variable; None for the median of the image
    flow: FlowChoice = field(default_factory=FlowChoice)  # settings of the page Flow
    compare: CompareChoice = field(default_factory=CompareChoice)
    sweep: SweepChoice = field(default_factory=SweepChoice)
    reference: TrainingImage | None = None  # field from which the data were sampled
    runs: PastRuns = field(default_factory=PastRuns)  # earlier runs, which can be restored
    pages: dict[type, Any] = field(default_factory=dict)  # state of each page, by type of state
    own_seed: int | None = None  # random seed of a reader of a link for a class
    address: str = ""  # latest query in the address of the page
    notes: tuple[str, ...] = ()  # notes on unusable parts of an address or project
    # values of an address, by name, that name files which are not on this server
    missing: dict[str, str] = field(default_factory=dict)
    earlier: list[Choices] = field(default_factory=list)  # studies before changes, newest last
    drawn: Choices | None = None  # the latest study with which a page was drawn without an error
    welcome: bool = False  # whether to introduce the program to a reader who has not used it
    opened: tuple[str, str] = ("", "")  # the latest project file and the error in it
    fitted: tuple[str, Grid, Grid] | None = None  # why the grid was fitted, the grid, that before

    @property
    def image(self) -> TrainingImage:
        """The training image of the study; raise `CCWSIMError` if a question is open."""
        return resolve.image_of(self.choices.image)

    @property
    def grid(self) -> Grid:
        """The grid of the study."""
        return self.choices.grid

    def page(self, kind: type[PageState]) -> PageState:
        """Return the page state of type `kind`, which is created without arguments if necessary."""
        return self.pages.setdefault(kind, kind())

    def change(self, **changes: Any) -> None:
        """Replace some choices of the study."""
        self.choices = replace(self.choices, **changes)

    def fit_grid(self, reason: str, grid: Grid) -> None:
        """Replace the grid; the study column shows the reason, and *Undo*."""
        self.fitted = reason, grid, self.grid
        self.change(grid=grid)

    def change_flow(self, **changes: Any) -> None:
        """Replace some settings of the page Flow."""
        self.flow = replace(self.flow, **changes)

    def change_compare(self, **changes: Any) -> None:
        """Replace some settings of the page Compare."""
        self.compare = replace(self.compare, **changes)

    def change_sweep(self, **changes: Any) -> None:
        """Replace some settings of the page Sweep."""
        self.sweep = replace(self.sweep, **changes)

    def fit_shown(self, ensemble: Ensemble) -> None:
        """Choose a realization and a facies that an ensemble has, unless they are chosen."""
        self.shown = min(self.shown, ensemble.n - 1)
        self.choose_facies(ensemble.training_image)

    def choose_facies(self, image: TrainingImage) -> None:
        """Choose the facies of interest of an image, unless a facies of this image is chosen."""
        if self.facies_image != image.digest:
            self.facies, self.facies_image = image.facies_of_interest, image.digest

    def note_drawn(self) -> None:
        """Store the study of a drawn page; the study before can be restored with `undo`."""
        if self.drawn not in (None, self.choices):
            self.earlier = [*self.earlier, self.drawn][-MAX_UNDO:]
            used = {*map(id, files_of(self.choices)), *map(id, files_of(self.drawn))}
            self.earlier = [c for c in self.earlier if used.issuperset(map(id, files_of(c)))]
        self.drawn = self.choices

    def undo(self) -> None:
        """Restore the study before the last change, if any."""
        if self.earlier:
            self.go_back(self.earlier.pop())

    def go_back(self, drawn: Choices) -> None:
        """Restore a study without drafts; `undo` cannot take back this change."""
        self.choices = self.drawn = drawn
        self.image_draft = self.data_draft = None


def session_state() -> State:
    """Return the state of this session; a new session gets the default study."""
    if KEY not in st.session_state:
        st.session_state[KEY] = State()
    return st.session_state[KEY]


def start_afresh() -> None:
    """Stop the jobs of this session, and reset the session to its first state."""
    state = session_state()
    if state.job is not None:
        state.job.cancel()
    for page_state in state.pages.values():
        for part in (page_state, *vars(page_state).values()):
            if isinstance(part, RunState) and part.run is not None:
                part.run.stop()
    st.query_params.clear()
    st.session_state[KEY] = State()
