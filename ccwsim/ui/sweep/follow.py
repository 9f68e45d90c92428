"""Follow a sweep: progress, time left, a way to stop; and new settings as they come."""

from __future__ import annotations

import time

from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.state import State
from ccwsim.ui.sweep.run import SweepRun
from ccwsim.ui.sweep.state import SweepState
from ccwsim.ui.widgets.errors import reason

REDRAW_SECONDS = 1.5
"""Seconds at least from one look at new settings to the next."""


def follow_sweep(state: State, drawn_at: float) -> None:
    """Show how far the sweep is; draw the page again for new settings and at the end."""
    run = state.page(SweepState).run
    if run is None or run.job is None:
        return

    def has_news() -> bool:
        return len(run.rows) > run.n_drawn and time.monotonic() - drawn_at > REDRAW_SECONDS

    follow(run.job, has_news=has_news, keys=("sweep_progress", "sweep_cancel"))


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
