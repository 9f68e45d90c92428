"""The main screen: set up a study, run it, and see what it gives."""

from __future__ import annotations

import streamlit as st

from ccwsim.ui.page import show_page
from ccwsim.ui.results import draw_results
from ccwsim.ui.run import PATIENCE, collect, follow_run, start_run
from ccwsim.ui.run_step import problem_of, run_button
from ccwsim.ui.state import State
from ccwsim.ui.study_column import study_column

OLD_RESULTS = """
.st-key-results { opacity: 0.4 }
.st-key-facts_row { display: none }
"""
"""While new results come: the old ones are dimmed, and progress takes the place of their facts."""


def simulate_page(state: State) -> None:
    """Draw the study at the left and the results at the right."""
    study_column(state)
    first = state.ensemble is None and state.job is None and not state.message
    changed = state.choices != (state.job.about if state.job else state.ran)
    if first or (state.live and changed and not problem_of(state)):
        start_run(state)
    if state.job is not None and state.job.wait(PATIENCE):
        collect(state)
    if state.job is not None:
        follow_run(state)
        if state.ensemble is not None:
            st.html(f"<style>{OLD_RESULTS}</style>")
    if state.message:
        st.warning(state.message)
    with st.container(key="results"):
        draw_results(state)
    with st.container(key="run_bar"):
        run_button(state, "run_below")


if __name__ == "__main__":
    show_page("Simulate", simulate_page)
