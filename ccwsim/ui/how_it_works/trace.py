"""The realization that the page follows, and how its setting is chosen."""

from __future__ import annotations

from typing import Any

import streamlit as st

from ccwsim.engine.stages.similarity import L_SHAPE
from ccwsim.engine.trace import Trace
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.ui.how_it_works.state import How
from ccwsim.ui.session.fitting import fitted
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State

SHOWN_FIRST = 0.4
"""How far along the path the patch lies that is shown first."""


def parameters_of(state: State) -> Parameters:
    """Return the page's own setting, or the study's."""
    own = state.page(How).parameters
    return state.choices.parameters if own is None else own


def trace_of(state: State) -> Trace:
    """Return the realization that is followed; another setting is followed anew.

    Raises
    ------
    CCWSIMError
        Where the study cannot be simulated, or not followed.
    """
    how, choices, parameters = state.page(How), state.choices, parameters_of(state)
    image, data = image_of(choices.image), data_of(choices)
    key = image.digest, data.digest, repr(choices.grid), parameters.digest, choices.seed, how.number
    if how.trace is None or how.traced != key:
        how.trace = how.traced = None
        study = Study(image, choices.grid, parameters, data, choices.seed)
        with st.spinner("Preparing the image; the first time, kernels are compiled …"):
            trace = Trace(study, how.number)
            trace.at(0)
        how.trace, how.traced = trace, key
    how.facies = min(how.facies, image.n_facies - 1)
    if how.patch < 0:
        how.patch = usual_patch(how.trace)
    how.patch = min(how.patch, len(how.trace.patches) - 1)
    return how.trace


def usual_patch(trace: Trace) -> int:
    """Return a patch with an L-shaped overlap some way down the path: it shows most."""
    wanted = SHOWN_FIRST * len(trace.patches)
    inner = [p.number for p in trace.patches if p.shape == L_SHAPE]
    return min(inner, key=lambda number: abs(number - wanted), default=0)


def set_own(state: State, **changes: Any) -> None:
    """Change the page's own setting; sizes that do not fit any more go to the nearest that do."""
    page_state = state.page(How)
    shape = image_of(state.choices.image).shape
    own = fitted(parameters_of(state), shape, **changes)
    page_state.parameters = None if own == state.choices.parameters else own
    page_state.playing = False


def use_own(state: State) -> None:
    """Make the page's setting the study's."""
    state.change(parameters=parameters_of(state))
    forget_own(state)


def forget_own(state: State) -> None:
    """Go back to the study's setting."""
    page_state = state.page(How)
    page_state.parameters = None
    page_state.playing = False


def follow(how: How, number: int) -> None:
    """Follow another realization, at the same patch."""
    how.number, how.playing, how.datum = number, False, 0
