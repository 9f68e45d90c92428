"""The page that compares settings, put together."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from pathlib import Path

import streamlit as st

from ccwsim.experiments.comparison import Comparison
from ccwsim.figures import facies_colours
from ccwsim.model.bounds import MAX_REALIZATIONS_COMPARED
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.study import Study
from ccwsim.ui.compare.choice import settings_of
from ccwsim.ui.compare.curves import draw_curves
from ccwsim.ui.compare.maps import draw_maps
from ccwsim.ui.compare.patterns import draw_patterns
from ccwsim.ui.compare.run import asked_of, start_comparison
from ccwsim.ui.compare.settings import draw_settings
from ccwsim.ui.compare.state import Asked, Comparing
from ccwsim.ui.compare.tables import draw_figures, ratios_csv, realizations_csv, settings_csv
from ccwsim.ui.compare.words import sentences
from ccwsim.ui.jobs.admission import Demand, check_limits
from ccwsim.ui.results.facies import pretty
from ccwsim.ui.session.guarding import error_boundary
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import button, field
from ccwsim.ui.widgets.steps import step_note

STYLE = Path(__file__).with_name("compare.css")


def draw_style() -> None:
    """Write what is particular to the look of this page."""
    st.html(f"<style>{STYLE.read_text('utf-8')}</style>")


def draw_top(state: State, problem: str) -> None:
    """Draw the settings, and below them what else decides the comparison.

    Parameters
    ----------
    state : State
    problem : str
        Why they cannot be compared, or an empty text.
    """
    draw_settings(state)
    here = state.page(Comparing)
    with st.container(horizontal=True, vertical_alignment="bottom", gap="small", key="compare_row"):
        field(
            st.number_input, "Realizations of each", key="n_compared", value=here.n, width=140,
            min_value=1, max_value=MAX_REALIZATIONS_COMPARED,
            help="More make small differences between settings surer.",
            write=lambda n: setattr(here, "n", int(n)),
        )  # fmt: skip
        button(
            "Compare", key="compare", type="primary", on_click=start_comparison,
            args=(state,),
            disabled=bool(problem), help=problem or None,
        )  # fmt: skip
        _draw_files(here.found)
        if not problem:
            step_note(said_study(state))


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


def said_study(state: State) -> str:
    """Say what all settings have in common."""
    choices = state.choices
    image, data = image_of(choices.image), data_of(choices)
    with_data = f"{data.n} data" if data.n else "no data"
    grid = choices.grid
    return (
        f"The same for all, as on Simulate: {pretty(image.name)}, {with_data}, grid "
        f"{grid.nx} × {grid.ny}, seed {choices.seed}."
    )


def is_old(state: State) -> bool:
    """Return whether what is shown is of before, while something new is on its way."""
    here = state.page(Comparing)
    return here.found is not None and here.job is not None and here.job.about.so_far is None


def shown_of(state: State) -> tuple[Comparison | None, Asked | None]:
    """Return the comparison to show, and what was asked for it."""
    here = state.page(Comparing)
    if here.job is not None and here.job.about.so_far is not None:
        return here.job.about.so_far, here.job.about.asked
    return here.found, here.asked


@st.fragment
def draw_results(state: State, busy: bool) -> None:
    """Draw what is known of the comparison that runs, else the latest one.

    Parameters
    ----------
    state : State
    busy : bool
        Whether something was worked out when the page was drawn.
    """
    with error_boundary():
        if (state.page(Comparing).job is not None) != busy:  # a part of it asked for more work
            st.rerun()
        found, asked = shown_of(state)
        if found is None or asked is None:
            _draw_ghost(state)
            return
        _draw_found(state, found, asked)


def _draw_found(state: State, found: Comparison, asked: Asked) -> None:
    image = found.ensembles[0].training_image
    here = state.page(Comparing)
    here.shown = min(here.shown, found.ensembles[0].n - 1)
    state.facies = min(state.facies, image.n_facies - 1)
    with st.container(key="said"):  # always there, so that what is below never moves
        if len(found.names) == len(asked.settings) or here.job is None:
            left, right = st.columns(2, gap="medium")
            with left:
                _draw_summary(state, found, asked)
            with right:
                draw_figures(found)
    draw_maps(state, found, asked, facies_colours(image, dict(asked.image.colours)))
    with st.container(key="curves"):
        draw_curves(state, found)
    with st.container(key="patterns"):
        draw_patterns(state, found)


def _draw_summary(state: State, found: Comparison, asked: Asked) -> None:
    lines = "".join(f"<p>{escape(text)}</p>" for text in sentences(found))
    st.html(f'<div class="summary">{lines}</div>')
    if state.page(Comparing).job is None and asked.key != asked_of(state).key:
        step_note("The settings or the study were changed since this comparison: compare again.")


def _draw_ghost(state: State) -> None:
    """Show where the results will be, before there are any."""
    grid, settings = state.choices.grid, settings_of(state)
    with st.container(key="maps"):
        places = st.columns(len(settings), gap="medium")
    text = "The same realization of each setting, from the same random numbers"
    for place in places:
        with place:
            st.html(f'<div class="ghost" style="aspect-ratio: {grid.nx} / {grid.ny}">{text}</div>')


def _draw_files(found: Comparison | None) -> None:
    if found is None:
        return

    def file(label: str, name: str, content: Callable[[Comparison], bytes]) -> None:
        st.download_button(
            label, lambda: content(found), file_name=f"{name}.csv", mime="text/csv",
            key=f"download_{name}", on_click="ignore", width="stretch",
        )  # fmt: skip

    with st.popover("Download", key="downloads"):
        file("Settings and their figures, CSV", "settings", settings_csv)
        file("Every realization, CSV", "compared_realizations", realizations_csv)
        file("ANODI ratios, CSV", "anodi_ratios", ratios_csv)
