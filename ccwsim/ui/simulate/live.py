"""Keep the results up with the study: start runs by themselves, dim what is out of date, wait."""

from __future__ import annotations

import time

import streamlit as st

from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import PATIENCE, collect, problem_of, start_run, stop_run

WAIT_SECONDS = 0.05
"""Seconds between two chances for a change of the user's to end the waiting."""
UP_TO_DATE = "<i></i>"
SOON_OLD = """<i></i><style>
.st-key-results { opacity: 0.4; transition: opacity 0.1s 0.15s }
</style>"""
"""A run as quick as the eye dims nothing."""
OLD = """<i></i><style>
.st-key-results { opacity: 0.4 }
.st-key-facts_row { display: none }
</style>"""
"""The old results are dimmed, and progress takes the place of their facts."""
PARTLY = """<i></i><style>.st-key-facts_row { display: none }</style>"""


def keep_up(state: State) -> bool:
    """Start the first run of a session, and with `live` on one after every change.

    Returns
    -------
    bool
        Whether one was started or stopped.
    """
    first = state.ensemble is None and state.job is None and not state.message
    latest = state.job.about if state.job else state.ran
    changed = state.choices not in (latest, state.tried)  # a run that failed is not tried again
    if not first and not (state.live and changed):
        return False
    job = state.job
    if first or not problem_of(state):
        start_run(state)
    else:
        stop_run(state)  # it is of a study that is no more
    return state.job is not job


def dim_and_wait(state: State) -> None:
    """Give a run that is going a moment to bring results; the old ones are dimmed meanwhile.

    What dims them is replaced in place, so that nothing on the page moves.
    """
    place, job = st.empty(), state.job
    if job is None:
        place.html(UP_TO_DATE)
        return
    end = time.monotonic() + PATIENCE
    while True:
        place.html(SOON_OLD)
        if job.wait_first(WAIT_SECONDS) or time.monotonic() > end:
            break
    collect(state)  # a run that finishes from here on is collected where it is followed
    if state.job is None:
        place.html(UP_TO_DATE)
    else:
        place.html(OLD if job.partial is None else PARTLY)
