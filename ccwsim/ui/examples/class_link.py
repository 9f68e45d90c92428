"""One link for a class: the study is the same for all, the seed is each one's own."""

from __future__ import annotations

from dataclasses import replace
from urllib.parse import urlencode

import streamlit as st

from ccwsim.model.choices import Choices
from ccwsim.sharing import left_out, link_of
from ccwsim.ui.session.address import CLASS
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.steps import step_note


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
