"""Step 5 of the study, the run button; and the run: start it, follow it, take in what it gives."""

from __future__ import annotations

import time
from collections.abc import Callable

import streamlit as st

from ccwsim.datasets.default_study import stored_ensemble
from ccwsim.engine.kernels import compile_apart, is_ready
from ccwsim.model.bounds import MAX_REALIZATIONS, MAX_SEED
from ccwsim.model.choices import Choices
from ccwsim.model.ensemble import Ensemble, joined
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.study import Study
from ccwsim.run.simulation import simulate
from ccwsim.system.workers import n_cores
from ccwsim.ui.jobs.job import Cancel, Job, Progress
from ccwsim.ui.jobs.limits import (
    Demand,
    check_limits,
    demand_of,
    executor_of_environment,
    limits_of_environment,
)
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import PastRun, State
from ccwsim.ui.widgets.errors import reason
from ccwsim.ui.widgets.fields import bound_to, button, field
from ccwsim.ui.widgets.text import pair, plain, step_note, step_title

STORED = "Stored realizations of this study are shown until your machine has its own"
PATIENCE = 0.3
"""Seconds to wait for a quick run before progress is shown instead."""
ENOUGH_TO_STOP = 1.0
"""Seconds in which a run that was stopped gives its memory back."""
AT_ONCE = 0.3
"""Seconds that the first part of a live run may take."""
NEXT_PART = 1.0
"""Seconds of the second part; each later one takes twice as long, as drawing costs time too."""
MIN_PART = 2
NEARLY_ALL = 0.7
"""A part that is so large a share of what is left takes all of it."""
MORE = "More show the uncertainty better and take proportionally longer."
SAME_SEED = "The same seed gives the same realizations, on any machine."
Some = Callable[[int, int, Progress, Cancel], Ensemble]
"""Called as some(first, n, progress, cancel): realizations first … first + n − 1 of a study."""


def run_step(state: State) -> None:
    """Draw the step; what is not ready says what it needs."""
    step_title(5, "Realizations")
    numbers = {
        "n_realizations": ("How many", 1, MAX_REALIZATIONS, MORE),
        "seed": ("Seed", 0, MAX_SEED, SAME_SEED),
    }
    for column, (name, (label, low, high, tip)) in zip(pair(), numbers.items(), strict=True):
        with column:
            number = bound_to(state.choices, name, state.change, min_value=low, max_value=high)
            field(st.number_input, label, key=name, help=tip, **number)
    if limits := str(limits_of_environment()):
        step_note(limits)
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="run_row"):
        run_button(state, "run")
        live = bound_to(state, "live", help="Run again after every change.")
        field(st.toggle, "Live", key="live", **live)


def run_button(state: State, key: str) -> None:
    """Draw a button that starts a run; it is off, and says why, where the study cannot run."""
    problem = problem_of(state)
    options = {"type": "primary", "width": "stretch", "disabled": bool(problem)}
    button("Run", key=key, on_click=start_run, args=(state,), help=problem or None, **options)


def problem_of(state: State) -> str:
    """Return why the study cannot run, or an empty text."""
    choices = state.choices
    try:
        data = data_of(choices)
        Study(image_of(choices.image), choices.grid, choices.parameters, data, choices.seed)
        cells = choices.grid.ny * choices.grid.nx
        check_limits(Demand(cells * choices.n_realizations, data.n))
    except CCWSIMError as error:
        return str(error)
    return ""


def start_run(state: State) -> None:
    """Simulate the study as it is set up; a run that is still going is stopped."""
    before = state.job
    try:
        some, demand = part_of(state.choices), demand_of_run(state)
        check_limits(demand)
    except CCWSIMError as error:
        state.message = str(error)
        return
    stop_run(state)
    state.message, state.tried = "", state.choices
    try:
        state.job = _begun(state, some, demand)
    except CCWSIMError as error:
        if before is None or not before.wait(ENOUGH_TO_STOP):
            state.message = str(error)
            return
        try:  # what the run before had is free by now
            state.job = _begun(state, some, demand)
        except CCWSIMError as again:
            state.message = str(again)


def _begun(state: State, some: Some, demand: Demand) -> Job[Ensemble]:
    """Return the job of the study, which is in the queue."""
    choices, n = state.choices, state.choices.n_realizations
    state.wanted = state.shown
    n_first = first_part(choices, state.ensemble) if state.live else n
    waits_for_kernels = state.ensemble is None and not is_ready() and choices == Choices()

    def work(job: Job[Ensemble]) -> Ensemble:
        if waits_for_kernels:  # the same realizations, stored; the facts and the progress say so
            job.give(stored_ensemble())
        return in_parts(job, some, n_first)

    return Job(work, choices, demand, n=n)


def in_parts(job: Job[Ensemble], some: Some, n_first: int) -> Ensemble:
    """Simulate a few realizations at once and the rest as they come; all are as of one run."""
    size, budget = min(n_first, job.n), NEXT_PART
    start = time.monotonic()
    whole = _with_part(job, some, None, size)
    while whole.n < job.n:
        job.give(whole)
        each = (time.monotonic() - start) / whole.n
        size = part_size(job.n - whole.n, budget / each)
        whole = _with_part(job, some, whole, size)
        budget *= 2
    return whole


