"""Everything a session remembers, in one typed object that survives page changes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any, TypeVar

import streamlit as st

from ccwsim.jobs.job import Job
from ccwsim.jobs.limits import limits_of_environment
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.training_image import TrainingImage
from ccwsim.sharing.choices import Choices, DataChoice, EMap, ImageChoice
from ccwsim.ui.session.page_run import PageRun
from ccwsim.ui.session.uploads import size_of_all

KEY = "ccwsim"
MAX_RUNS = 12
PageState = TypeVar("PageState")


@dataclass(frozen=True, eq=False)
class PastRun:
    """A run as it came out, with the reference field of its hard data, if there is one."""

    choices: Choices
    ensemble: Ensemble
    reference: TrainingImage | None = None
    at: datetime = field(default_factory=lambda: datetime.now().astimezone())  # when it came out

    @property
    def key(self) -> str:
        """What tells it from the other runs of the session."""
        return self.at.isoformat()

    @property
    def nbytes(self) -> int:
        """Memory of the realizations, in indices and, if they differ, in codes too."""
        ensemble = self.ensemble
        in_codes = ensemble.realizations
        own = 0 if in_codes is ensemble.indices else in_codes.nbytes
        return ensemble.indices.nbytes + own + ensemble.data_status.nbytes

    @property
    def files(self) -> list[bytes]:
        """The user's own files that the study has; runs of one study share them."""
        return [file.content for file in (*self.choices.image.files, *self.choices.data.files)]


@dataclass
class PastRuns:
    """The latest runs, newest first, in the memory that the server gives each session for them."""

    runs: list[PastRun] = field(default_factory=list)
    max_runs: int = MAX_RUNS
    max_bytes: int | None = None

    def remember(self, run: PastRun) -> None:
        """Keep a run in place of the newest if only data placed by hand differ; the oldest go."""
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
    """What a session remembers."""

    choices: Choices = field(default_factory=Choices)  # as set up; always one that can be read
    image_draft: ImageChoice | None = None  # not usable yet: broken, or a question is open
    visit_import: bool = False  # a file has questions, which are asked on the page of its own
    data_draft: DataChoice | None = None
    # parameters that the image has no room for: asked for, and given (see `refitted`)
    moved: dict[str, tuple[Any, Any]] = field(default_factory=dict)
    live: bool = False  # every change starts a run
    job: Job[Ensemble] | None = None  # the simulation that runs now
    needs_confirmation: bool = False  # it came by a link or a project: a long run waits
    last_attempt: Choices | None = None  # what a run was started with last, whatever came of it
    ensemble: Ensemble | None = None  # the latest results, and the choices they came from
    ensemble_choices: Choices | None = None
    message: str = ""  # what went wrong or was stopped, shown above the results
    shown: int = 0  # which realization is large
    realization_to_restore: int = 0  # the large one when the latest run started
    facies: int = 1  # index of the facies whose curves and probability are shown
    e_type: EMap = "probability"  # what the uncertainty map shows
    reference: TrainingImage | None = None  # the field that the hard data were sampled from
    runs: PastRuns = field(default_factory=PastRuns)  # of this session, to go back to
    pages: dict[type, Any] = field(default_factory=dict)  # what single pages remember, by type
    own_seed: int | None = None  # this reader's if a class shares a study
    address: str = ""  # the latest query of the page's address
    notes: tuple[str, ...] = ()  # what of an address or a project could not be taken, until read
    opened: tuple[str, str] = ("", "")  # the latest project file, and why it could not be opened

    def page(self, kind: type[PageState]) -> PageState:
        """Return what a page remembers; `kind` is the type of it, made without arguments."""
        return self.pages.setdefault(kind, kind())

    def change(self, **changes: Any) -> None:
        """Replace some of the choices."""
        self.choices = replace(self.choices, **changes)


def session_state() -> State:
    """Return the state of this session; a new session gets the default study."""
    if KEY not in st.session_state:
        st.session_state[KEY] = State()
    return st.session_state[KEY]


def start_afresh() -> None:
    """Let go of everything of this session, as if the page had just been opened; stop its jobs."""
    state = session_state()
    if state.job is not None:
        state.job.cancel()
    for page_state in state.pages.values():
        for run in vars(page_state).values():
            if isinstance(run, PageRun):
                run.stop()
    st.query_params.clear()
    st.session_state[KEY] = State()
