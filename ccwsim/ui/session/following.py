"""The address of a page follows the study."""

from __future__ import annotations

from urllib.parse import urlencode

import streamlit as st

from ccwsim.model.choices import Shown
from ccwsim.sharing import link_of, meant
from ccwsim.ui.session.state import State


def shown_of(state: State) -> Shown:
    """Return what of the results is looked at."""
    return Shown(state.shown, state.facies, state.e_type)


def follow_study(state: State) -> None:
    """Write the study behind the address, where it is not there; the page is not drawn again."""
    there = {name: st.query_params.get_all(name) for name in st.query_params}
    kept = {name: values for name, values in there.items() if not meant(name)}
    wanted = {**kept, **link_of(state.choices, shown_of(state))}
    word = urlencode(wanted, doseq=True)
    # what the browser told may be older than what it was sent last
    if word != state.address or wanted != there:
        st.query_params.from_dict(wanted)
        state.address = word