def _with_part(job: Job[Ensemble], some: Some, before: Ensemble | None, size: int) -> Ensemble:
    if size == job.n:
        return some(0, size, job.report, job.is_cancelled)
    done = before.n if before else 0

    def report(fraction: float, n_done: int) -> None:
        job.report((done + fraction * size) / job.n, done + n_done)

    parts = [before] if before else []
    try:
        return joined([*parts, some(done, size, report, job.is_cancelled)])
    except Cancelled as stopped:
        parts += [stopped.ensemble] if stopped.ensemble else []
        ended = joined(parts) if parts else None
        said = f"stopped after {ended.n if ended else 0} of {job.n} realizations"
        raise Cancelled(said, ended) from None


def first_part(choices: Choices, latest: Ensemble | None) -> int:
    """Return how many realizations are likely to be finished at once, by the pace of the latest."""
    if latest is None or latest.revised or latest.wall_seconds <= 0:
        return MIN_PART
    cells = choices.grid.ny * choices.grid.nx
    each = latest.wall_seconds / latest.n * cells / (latest.grid.ny * latest.grid.nx)
    return part_size(choices.n_realizations, AT_ONCE / each)


def part_size(left: int, fits: float) -> int:
    """Return how many of `left` realizations make the next part, where time does for `fits`.

    Examples
    --------
    >>> part_size(100, 0.2), part_size(100, 31.0), part_size(12, 10.0)
    (2, 30, 12)
    """
    cores = n_cores()
    size = max(int(fits) // cores * cores, cores, MIN_PART)
    return left if fits >= NEARLY_ALL * left else min(size, left)


def demand_of_run(state: State) -> Demand:
    """Return what the study asks of the server; with Live on parts are put together."""
    choices = state.choices
    image, data = image_of(choices.image), data_of(choices)
    study = Study(image, choices.grid, choices.parameters, data, choices.seed)
    return demand_of(study, choices.n_realizations, copies=3 if state.live else 1)


def stop_run(state: State) -> None:
    """Stop the run that is going, if one is, and never show what it still gives."""
    if state.job is not None:
        state.job.cancel()
        state.job = None


def part_of(choices: Choices) -> Some:
    """Return the work of some realizations of a study, as some(first, n, progress, cancel)."""
    image, data = image_of(choices.image), data_of(choices)

    def some(first: int, n: int, progress: Progress, cancel: Cancel) -> Ensemble:
        executor = executor_of_environment()
        if executor is None and not is_ready():  # the workers of a cluster compile for themselves
            compile_apart(cancel)
        return simulate(
            image,
            grid_shape=choices.grid,
            parameters=choices.parameters,
            hard_data=data,
            n_realizations=n,
            seed=choices.seed,
            progress=progress,
            cancel=cancel,
            first_realization=first,
            executor=executor,
        )

    return some


def collect(state: State) -> None:
    """Take what a job gives into the state; earlier results stay where it gave none."""
    job = state.job
    if job is None:
        return
    if not job.finished:
        if job.partial is not None:
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
        state.runs.remember(PastRun.of(job.about, ensemble, state.reference))


def take_in(state: State, job: Job[Ensemble], ensemble: Ensemble) -> None:
    """Show what a job gave; the realization that was large is again, when it is there."""
    shown = min(state.wanted, state.ensemble.n - 1) if state.ensemble else state.wanted
    if state.shown == shown:  # the user chose no other one meanwhile
        state.shown = state.wanted
    state.ensemble, state.ran = ensemble, job.about
    state.shown = min(state.shown, ensemble.n - 1)


def stopped(error: Cancelled, has_older: bool) -> str:
    """Say what a cancelled run left."""
    if error.ensemble is not None:
        return f"{str(error).capitalize()}; these are shown."
    return "Stopped before the first realization was finished." + (
        " The earlier results are still shown." if has_older else ""
    )


def failed(error: Exception) -> str:
    """Say why a run gave nothing."""
    if isinstance(error, CCWSIMError):
        return str(error)
    if isinstance(error, MemoryError):
        return "The results do not fit into memory: ask for fewer realizations or a smaller grid."
    return f"The run failed; your study is kept. The reason: {reason(error)}."


def follow_run(state: State) -> None:
    """Show progress where the results will be; the page is drawn again for each part of them."""
    job = state.job
    if job is not None:
        follow(
            job,
            on_finished=lambda: collect(state),
            has_news=lambda: job.partial is not None and job.partial is not state.ensemble,
            label=lambda: STORED if state.ensemble and state.ensemble.is_stored else "",
        )


def draw_news(state: State) -> None:
    """Take in a quick run, or follow a slow one above the earlier results; say what failed."""
    if state.job is not None and state.job.wait(PATIENCE):
        collect(state)
    with st.container(key="news"):  # always there, so that what is below never moves or blanks
        if state.job is not None:
            follow_run(state)
            if state.ensemble is not None:
                st.html("<style>.st-key-results { opacity: 0.4 }</style>")
        if state.message:
            st.warning(plain(state.message))
