"""Start a simulation, follow it, and take in what it gives."""

from __future__ import annotations

from collections.abc import Callable

import streamlit as st

from ccwsim.model.choices import Choices
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.study import Study
from ccwsim.run.simulation import simulate
from ccwsim.ui.jobs.admission import Demand, check_limits, demand_of
from ccwsim.ui.jobs.job import Cancel, Job, Progress, held_up
from ccwsim.ui.jobs.scheduler import executor_of_environment
from ccwsim.ui.session.guarding import error_boundary
from ccwsim.ui.session.past_runs import PastRun
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.live_run import LiveRun, first_part
from ccwsim.ui.widgets.errors import reason
from ccwsim.ui.widgets.fields import button

PATIENCE = 0.3
"""Seconds to wait for a quick run before progress is shown instead."""
POLL_EVERY = 0.25
ENOUGH_TO_STOP = 1.0
"""Seconds in which a run that was stopped gives its memory back."""
Some = Callable[[int, int, Progress, Cancel], Ensemble]


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
    choices = state.choices
    if state.live:
        n_first = first_part(choices, state.ensemble)
        return LiveRun(some, choices, n_first, wanted=state.shown, demand=demand)
    n = choices.n_realizations
    return Job(lambda progress, cancel: some(0, n, progress, cancel), choices, demand)


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


def simulation_of(choices: Choices):
    """Return the work of a study, as work(progress, cancel) → Ensemble."""
    some, n = part_of(choices), choices.n_realizations
    return lambda progress, cancel: some(0, n, progress, cancel)


def part_of(choices: Choices) -> Some:
    """Return the work of some realizations of a study, as some(first, n, progress, cancel)."""
    image, data = image_of(choices.image), data_of(choices)

    def some(first: int, n: int, progress: Progress, cancel: Cancel) -> Ensemble:
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
            executor=executor_of_environment(),
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
    if isinstance(job, LiveRun):
        state.shown = job.place_of(state.shown, ensemble.n)
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


@st.fragment(run_every=POLL_EVERY)
def follow_run(state: State) -> None:
    """Show progress where the results will be, with a way to stop; redraw the page at the end."""
    with error_boundary():
        _follow(state)


def _follow(state: State) -> None:
    job = state.job
    news = job is not None and job.partial is not None and job.partial is not state.ensemble
    if job is None or job.finished or news:
        collect(state)
        st.rerun()
    with st.container(horizontal=True, vertical_alignment="center", key="progress"):
        st.progress(min(job.fraction, 1.0), text=progress_text(job))
        button(
            "Cancel",
            key="cancel",
            on_click=job.cancel,
            disabled=job.cancelled,
        )


def progress_text(job: Job[Ensemble]) -> str:
    """Say how far a run is."""
    if said := held_up(job):
        return said
    text = f"{job.n_done} of {job.about.n_realizations} realizations"
    left = job.seconds_left
    if job.seconds > 2 and left is not None:
        text += f" · {left:.0f} s left"
    return text
