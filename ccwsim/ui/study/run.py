"""Step 5 of the study: the run button, a run, its progress, its results and messages."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from html import escape
from typing import Any

import streamlit as st

from ccwsim import Cancelled, CCWSIMError, Ensemble, Parameters, concatenate
from ccwsim.datasets.default_study import stored_ensemble
from ccwsim.engine.realization import is_ready
from ccwsim.experiments.timing import typical
from ccwsim.experiments.trials import Trial
from ccwsim.jobs.job import FIRST_RESULT_SECONDS, Job, server_queue
from ccwsim.jobs.limits import Demand, limits_of_environment, needs_consent
from ccwsim.model import (
    MAX_REALIZATIONS,
    MAX_SEED,
    Watch,
    duration,
    fitted,
    format_bytes,
    levels,
    per_axis,
)
from ccwsim.run.executors import executor_of_environment
from ccwsim.run.footprint import demand_of
from ccwsim.run.shared import MAX_SHARED, MAX_SHARED_BYTES, SharedRun, SharedRuns
from ccwsim.run.simulation import simulate_study
from ccwsim.sharing.choices import Choices
from ccwsim.sharing.link import KEY_OF, files_named
from ccwsim.system.log import reason
from ccwsim.system.machine import n_cores
from ccwsim.ui.session import PastRun, State, cached, follow, go_to, resolve
from ccwsim.ui.study.changes import changes_between
from ccwsim.ui.widgets import (
    bound_to,
    button,
    field,
    if_possible,
    in_row,
    page_text,
    pair,
    plain,
    problem_in,
    step_note,
    step_title,
)

SIMULATE_PAGE = "pages/simulate.py"
ENOUGH_TO_STOP = 1.0  # maximum seconds to wait until a stopped run has freed its memory
FIRST_PART_SECONDS = 0.3  # maximum duration of the first part of a run in seconds
NEXT_PART_SECONDS = 1.0
"""Seconds of the second part of a run; each later part takes twice as long as the part before."""
MIN_PART = 2
COPIES_OF_PARTS = 3
"""Maximum copies of the realizations in memory: earlier parts, next part, and all parts joined."""
NEARLY_ALL = 0.7
"""If this share of the remaining realizations fits into a part, the part includes all of them."""
MORE = "More realizations estimate the uncertainty better and take proportionally longer."
SAME_SEED = "The same seed gives the same realizations, on any machine."
LIVE = "Start a run after every change of the study. On by default if a run is short."
SHORT = 0.5  # maximum estimated seconds of a run that every change starts by default
STORED_NOTE = "Stored realizations of this study are shown until your machine has computed them"
FIRST_VOLUME_SECONDS = 0.7
"""Seconds to wait for the first new volume, because drawing the old volume takes longer."""
WAIT_SECONDS = 0.05
"""Seconds between checks whether the user has changed the study; a change ends the waiting."""
SimulateRange = Callable[[int, int, Watch], Ensemble]
"""A function f(first, n, watch) that simulates realizations first … first + n − 1."""


def run_step(state: State) -> None:
    """Draw step 5 of the study."""
    with st.container(key="run_step"):
        step_title(5, "Realizations")
        numbers = {
            "n_realizations": ("How many", 1, MAX_REALIZATIONS, MORE),
            "seed": ("Seed", 0, MAX_SEED, SAME_SEED),
        }
        for column, (name, (label, low, high, tip)) in zip(pair(), numbers.items(), strict=True):
            with column:
                field(
                    st.number_input,
                    label,
                    key=name,
                    help=tip,
                    **bound_to(state.choices, name, state.change, min_value=low, max_value=high),
                )
        if limits := str(limits_of_environment()):
            step_note(limits)
        with in_row("run_row"):
            run_button(state, "run")
            field(
                st.toggle,
                "Live",
                key="live",
                help=LIVE,
                **bound_to(state, "live", value=is_live(state)),
            )


def run_button(state: State, key: str, width: str = "stretch") -> None:
    """Draw a button that starts a run; if the study cannot run, the button is disabled."""
    problem = study_problem(state)
    button(
        "Run",
        key=key,
        on_click=start_run,
        args=(state,),
        help=problem or None,
        type="primary",
        width=width,
        disabled=bool(problem),
    )


def simulate_button(state: State, key: str) -> None:
    """Draw a button that starts a run and opens the page Simulate."""
    if button("Simulate", key=key, on_click=start_run, args=(state,), type="primary"):
        go_to(SIMULATE_PAGE)


def study_problem(state: State) -> str:
    """Return the reason why the study cannot run, or an empty text."""
    choices = state.choices

    def check() -> None:
        n_data = resolve.study_of(choices).hard_data.n
        limits_of_environment().check(Demand(choices.grid.n_cells * choices.n_realizations, n_data))

    return problem_in(check)


def start_run(state: State, after: float = 0.0) -> None:
    """Simulate the present study `after` seconds from now, and stop a run in progress."""
    before, choices = state.job, state.choices
    try:
        simulate_range = part_of(choices)
        limits_of_environment().check(demand_of_run(choices))
    except CCWSIMError as error:
        state.message = str(error)
        return
    stop_run(state)
    state.last_attempt, state.needs_confirmation, state.missing = choices, False, {}

    def begin() -> None:
        state.job = _begun(state, choices, simulate_range, after)

    state.message = problem_in(begin)
    if state.message and before is not None and before.wait(ENOUGH_TO_STOP):
        state.message = problem_in(begin)  # the previous run has freed its memory


def start_run_if_needed(state: State, *, live: bool, after: float = 0.0) -> bool:
    """Start the first run of a session and, if `live`, a new run after every change of the study.

    The run begins when the study has not changed for `after` seconds. A run that needs the user's
    consent is not started (see `question_of`). Return whether a run was started or stopped.
    """
    first = state.ensemble is None and state.job is None and not state.message
    if not first and not (live and _is_changed(state)):
        return False
    job, ensemble = state.job, state.ensemble
    if ensemble is not None and is_current(state) and ensemble.n == state.choices.n_realizations:
        stop_run(state)  # the results already belong to this study
    elif question_of(state):
        stop_run(state)
    elif first or not study_problem(state):
        start_run(state, after)
    else:
        stop_run(state)  # the running job simulates an earlier study
    return state.job is not job


def is_live(state: State) -> bool:
    """Whether every change of the study starts a run: as the user chose, or if a run is short."""
    return estimated_seconds(state.choices) < SHORT if state.live is None else state.live


def question_of(state: State) -> str:
    """Return the question to ask before a run of a study from a link or project, or ""."""
    if files := missing_files(state):
        return page_text("Missing files", files=files)
    if not state.needs_confirmation or study_problem(state):
        return ""
    seconds, demand = estimated_seconds(state.choices), demand_of_run(state.choices)
    if not needs_consent(demand, seconds, server_queue().still_to_take):
        return ""
    memory = format_bytes(demand.n_bytes)
    return page_text("Long run", duration=duration(seconds, rough=True), memory=memory)


def missing_files(state: State) -> str:
    """Return the names of files of a link that are not on this server and not chosen since."""
    choices = state.choices
    chosen = {KEY_OF[type(part)]: part for part in (choices.image, choices.data, choices.guides)}
    state.missing = {k: text for k, text in state.missing.items() if chosen[k] == type(chosen[k])()}
    return ", ".join(map(files_named, state.missing.values()))


def estimated_seconds(choices: Choices) -> float:
    """Return the estimated seconds of a run that shares the cores with the runs of others."""
    n, cores = choices.n_realizations, n_cores() / (1 + server_queue().n_of_others)
    return n * _seconds_of_one(choices, choices.parameters) / min(cores, n)


def _seconds_of_one(choices: Choices, parameters: Parameters) -> float:
    """Return the estimated seconds of one realization of a study with other parameters."""
    inputs = if_possible(lambda: resolve.study_inputs(choices))
    bare = {"training_image": resolve.image_of(choices.image), "grid": choices.grid}
    return typical(Trial(**{**(inputs or bare), "parameters": parameters}))


def describe_price(choices: Choices, **changes: Any) -> str:
    """Return the estimated time of a realization after changes of parameters, and its ratio."""
    image = resolve.image_of(choices.image)
    fitting = resolve.fitted_to_image(choices, image)
    present = _seconds_of_one(fitting, fitting.parameters)
    changed = _seconds_of_one(fitting, fitted(fitting.parameters, image.shape, **changes))
    time_text = duration(float(f"{changed:.2g}"))
    return f"about {time_text} a realization, {changed / present:.2g} × the present setting"


def describe_prices_of_levels(choices: Choices) -> str:
    """Describe the times of a realization at the next lower and the next higher level."""
    shape, p = resolve.image_of(choices.image).shape, choices.parameters
    z, _, present = p.along(shape).level
    near = [k for k in levels(shape) if abs(k - present) == 1 and p.method != "ccsim"]
    tried = [(k, per_axis((z, k, k), shape)) for k in near]
    prices = [f"Level {k}: {describe_price(choices, wavelet_level=level)}" for k, level in tried]
    return "\n".join(prices)


def _is_changed(state: State) -> bool:
    """Return whether the study differs from the latest run, including a run that failed."""
    latest = state.job.about if state.job else state.ensemble_choices
    return not any(
        choices and resolve.same_realizations(choices, state.choices)
        for choices in (latest, state.last_attempt)
    )


def is_current(state: State) -> bool:
    """Return whether the results belong to the present study."""
    simulated = state.ensemble_choices
    return simulated is not None and resolve.same_realizations(simulated, state.choices)


def take_names(state: State) -> None:
    """Rename the facies of the results as in the present study, if the results belong to it."""
    if state.ensemble is None or state.ensemble_choices == state.choices or not is_current(state):
        return
    state.ensemble_choices = state.choices
    image = state.image
    state.ensemble = replace(
        state.ensemble, study=replace(state.ensemble.study, training_image=image)
    )


def _begun(
    state: State, choices: Choices, simulate_range: SimulateRange, after: float
) -> Job[Ensemble]:
    """Queue a study and return the job; if memory is scarce, the job has only one part."""
    state.realization_to_restore, n = state.shown, choices.n_realizations
    waits_for_kernels = state.ensemble is None and not is_ready() and choices == Choices()
    runs, image = shared_runs(), resolve.image_of(choices.image)
    names = image.name, image.facies_names  # the page shows the names
    key = *resolve.study_of(choices).key(), n, *names

    if (ensemble := runs.get(key)) is not None:
        return Job(lambda job: ensemble, choices, n=n)

    def begun(n_first: int, copies: int) -> Job[Ensemble]:
        def work(job: Job[Ensemble]) -> Ensemble:
            job.sleep(after)
            if waits_for_kernels:  # stored realizations are shown until the job has computed them
                job.publish_partial(stored_ensemble())
            return runs.ensemble_for(job, key, lambda run: in_parts(run, simulate_range, n_first))

        return Job(work, choices, demand_of_run(choices, copies), n=n)

    n_first = first_part(choices, state.ensemble)
    try:
        return begun(n_first, COPIES_OF_PARTS if n_first < n else 1)
    except CCWSIMError:
        if n_first == n:
            raise
        return begun(n, 1)


@cached()
def shared_runs() -> SharedRuns:
    """Return the only store of runs of this server."""
    return SharedRuns(MAX_SHARED, MAX_SHARED_BYTES, min_values=0)


def in_parts(
    job: Job[Ensemble] | SharedRun, simulate_range: SimulateRange, n_first: int
) -> Ensemble:
    """Simulate an ensemble in parts; the first part is small. Parts do not affect the result."""
    size, budget = min(n_first, job.n), NEXT_PART_SECONDS
    start = time.monotonic()
    whole = _with_part(job, simulate_range, None, size)
    while whole.n < job.n:
        job.publish_partial(whole)
        seconds_each = (time.monotonic() - start) / whole.n
        size = part_size(job.n - whole.n, budget / seconds_each)
        whole = _with_part(job, simulate_range, whole, size)
        budget *= 2
    return whole


def _with_part(
    job: Job[Ensemble] | SharedRun,
    simulate_range: SimulateRange,
    before: Ensemble | None,
    size: int,
) -> Ensemble:
    watch = Watch(job.report, job.is_cancelled)
    if size == job.n:
        return simulate_range(0, size, watch)
    done = before.n if before else 0
    part = watch.part(done / job.n, (done + size) / job.n, done)
    parts = [before] if before else []
    try:
        return concatenate([*parts, simulate_range(done, size, part)])
    except Cancelled as stopped:
        parts += [stopped.ensemble] if stopped.ensemble else []
        ended = concatenate(parts) if parts else None
        message = f"stopped after {ended.n if ended else 0} of {job.n} realizations"
        raise Cancelled(message, ended) from None


def first_part(choices: Choices, latest: Ensemble | None) -> int:
    """Return the number of realizations in the first part, based on the latest run's speed."""
    if latest is None or latest.wall_seconds <= 0:
        return MIN_PART
    seconds_each = latest.wall_seconds / latest.n * choices.grid.n_cells / latest.grid.n_cells
    return part_size(choices.n_realizations, FIRST_PART_SECONDS / seconds_each)


