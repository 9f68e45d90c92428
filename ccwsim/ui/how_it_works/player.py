"""Step through the patches: a slider, buttons, play, arrow keys; and whose patches they are."""

from __future__ import annotations

import time
from html import escape

import streamlit as st

from ccwsim.engine.trace import Patch, Trace
from ccwsim.model.bounds import MAX_CANDIDATES_OFFERED, MAX_REALIZATIONS
from ccwsim.ui.how_it_works.state import How
from ccwsim.ui.how_it_works.trace import follow, forget_own, parameters_of, set_own, use_own
from ccwsim.ui.how_it_works.words import said_shape
from ccwsim.ui.session.fitting import levels, overlap_sizes
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import button, field, help_of
from ccwsim.ui.widgets.maps import canvas_component

EVERY = 0.8
"""Seconds a patch is shown while it plays."""


def tick(how: How, n: int) -> None:
    """While it plays, go on to the next patch when it is time; stop at the last one."""
    if not how.playing or time.monotonic() - how.ticked < 0.7 * EVERY:
        return
    how.ticked = time.monotonic()
    if how.patch + 1 < n:
        how.patch += 1
    how.playing = how.patch + 1 < n


def draw_player(state: State, trace: Trace) -> None:
    """Draw the row that steps through the patches."""
    how, n = state.page(How), len(trace.patches)
    st.html(f'<p class="facts where">{where(trace, trace.patches[how.patch])}</p>')
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="how_row"):
        button(
            "Previous", key="how_previous", icon=":material/chevron_left:",
            disabled=how.patch == 0, on_click=lambda: how.go(max(how.patch - 1, 0)),
        )  # fmt: skip
        with st.container(key="how_slide"):
            field(
                st.slider, "Patch", key="how_patch", value=how.patch + 1, min_value=1,
                max_value=max(n, 2), write=lambda at: how.go(min(at, n) - 1), disabled=n < 2,
                label_visibility="collapsed",
            )  # fmt: skip
        button(
            "Next", key="how_next", icon=":material/chevron_right:",
            disabled=how.patch + 1 == n, on_click=lambda: how.go(min(how.patch + 1, n - 1)),
        )  # fmt: skip
        button(
            "Stop" if how.playing else "Play", key="how_play", type="primary",
            on_click=_play, args=(how, n),
        )  # fmt: skip
    _keys(how, n)


def where(trace: Trace, patch: Patch) -> str:
    """Say which patch is shown and where it lies."""
    path = trace.path
    facts = [
        f"<b>Patch {patch.number + 1} of {len(trace.patches)}</b>",
        escape(said_shape(trace, patch.shape)),
        f"row {patch.row + 1} of {path.n_rows}, column {patch.column + 1} of {path.n_columns} "
        "of the path",
    ]
    if patch.parts > 1:
        n = patch.parts**2
        facts.append(f"part {patch.part + 1} of {n}, as the tile is full of data")
    dot = ' <span class="dot">·</span> '
    return dot.join(f'<span class="fact">{fact}</span>' for fact in facts)


def _play(how: How, n: int) -> None:
    how.playing = not how.playing
    if how.playing and how.patch + 1 >= n:
        how.patch = 0
    how.ticked = time.monotonic()


def _keys(how: How, n: int) -> None:
    def stepped() -> None:
        step = st.session_state["how_arrows"].step
        if step:
            how.go(min(max(how.patch + int(step), 0), n - 1))

    canvas_component("arrows")(key="how_arrows", data={}, on_step_change=stepped)


def draw_setting(state: State) -> None:
    """Draw the controls of this page's own setting, and a way to take it to the study."""
    how, p = state.page(How), parameters_of(state)
    shape = image_of(state.choices.image).shape
    with st.container(horizontal=True, vertical_alignment="bottom", gap="small", key="how_setting"):
        field(
            st.number_input, "Realization", key="how_number", value=how.number + 1, min_value=1,
            max_value=MAX_REALIZATIONS, width=124, write=lambda r: follow(how, int(r) - 1),
            help="Each has its own random numbers; numbered as on Simulate.",
        )  # fmt: skip
        field(
            st.selectbox, "Level J", key="how_level", value=p.level, width=96,
            options=[0] if p.method == "ccsim" else levels(shape), disabled=p.method == "ccsim",
            write=lambda level: set_own(state, wavelet_level=level), help=help_of("wavelet_level"),
        )  # fmt: skip
        field(
            st.selectbox, "Overlap OR", key="how_overlap", value=p.overlap_size, width=116,
            options=overlap_sizes(p.level, p.template_size),
            write=lambda size: set_own(state, overlap_size=size), help=help_of("overlap_size"),
        )  # fmt: skip
        field(
            st.number_input, "Candidates K", key="how_candidates", value=p.n_candidates, width=136,
            min_value=1, max_value=MAX_CANDIDATES_OFFERED,
            write=lambda k: set_own(state, n_candidates=int(k)), help=help_of("n_candidates"),
        )  # fmt: skip
        if how.parameters is not None:
            button(
                "Use this setting", key="how_use", on_click=use_own, args=(state,),
                help="Takes it to the study, and so to Simulate.",
            )  # fmt: skip
            button(
                "Back to the study's",
                key="how_back",
                on_click=forget_own,
                args=(state,),
            )
