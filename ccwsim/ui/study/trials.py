"""Runs of trials, which pages plan, start, follow and show, and “Find good settings”."""

import time
from base64 import b64encode
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import accumulate
from typing import Any, Generic, TypeVar

import numpy as np
import streamlit as st

from ccwsim import Cancelled, CCWSIMError, Grid, Parameters, TrainingImage
from ccwsim.experiments import plan
from ccwsim.experiments.sweep import Sweep, SweepRow, nearest_on_front, recommended, sweep
from ccwsim.experiments.timing import expected_seconds, typical
from ccwsim.experiments.trials import Trial
from ccwsim.figures import contact_sheet, tile_size
from ccwsim.jobs.job import Job
from ccwsim.jobs.limits import Demand
from ccwsim.model import UNKNOWN, Bytes, Integers, duration, plural, three_digits
from ccwsim.run.footprint import demand_of
from ccwsim.sharing.choices import Choices
from ccwsim.ui.frontend.component import draw_tiles
from ccwsim.ui.results.maps import colours_of, middle_layers
from ccwsim.ui.session import (
    PageRun,
    RunState,
    State,
    cached,
    compilation_to_come,
    error_boundary,
    follow,
    go_to,
    image_of,
    session_state,
    study_inputs,
    study_of,
)
from ccwsim.ui.study.run import draw_out_of_date, failed, study_problem
from ccwsim.ui.widgets import button, page_text, plain, step_note

CELLS_KEPT = 64_000_000  # maximum cells of the realizations that a sweep stores, of one byte each
SOURCE_BYTES = 4  # number of bytes per cell that store the source of the cell in the training image
MAX_KEPT_SWEEPS = 4
TILE_PIXELS = 124  # length of the longer side of a tile in pixels
N_TUNED, FEW_TUNED = 3, 2
"""Numbers of realizations of each setting that “Find good settings” tries: usually, and if the
fewest settings would take longer than `TUNING_SECONDS`."""
TUNING_SECONDS = 5.0  # maximum expected CPU seconds to try settings, if there are enough of them
advice_on = cached(max_entries=16)(plan.describe_advice)
ranges_around = cached(max_entries=16)(plan.suggested_ranges)
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

    def inputs(self, job: Job) -> dict[str, Any]:
        """Return the arguments that are equal for a comparison and for a sweep of the settings."""
        first = self.first
        return {
            "training_image": first.training_image,
            "grid_shape": first.grid,
            "hard_data": first.hard_data,
            "secondary": first.secondary,
            "n_realizations": self.n_realizations,
            "seed": first.seed,
            "facies": int(first.training_image.codes[self.facies]),
            "progress": job.report,
            "cancel": job.is_cancelled,
        }

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
        if isinstance(self.error, Cancelled):
            return self.describe_stop()
        return "" if self.error is None else failed(self.error)

    def describe_stop(self) -> str:
        """Return how many trials were finished before the run was stopped."""
        shown = "; these are shown" if self.rows else ""
        return f"Stopped after {len(self.rows)} of {len(self.trials)} settings{shown}."


@dataclass(kw_only=True)
class SweepRun(TrialsRun[SweepRow, Sweep]):
    """A sweep with its finished rows, and `tiles`, the `pictures` made so far."""

    tiles: list[bytes] = field(default_factory=list)

    def demand(self) -> Demand:
        """Return the resources that the sweep needs for one setting and the stored realizations."""
        largest = max((demand.n_bytes for demand in self.demands(n_workers=1)), default=0)
        cells_per_realization = self.first.grid.n_cells
        n_cells = cells_per_realization * len(self.trials)
        kept = max(CELLS_KEPT, n_cells)  # at least one realization is stored
        sources = SOURCE_BYTES * cells_per_realization * self.n_realizations
        return Demand(n_cells * self.n_realizations, self.first.n_data, largest + sources + kept)

    def work(self, job: Job[Sweep]) -> Sweep:
        n_kept = CELLS_KEPT // (self.grid.n_cells * len(self.trials))
        return sweep(
            settings=self.settings,
            found=self.rows.append,
            n_kept=min(max(n_kept, 1), MAX_KEPT_SWEEPS),
            **self.inputs(job),
        )

    @property
    def latest_result(self) -> Sweep:
        """The results of the settings that are finished."""
        shape = self.training_image.shape
        return self.result or Sweep(tuple(self.rows), (), len(self.trials), shape)

    def describe_end(self) -> str:
        """Describe settings without results in an ended sweep; empty if all have results."""
        if self.going or self.error is not None:
            return super().describe_end()
        results = self.latest_result
        sentences = [self.describe_stop()] if results.stopped else []
        if results.failed:
            n = len(results.failed)
            sentences.append(f"{n} could not be simulated: {results.failed[0][1]}.")
        return " ".join(sentences)

    @property
    def pictures(self) -> list[bytes]:
        """A picture (PNG) of the first realization of each finished setting."""
        for row in self.latest_result.rows[len(self.tiles) :]:
            first = middle_layers(indices_of(row.realizations[:1], self.training_image))
            self.tiles.append(contact_sheet(first, self.colours, longest=2 * TILE_PIXELS)[0])
        return self.tiles


def indices_of(realizations: Integers, image: TrainingImage) -> Bytes:
    """Convert facies codes to facies indices, which maps need."""
    indices = image.codes.searchsorted(realizations)
    return np.where(np.isnan(realizations), UNKNOWN, indices).astype(np.uint8)


