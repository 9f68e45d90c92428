"""The study: five numbered steps in the order of the method."""

from __future__ import annotations

import streamlit as st

from ccwsim.ui.session.state import State
from ccwsim.ui.study.data_step import data_step
from ccwsim.ui.study.grid_step import grid_step
from ccwsim.ui.study.image_step import image_step
from ccwsim.ui.study.method_step import method_step
from ccwsim.ui.study.run import run_step


def study_column(state: State) -> None:
    """Draw the whole study column in the sidebar."""
    with st.sidebar:
        for step in (image_step, data_step, grid_step, method_step, run_step):
            step(state)
