"""The page Sweep: many settings of the study, what each costs and gives, and one to take."""

from __future__ import annotations

import time
from contextlib import suppress
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import streamlit as st
from streamlit.errors import StreamlitAPIException

from ccwsim.experiments.sweep import Recommendation, Sweep, label, pareto_front, recommended, varied
from ccwsim.figures import sweep_chart
from ccwsim.model.bounds import MAX_REALIZATIONS_OF_SWEEP
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.parameters import Parameters
from ccwsim.ui.results.charts import draw_clickable_chart
from ccwsim.ui.results.ghost import ghost_panel
from ccwsim.ui.results.tables import csv_button
from ccwsim.ui.results.titled_chart import chart_menu
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.sweep.plan import (
    LABELS,
    describe_plan,
    describe_study,
    plan_of,
    problem_of,
    ranges_of,
    start,
    values_on_offer,
)
from ccwsim.ui.sweep.run import SweepRun, SweepState, describe_end, follow_sweep
from ccwsim.ui.sweep.setting import (
    draw_numbers,
    draw_planned_tiles,
    draw_realization,
    draw_table,
    draw_tiles,
    sweep_csv,
    use_button,
)
from ccwsim.ui.widgets.fields import PARAMETERS, bound_to, button, field
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.steps import panel_title, step_note, step_title
from ccwsim.ui.widgets.theme import chart_theme, draw_style

STYLE = Path(__file__).with_name("sweep.css")
CHART_HEIGHT = 392
WIDTHS = (1.15, 1, 0.72)
"""Of the chart, the large setting and its numbers."""
ERRORS = {
    "patterns": ("Patterns", "pattern distance to the training image (bits)"),
    "connection": ("Connectivity", "error of connectivity τ(h)"),
    "mended": ("Re-simulated data", "data not honoured in the raster pass"),
}
"""What may be over time in the chart: the name of the choice, and the title of the axis."""


def draw_page(state: State) -> None:
    """Draw ranges at the left, and what the sweep found at the right."""
    draw_style(STYLE)
    with st.sidebar:
        _draw_controls(state)
    run = state.page(SweepState).run
    with st.container(key="news"):  # always there, so that what is below never moves
        if run is not None and run.going:
            follow_sweep(state, time.monotonic())
    with st.container(key="results"):
        if run is not None:
            _draw_found(state)
        if run is None or not (run.going or run.found.rows):
            _draw_outlines()
            with st.container(key="first_row"):
                _sweep_button(state, "sweep_first")
            if not problem_of(state):
                plan = plan_of(state).fitting
                panel_title("Settings", "what will be tried: one realization of each will be here")
                draw_planned_tiles(plan, names_of(plan), state.choices.grid)
    with st.container(key="run_bar"):
        _sweep_button(state, "sweep_below")


def _draw_controls(state: State) -> None:
    """Draw the three steps of a sweep."""
    page_state = state.page(SweepState)
    step_title(1, "Study")
    step_note(describe_study(state))
    with suppress(StreamlitAPIException, KeyError):  # a page run alone knows no others
        st.page_link("pages/simulate.py", label="Change on Simulate")
    step_title(2, "Ranges")
    ranges = ranges_of(state)
    for name, values in values_on_offer(state.choices).items():
        with st.container(key=f"range_{name}"):
            _draw_range(page_state, name, values, ranges[name])
    if page_state.ranges:
        reset = bound_to(page_state, "ranges")["write"]
        button("Back to what suits the study", key="ranges_back", on_click=reset, args=({},))
    step_title(3, "Realizations")
    limits = {"min_value": 1, "max_value": MAX_REALIZATIONS_OF_SWEEP}
    help_ = "More tell closer settings apart, and take proportionally longer."
    options = {**bound_to(page_state, "n_realizations"), **limits, "help": help_}
    field(st.number_input, "Of each setting", key="n_swept", **options)
    problem = problem_of(state) or page_state.message
    if problem:
        st.warning(plain(problem))
    else:
        step_note(describe_plan(state, plan_of(state)))
    _sweep_button(state, "sweep")


def _draw_range(page_state: SweepState, name: str, values: list[Any], chosen: list[Any]) -> None:
    def write(new: list[Any]) -> None:
        page_state.ranges = {**page_state.ranges, name: list(new)}

    # the key has the values in it: others make another widget, which keeps nothing of the old one
    key = f"range_{name}_{'_'.join(map(str, values))}"
    options = {"choices": values, "value": chosen, "help": PARAMETERS[name]["meaning"]}
    if name == "method":
        options["format_func"] = str.upper
    field(pills, LABELS[name], key=key, write=write, **options)


def pills(label: str, choices: list[Any], **options: Any) -> Any:
    """Draw pills of which any number may be on; `field` knows them by this name."""
    return st.pills(label, choices, selection_mode="multi", width="stretch", **options)


def _sweep_button(state: State, key: str) -> None:
    """Draw a button that starts the sweep; it is off, and says why, where it cannot start."""
    problem, run = problem_of(state), state.page(SweepState).run
    going = run is not None and run.going
    n = 0 if problem else len(plan_of(state))
    text = f"Try {n} settings" if n > 1 else "Try this setting" if n else "Try settings"
    help_ = "A sweep is running." if going else problem or None
    options = {"type": "primary", "width": "stretch", "disabled": bool(problem) or going}
    button(text, key=key, on_click=start, args=(state,), help=help_, **options)


