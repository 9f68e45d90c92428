"""The main screen: set up a study, run it, and see what it gives."""

from __future__ import annotations

import streamlit as st

from ccwsim.ui.examples.opened import draw_opened
from ccwsim.ui.page import show_page
from ccwsim.ui.session.state import State
from ccwsim.ui.simulate.history import draw_history
from ccwsim.ui.simulate.results import dim_and_wait, draw_results, keep_up
from ccwsim.ui.study.run import follow_run, run_button
from ccwsim.ui.study.study_column import study_column
from ccwsim.ui.widgets.text import plain


def simulate_page(state: State) -> None:
    """Draw the study at the left and the results at the right."""
    keep_up(state)  # before anything is drawn: it runs meanwhile
    if not state.live:
        study_column(state)
    draw_opened(state)
    with st.container(key="news"):  # always there, so that what is below is never made anew
        dim_and_wait(state)
        if state.job is not None:
            follow_run(state)
        if state.message:
            st.warning(plain(state.message))
    with st.container(key="results"):
        draw_results(state)
    with st.container(key="history"):
        draw_history(state)
    if state.live:  # pictures first
        study_column(state)
        if keep_up(state):  # what is drawn may settle the study
            st.rerun()
    with st.container(key="run_bar"):
        run_button(state, "run_below")


if __name__ == "__main__":
    show_page("Simulate", simulate_page)
