"""The page of validation, put together."""

from __future__ import annotations

from pathlib import Path

import streamlit as st

from ccwsim.model.bounds import MAX_REALIZATIONS
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.results.e_type import choose
from ccwsim.ui.results.facies import colours_of_ran
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import start_run
from ccwsim.ui.study.run_step import problem_of
from ccwsim.ui.validate.overview import draw_curves_row, draw_look, shown_elsewhere
from ccwsim.ui.validate.panel import begin
from ccwsim.ui.validate.sections import draw_links, draw_sections
from ccwsim.ui.validate.state import Validation
from ccwsim.ui.validate.summary import draw_summary
from ccwsim.ui.widgets.fields import button, field
from ccwsim.ui.widgets.steps import step_note
from ccwsim.ui.widgets.theme import chart_theme

STYLE = Path(__file__).with_name("validate.css")


def draw_style() -> None:
    """Write what is particular to the look of this page."""
    own = f":root {{ --odd: {chart_theme().reference} }}"
    st.html(f"<style>{own}\n{STYLE.read_text('utf-8')}</style>")


def draw_validation(state: State, ensemble: Ensemble) -> None:
    """Draw the first screen and all sections of the latest realizations."""
    page_state = state.page(Validation)
    begin(state)
    page_state.bench.forget()
    page_state.waiting.clear()
    state.shown = min(state.shown, ensemble.n - 1)
    state.facies = min(state.facies, ensemble.training_image.n_facies - 1)
    colours = colours_of_ran(state)
    with st.container(horizontal=True, vertical_alignment="top", key="judge_row"):
        top = st.container(key="judgement")
        draw_controls(state, ensemble)
    elsewhere = shown_elsewhere(state)
    draw_look(state, colours, elsewhere)
    draw_curves_row(state, ensemble)
    with top:
        draw_summary(state, ensemble)
        if state.choices != state.ran:
            step_note("The study was changed since these realizations were simulated.")
    draw_links()
    draw_sections(state, colours)


def draw_controls(state: State, ensemble: Ensemble) -> None:
    """Draw the choice of the facies, and a way to judge more realizations."""
    names = ensemble.training_image.facies_names
    with st.container(
        horizontal=True, vertical_alignment="bottom", gap="small", key="judge_what", width=420
    ):
        field(
            st.selectbox, "Facies", key="judged", options=list(range(len(names))), width=140,
            value=state.facies, format_func=lambda k: names[k],
            write=lambda k: choose(state, k), help="Whose curves and probability are shown.",
        )  # fmt: skip
        field(
            st.number_input, "Realizations", key="n_realizations", width=140,
            value=state.choices.n_realizations, min_value=1, max_value=MAX_REALIZATIONS,
            write=lambda n: state.change(n_realizations=int(n)),
            help="How many the next run gives; a band of 5–95 % needs about 20 or more.",
        )  # fmt: skip
        problem = problem_of(state)
        button(
            "Run", key="run", type="primary", on_click=start_run, args=(state,),
            disabled=bool(problem), help=problem or None,
        )  # fmt: skip
