"""What the page remembers, and panels that show a statistic as soon as it is known."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import streamlit as st

from ccwsim.ui.jobs.statistics import Failure, LruCache, StatisticsWorker, Task
from ccwsim.ui.session.fragments import follow_tasks
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import PATIENCE
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.steps import step_note

if TYPE_CHECKING:
    from ccwsim.ui.validate.large_ensemble import LargeEnsembleRun

Value = TypeVar("Value")
MIN_STOPPABLE = 3.0
"""Seconds of work after which it can be stopped."""


@st.cache_resource(show_spinner=False)
def shared_values() -> LruCache:
    """Return the values that all sessions share; their keys are digests of contents."""
    return LruCache()


@dataclass
class Validation:
    """What the page remembers.

    Attributes
    ----------
    azimuth : int
        Direction of the third variogram, in degrees from north.
    along : str
        Direction of the transiograms, "E-W" or "N-S".
    tail : int
        Index of the facies whose transitions are shown where there are many.
    seen : set of str
        Sections that came into view; others are not worked out.
    drawn : dict
        By panel, what it drew last, to be dimmed while something new is worked out.
    waiting : dict
        By panel, what it waits for.
    deadline : float
        Until when this run of the page may wait for quick statistics.
    n_long : int
        How many realizations a large ensemble is asked for.
    long_message : str
        Why one was not started.
    """

    azimuth: int = 45
    along: str = "E-W"
    tail: int = 0
    seen: set[str] = field(default_factory=set)
    drawn: dict[str, Callable[[], Any]] = field(default_factory=dict)
    waiting: dict[str, Task] = field(default_factory=dict)
    worker: StatisticsWorker = field(default_factory=lambda: StatisticsWorker(shared_values()))
    deadline: float = 0.0
    n_long: int = 1000
    long_run: LargeEnsembleRun | None = None
    long_message: str = ""


def begin(state: State) -> None:
    """Let this run of the page, or of a part of it, wait for quick statistics."""
    state.page(Validation).deadline = time.monotonic() + PATIENCE


def panel(state: State, name: str, task: Task[Value], draw: Callable[[Value], None]) -> None:
    """Draw a statistic, or what this panel showed before, dimmed, while it is worked out."""
    page_state = state.page(Validation)
    worker = page_state.worker
    worker.ask(task)
    value = worker.wait_for(task, max(0.0, page_state.deadline - time.monotonic()))
    if isinstance(value, Failure):
        step_note(f"{value.reason[:1].upper()}{value.reason[1:]}.")
        return
    if value is not None:
        page_state.drawn[name] = lambda: draw(value)
        draw(value)
        return
    page_state.waiting[name] = task
    with st.container(key=f"waiting_{name}"):
        if name in page_state.drawn:
            with st.container(key=f"dim_{name}"):
                page_state.drawn[name]()
        if worker.stopped:
            button("Stopped: work it out", key=f"go_on_{name}", on_click=worker.go_on)
        else:
            bar = '<div class="working" role="progressbar" aria-label="working it out">'
            st.html(f"{bar}<i></i></div>")


def known(state: State, task: Task[Value]) -> Value | None:
    """Return a value only where it was worked out already."""
    value = state.page(Validation).worker.cache.get(task.key)
    return None if isinstance(value, Failure) else value


def draw_work(state: State) -> None:
    """Follow what is still worked out; called last on the page, where its position is fixed."""
    page_state = state.page(Validation)
    waiting = dict(page_state.waiting)
    if waiting and not page_state.worker.stopped:
        worker = page_state.worker
        tasks = list(waiting.values())
        follow_tasks(worker, tasks, time.monotonic(), lambda n: _fill(worker, waiting, n))


def _fill(worker: StatisticsWorker, waiting: dict[str, Task], n: int) -> None:
    """Fill the bars of the panels that wait.

    One fragment does it for all: the browser gives up on a fragment in a panel that is replaced
    while it draws.
    """
    bars = "".join(
        f".st-key-waiting_{name} .working i {{ width: {100 * (worker.share_of(task) or 0):.0f}% }}"
        for name, task in waiting.items()
    )
    st.html(f"<style>{bars}</style>")
    if worker.seconds > MIN_STOPPABLE or worker.waiting:
        with st.container(horizontal=True, vertical_alignment="center", key="work_bar"):
            text = f"Working out {n} more {'figures' if n > 1 else 'figure'}"
            st.html(f'<div class="note">{worker.waiting or text}</div>')
            button("Stop", key="stop_work", on_click=worker.stop)
