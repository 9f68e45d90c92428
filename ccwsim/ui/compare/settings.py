"""The settings side by side: what is common at once, the rest behind a menu."""

from __future__ import annotations

from collections.abc import Callable

import streamlit as st
from streamlit.errors import StreamlitAPIException

from ccwsim.experiments.comparison import FEWEST, MOST
from ccwsim.model.bounds import MAX_CANDIDATES_OFFERED
from ccwsim.model.parameters import Parameters
from ccwsim.ui.compare.choice import (
    add_setting,
    called,
    change_setting,
    copy_setting,
    remove_setting,
    said_setting,
    settings_of,
    use_setting,
)
from ccwsim.ui.compare.name import draw_name
from ccwsim.ui.session.fitting import levels, overlap_sizes, template_sizes
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.method_step import parameter_field
from ccwsim.ui.widgets.fields import PARAMETERS, button, field, help_of
from ccwsim.ui.widgets.steps import pair

SIMULATE = "pages/simulate.py"
COMMON = (
    "method", "wavelet_level", "template_size", "overlap_size", "n_candidates", "search_fraction",
    "refine",
)  # fmt: skip
"""What is shown at once."""


def draw_settings(state: State) -> None:
    """Draw one column a setting."""
    settings = settings_of(state)
    with st.container(key="settings"):
        places = st.columns(len(settings), gap="medium", wrap=False)
    for k, (place, letter) in enumerate(zip(places, called(len(settings)), strict=True)):
        with place, st.container(key=f"setting_{letter}"):
            _title(k, letter, settings)
            _common(state, k, letter, settings[k])
            _actions(state, k, letter, settings)


def _title(k: int, letter: str, settings: tuple[Parameters, ...]) -> None:
    note = said_setting(settings[k], settings[0]) if k else "the study’s own"
    draw_name(letter, "the same as A" if note == "the same" else note)


def _common(state: State, k: int, letter: str, p: Parameters) -> None:
    shape = image_of(state.choices.image).shape

    def change(name: str) -> Callable[[object], None]:
        return lambda value: change_setting(state, k, **{name: value})

    def choice(name: str, label: str, value: object, options: list, off: bool = False) -> None:
        field(
            st.selectbox, label, key=f"{letter}_{name}", value=value, options=options,
            write=change(name), help=help_of(name), disabled=off,
        )  # fmt: skip

    def number(name: str, label: str, **limits: float) -> None:
        field(
            st.number_input, label, key=f"{letter}_{name}", value=getattr(p, name),
            write=change(name), help=help_of(name), **limits,
        )  # fmt: skip

    left, right = pair()
    with left:
        choice("method", "Method", p.method, PARAMETERS["method"]["allowed"].split(", "))
        sizes = template_sizes(p.level, shape)
        choice("template_size", "Template (cells)", p.template_size, sizes)
        number("n_candidates", "Candidates K", min_value=1, max_value=MAX_CANDIDATES_OFFERED)
    with right:
        off = p.method == "ccsim"
        choice("wavelet_level", "Level", p.level, [0] if off else levels(shape), off)
        sizes = overlap_sizes(p.level, p.template_size)
        choice("overlap_size", "Overlap (cells)", p.overlap_size, sizes)
        number("search_fraction", "Search fraction", min_value=0.01, max_value=1.0, step=0.01)
    with st.container(horizontal=True, vertical_alignment="center", key=f"last_{letter}"):
        parameter_field(p, "refine", change("refine"), f"{letter}_")
        with st.popover("More", key=f"more_{letter}"):
            for name in PARAMETERS:
                if name not in COMMON:
                    parameter_field(p, name, change(name), f"{letter}_")


def _actions(state: State, k: int, letter: str, settings: tuple[Parameters, ...]) -> None:
    with st.container(horizontal=True, gap="small", key=f"actions_{letter}"):
        if button(
            "Use these", key=f"use_{letter}", on_click=use_setting, args=(state, k),
            help="Take this setting to Simulate"
            + ("." if k == 0 else "; what the study had takes its place here."),
        ):  # fmt: skip
            _go_to_simulate()
        with st.popover("Copy from", key=f"copy_{letter}"):
            for j, other in enumerate(called(len(settings))):
                if j != k:
                    button(
                        f"Setting {other}", key=f"copy_{letter}_from_{other}", width="stretch",
                        on_click=copy_setting, args=(state, k, j),
                    )  # fmt: skip
        if k:
            button(
                "Remove", key=f"remove_{letter}", on_click=remove_setting, args=(state, k),
                disabled=len(settings) == FEWEST,
                help="Two settings are needed." if len(settings) == FEWEST else None,
            )  # fmt: skip
        elif len(settings) < MOST:
            button(
                "Add a setting",
                key="add_setting",
                on_click=add_setting,
                args=(state,),
            )


def _go_to_simulate() -> None:
    try:
        st.switch_page(SIMULATE)
    except (StreamlitAPIException, KeyError):  # where a page is run alone, there is no other
        st.info("The study has this setting now.")
