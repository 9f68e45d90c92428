"""The page that follows a realization patch by patch, put together."""

from __future__ import annotations

from pathlib import Path

import streamlit as st

from ccwsim.engine.trace import Trace, check_traceable, fates
from ccwsim.model.errors import CCWSIMError
from ccwsim.ui.how_it_works.bands import draw_bands
from ccwsim.ui.how_it_works.fates import candidate_words, draw_fates
from ccwsim.ui.how_it_works.player import EVERY, draw_player, draw_setting, tick
from ccwsim.ui.how_it_works.resimulation import draw_resimulation
from ccwsim.ui.how_it_works.state import How
from ccwsim.ui.how_it_works.steps import draw_steps
from ccwsim.ui.how_it_works.trace import parameters_of, set_own, trace_of
from ccwsim.ui.results.facies import colours_of
from ccwsim.ui.session.guarding import error_boundary
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.steps import panel_title
from ccwsim.ui.widgets.theme import chart_theme

STYLE = Path(__file__).with_name("how.css")

DRAWING = "drawing"
"""Stands for what the part on mending shows while the whole page is drawn."""


def draw_style() -> None:
    """Write what is particular to the look of this page."""
    theme = chart_theme()
    own = f":root {{ --drawn: {theme.reference} }}"
    st.html(f"<style>{own}\n{STYLE.read_text('utf-8')}</style>")


def draw_how(state: State) -> None:
    """Draw the page; while it plays, it draws itself again and again."""
    page_state = state.page(How)
    draw_style()
    how, playing = page_state, page_state.playing
    how.mended = DRAWING
    st.fragment(_draw, run_every=EVERY if playing else None)(state, playing)
    with st.container(key="how_after"):
        _after(state)


def _draw(state: State, timed: bool) -> None:
    how = state.page(How)
    with error_boundary():
        _page(state)
    # a fragment's clock is wound up, and what lies below it drawn anew, only from outside of it
    if how.playing != timed or how.mended not in (DRAWING, how.traced):
        st.rerun()


@st.fragment
def _after(state: State) -> None:
    """Draw what mending did: it is the same for all patches, so stepping leaves it alone."""
    how = state.page(How)
    how.mended = how.traced
    with error_boundary():
        if how.trace is not None:
            draw_resimulation(state, how.trace, colours_of(state), chart_theme())


def _page(state: State) -> None:
    page_state = state.page(How)
    with st.container(horizontal=True, vertical_alignment="bottom", gap="large", key="how_top"):
        player = st.container(key="how_player", gap="small")
        draw_setting(state)
    try:
        check_traceable(parameters_of(state))
    except CCWSIMError as error:
        page_state.leave()
        st.warning(plain(str(error)))
        button(
            "Follow ccwsim here", key="how_ccwsim", type="primary",
            on_click=lambda: set_own(state, method="ccwsim"),
        )  # fmt: skip
        return
    trace = trace_of(state)
    tick(page_state, len(trace.patches))
    with player:
        draw_player(state, trace)
    with st.container(key="results"):
        _patch(state, trace)


def _patch(state: State, trace: Trace) -> None:
    step = trace.at(state.page(How).patch)
    told, colours, theme = fates(step), colours_of(state), chart_theme()
    draw_steps(state, trace, step, told, colours, theme)
    with st.container(key="how_more"):
        left, right = st.columns([1, 1.6], gap="large")
    with left:
        panel_title("Candidates" if step.data is None else "Candidates and hard data")
        candidate_words(trace, step, told)
        draw_fates(trace, step, told)
    with right:
        draw_bands(state, trace, step, theme)
