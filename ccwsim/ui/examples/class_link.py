"""One link for a class: the study is the same for all, the seed is each one's own."""

from __future__ import annotations

from dataclasses import replace
from secrets import randbelow
from urllib.parse import urlencode

import streamlit as st

from ccwsim.sharing import left_out, link_of
from ccwsim.ui.choices import Choices
from ccwsim.ui.examples.state import Examples
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run_step import LARGEST_SEED
from ccwsim.ui.widgets.steps import step_note

CLASS = "class"
FEWEST_DIGITS = 1000
"""Seeds below this are what people type: none of them is given out."""


def own_seed(state: State, choices: Choices) -> Choices:
    """Return a study with a seed of this reader's own where the address is a class's.

    It is drawn once: the word for the class leaves the address, the seed stays in it, so that the
    page can be loaded again.
    """
    if st.query_params.get(CLASS) != "1":
        return choices
    del st.query_params[CLASS]
    seed = FEWEST_DIGITS + randbelow(LARGEST_SEED - FEWEST_DIGITS)
    state.page(Examples).own_seed = seed
    return replace(choices, seed=seed)


def class_link(choices: Choices, page: str) -> str:
    """Return the address that opens a study on Simulate, with another seed for everyone.

    Parameters
    ----------
    choices : Choices
    page : str
        The address of a page of the dashboard.

    Examples
    --------
    >>> class_link(Choices(n_realizations=4, seed=7), "http://lab:8501/examples")
    'http://lab:8501/simulate?realizations=4&class=1'
    """
    found = link_of(replace(choices, seed=0)) | {CLASS: ["1"]}
    start = page.split("?")[0].rpartition("/")[0]
    return f"{start}/simulate?{urlencode(found, doseq=True)}"


def draw_class_link(state: State) -> None:
    """Draw the menu that gives the link of the study for a class."""
    with st.popover("Link for a class", key="class_menu"):
        step_note(
            "Whoever opens this link gets your present study with a seed of their own, drawn once "
            "and shown. Put the pictures side by side: what all have in common is the image's and "
            "the data's, what differs is uncertainty."
        )
        st.code(class_link(state.choices, st.context.url or ""), language=None, wrap_lines=True)
        missing = left_out(state.choices)
        if missing:
            step_note(f"The link cannot carry {' and '.join(missing)}.")
