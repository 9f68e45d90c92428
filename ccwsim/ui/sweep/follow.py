"""Follow a sweep: progress, time left, a way to stop; and new settings as they come."""

from __future__ import annotations

import time

import streamlit as st

from ccwsim.ui.jobs.job import held_up
from ccwsim.ui.session.guarding import error_boundary
from ccwsim.ui.session.state import State
from ccwsim.ui.sweep.run import SweepRun
from ccwsim.ui.sweep.state import SweepState
from ccwsim.ui.widgets.errors import reason
from ccwsim.ui.widgets.facts import seconds
from ccwsim.ui.widgets.fields import button

POLL_EVERY = 0.5
POLL_SECONDS = 1.5
"""Seconds at least from one look at new settings to the next."""


@st.fragment(run_every=POLL_EVERY)
def follow_sweep(state: State, drawn_at: float) -> None:
    """Show how far the sweep is; draw the page again for new settings and at the end."""
    with error_boundary():
        run = state.page(SweepState).run
        if run is None or not run.going:
            st.rerun()
        if len(run.rows) > run.n_drawn and time.monotonic() - drawn_at > POLL_SECONDS:
            st.rerun()
        job = run.job
        assert job is not None
        with st.container(horizontal=True, vertical_alignment="center", key="sweep_progress"):
            st.progress(min(job.fraction, 1.0), text=progress_text(run))
            button(
                "Cancel",
                key="sweep_cancel",
                on_click=job.cancel,
                disabled=job.cancelled,
            )


def progress_text(run: SweepRun) -> str:
    """Say how far a sweep is."""
    job = run.job
    if said := held_up(job):
        return said
    assert job is not None
    text = f"{job.n_done} of {len(run.settings)} settings"
    left = run.seconds_left
    if job.seconds > 1 and left is not None:
        text += f" · {seconds(max(round(left), 1))} left"
    return text


def said_end(run: SweepRun) -> str:
    """Say what is missing of a sweep that has come to its end, or nothing."""
    found, job = run.found, run.job
    said = []
    if job is not None and job.error is not None:
        said.append(f"The sweep ended early: {reason(job.error)}.")
    if found.stopped and not run.going:
        n, asked = len(found.rows), found.n_asked
        said.append(f"Stopped after {n} of {asked} settings" + ("; these are shown." if n else "."))
    if found.failed:
        said.append(f"{len(found.failed)} could not be simulated: {found.failed[0][1]}.")
    return " ".join(said)
