"""What a sweep found: the recommended setting, the chart, one setting large, all of them small."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

import streamlit as st

from ccwsim.experiments.sweep import Recommendation, Sweep, label, pareto_front, recommended, varied
from ccwsim.figures import sweep_chart
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.parameters import Parameters
from ccwsim.ui.results.titled_chart import chart_menu
from ccwsim.ui.session.guarding import error_boundary
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.sweep.controls import problem_of
from ccwsim.ui.sweep.follow import said_end
from ccwsim.ui.sweep.ranges import plan_of
from ccwsim.ui.sweep.run import SweepRun
from ccwsim.ui.sweep.setting import draw_numbers, draw_realization, use_button
from ccwsim.ui.sweep.state import SweepState
from ccwsim.ui.sweep.table import csv_button, draw_table
from ccwsim.ui.sweep.tiles import draw_planned_tiles, draw_tiles
from ccwsim.ui.widgets.errors import catch_callback_errors
from ccwsim.ui.widgets.fields import field
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.steps import panel_title, step_note
from ccwsim.ui.widgets.theme import chart_theme

STYLE = Path(__file__).with_name("sweep.css")
CHART_HEIGHT = 392
TITLES = {
    "patterns": ("Patterns", "pattern distance to the training image (bits)"),
    "connection": ("Connection", "error of connection τ(h)"),
    "mended": ("Mended data", "data that the raster did not meet"),
}


def draw_sweep_style() -> None:
    """Write what is particular to the look of this page."""
    st.html(f"<style>{STYLE.read_text('utf-8')}</style>")


@st.fragment
def draw_found(state: State) -> None:
    """Draw all that is known so far; choosing a setting redraws only this."""
    with error_boundary():
        run = state.page(SweepState).run
        assert run is not None
        found = run.found
        run.n_drawn = len(found.rows)
        end = said_end(run)
        if end:
            st.warning(plain(end))
        if not run.n_drawn:
            if run.going:
                draw_waiting(state, run)
            return
        tried = run.settings if run.going else tuple(row.parameters for row in found.rows)
        names = names_of(tried)
        choice = recommended(found)
        k = shown_of(state, found, choice)
        if not is_current(run, state):
            step_note("This sweep was of another training image, data or grid than the study has.")
        _recommendation(state, run, found, names, choice)
        with st.container(key="maps"):
            left, middle, right = st.columns([1.15, 1, 0.72], gap="medium")
        with left:
            _chart(state, found, names, k, choice.index)
        with middle:
            draw_realization(state, run, k)
        with right:
            draw_numbers(state, run, k)
        with st.container(horizontal=True, vertical_alignment="center", key="tiles_row"):
            panel_title("Settings", "one realization of each; click one to see it large")
            csv_button(found, choice.index)
        draw_tiles(run, names, k, choice.index, lambda number: choose(state, number))
        if not run.going:
            draw_table(found)


def draw_waiting(state: State, run: SweepRun) -> None:
    """Show where settings will be until the first one is there."""
    panel_title("Settings", "they appear as they are finished")
    draw_tiles(run, names_of(run.settings), -1, -1, lambda _: None)


def draw_empty(state: State) -> None:
    """Show what will be where, before a sweep."""
    with st.container(key="maps"):
        left, middle, right = st.columns([1.15, 1, 0.72], gap="medium")
    for place, title, text in (
        (left, "Time against error", "Each setting as a point: how long a realization "
         "takes, and how far it is from the training image. The line joins the settings that no "
         "other beats."),
        (middle, "One setting", "The setting that you click, large, with the hard data on it"),
        (right, "Its numbers", "Patterns, connection, variety, data and CPU time, beside "
         "the best of all settings"),
    ):  # fmt: skip
        with place:
            panel_title(title)
            st.html(f'<div class="ghost" style="height: {CHART_HEIGHT}px">{escape(text)}</div>')


def draw_planned(state: State) -> None:
    """Show which settings are going to be tried."""
    if problem_of(state):
        return
    plan = plan_of(state)
    panel_title("Settings", "what will be tried: one realization of each will be here")
    draw_planned_tiles(plan.fitting, names_of(plan.fitting), state.choices.grid)


def names_of(settings: tuple[Parameters, ...]) -> list[str]:
    """Return the parameters by which settings are told apart."""
    return varied(settings) or ["template_size", "overlap_size", "wavelet_level"]


def shown_of(state: State, found: Sweep, choice: Recommendation) -> int:
    """Return which setting is large: the chosen one, else the recommended."""
    chosen = state.page(SweepState).chosen
    return choice.index if chosen is None else min(chosen, len(found.rows) - 1)


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
    return (
        run.training_image.digest == image.digest
        and run.grid == choices.grid
        and run.hard_data.digest == data.digest
    )


def _recommendation(
    state: State, run: SweepRun, found: Sweep, names: list[str], choice: Recommendation
) -> None:
    row = found.rows[choice.index]
    with st.container(horizontal=True, vertical_alignment="center", gap="medium", key="choice"):
        so_far = " so far" if run.going or found.stopped else ""
        said = escape(label(row.parameters, names))
        title = f"<b>Recommended{so_far}: {said}</b>"
        st.html(f'<p class="facts choice">{title} {escape(choice.reason)}</p>')
        use_button(state, row.parameters, "Use this one", "use_recommended")


def _chart(
    state: State, found: Sweep, names: list[str], shown: int, recommended_one: int
) -> None:  # fmt: skip
    page_state = state.page(SweepState)
    kinds = [kind for kind in TITLES if kind != "mended" or _has_data(state)]
    kind = page_state.error if page_state.error in kinds else "patterns"
    with st.container(key="panel_sweep"):
        with st.container(horizontal=True, gap="small", key="title_sweep"):
            field(
                st.segmented_control, "Error", key="sweep_error", options=kinds, value=kind,
                format_func=lambda one: TITLES[one][0], label_visibility="collapsed",
                write=lambda one: setattr(page_state, "error", one),
            )  # fmt: skip
            chart_menu("Time against error", "sweep")
        errors = found.errors(kind)
        chart = sweep_chart(
            1000 * found.times, errors, [label(row.parameters, names) for row in found.rows],
            chart_theme(), front=pareto_front(found.times, errors), selected=shown,
            recommended=recommended_one, y_title=TITLES[kind][1], height=CHART_HEIGHT,
        )  # fmt: skip
        _selectable(state, chart)


def _selectable(state: State, chart: Any) -> None:
    def chosen() -> None:
        points = st.session_state["chart_sweep"].selection.points
        clicked = [p["point_index"] for p in points if p.get("curve_number") == 0]
        if clicked:
            choose(state, int(clicked[0]))

    st.plotly_chart(
        chart, key="chart_sweep", theme=None, on_select=catch_callback_errors(chosen),
        selection_mode="points",
        alt="Settings by CPU time and error; a line joins those that no other beats",
        config={"displayModeBar": False},
    )  # fmt: skip


def _has_data(state: State) -> bool:
    run = state.page(SweepState).run
    return run is not None and run.hard_data.n > 0