def part_size(n_left: int, fits: float) -> int:
    """Return the size of the next part; `n_left` realizations remain, and time allows `fits`."""
    cores = n_cores()
    size = max(int(fits) // cores * cores, cores, MIN_PART)
    return n_left if fits >= NEARLY_ALL * n_left else min(size, n_left)


def demand_of_run(choices: Choices, copies: int = 1) -> Demand:
    """Return the resources for a run of a study whose results are in memory `copies` times."""
    return demand_of(resolve.study_of(choices), choices.n_realizations, copies=copies)


def stop_run(state: State) -> None:
    """Stop the present run, if any, and ignore its further results."""
    if state.job is not None:
        state.job.cancel()
        state.job = None


def part_of(choices: Choices) -> SimulateRange:
    """Return a function f(first, n, watch) that simulates realizations of a study."""
    study = resolve.study_of(choices, checked=False)

    def simulate_range(first: int, n: int, watch: Watch) -> Ensemble:
        return simulate_study(
            study,
            n,
            progress=watch.progress,
            cancel=watch.cancel,
            first_realization=first,
            executor=executor_of_environment(),
        )

    return simulate_range


def collect(state: State, *, parts: bool = True) -> None:
    """Store the results of a job or, if `parts`, partial results; otherwise keep the earlier."""
    job = state.job
    if job is None:
        return
    if not job.finished:
        if job.partial is not None and (parts or state.ensemble is None):
            take_in(state, job, job.partial)
        return
    state.job = None
    ensemble = job.result
    if isinstance(job.error, Cancelled):
        ensemble = job.error.ensemble
        state.message = stopped(job.error, state.ensemble is not None)
    elif job.error is not None:
        state.message = failed(job.error)
    if ensemble is not None:
        take_in(state, job, ensemble)
        state.runs.remember(PastRun(job.about, ensemble, state.reference))


def take_in(state: State, job: Job[Ensemble], ensemble: Ensemble) -> None:
    """Show the results of a job; the same realization as before is shown large."""
    restored = state.realization_to_restore
    at_start = min(restored, state.ensemble.n - 1) if state.ensemble else restored
    if state.shown == at_start:  # the user has not chosen another realization during the run
        state.shown = restored
    state.ensemble, state.ensemble_choices = ensemble, job.about
    state.shown = min(state.shown, ensemble.n - 1)


def stopped(error: Cancelled, has_older: bool) -> str:
    """Return a message about the results of a cancelled run."""
    if error.ensemble is not None:
        return f"{str(error).capitalize()}; these are shown."
    return "Stopped before the first realization was finished." + (
        " The earlier results are still shown." if has_older else ""
    )


def failed(error: Exception) -> str:
    """Return a message that states why a run has no results."""
    if isinstance(error, CCWSIMError):
        return str(error)
    if isinstance(error, MemoryError):
        return "The results do not fit into memory: ask for fewer realizations or a smaller grid."
    return f"The run failed; your study is kept. The reason: {reason(error)}."


def draw_news(state: State, *, parts: bool = True, wait: bool = True) -> None:
    """Follow the present run, dim results that are out of date, and report failures.

    If `parts` is false, earlier results stay until the run is finished. If `wait` is false, the
    page does not wait for a run that has just begun.
    """
    take_names(state)
    with st.container(key="news"):  # always drawn, so that Streamlit keeps the elements below
        patience = FIRST_VOLUME_SECONDS if state.grid.is_volume else FIRST_RESULT_SECONDS
        outdated = _wait_and_dim(state, parts, patience if wait else 0.0)
        if state.job is not None:
            _follow_run(state, parts)
        waits = state.job is None and (state.ensemble is None or outdated)
        for message in filter(None, (state.message, question_of(state) if waits else "")):
            st.warning(plain(message))
        if waits:
            with _outdated(outdated):
                run_button(state, "run_news", width="content")


def draw_out_of_date(text: str) -> None:
    """Dim results of an earlier study; `text` describes the differences to the present study."""
    _mark(st, "outdated")
    with _outdated(text):
        pass


def out_of_date(state: State) -> str:
    """Describe how the study differs from the study of the results; empty without differences."""
    if state.ensemble is None or state.ensemble_choices is None or is_current(state):
        return ""
    changes = changes_between(state.ensemble_choices, state.choices)
    return f"simulated before these changes: {', '.join(changes)}."


@contextmanager
def _outdated(text: str) -> Iterator[None]:
    """Draw a row with a note on outdated results, and elements drawn in the context."""
    with in_row("outdated"):
        if text:
            st.html(f'<p role="status"><b>Out of date:</b> {escape(text)}</p>')
        yield


def _wait_and_dim(state: State, parts: bool, patience: float) -> str:
    """Wait a short time for results of a run, and dim older results.

    Return the text of `out_of_date`. The element that dims results is replaced in place, so that
    nothing on the page moves. `style.css` defines the style of each state.
    """
    place, job = st.empty(), state.job
    if job is not None:
        end = time.monotonic() + patience
        while True:
            _mark(place, "soon-old")  # very short runs do not dim results
            first = job.wait_first if parts else job.wait
            if first(WAIT_SECONDS) or time.monotonic() > end:
                break
        collect(state, parts=parts)  # `_follow_run` collects later results
    outdated = out_of_date(state)
    if state.job is not None:
        _mark(place, "old" if outdated or state.ensemble is None else "partly")
    else:
        _mark(place, "outdated" if outdated else "current")
    return outdated


def _mark(place: Any, results: str) -> None:
    place.html(f'<i class="results-{results}"></i>')


def _follow_run(state: State, parts: bool) -> None:
    """Show the progress of the run, and redraw the page for each part of the results."""
    job = state.job
    assert job is not None

    def has_news() -> bool:
        shows_parts = parts or state.ensemble is None
        return shows_parts and job.partial is not None and job.partial is not state.ensemble

    follow(
        job,
        on_finished=lambda: collect(state, parts=parts),
        has_news=has_news,
        label=lambda: STORED_NOTE if state.ensemble and state.ensemble.is_stored else "",
    )
