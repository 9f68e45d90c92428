"""What a sweep starts from: the study, ranges, and how many realizations of each setting."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import streamlit as st
from streamlit.errors import StreamlitAPIException

from ccwsim.experiments.sweep import Settings
from ccwsim.model.bounds import MAX_REALIZATIONS_OF_SWEEP
from ccwsim.model.errors import CCWSIMError
from ccwsim.ui.jobs.admission import Demand, check_limits
from ccwsim.ui.results.facies import colours_of, pretty
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.sweep.ranges import MOST, plan_of, ranges_of, seconds_of, values_on_offer
from ccwsim.ui.sweep.run import SweepRun
from ccwsim.ui.sweep.state import SweepState
from ccwsim.ui.widgets.facts import seconds
from ccwsim.ui.widgets.fields import PARAMETERS, button, field
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.steps import step_note, step_title

LABELS = {
    "template_size": "Template T (cells)",
    "wavelet_level": "Level",
    "overlap_size": "Overlap OR (cells)",
    "n_candidates": "Candidates K",
    "method": "Method",
    "search_fraction": "Search fraction",
}


def draw_controls(state: State) -> None:
    """Draw the three steps of a sweep."""
    page_state = state.page(SweepState)
    step_title(1, "Study")
    step_note(said_study(state))
    with suppress(StreamlitAPIException, KeyError):  # a page run alone knows no others
        st.page_link("pages/simulate.py", label="Change on Simulate")
    step_title(2, "Ranges")
    ranges = ranges_of(state)
    for name, values in values_on_offer(state.choices).items():
        with st.container(key=f"range_{name}"):
            _range(state, name, values, ranges[name])
    if page_state.ranges:
        button(
            "Back to what suits the study",
            key="ranges_back",
            on_click=_back,
            args=(state,),
        )
    step_title(3, "Realizations")
    field(
        st.number_input, "Of each setting", key="n_swept", value=page_state.n_realizations,
        min_value=1, max_value=MAX_REALIZATIONS_OF_SWEEP,
        help="More tell closer settings apart, and take proportionally longer.",
        write=lambda n: setattr(page_state, "n_realizations", int(n)),
    )  # fmt: skip
    draw_plan(state)
    sweep_button(state, "sweep")


def sweep_button(state: State, key: str) -> None:
    """Draw a button that starts the sweep; it is off, and says why, where it cannot start."""
    problem, run = problem_of(state), state.page(SweepState).run
    going = run is not None and run.going
    n = 0 if problem else len(plan_of(state))
    label = f"Try {n} settings" if n > 1 else "Try this setting" if n else "Try settings"
    button(
        label, key=key, type="primary", on_click=start, args=(state,), width="stretch",
        disabled=bool(problem) or going, help="A sweep is running." if going else problem or None,
    )  # fmt: skip


def draw_plan(state: State) -> None:
    """Say what the ranges come to, or what is wrong with them."""
    problem = problem_of(state) or state.page(SweepState).message
    if problem:
        st.warning(plain(problem))
    else:
        step_note(said_plan(state, plan_of(state)))


def said_study(state: State) -> str:
    """Say what is simulated."""
    choices = state.choices
    image = image_of(choices.image)
    ny, nx = image.shape
    try:
        n = data_of(choices).n
        data = f"{n} hard data" if n else "no hard data"
    except CCWSIMError:
        data = "hard data that do not fit"
    return (
        f"{pretty(image.name)}, {nx} × {ny}, {image.n_facies} facies\n"
        f"{data}, grid {choices.grid.nx} × {choices.grid.ny}, seed {choices.seed}"
    )


def said_plan(state: State, plan: Settings) -> str:
    """Say how many settings there are, how long they take, and what was left out and why."""
    time = seconds_of(state, plan)
    about = f"about {seconds(max(round(time), 1))}" if time < 90 else f"about {time / 60:.0f} min"
    many = "setting" if len(plan) == 1 else "settings"
    n = state.page(SweepState).n_realizations
    said = f"{len(plan)} {many} × {n} realizations: {about} on one core."
    if plan.left_out:
        n = len(plan.left_out)
        said += f"\n{n} left out: {plan.left_out[0][1]}" + (" …" if n > 1 else ".")
    if plan.n_equal:
        said += f"\n{plan.n_equal} left out that mean the same: ccsim has no level."
    return said


def problem_of(state: State) -> str:
    """Return why a sweep cannot start, or an empty text."""
    try:
        data_of(state.choices)
        plan = plan_of(state)
    except CCWSIMError as error:
        text = str(error)
        for name, label in LABELS.items():
            text = text.replace(f"{name} has no value", f"{label.split(' ')[0]} has no value")
        return text
    if not len(plan):
        return f"No combination fits together. {plan.left_out[0][1]}."
    if len(plan) > MOST:
        return f"{len(plan)} settings; a sweep tries at most {MOST}: take fewer values."
    cells = state.choices.grid.ny * state.choices.grid.nx
    try:
        n_cells = len(plan) * state.page(SweepState).n_realizations * cells
        check_limits(Demand(n_cells, data_of(state.choices).n))
    except CCWSIMError as error:
        return str(error)
    return ""


def start(state: State) -> None:
    """Start the sweep as it is set up; what an earlier one found is let go."""
    page_state = state.page(SweepState)
    if problem_of(state):
        return
    choices, image = state.choices, image_of(state.choices.image)
    run = SweepRun(
        image, choices.grid, data_of(choices), choices.seed, plan_of(state).fitting,
        page_state.n_realizations, min(state.facies, image.n_facies - 1), colours_of(state),
    )  # fmt: skip
    page_state.message = ""
    try:
        page_state.run = run.start()
    except CCWSIMError as error:
        page_state.message = str(error)
        return
    page_state.chosen, page_state.shown = None, 0


def _range(state: State, name: str, values: list[Any], chosen: list[Any]) -> None:
    page_state = state.page(SweepState)

    def write(new: list[Any]) -> None:
        page_state.ranges = {**page_state.ranges, name: list(new)}

    # the key has the values in it: others make another widget, which keeps no place of the old
    field(
        pills, LABELS[name], key=f"range_{name}_{'_'.join(map(str, values))}", value=chosen,
        write=write, choices=values, help=PARAMETERS[name]["meaning"],
    )  # fmt: skip


def pills(label: str, choices: list[Any], **options: Any) -> Any:
    """Draw pills of which any number may be on; `field` knows them by this name."""
    return st.pills(label, choices, selection_mode="multi", width="stretch", **options)


def _back(state: State) -> None:
    state.page(SweepState).ranges = {}
