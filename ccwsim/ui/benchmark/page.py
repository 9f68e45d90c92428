"""The page of times, put together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import streamlit as st

from ccwsim.system.machine import this_machine
from ccwsim.ui.benchmark.controls import Kind, draw_data_controls, draw_grid_controls
from ccwsim.ui.benchmark.csv import timings_csv
from ccwsim.ui.benchmark.results import draw_data, draw_grids
from ccwsim.ui.benchmark.run import TimingRun
from ccwsim.ui.benchmark.state import Benchmark
from ccwsim.ui.benchmark.words import DISTURBED, WHAT_CAN_BE_COMPARED, why_ended
from ccwsim.ui.session.fragments import follow
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.steps import step_note

STYLE = Path(__file__).with_name("benchmark.css")
DRAW: dict[Kind, Callable[[State], None]] = {"grids": draw_grids, "data": draw_data}


def draw_benchmark(state: State) -> None:
    """Draw both measurements, each with its controls above its results."""
    page_state = state.page(Benchmark)
    st.html(f"<style>{STYLE.read_text('utf-8')}</style>")
    with st.container(horizontal=True, vertical_alignment="center", key="machine_row"):
        st.html(f'<p class="facts machine">This machine: {this_machine()}</p>')
        _download(state)
    step_note(WHAT_CAN_BE_COMPARED)
    if page_state.message:
        st.error(plain(page_state.message))
    st.html('<h2 class="part">CPU time and the size of the grid <span>as in Fig. 13</span></h2>')
    draw_grid_controls(state)
    draw_part(state, "grids")
    st.html('<h2 class="part">CPU time and the number of data <span>as in Table 2</span></h2>')
    draw_data_controls(state)
    draw_part(state, "data")


def draw_part(state: State, kind: Kind) -> None:
    """Draw one measurement, followed while it runs."""
    run = getattr(state.page(Benchmark), kind)
    with st.container(key=f"part_{kind}"):
        if run and run.going:
            _follow(state, run, kind)
            return
        if run and why_ended(run):
            st.warning(plain(why_ended(run)))
        if run and run.disturbed:
            step_note(DISTURBED)
        DRAW[kind](state)


def _follow(state: State, run: TimingRun, kind: Kind) -> None:
    def draw() -> None:
        if run.disturbed:
            step_note(DISTURBED)
        DRAW[kind](state)

    assert run.job is not None
    keys = (f"progress_{kind}", f"cancel_{kind}")
    follow(run.job, label=lambda: progress_label(run), draw=draw, keys=keys)


def progress_label(run: TimingRun) -> str:
    """Say how many settings are timed, and which one is now."""
    n = len(run.timings)
    text = f"{n} of {len(run.cases)} settings"
    if n < len(run.cases):
        case = run.cases[n]
        data = f", {case.n_data} data" if case.n_data else ""
        text += f" · now {case.grid_shape[0]}², level {case.parameters.level}{data}"
    return text


def _download(state: State) -> None:
    page_state = state.page(Benchmark)
    runs = [run for run in (page_state.grids, page_state.data) if run and run.timings]
    if runs and not page_state.running:
        st.download_button(
            "Download CSV", lambda: timings_csv(runs, str(this_machine())),
            file_name="times.csv", mime="text/csv", on_click="ignore", key="download_times",
        )  # fmt: skip
