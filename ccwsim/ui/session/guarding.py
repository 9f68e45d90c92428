"""The body of a page and of each of its parts that is drawn by itself, with errors caught."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import streamlit as st

from ccwsim.model.choices import Choices
from ccwsim.ui.session.following import follow_study
from ccwsim.ui.session.state import KEY, session_state
from ccwsim.ui.widgets.errors import (
    TROUBLE,
    is_control_flow,
    logged,
    user_message,
)
from ccwsim.ui.widgets.fields import button

DREW = "ccwsim_drew"
"""Where the session keeps the choices that a page was last drawn with, whole."""


@contextmanager
def error_boundary(whole: bool = False) -> Iterator[None]:
    """Say errors in words and keep the state; for the body of a page and of each fragment.

    What was changed goes into the address.

    Parameters
    ----------
    whole : bool
        Whether this is the whole body of a page: a way back to what could be drawn is offered.
    """
    if TROUBLE in st.session_state:
        st.error(st.session_state.pop(TROUBLE))
    try:
        yield
        if whole and KEY in st.session_state:
            st.session_state[DREW] = session_state().choices
    except Exception as error:
        if is_control_flow(error):
            raise
        st.error(user_message(error, "drawn"))
        if whole:
            _way_back()
    if KEY in st.session_state:
        try:
            follow_study(session_state())
        except Exception as error:  # the page is there, only its address is not
            logged(error)


def _way_back() -> None:
    """Offer the study that could be drawn, so that one that cannot never locks the reader out."""
    drew = st.session_state.get(DREW)
    if drew is not None and drew != session_state().choices:
        button(
            "Back to the study before", key="way_back", type="primary",
            on_click=_go_back, args=(drew,),
        )  # fmt: skip


def _go_back(drew: Choices) -> None:
    state = session_state()
    state.choices, state.image_draft, state.data_draft = drew, None, None
