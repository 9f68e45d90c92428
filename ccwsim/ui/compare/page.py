"""The page Compare: two to four settings on the same training image, data and seeds."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Any

import streamlit as st

from ccwsim.experiments.comparison import Comparison
from ccwsim.figures import facies_colours
from ccwsim.model.bounds import MAX_CANDIDATES_OFFERED, MAX_REALIZATIONS_COMPARED
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.ui.compare.findings import (
    figures_table,
    ratios_csv,
    realizations_csv,
    sentences,
    settings_csv,
)
from ccwsim.ui.compare.results import draw_curves, draw_maps, draw_name, draw_patterns
from ccwsim.ui.compare.run import (
    asked_of,
    collect_comparison,
    follow_comparison,
    start_comparison,
)
from ccwsim.ui.compare.settings import (
    LETTERS,
    MAX_SETTINGS,
    MIN_SETTINGS,
    Asked,
    Comparing,
    add_setting,
    change_setting,
    copy_setting,
    describe_setting,
    remove_setting,
    settings_of,
    use_setting,
)
from ccwsim.ui.jobs.limits import Demand, check_limits
from ccwsim.ui.results.facies import pretty
from ccwsim.ui.results.ghost import ghost_panel
from ccwsim.ui.results.tables import csv_button
from ccwsim.ui.session.address import go_to
from ccwsim.ui.session.fitting import levels, overlap_sizes, template_sizes
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.method_step import parameter_field
from ccwsim.ui.study.run import PATIENCE
from ccwsim.ui.widgets.fields import PARAMETERS, bound_to, button, field, help_of
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.scrolled import scrolled
from ccwsim.ui.widgets.steps import pair, step_note
from ccwsim.ui.widgets.theme import draw_style

STYLE = Path(__file__).with_name("compare.css")
SHOWN_AT_ONCE = {
    *("method", "wavelet_level", "template_size", "overlap_size"),
    *("n_candidates", "search_fraction", "refine"),
}
"""Parameters that are not behind the menu of a setting."""


def draw_page(state: State) -> None:
    """Draw the settings and what the latest comparison gave; run one where there is none."""
    draw_style(STYLE)
    page_state = state.page(Comparing)
    problem = problem_of(state)
    has_none = page_state.found is None and page_state.job is None
    if has_none and not page_state.message and not problem:
        start_comparison(state)
    if page_state.job is not None and page_state.job.wait(PATIENCE):
        collect_comparison(state)
    _draw_settings(state)
    _draw_run_row(state, problem)
    with st.container(key="news"):  # always there, so that what is below never moves
        if page_state.job is not None:
            follow_comparison(state, page_state.job.about.n_parts)
            if page_state.found is not None and page_state.job.about.partial is None:
                st.html("<style>.st-key-results { opacity: 0.4 }</style>")
        if problem:
            st.error(plain(problem))
        if page_state.message:
            st.warning(plain(page_state.message))
    with st.container(key="results"):
        _draw_results(state, page_state.job is not None)


def problem_of(state: State) -> str:
    """Return why the settings cannot be compared, or an empty text."""
    choices = state.choices
    try:
        image, data = image_of(choices.image), data_of(choices)
        for parameters in settings_of(state):
            Study(image, choices.grid, parameters, data, choices.seed)
        cells = choices.grid.ny * choices.grid.nx * len(settings_of(state))
        check_limits(Demand(cells * state.page(Comparing).n, data.n))
    except CCWSIMError as error:
        return str(error)
    return ""


def _draw_settings(state: State) -> None:
    """Draw one column a setting: what is common at once, the rest behind a menu."""
    settings = settings_of(state)
    with st.container(key="settings"):
        columns = st.columns(len(settings), gap="medium", wrap=False)
    for k, (column, p) in enumerate(zip(columns, settings, strict=True)):
        letter = LETTERS[k]
        note = describe_setting(p, settings[0]) if k else "the study’s own"
        with column, st.container(key=f"setting_{letter}"):
            draw_name(letter, "the same as A" if note == "the same" else note)
            _draw_parameters(state, k, p)
            _draw_actions(state, k, len(settings))


def _draw_parameters(state: State, k: int, p: Parameters) -> None:
    shape, letter, has_levels = image_of(state.choices.image).shape, LETTERS[k], p.method != "ccsim"

    def change(name: str) -> Callable[[object], None]:
        return lambda value: change_setting(state, k, **{name: value})

    def draw(widget: Callable[..., Any], name: str, label: str, value: Any, **options: Any) -> None:
        common: dict[str, Any] = {"write": change(name), "help": help_of(name)}
        field(widget, label, key=f"{letter}_{name}", value=value, **common, **options)

    left, right = pair()
    with left:
        methods = PARAMETERS["method"]["allowed"].split(", ")
        draw(st.selectbox, "method", "Method", p.method, options=methods, format_func=str.upper)
        sizes = template_sizes(p.level, shape)
        draw(st.selectbox, "template_size", "Template (cells)", p.template_size, options=sizes)
        limits = {"min_value": 1, "max_value": MAX_CANDIDATES_OFFERED}
        draw(st.number_input, "n_candidates", "Candidates K", p.n_candidates, **limits)
    with right:
        options = {"options": levels(shape) if has_levels else [0], "disabled": not has_levels}
        draw(st.selectbox, "wavelet_level", "Level", p.level, **options)
        sizes = overlap_sizes(p.level, p.template_size)
        draw(st.selectbox, "overlap_size", "Overlap (cells)", p.overlap_size, options=sizes)
        limits = {"min_value": 0.01, "max_value": 1.0, "step": 0.01}
        draw(st.number_input, "search_fraction", "Search fraction", p.search_fraction, **limits)
    with st.container(horizontal=True, vertical_alignment="center", key=f"last_{letter}"):
        parameter_field(p, "refine", change("refine"), f"{letter}_")
        with st.popover("More", key=f"more_{letter}"):
            for name in PARAMETERS:
                if name not in SHOWN_AT_ONCE:
                    parameter_field(p, name, change(name), f"{letter}_")


def _draw_actions(state: State, k: int, n: int) -> None:
    letter = LETTERS[k]
    with st.container(horizontal=True, gap="small", key=f"actions_{letter}"):
        help_ = "Take this setting to Simulate."
        if k:
            help_ = "Take this setting to Simulate; what the study had takes its place here."
        act: dict[str, Any] = {"on_click": use_setting, "args": (state, k)}
        if button("Use these", key=f"use_{letter}", help=help_, **act):
            go_to("pages/simulate.py", "The study has this setting now.")
        with st.popover("Copy from", key=f"copy_{letter}"):
            for j, other in enumerate(LETTERS[:n]):
                if j != k:
                    act = {"on_click": copy_setting, "args": (state, k, j)}
                    key = f"copy_{letter}_from_{other}"
                    button(f"Setting {other}", key=key, width="stretch", **act)
        if k:
            few = n == MIN_SETTINGS
            act = {"on_click": remove_setting, "args": (state, k), "disabled": few}
            help_ = "Two settings are needed." if few else None
            button("Remove", key=f"remove_{letter}", help=help_, **act)
        elif n < MAX_SETTINGS:
            button("Add a setting", key="add_setting", on_click=add_setting, args=(state,))


def _draw_run_row(state: State, problem: str) -> None:
    """Draw what else decides the comparison, the button that starts it, and its files."""
    page_state = state.page(Comparing)
    with st.container(horizontal=True, vertical_alignment="bottom", gap="small", key="compare_row"):
        limits = {"min_value": 1, "max_value": MAX_REALIZATIONS_COMPARED, "width": 140}
        options = {"help": "More make small differences between settings surer.", **limits}
        n = bound_to(page_state, "n")
        field(st.number_input, "Realizations of each", key="n_compared", **n, **options)
        options = {"type": "primary", "disabled": bool(problem), "help": problem or None}
        button("Compare", key="compare", on_click=start_comparison, args=(state,), **options)
        if (found := page_state.found) is not None:
            with st.popover("Download", key="downloads"):
                label = "Settings and their figures, CSV"
                csv_button(label, "settings", lambda: settings_csv(found))
                each = "compared_realizations"
                csv_button("Every realization, CSV", each, lambda: realizations_csv(found))
                csv_button("ANODI ratios, CSV", "anodi_ratios", lambda: ratios_csv(found))
        if not problem:
            step_note(describe_study(state))


def describe_study(state: State) -> str:
    """Say what all settings have in common."""
    choices = state.choices
    image, data, grid = image_of(choices.image), data_of(choices), choices.grid
    with_data = f"{data.n} data" if data.n else "no data"
    return (
        f"The same for all, as on Simulate: {pretty(image.name)}, {with_data}, grid "
        f"{grid.nx} × {grid.ny}, seed {choices.seed}."
    )


@st.fragment
def _draw_results(state: State, busy: bool) -> None:
    """Draw what is known of the comparison that runs, else the latest one.

    `busy` is whether something was worked out when the page was drawn.
    """
    page_state = state.page(Comparing)
    with error_boundary():
        job = page_state.job
        if (job is not None) != busy:  # a part of it asked for more work
            st.rerun()
        found, asked = page_state.found, page_state.asked
        if job is not None and job.about.partial is not None:
            found, asked = job.about.partial, job.about.asked
        if found is None or asked is None:
            _draw_outlines(state)
        else:
            _draw_found(state, found, asked)


def _draw_found(state: State, found: Comparison, asked: Asked) -> None:
    image = found.ensembles[0].training_image
    page_state = state.page(Comparing)
    page_state.shown = min(page_state.shown, found.ensembles[0].n - 1)
    state.facies = min(state.facies, image.n_facies - 1)
    with st.container(key="said"):  # always there, so that what is below never moves
        if len(found.names) == len(asked.settings) or page_state.job is None:
            left, right = st.columns(2, gap="medium")
            with left:
                lines = "".join(f"<p>{escape(text)}</p>" for text in sentences(found))
                st.html(f'<div class="summary">{lines}</div>')
                if page_state.job is None and asked.key != asked_of(state).key:
                    step_note(
                        "The settings or the study were changed since this comparison: compare "
                        "again."
                    )
            with right:
                st.html(scrolled(figures_table(found), "Settings in numbers"))
    draw_maps(state, found, asked, facies_colours(image, dict(asked.image.colours)))
    with st.container(key="curves"):
        draw_curves(state, found)
    with st.container(key="patterns"):
        draw_patterns(state, found)


def _draw_outlines(state: State) -> None:
    """Show where the results will be, before there are any."""
    grid, n = state.choices.grid, len(settings_of(state))
    with st.container(key="maps"):
        columns = st.columns(n, gap="medium")
    for column in columns:
        with column:
            text = "The same realization of each setting, from the same random numbers"
            ghost_panel(text, f"aspect-ratio: {grid.nx} / {grid.ny}")
