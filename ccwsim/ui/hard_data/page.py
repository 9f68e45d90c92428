"""Hard data placed by hand: a map that takes them, a table beside it, and what answers."""

from __future__ import annotations

from pathlib import Path

import streamlit as st

from ccwsim.model.choices import DataChoice
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.hard_data.actions import answer, fits, is_revised, needs_run, take
from ccwsim.ui.hard_data.canvas import draw_canvas, said_help
from ccwsim.ui.hard_data.files import draw_export, draw_import, draw_problem
from ccwsim.ui.hard_data.sampling import draw_sampling
from ccwsim.ui.hard_data.state import Editor
from ccwsim.ui.hard_data.table import draw_table
from ccwsim.ui.results.e_type import draw_e_type
from ccwsim.ui.results.facies import colours_of
from ccwsim.ui.results.gallery import draw_gallery
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.data_step import problem_of_data
from ccwsim.ui.study.run import problem_of, start_run
from ccwsim.ui.widgets.facts import draw_facts
from ccwsim.ui.widgets.fields import button, field
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.maps import draw_map, facies_map, points_of
from ccwsim.ui.widgets.steps import panel_title, step_note

STYLE = Path(__file__).with_name("editor.css")
GROUNDS = {"realization": "realization", "e_type": "E-type", "empty": "empty grid"}


@st.fragment
def draw_editor(state: State) -> None:
    """Draw the editor; an edit redraws only this."""
    with error_boundary():
        st.html(f"<style>{STYLE.read_text('utf-8')}</style>")
        problem = problem_of_data(state.choices)
        if problem:
            draw_problem(state, problem)
        else:
            _editor(state)


def _editor(state: State) -> None:
    if needs_run(state):
        st.rerun()
    answer(state)
    data, image = data_of(state.choices), image_of(state.choices.image)
    colours = colours_of(state)
    ensemble = state.ensemble
    if ensemble is not None and not fits(ensemble, state.choices):
        ensemble = None
    if ensemble is not None:
        state.shown = min(state.shown, ensemble.n - 1)
        state.facies = min(state.facies, image.n_facies - 1)
    _top(state, data, ensemble)
    with st.container(key="maps"):
        left, middle, right = st.columns([1.0, 1.0, 0.56], gap="medium")
    with left:
        _ground(state)
        draw_canvas(state, data, image, colours, ensemble)
        if ensemble is not None:  # below, where its length moves no map under the pointer
            step_note(said_answer(state, ensemble))
    with middle:
        if ensemble is not None:
            _beside(state, ensemble, colours)
        else:
            panel_title("Realizations and E-type")
            step_note("They answer every edit here, once the study has been simulated.")
    with right:
        draw_table(state, data, image)
    if ensemble is not None:
        draw_gallery(ensemble, colours, state.shown, lambda r: setattr(state, "shown", r))


def _top(state: State, data: HardData, ensemble: Ensemble | None) -> None:
    page_state = state.page(Editor)
    if ensemble is not None:
        with st.container(key="facts_row"):
            draw_facts(ensemble)
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="editor_top"):
        draw_import(state)
        draw_sampling(state)
        draw_export(state, data)
        button(
            "Clear", key="clear", disabled=not data.n, on_click=take,
            args=(state, DataChoice("placed", placed=HardData())),
            help="Take all data away; undo brings them back.",
        )  # fmt: skip
        problem = problem_of(state)
        if st.button(
            "Run again", key="run_again", type="primary", disabled=bool(problem), help=problem
            or "Draw the realizations with all data from the beginning, instead of mending them "
            "around each edit.",
        ):  # fmt: skip
            start_run(state)
            st.rerun()
    if page_state.message:
        st.warning(plain(page_state.message))


def said_answer(state: State, ensemble: Ensemble) -> str:
    """Say how the shown realization met the data, and whether it was mended since its run."""
    if not ensemble.hard_data.n:
        return "Click the map to place a datum; drag to place a line of them."
    met = said_help(ensemble.data_status[state.shown])
    text = f"Realization {state.shown + 1}: {met}."
    if is_revised(state) and not ensemble.parameters.exact_data:
        text += " Edits change nothing while exact data is off; Run again lets them steer."
    elif is_revised(state):
        text += " Mended around your edits; Run again draws it with all data from the beginning."
    return text


def _ground(state: State) -> None:
    page_state = state.page(Editor)
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="ground_row"):
        panel_title("Hard data on")
        field(
            st.segmented_control, "What lies under the data", key="ground",
            value=page_state.ground, options=list(GROUNDS), format_func=GROUNDS.get,
            write=lambda ground: setattr(page_state, "ground", ground),
            label_visibility="collapsed",
        )  # fmt: skip


def _beside(state: State, ensemble: Ensemble, colours: list[str]) -> None:
    if state.page(Editor).ground != "e_type":
        draw_e_type(state, ensemble, colours)
        return
    image: TrainingImage = ensemble.training_image
    r = state.shown
    panel_title(f"Realization {r + 1} of {ensemble.n}")
    shown = facies_map(ensemble.indices[r], image, colours, f"Realization {r + 1}")
    shown.points.extend(points_of(ensemble.hard_data, image, ensemble.realizations[r]))
    draw_map(
        shown, "map_realization", link="grid", scale="maps", name=f"realization_{r + 1}"
    )  # fmt: skip
