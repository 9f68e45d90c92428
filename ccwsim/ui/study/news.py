"""Progress of the run, a note on results that are out of date, and messages."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

import streamlit as st

from ccwsim.jobs.job import PATIENCE
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.state import State
from ccwsim.ui.study.changes import changes_between
from ccwsim.ui.study.run import collect, is_current, question_of, run_button, take_names
from ccwsim.ui.widgets.text import plain

STORED = "Stored realizations of this study are shown until your machine has computed them"
PATIENCE_VOLUME = 0.7
"""Seconds to wait for the first new volume, because drawing the old volume takes longer."""
WAIT_SECONDS = 0.05
"""Seconds between checks whether the user has changed the study; a change ends the waiting."""


def draw_news(state: State, *, parts: bool = True, wait: bool = True) -> None:
    """Follow the present run, dim results that are out of date, and report failures.

    If `parts` is false, earlier results stay until the run is finished. If `wait` is false, the
    page does not wait for a run that has just begun.
    """
    take_names(state)
    with st.container(key="news"):  # always drawn, so that Streamlit keeps the elements below
        patience = PATIENCE if state.choices.grid.nz is None else PATIENCE_VOLUME
        outdated = _wait_and_dim(state, parts, patience if wait else 0.0)
        if state.job is not None:
            _follow_run(state, parts)
        if state.message:
            st.warning(plain(state.message))
        if state.job is None and (state.ensemble is None or outdated):
            with _outdated(outdated, question_of(state)):
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
def _outdated(text: str, question: str = "") -> Iterator[None]:
    """Draw a row with a note on outdated results, a question, and elements drawn in the context."""
    with st.container(horizontal=True, vertical_alignment="center", key="outdated"):
        said = [f"<b>Out of date:</b> {escape(text)}"] if text else []
        if said or question:
            st.html(f'<p role="status">{" ".join([*said, escape(question)])}</p>')
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
        wanted = parts or state.ensemble is None
        return wanted and job.partial is not None and job.partial is not state.ensemble

    follow(
        job,
        on_finished=lambda: collect(state, parts=parts),
        has_news=has_news,
        label=lambda: STORED if state.ensemble and state.ensemble.is_stored else "",
    )
