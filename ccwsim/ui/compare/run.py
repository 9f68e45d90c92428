"""Start a comparison, follow it, and take in what it gives."""

from __future__ import annotations

import streamlit as st

from ccwsim.experiments.comparison import Comparison, add_curves, compare
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.study import Study
from ccwsim.ui.compare.settings import LETTERS, MIN_SETTINGS, Asked, Comparing, Run, settings_of
from ccwsim.ui.jobs.admission import Demand, demand_of
from ccwsim.ui.jobs.job import Cancel, Job, Progress, held_up
from ccwsim.ui.session.guarding import error_boundary
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import POLL_EVERY, failed
from ccwsim.ui.widgets.fields import button


def asked_of(state: State) -> Asked:
    """Return what a comparison would be asked for now."""
    c = state.choices
    return Asked(c.image, c.data, c.grid, c.seed, state.page(Comparing).n, settings_of(state))


def start_comparison(state: State) -> None:
    """Compare the settings as they are; a comparison that is still going is stopped."""
    page_state = state.page(Comparing)
    try:
        run = Run(asked_of(state))
        image, data = image_of(state.choices.image), data_of(state.choices)
    except CCWSIMError as error:
        page_state.message = str(error)
        return
    if page_state.job is not None:
        page_state.job.cancel()
    asked, facies = run.asked, min(state.facies, image.n_facies - 1)

    def work(progress: Progress, cancel: Cancel) -> Comparison:
        settings = dict(zip(LETTERS, asked.settings, strict=False))
        return compare(
            image, asked.grid, settings, data, asked.n, asked.seed, progress, cancel,
            facies=facies, on_partial=run.take,
        )  # fmt: skip

    page_state.message = ""
    try:
        page_state.job = Job(work, run, _demand(state, asked))
    except CCWSIMError as error:
        page_state.job, page_state.message = None, str(error)


def _demand(state: State, asked: Asked) -> Demand:
    """Return what a comparison asks of the server: all its realizations are kept."""
    image, data = image_of(state.choices.image), data_of(state.choices)
    each = [
        demand_of(Study(image, asked.grid, p, data, asked.seed), asked.n) for p in asked.settings
    ]
    n_cells = sum(demand.n_cells for demand in each)
    return Demand(n_cells, data.n, sum(demand.n_bytes for demand in each))


def want_curves(state: State) -> None:
    """Work out the curves of the chosen facies where the comparison does not have them yet."""
    page_state = state.page(Comparing)
    found = page_state.found
    if page_state.job is not None or found is None or has_curves(found, state.facies):
        return
    assert page_state.asked is not None
    facies = state.facies
    page_state.job = Job(
        lambda progress, cancel: add_curves(found, facies, progress, cancel),
        about=Run(page_state.asked, found),
    )


def has_curves(found: Comparison, facies: int) -> bool:
    """Return whether the curves of a facies are known."""
    return any(key[0] == facies for key in found.curves)


def collect_comparison(state: State) -> None:
    """Take what a finished job gives; earlier results stay where it gave none."""
    page_state = state.page(Comparing)
    job = page_state.job
    if job is None or not job.finished:
        return
    page_state.job = None
    run: Run = job.about
    found = job.result
    if isinstance(job.error, Cancelled):
        found = run.partial
        if found is not None and len(found.names) < MIN_SETTINGS:
            found = None
        page_state.message = _stopped(found, len(run.asked.settings), page_state.found is not None)
    elif job.error is not None:
        page_state.message = failed(job.error)
    if found is not None:
        page_state.found, page_state.asked = found, run.asked


def _stopped(found: Comparison | None, n: int, has_older: bool) -> str:
    if found is not None:
        all_ = "all" if len(found.names) == n else f"{len(found.names)} of {n}"
        return f"Stopped after {all_} settings were simulated; what was worked out is shown."
    return "Stopped before two settings were simulated." + (
        " The earlier comparison is still shown." if has_older else ""
    )


@st.fragment(run_every=POLL_EVERY)
def follow_comparison(state: State, n_parts: int) -> None:
    """Show progress, with a way to stop; draw the page again when more is known, and at the end.

    Parameters
    ----------
    state : State
    n_parts : int
        How often there was more when the page was drawn.
    """
    with error_boundary():
        job = state.page(Comparing).job
        if job is None or job.finished:
            collect_comparison(state)
            st.rerun()
        if job.about.n_parts != n_parts:
            st.rerun()
        with st.container(horizontal=True, vertical_alignment="center", key="progress"):
            st.progress(min(job.fraction, 1.0), text=said_progress(job))
            button(
                "Cancel",
                key="cancel",
                on_click=job.cancel,
                disabled=job.cancelled,
            )


def said_progress(job: Job[Comparison]) -> str:
    """Say how far a comparison is."""
    run: Run = job.about
    if said := held_up(job):
        return said
    total, known = run.asked.n * len(run.asked.settings), run.partial
    text = f"{job.n_done} of {total} realizations"
    if job.n_done >= total:
        text = "Comparing patterns" if known and known.curves else "Comparing curves"
    left = job.seconds_left
    if job.seconds > 2 and left is not None:
        text += f" · {left:.0f} s left"
    return text
