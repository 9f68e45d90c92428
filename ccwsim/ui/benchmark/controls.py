"""The controls of the page of times: what is timed, how long it will take, and the button."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import streamlit as st

from ccwsim.experiments.timing import TimingCase
from ccwsim.model.bounds import MAX_REALIZATIONS_TIMED
from ccwsim.model.errors import CCWSIMError
from ccwsim.system.machine import this_machine
from ccwsim.ui.benchmark.run import TimingRun
from ccwsim.ui.benchmark.settings import (
    BYTES_A_CELL,
    DATA_SIDES,
    NAMES,
    cases_of_data,
    cases_of_grids,
    expected,
    level_options,
    method_options,
    number_options,
    side_options,
)
from ccwsim.ui.benchmark.state import Benchmark
from ccwsim.ui.benchmark.words import said_plan
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import button, field
from ccwsim.ui.widgets.steps import step_note

Kind = Literal["grids", "data"]
CASES: dict[Kind, Callable[[State], list[TimingCase]]] = {
    "grids": cases_of_grids,
    "data": cases_of_data,
}
LARGE = 50e6
"""Bytes that are worth a word."""


def draw_grid_controls(state: State) -> None:
    """Draw what is timed against the size of the grid."""
    own = state.page(Benchmark)
    sides = side_options(this_machine().free_bytes)
    own.largest = min(own.largest, sides[-1])
    with _row("grids"):
        field(
            st.selectbox, "Largest grid", key="largest", options=sides, value=own.largest,
            format_func=lambda side: f"{side} × {side}", width=150,
            write=lambda side: setattr(own, "largest", side),
            help="Square grids from 256 × 256 up to this one. Time grows with the cells: 5000 × "
            "5000 takes six times as long as 2000 × 2000.",
        )  # fmt: skip
        _choices(state, "grid")
        _realizations(state, "grids")
        _button(state, "grids")
    _plan(state, "grids")


def draw_data_controls(state: State) -> None:
    """Draw what is timed against the number of data."""
    own = state.page(Benchmark)
    with _row("data"):
        field(
            st.selectbox, "Grid", key="data_side", options=list(DATA_SIDES), value=own.side,
            format_func=lambda side: f"{side} × {side}", width=130,
            write=lambda side: setattr(own, "side", side),
            help="The paper's Table 2 is of 512 × 512 cells.",
        )  # fmt: skip
        offered = number_options(own.side)
        field(
            st.pills, "Hard data", key="numbers", options=offered, selection_mode="multi",
            value=[n for n in own.numbers if n in offered], width="content",
            format_func=lambda n: str(n) if n else "none",
            write=lambda chosen: setattr(own, "numbers", chosen),
            help="They are read off an unconditional realization at random cells.",
        )  # fmt: skip
        _choices(state, "data")
        _realizations(state, "data")
        _button(state, "data")
    _plan(state, "data")


def start(state: State, kind: Kind) -> None:
    """Start timing; what was measured before stays where nothing can be timed."""
    own = state.page(Benchmark)
    own.message = ""
    try:
        run = TimingRun(
            image_of(state.choices.image), CASES[kind](state), own.n_realizations,
            state.choices.seed,
        ).start()  # fmt: skip
    except CCWSIMError as error:
        own.message = str(error)
        return
    setattr(own, kind, run)


def _row(kind: Kind):
    return st.container(
        horizontal=True, vertical_alignment="bottom", gap="medium", key=f"controls_{kind}"
    )


def _choices(state: State, which: Literal["grid", "data"]) -> None:
    own, methods = state.page(Benchmark), method_options()
    chosen = [m for m in getattr(own, f"{which}_methods") if m in methods]
    if len(methods) > 1:
        field(
            st.pills, "Methods", key=f"{which}_methods", options=methods, value=chosen,
            selection_mode="multi", format_func=lambda m: NAMES.get(m, m), width="content",
            write=lambda names: setattr(own, f"{which}_methods", names),
        )  # fmt: skip
    offered = level_options(state)
    field(
        st.pills, "Levels", key=f"{which}_levels", options=offered, selection_mode="multi",
        value=[level for level in getattr(own, f"{which}_levels") if level in offered],
        write=lambda levels: setattr(own, f"{which}_levels", levels), width="content",
        help="Wavelet level, or scale of MS-CCSIM. Lower searches more finely and takes longer; "
        "0 compares single cells.",
    )  # fmt: skip


def _realizations(state: State, kind: Kind) -> None:
    page_state = state.page(Benchmark)
    field(
        st.number_input, "Realizations each", key=f"{kind}_realizations", width=140,
        value=page_state.n_realizations, min_value=1, max_value=MAX_REALIZATIONS_TIMED,
        write=lambda n: setattr(page_state, "n_realizations", int(n)),
        help="The median of them is shown. More make it steadier and take proportionally longer.",
    )  # fmt: skip


def _button(state: State, kind: Kind) -> None:
    button(
        "Measure", key=f"measure_{kind}", type="primary", on_click=start,
        args=(state, kind),
        disabled=state.page(Benchmark).running is not None,
    )  # fmt: skip


def _plan(state: State, kind: Kind) -> None:
    page_state = state.page(Benchmark)
    try:
        cases = CASES[kind](state)
    except CCWSIMError as error:
        step_note(str(error))
        return
    text = said_plan(len(cases), page_state.n_realizations, expected(state, cases))
    most = max(case.n_cells for case in cases) * BYTES_A_CELL
    if most > LARGE:
        text += f" Up to {most / 1e6:.0f} MB of memory."
    if page_state.running not in (None, getattr(page_state, kind)):
        text += " Another measurement is running; two at once would slow each other down."
    step_note(text)
