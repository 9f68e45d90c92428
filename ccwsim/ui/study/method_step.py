"""Step 4: template, overlap, level and candidates, and the other parameters behind a menu."""

from __future__ import annotations

import streamlit as st

from ccwsim.model.bounds import (
    MAX_CANDIDATES_OFFERED,
    MAX_CO_TEMPLATE,
    MAX_LOCATION_WEIGHT,
    MAX_TEMPLATE_VARIATION,
)
from ccwsim.model.parameters import Parameters
from ccwsim.ui.session.fitting import fitted, levels, overlap_sizes, template_sizes
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import PARAMETERS, button, field, help_of
from ccwsim.ui.widgets.steps import pair, step_title

ON_TOP = ("template_size", "overlap_size", "wavelet_level", "n_candidates")
NUMBERS = {
    "search_fraction": (0.01, 1.0, 0.01),
    "co_template": (1, MAX_CO_TEMPLATE, 1),
    "template_variation": (0.0, MAX_TEMPLATE_VARIATION, 0.05),
    "location_weight": (0.0, MAX_LOCATION_WEIGHT, 0.5),
}
"""Smallest, largest and step of the numbers behind the menu."""


def method_step(state: State) -> None:
    """Draw the step; only values that fit together are on offer."""
    step_title(4, "Method")
    p, shape = state.choices.parameters, image_of(state.choices.image).shape

    def change(name: str):
        return lambda value: set_parameters(state, **{name: value})

    left, right = pair()
    with left:
        field(
            st.selectbox, "Template (cells)", key="template_size", value=p.template_size,
            options=template_sizes(p.level, shape), write=change("template_size"),
            help=help_of("template_size"),
        )  # fmt: skip
        field(
            st.selectbox, "Level", key="wavelet_level", value=p.level,
            options=[0] if p.method == "ccsim" else levels(shape), write=change("wavelet_level"),
            help=help_of("wavelet_level"), disabled=p.method == "ccsim",
        )  # fmt: skip
    with right:
        field(
            st.selectbox, "Overlap (cells)", key="overlap_size", value=p.overlap_size,
            options=overlap_sizes(p.level, p.template_size), write=change("overlap_size"),
            help=help_of("overlap_size"),
        )  # fmt: skip
        field(
            st.number_input, "Candidates K", key="n_candidates", value=p.n_candidates,
            min_value=1, max_value=MAX_CANDIDATES_OFFERED, write=change("n_candidates"),
            help=help_of("n_candidates"),
        )  # fmt: skip
    with st.popover("Advanced", key="method_menu"):
        for name in PARAMETERS:
            if name not in ON_TOP:
                parameter_field(p, name, change(name))
        button("Back to the defaults", on_click=lambda: _reset(state))


def set_parameters(state: State, **changes: object) -> None:
    """Change parameters; sizes that do not fit any more go to the nearest that do."""
    shape = image_of(state.choices.image).shape
    state.change(parameters=fitted(state.choices.parameters, shape, **changes))


def parameter_field(p: Parameters, name: str, write, prefix: str = "p_") -> None:
    """Draw the control of one parameter, by the kind of its value; its key starts with `prefix`."""
    value = getattr(p, name)
    label = name.replace("_", " ").capitalize()
    options = {"key": f"{prefix}{name}", "value": value, "write": write, "help": help_of(name)}
    if isinstance(value, bool):
        field(st.checkbox, label, **options)
    elif isinstance(value, str):
        allowed = PARAMETERS[name]["allowed"].split(", ")
        field(st.selectbox, label, options=allowed, **options)
    else:
        low, high, step = NUMBERS[name]
        field(st.slider, label, min_value=low, max_value=high, step=step, **options)


def _reset(state: State) -> None:
    shape = image_of(state.choices.image).shape
    state.change(parameters=fitted(Parameters(), shape))
