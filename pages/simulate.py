"""Main page, to define a study, run the study and view the results."""

from __future__ import annotations

import streamlit as st

from ccwsim.ui.examples.opened import draw_opened
from ccwsim.ui.page import show_page
from ccwsim.ui.session import State
from ccwsim.ui.simulate.results import draw_history, draw_results
from ccwsim.ui.study.run import draw_news, is_live, run_button, start_run_if_needed
from ccwsim.ui.study.study_column import study_column
from ccwsim.ui.widgets import draw_style


def simulate_page(state: State) -> None:
    """Show the study on the left and the results on the right."""
    draw_style("simulate/simulate.css")
    live = is_live(state)
    start_run_if_needed(state, live=live)  # the run continues while the page is drawn
    if not live:
        study_column(state)
    draw_opened(state)
    draw_news(state)
    with st.container(key="results"):
        draw_results(state)
    with st.container(key="history"):
        draw_history(state)
    if live:  # pictures first
        study_column(state)
        if start_run_if_needed(state, live=True):  # drawing may change the study
            st.rerun()
    with st.container(key="run_bar"):
        run_button(state, "run_below")


if __name__ == "__main__":
    show_page("Simulate", simulate_page)