def setting_tile(
    run: SweepRun, k: int, names: Sequence[str], best: int | None = None
) -> dict[str, Any]:
    """Return the tile of a finished setting: label, pattern distance, time, and picture.

    `names` are the parameters in the label, and `best` is the number of the recommended setting.
    """
    row = run.latest_result.rows[k]
    label, bits = plan.label(row.parameters, names), three_digits(row.quality.pattern_distance)
    return {
        "label": label,
        "note": f"{bits} bits · {duration(row.quality.cpu_seconds)}",
        "name": f"Setting {label}",
        "png": b64encode(run.pictures[k]).decode(),
        "badge": "recommended" if k == best else "",
        "value": k,
    }


def trials_of(choices: Choices, settings: Iterable[Parameters]) -> list[Trial]:
    """Return the study with each setting; raise `CCWSIMError` if its parts cannot be read."""
    study = Trial(**study_inputs(choices))
    with suppress(CCWSIMError):  # without data in inactive cells; the run reports errors
        study = replace(study.fitting(), checked=False)
    return [replace(study, parameters=parameters) for parameters in settings]


def shown_in(state: State) -> dict[str, Any]:
    """Return the facies and the colours with which a new run is shown."""
    n_facies = state.image.n_facies
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
    with st.container(key="news"):  # always drawn, so that elements below do not move
        if run is not None and run.job is not None and run.going:
            rows, n_drawn, drawn_at = run.rows, len(run.rows), time.monotonic()
            follow(
                run.job,
                has_news=lambda: (
                    len(rows) > n_drawn and time.monotonic() - drawn_at > redraw_seconds
                ),
                label=run.label,
                **options,
            )
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


@dataclass
class TuningState(RunState[SweepRun]):
    """The latest search for good settings, and whether its dialog is open."""

    is_open: bool = False


def tuned_trials(choices: Choices) -> list[Trial]:
    """Return the study with settings around its own, fastest first, if there is time for them."""
    image = image_of(choices.image)
    ranges = ranges_around(choices.parameters, image)
    trials = trials_of(choices, plan.plan_sweep(choices.parameters, ranges, image.shape))
    trials.sort(key=partial(typical, judged=True))
    ends = accumulate(N_TUNED * typical(trial, judged=True) for trial in trials)
    n = sum(seconds <= TUNING_SECONDS for seconds in ends)
    return trials[: max(n, plan.MIN_SUGGESTED)]


def find_settings(state: State) -> None:
    """Open the dialog; start a search, unless the latest one is of this study."""
    tuning, choices = state.page(TuningState), state.choices
    run, key = tuning.run, (study_key(choices), choices.parameters)
    tuning.is_open = True
    if run is None or run.key != key or (not run.going and run.latest_result.stopped):

        def make() -> SweepRun:
            trials = tuned_trials(choices)
            is_slow = expected_seconds(trials, N_TUNED, judged=True) > TUNING_SECONDS
            n = FEW_TUNED if is_slow else N_TUNED
            return SweepRun(trials=trials, n_realizations=n, key=key, **shown_in(state))

        tuning.start(make)


def close_settings() -> None:
    """Note that the dialog is closed; a search that is going continues."""
    session_state().page(TuningState).is_open = False


def find_button(state: State) -> None:
    """Draw the button that searches for good settings, and the dialog with its results."""
    problem = study_problem(state)
    button(
        "Find good settings",
        key="find_settings",
        on_click=find_settings,
        args=(state,),
        disabled=bool(problem),
        help=problem or page_text("Find good settings"),
    )
    if state.page(TuningState).is_open:
        _draw_settings_dialog(state)


@st.dialog("Good settings", width="large", on_dismiss=close_settings)
def _draw_settings_dialog(state: State) -> None:
    with error_boundary():
        tuning = state.page(TuningState)
        if not tuning.is_open:  # a setting was taken
            st.rerun()
        run = tuning.run
        if run is not None and run.job is not None and run.going:
            step_note(f"Tries {plural(run.n_pieces, 'setting')} around the present one:")
            follow(run.job, label=run.label, keys=("tuning_progress", "tuning_cancel"))
        elif run is not None and run.latest_result.rows:
            _offer_settings(state, run)
        if message := tuning.message or (run and run.describe_end()):
            st.warning(plain(message))
        step_note(advice_on(state.image, state.choices.parameters))


def _offer_settings(state: State, run: SweepRun) -> None:
    """Draw three settings; a click takes a setting and closes the dialog."""
    results = run.latest_result
    choice, rows = recommended(results), results.rows
    names = [name for name in plan.RANGED if name in {*plan.SIZES, *plan.varied(run.settings)}]

    def take(k: int) -> None:
        state.change(parameters=rows[int(k)].parameters)
        close_settings()

    step_note("Click a setting to use it. Each is faster or closer in patterns than the others.")
    tiles = [setting_tile(run, k, names, choice.index) for k in nearest_on_front(results)]
    width, height = tile_size(run.grid.shape[-2:], 2 * TILE_PIXELS)
    options = {"kind": "settings", "width": width, "height": height}
    draw_tiles("good_settings", "Good settings; a click takes one", tiles, take, **options)
    best = plan.label(rows[choice.index].parameters, names)
    step_note(f"Recommended: {best}. {choice.reason}")
