"""Judge realizations against the training image, the data and each other, on one page."""

from __future__ import annotations

import streamlit as st

from ccwsim.ui.page import show_page
from ccwsim.ui.results.ghost import draw_ghost
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import PATIENCE, collect, follow_run, start_run
from ccwsim.ui.study.run_step import run_button
from ccwsim.ui.validate.page import draw_style, draw_validation
from ccwsim.ui.validate.panel import draw_work
from ccwsim.ui.widgets.literal import plain


def validate_page(state: State) -> None:
    """Draw the validation of the latest realizations; simulate some where there are none."""
    draw_style()
    if state.ensemble is None and state.job is None and not state.message:
        start_run(state)
    if state.job is not None and state.job.wait(PATIENCE):
        collect(state)
    with st.container(key="news"):  # always there, so that what is below never moves
        if state.job is not None:
            follow_run(state)
            if state.ensemble is not None:
                st.html("<style>.st-key-results { opacity: 0.4 }</style>")
        if state.message:
            st.warning(plain(state.message))
    with st.container(key="results"):
        if state.ensemble is not None:
            draw_validation(state, state.ensemble)
        else:
            draw_ghost(state)
            if state.job is None:
                run_button(state, "run_first")
    with st.container(key="work"):
        draw_work(state)


if __name__ == "__main__":
    show_page("Validate", validate_page)
