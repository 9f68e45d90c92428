"""Runs of trials, which the pages Compare, Sweep and Benchmark plan, start, follow and show."""

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import streamlit as st

from ccwsim import CCWSIMError, Grid, Parameters, TrainingImage
from ccwsim.experiments.trials import Trial
from ccwsim.jobs.limits import Demand
from ccwsim.model.errors import Cancelled
from ccwsim.model.numbers import duration, plural
from ccwsim.run.footprint import demand_of
from ccwsim.sharing.choices import Choices
from ccwsim.ui.results.maps import colours_of
from ccwsim.ui.session.address import go_to
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.progress import compilation_to_come
from ccwsim.ui.session.resolve import image_of, study_inputs, study_of
from ccwsim.ui.session.state import PageRun, State
from ccwsim.ui.study.run import draw_out_of_date, failed
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.text import plain

Row = TypeVar("Row")
Result = TypeVar("Result")


@dataclass(kw_only=True)
class TrialsRun(PageRun[Result], Generic[Row, Result]):
    """A run of trials; `rows` has the results so far.

    `facies` is the index of the facies whose curves are shown. Results are out of date if the
    page's present key differs from `key`.
    """

    trials: Sequence[Trial]
    n_realizations: int
    key: object = None
    facies: int = 0
    colours: list[str] = field(default_factory=list)
    rows: list[Row] = field(default_factory=list)
    unit = "settings"

    @property
    def first(self) -> Trial:
        """The first trial; on Compare and Sweep, all trials have its image, grid and data."""
        return self.trials[0]

    @property
    def training_image(self) -> TrainingImage:
        """The training image of the first trial."""
        return self.first.training_image

    @property
    def grid(self) -> Grid:
        """The grid of the first trial."""
        return self.first.grid

    @property
    def settings(self) -> list[Parameters]:
        """The parameters of the trials."""
        return [trial.parameters for trial in self.trials]

    @property
    def n_pieces(self) -> int:
        """Number of trials."""
        return len(self.trials)

    @property
    def n_finished(self) -> str:
        """Number of finished trials as text, such as "2 of 5 settings"."""
        return f"{len(self.rows)} of {len(self.trials)} settings"

    def n_kept(self, trial: Trial) -> int:
        """Return the number of realizations of a trial that are in memory at a time."""
        return self.n_realizations

    def demands(self, n_workers: int | None = None) -> list[Demand]:
        """Return the resources of each trial that fits; the run reports the other trials."""
        demands = []
        for trial in self.trials:
            with suppress(CCWSIMError):
                n_kept = self.n_kept(trial)
                demands.append(demand_of(trial.fitting(), self.n_realizations, n_kept, n_workers))
        return demands

    def label(self) -> str:
        """Return the text beside the progress, if it is not the number of finished pieces."""
        return ""

    def describe_end(self) -> str:
        """Describe how the run was stopped or failed; otherwise return an empty text."""
        if self.error is None:
            return ""
        if not isinstance(self.error, Cancelled):
            return failed(self.error)
        return self.describe_stop()

    def describe_stop(self) -> str:
        """Return how many trials were finished before the run was stopped."""
        return f"Stopped after {self.n_finished}" + ("; these are shown." if self.rows else ".")


def trial_of(choices: Choices) -> Trial:
    """Return the present study as a trial; raise `CCWSIMError` if its parts cannot be read."""
    return Trial(**study_inputs(choices))


def shown_in(state: State) -> dict[str, Any]:
    """Return the facies and the colours with which a new run is shown."""
    n_facies = image_of(state.choices.image).n_facies
    return {"facies": min(state.facies, n_facies - 1), "colours": colours_of(state)}


def study_key(choices: Choices) -> tuple:
    """Return a key of image, data, grid and guides; raise `CCWSIMError` if they do not fit."""
    return study_of(choices, checked=False).key("parameters", "seed")


def describe_work(n_trials: int, n_realizations: int, seconds: float) -> str:
    """Describe a planned run and its approximate duration."""
    work = f"{plural(n_trials, 'setting')} × {plural(n_realizations, 'realization')}"
    about = duration(seconds, rough=True)
    return f"{work} on one thread: about {about}.{compilation_to_come()}"


def draw_run_news(
    run: TrialsRun | None,
    *,
    outdated: str = "",
    problem: str = "",
    message: str = "",
    dim: bool = False,
    redraw_seconds: float = 0.0,
    **options: Any,
) -> None:
    """Draw the progress of a run or, after it, what is out of date; then a problem and a message.

    The page is redrawn for new rows, at most every `redraw_seconds`, and at the end. If `dim`, the
    results are pale during the run.
    """
    drawn_at = time.monotonic()
    n_drawn = len(run.rows) if run is not None else 0

    def has_news() -> bool:
        assert run is not None
        return len(run.rows) > n_drawn and time.monotonic() - drawn_at > redraw_seconds

    with st.container(key="news"):  # always drawn, so that elements below do not move
        if run is not None and run.job is not None and run.going:
            follow(run.job, has_news=has_news, label=run.label, **options)
            if dim:
                st.html("<style>.st-key-results { opacity: 0.4 }</style>")
        elif outdated:
            draw_out_of_date(outdated)
        if problem:
            st.error(plain(problem))
        if message:
            st.warning(plain(message))


def use_button(label: str, key: str, **options: Any) -> None:
    """Draw a button that applies a setting to the study and opens Simulate."""
    if button(label, key=key, **options):
        go_to("pages/simulate.py", "The study has this setting now.")
