"""A panel that shows a statistic when it is known, and its progress in its place until then."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import streamlit as st

from ccwsim.ui.jobs.statistics import Failure, Task
from ccwsim.ui.session.guarding import error_boundary
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import PATIENCE
from ccwsim.ui.validate.state import Validation
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.steps import step_note

Value = TypeVar("Value")
POLL_EVERY = 0.4
TOGETHER = 1.0
"""Seconds in which values that arrive are drawn together."""
LONG = 3.0
"""Seconds of work after which it can be stopped."""


def begin(state: State) -> None:
    """Let this run of the page, or of a part of it, wait for quick statistics."""
    state.page(Validation).deadline = time.monotonic() + PATIENCE


def panel(
    state: State, place: str, statistic: Task[Value], draw: Callable[[Value], None]
) -> Value | None:
    """Draw a statistic, or what this place showed before, dimmed, while it is worked out.

    Parameters
    ----------
    state : State
    place : str
        Of the panel on the page, a word.
    statistic : Statistic
    draw : callable
        Called with the value.

    Returns
    -------
    object
        The value where it is known.
    """
    v = state.page(Validation)
    v.bench.ask(statistic)
    value = v.bench.wait_for(statistic, max(0.0, v.deadline - time.monotonic()))
    if isinstance(value, Failure):
        step_note(f"{value.reason[:1].upper()}{value.reason[1:]}.")
        return None
    if value is not None:
        v.drawn[place] = lambda: draw(value)
        draw(value)
        return value
    v.waiting[place] = statistic
    with st.container(key=f"waiting_{place}"):
        if place in v.drawn:
            with st.container(key=f"dim_{place}"):
                v.drawn[place]()
        if v.bench.stopped:
            button(
                "Stopped: work it out",
                key=f"go_on_{place}",
                on_click=v.bench.go_on,
            )
        else:
            st.html(
                '<div class="working" role="progressbar" aria-label="working it out"><i></i></div>'
            )
    return None


def known(state: State, statistic: Task[Value]) -> Value | None:
    """Return a value only where it was worked out already."""
    value = state.page(Validation).bench.shelf.get(statistic.key)
    return None if isinstance(value, Failure) else value


def draw_work(state: State) -> None:
    """Follow what is still worked out; called last on the page, where its place never changes."""
    page_state = state.page(Validation)
    waiting = dict(page_state.waiting)
    if waiting and not page_state.bench.stopped:
        _follow(state, waiting, time.monotonic())


@st.fragment(run_every=POLL_EVERY)
def _follow(state: State, waiting: dict[str, Task], begun: float) -> None:
    """Fill the bars of the panels that wait; draw the page again when some are there.

    One fragment for all, not one in each panel: the browser gives up on a fragment whose panel is
    replaced while it draws.
    """
    with error_boundary():
        _fill(state, waiting, begun)


def _fill(state: State, waiting: dict[str, Task], begun: float) -> None:
    bench = state.page(Validation).bench
    there = [bench.shelf.get(statistic.key) is not None for statistic in waiting.values()]
    if all(there) or (any(there) and time.monotonic() - begun > TOGETHER):
        st.rerun()
    for statistic in waiting.values():
        bench.ask(statistic)
    shares = {place: bench.share_of(statistic) or 0.0 for place, statistic in waiting.items()}
    bars = "".join(
        f".st-key-waiting_{place} .working i {{ width: {100 * share:.0f}% }}"
        for place, share in shares.items()
    )
    st.html(f"<style>{bars}</style>")
    if bench.seconds > LONG or bench.waiting:
        with st.container(horizontal=True, vertical_alignment="center", key="work_bar"):
            n = there.count(False)
            words = f"Working out {n} more {'figures' if n > 1 else 'figure'}"
            st.html(f'<div class="note">{bench.waiting or words}</div>')
            button("Stop", key="stop_work", on_click=_stop, args=(state,))


def _stop(state: State) -> None:
    state.page(Validation).bench.stop()
