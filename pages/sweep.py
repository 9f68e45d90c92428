"""Try many settings of the study, see what each costs and gives, and take one."""

from __future__ import annotations

import time

import streamlit as st

from ccwsim.ui.page import show_page
from ccwsim.ui.session.state import State
from ccwsim.ui.sweep.controls import draw_controls, sweep_button
from ccwsim.ui.sweep.follow import follow_sweep
from ccwsim.ui.sweep.results import draw_empty, draw_found, draw_planned, draw_sweep_style
from ccwsim.ui.sweep.state import SweepState


def sweep_page(state: State) -> None:
    """Draw ranges at the left, and what the sweep found at the right."""
    draw_sweep_style()
    with st.sidebar:
        draw_controls(state)
    run = state.page(SweepState).run
    with st.container(key="news"):  # always there, so that what is below never moves
        if run is not None and run.going:
            follow_sweep(state, time.monotonic())
    with st.container(key="results"):
        if run is not None:
            draw_found(state)
        if run is None or not (run.going or run.found.rows):
            draw_empty(state)
            with st.container(key="first_row"):
                sweep_button(state, "sweep_first")
            draw_planned(state)
    with st.container(key="run_bar"):
        sweep_button(state, "sweep_below")


if __name__ == "__main__":
    show_page("Sweep", sweep_page)
