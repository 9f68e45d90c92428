"""A study starts from the address of a page."""

from __future__ import annotations

from dataclasses import replace
from urllib.parse import urlencode

import streamlit as st
from streamlit.errors import StreamlitAPIException

from ccwsim.model.choices import Choices, DataChoice, Shown
from ccwsim.model.errors import CCWSIMError
from ccwsim.sharing import link_of, read_link
from ccwsim.ui.session.fitting import fitted_to_image
from ccwsim.ui.session.own_seed import own_seed
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State


def take_address(state: State) -> None:
    """Start a study from the address of the page; what cannot be taken is said in words."""
    query = {name: st.query_params.get_all(name) for name in st.query_params}
    choices, shown, notes = read_link(query)
    choices = own_seed(state, choices)
    choices, more = together(choices)
    state.choices, state.told = choices, (*notes, *more)
    show(state, shown)


def together(choices: Choices) -> tuple[Choices, tuple[str, ...]]:
    """Return choices whose parts go together, and what had to be changed for it."""
    notes = []
    fitting = fitted_to_image(choices, image_of(choices.image))
    if fitting != choices:
        own, its = choices.parameters, fitting.parameters
        notes.append(
            f"Template {own.template_size} and overlap {own.overlap_size} do not suit the training "
            f"image at level {own.level}: {its.template_size} and {its.overlap_size} are taken at "
            f"level {its.level}."
        )
    try:
        data_of(fitting)
    except CCWSIMError as error:
        notes.append(f"The hard data are left out. {str(error)[:1].upper()}{str(error)[1:]}.")
        fitting = replace(fitting, data=DataChoice())
    return fitting, tuple(notes)


def show(state: State, shown: Shown) -> None:
    """Look at something of the results."""
    state.shown, state.facies, state.e_type = shown.realization, shown.facies, shown.e_type


def link_here(choices: Choices, shown: Shown) -> str:
    """Return the whole address that opens a study on this page."""
    word = urlencode(link_of(choices, shown), doseq=True)
    page = (st.context.url or "").split("?")[0]
    return f"{page}?{word}" if word else page or "?"


def go_to(page: str, instead: str) -> None:
    """Go to a page; where a page is run alone, it has no others, and says something instead."""
    try:
        st.switch_page(page)
    except (StreamlitAPIException, KeyError):
        st.info(instead)
