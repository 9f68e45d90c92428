"""Two to four settings side by side on the same training image, data and seeds."""

from __future__ import annotations

import streamlit as st

from ccwsim.ui.compare.page import draw_results, draw_style, draw_top, is_old, problem_of
from ccwsim.ui.compare.run import collect_comparison, follow_comparison, start_comparison
from ccwsim.ui.compare.state import Comparing
from ccwsim.ui.examples.note import draw_opened
from ccwsim.ui.page import show_page
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import PATIENCE
from ccwsim.ui.widgets.literal import plain


def compare_page(state: State) -> None:
    """Draw the settings and what the latest comparison gave; run one where there is none."""
    draw_style()
    here = state.page(Comparing)
    problem = problem_of(state)
    if here.found is None and here.job is None and not here.message and not problem:
        start_comparison(state)
    if here.job is not None and here.job.wait(PATIENCE):
        collect_comparison(state)
    draw_opened(state, compared=True)
    draw_top(state, problem)
    with st.container(key="news"):  # always there, so that what is below never moves
        if here.job is not None:
            follow_comparison(state, here.job.about.n_parts)
            if is_old(state):
                st.html("<style>.st-key-results { opacity: 0.4 }</style>")
        if problem:
            st.error(plain(problem))
        if here.message:
            st.warning(plain(here.message))
    with st.container(key="results"):
        draw_results(state, here.job is not None)


if __name__ == "__main__":
    show_page("Compare", compare_page)
