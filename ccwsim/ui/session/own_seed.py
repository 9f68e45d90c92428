"""A link for a class gives each reader a seed of their own."""

from __future__ import annotations

from dataclasses import replace
from secrets import randbelow

import streamlit as st

from ccwsim.model.bounds import MAX_SEED
from ccwsim.model.choices import Choices
from ccwsim.ui.session.state import State

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
    seed = FEWEST_DIGITS + randbelow(MAX_SEED - FEWEST_DIGITS)
    state.own_seed = seed
    return replace(choices, seed=seed)
