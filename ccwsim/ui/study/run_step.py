"""Step 5: how many realizations, from which seed, and the run button."""

from __future__ import annotations

import streamlit as st

from ccwsim.model.bounds import MAX_REALIZATIONS, MAX_SEED
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.study import Study
from ccwsim.ui.jobs.admission import Demand, check_limits
from ccwsim.ui.jobs.limits import limits_of_environment
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import start_run
from ccwsim.ui.widgets.fields import button, field
from ccwsim.ui.widgets.steps import pair, step_note, step_title


def run_step(state: State) -> None:
    """Draw the step; what is not ready says what it needs."""
    step_title(5, "Realizations")
    left, right = pair()
    with left:
        field(
            st.number_input, "How many", key="n_realizations", value=state.choices.n_realizations,
            min_value=1, max_value=MAX_REALIZATIONS,
            help="More show the uncertainty better and take proportionally longer.",
            write=lambda n: state.change(n_realizations=int(n)),
        )  # fmt: skip
    with right:
        field(
            st.number_input, "Seed", key="seed", value=state.choices.seed, min_value=0,
            max_value=MAX_SEED,
            help="The same seed gives the same realizations, on any machine.",
            write=lambda n: state.change(seed=int(n)),
        )  # fmt: skip
    if limits := str(limits_of_environment()):
        step_note(limits)
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="run_row"):
        run_button(state, "run")
        field(
            st.toggle, "Live", key="live", value=state.live,
            help="Run again after every change.", write=lambda on: setattr(state, "live", on),
        )  # fmt: skip


def run_button(state: State, key: str) -> None:
    """Draw a button that starts a run; it is off, and says why, where the study cannot run."""
    problem = problem_of(state)
    button(
        "Run", key=key, type="primary", on_click=start_run, args=(state,),
        disabled=bool(problem), help=problem or None, width="stretch",
    )  # fmt: skip


def problem_of(state: State) -> str:
    """Return why the study cannot run, or an empty text."""
    choices = state.choices
    try:
        data = data_of(choices)
        Study(image_of(choices.image), choices.grid, choices.parameters, data, choices.seed)
        cells = choices.grid.ny * choices.grid.nx
        check_limits(Demand(cells * choices.n_realizations, data.n))
    except CCWSIMError as error:
        return str(error)
    return ""
