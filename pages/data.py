"""Hard data placed by hand, with realizations that answer every edit at once."""

from __future__ import annotations

import streamlit as st

from ccwsim.ui.hard_data.edits import needs_run
from ccwsim.ui.hard_data.page import draw_editor
from ccwsim.ui.page import show_page
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import draw_news, start_run


def data_page(state: State) -> None:
    """Draw the editor over the realizations of the study; simulate some where there are none."""
    if needs_run(state):
        start_run(state)
    draw_news(state)
    with st.container(key="results"):
        draw_editor(state)


if __name__ == "__main__":
    show_page("Hard data", data_page)
