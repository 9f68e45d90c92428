"""The state of the page How it works, and the realization that the page follows."""

from dataclasses import dataclass, replace
from typing import Any

import streamlit as st

from ccwsim.engine.trace import Trace
from ccwsim.model import Parameters, fitted
from ccwsim.sharing.choices import CellsOfWells
from ccwsim.ui.session import State, data_of, image_of, study_of, wells_of

SHOWN_FIRST = 0.4  # share of the path that precedes the patch with which the page opens


@dataclass
class How:
    """The state of the page.

    `parameters` are the page's setting, or None to use the study's setting. `number` is the index
    of the realization, `patch` the index of the patch, and `ticked` the time of the last step of
    play. `ground` is the map on which locations are marked: "score", "costs" (including data) or
    "image". Coefficients are shown for `facies`. `datum` is the index of the corrected datum.
    `trace` is None if the study cannot be followed. `traced` identifies the study of the trace, and
    `wells` are the named wells of its data. `resimulated` identifies the study whose local
    re-simulation is on the page.
    """

    parameters: Parameters | None = None
    number: int = 0
    patch: int = -1
    playing: bool = False
    ticked: float = 0.0
    ground: str = "score"
    facies: int = -1  # −1 for the facies of interest
    datum: int = 0
    trace: Trace | None = None
    traced: Any = None
    wells: CellsOfWells = ()
    resimulated: Any = None

    def stop(self, **changes: Any) -> None:
        """Change the state and stop the play, because the user has done something."""
        for name, value in changes.items():
            setattr(self, name, value)
        self.playing = False


def page_parameters(state: State) -> Parameters:
    """Return the setting of the page, or the setting of the study by default."""
    parameters = state.page(How).parameters
    return state.choices.parameters if parameters is None else parameters


def trace_of(state: State) -> Trace:
    """Return the trace of the realization; raise an error if it cannot be followed."""
    page_state, choices, parameters = state.page(How), state.choices, page_parameters(state)
    image, data = image_of(choices.image), data_of(choices)
    numbers = parameters.digest, choices.seed, page_state.number
    key = image.digest, data.digest, repr(choices.grid), choices.guides.digest, *numbers
    if page_state.trace is None or page_state.traced != key:
        page_state.trace = page_state.traced = None
        study = study_of(replace(choices, parameters=parameters))
        with st.spinner("Preparing the image; the first time, kernels are compiled …"):
            trace = Trace(study, page_state.number)
            trace.at(0)
        page_state.trace, page_state.traced, page_state.wells = trace, key, wells_of(choices)
    facies = page_state.facies if page_state.facies >= 0 else image.facies_of_interest
    page_state.facies = min(facies, image.n_facies - 1)
    if page_state.patch < 0:
        page_state.patch = usual_patch(page_state.trace)
    page_state.patch = min(page_state.patch, len(page_state.trace.patches) - 1)
    return page_state.trace


def usual_patch(trace: Trace) -> int:
    """Return a patch near `SHOWN_FIRST` that overlaps earlier patches on all possible sides."""
    target = SHOWN_FIRST * len(trace.patches)
    rank = max((not p.split, p.shape) for p in trace.patches)
    overlapped = [p.number for p in trace.patches if (not p.split, p.shape) == rank]
    return min(overlapped, key=lambda number: abs(number - target), default=0)


def set_own(state: State, **changes: Any) -> None:
    """Change the setting of the page; sizes that no longer fit become the nearest valid sizes."""
    parameters = fitted(page_parameters(state), state.image.shape, **changes)
    state.page(How).stop(parameters=None if parameters == state.choices.parameters else parameters)


def use_own(state: State) -> None:
    """Use the setting of the page in the study."""
    state.change(parameters=page_parameters(state))
    forget_own(state)


def forget_own(state: State) -> None:
    """Use the setting of the study on the page again."""
    state.page(How).stop(parameters=None)