@st.fragment
def _draw_found(state: State) -> None:
    """Draw all that is known so far; choosing a setting redraws only this."""
    with error_boundary():
        run = state.page(SweepState).run
        assert run is not None
        found = run.found
        run.n_drawn = len(found.rows)
        if end := describe_end(run):
            st.warning(plain(end))
        if run.n_drawn:
            _draw_rows(state, run, found)
        elif run.going:
            panel_title("Settings", "they appear as they are finished")
            draw_tiles(run, names_of(run.settings), (-1, -1), lambda _: None)


class _Shown(NamedTuple):
    """Results as they are shown: names that tell settings apart, the large one, the best one."""

    found: Sweep
    names: list[str]
    k: int
    choice: Recommendation


def _draw_rows(state: State, run: SweepRun, found: Sweep) -> None:
    tried = run.settings if run.going else tuple(row.parameters for row in found.rows)
    choice, chosen = recommended(found), state.page(SweepState).chosen
    k = choice.index if chosen is None else min(chosen, len(found.rows) - 1)
    shown = _Shown(found, names_of(tried), k, choice)
    if not is_current(run, state):
        step_note("This sweep was of another training image, data or grid than the study has.")
    best = found.rows[choice.index].parameters
    with st.container(horizontal=True, vertical_alignment="center", gap="medium", key="choice"):
        so_far = " so far" if run.going or found.stopped else ""
        title = f"<b>Recommended{so_far}: {escape(label(best, shown.names))}</b>"
        st.html(f'<p class="facts choice">{title} {escape(choice.reason)}</p>')
        use_button(state, best, "Use this one", "use_recommended")
    with st.container(key="maps"):
        left, middle, right = st.columns(WIDTHS, gap="medium")
    with left:
        _draw_chart(state, run, shown)
    with middle:
        draw_realization(state, run, k)
    with right:
        draw_numbers(state, run, k)
    with st.container(horizontal=True, vertical_alignment="center", key="tiles_row"):
        panel_title("Settings", "one realization of each; click one to see it large")
        options = {"key": "sweep_csv", "width": "content"}
        csv_button("Table, CSV", "sweep", lambda: sweep_csv(found, choice.index), **options)
    draw_tiles(run, shown.names, (k, choice.index), lambda number: choose(state, number))
    if not run.going:
        draw_table(found)


def _draw_chart(state: State, run: SweepRun, shown: _Shown) -> None:
    """Draw error over time; a click on a point makes its setting the large one."""
    page_state, found = state.page(SweepState), shown.found
    kinds = [kind for kind in ERRORS if kind != "mended" or run.hard_data.n]
    kind = page_state.error if page_state.error in kinds else "patterns"
    with st.container(key="panel_sweep"):
        with st.container(horizontal=True, gap="small", key="title_sweep"):
            options = {"options": kinds, "format_func": lambda one: ERRORS[one][0]}
            value = {**bound_to(page_state, "error"), "value": kind}
            options |= {"label_visibility": "collapsed", **value}
            field(st.segmented_control, "Error", key="sweep_error", **options)
            chart_menu("Time against error", "sweep")
        errors = found.errors(kind)
        labels = [label(row.parameters, shown.names) for row in found.rows]
        marks: dict[str, Any] = {"selected": shown.k, "recommended": shown.choice.index}
        marks |= {"front": pareto_front(found.times, errors), "height": CHART_HEIGHT}
        axis, milliseconds = ERRORS[kind][1], 1000 * found.times
        chart = sweep_chart(milliseconds, errors, labels, chart_theme(), y_title=axis, **marks)
        alt = "Settings by CPU time and error; a line joins the Pareto front"
        draw_clickable_chart(chart, "sweep", alt, lambda k: choose(state, k), mode_bar=False)


def _draw_outlines() -> None:
    """Show what will be where, before a sweep."""
    with st.container(key="maps"):
        left, middle, right = st.columns(WIDTHS, gap="medium")
    shape = f"height: {CHART_HEIGHT}px"
    with left:
        text = (
            "Each setting as a point: how long a realization takes, and how far it is from the "
            "training image. The line is the Pareto front: no other setting is both faster and "
            "nearer."
        )
        ghost_panel(text, shape, "Time against error")
    with middle:
        text = "The setting that you click, large, with the hard data on it"
        ghost_panel(text, shape, "One setting")
    with right:
        text = "Patterns, connectivity, variety, data and CPU time, beside the best of all settings"
        ghost_panel(text, shape, "Its numbers")


def names_of(settings: tuple[Parameters, ...]) -> list[str]:
    """Return the parameters by which settings are told apart."""
    return varied(settings) or ["template_size", "overlap_size", "wavelet_level"]


def choose(state: State, number: int) -> None:
    """Make a setting the large one."""
    page_state = state.page(SweepState)
    run = page_state.run
    if run is not None and 0 <= number < len(run.found.rows):
        page_state.chosen, page_state.shown = number, 0


def is_current(run: SweepRun, state: State) -> bool:
    """Return whether a sweep is of the study as it is now."""
    choices = state.choices
    try:
        image, data = image_of(choices.image), data_of(choices)
    except CCWSIMError:
        return False
    own = (run.training_image.digest, run.grid, run.hard_data.digest)
    return own == (image.digest, choices.grid, data.digest)
