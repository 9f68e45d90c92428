"""The uncertainty map: probability of a facies, the most likely facies, or entropy."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import streamlit as st

from ccwsim.figures import ENTROPY
from ccwsim.model.ensemble import Ensemble
from ccwsim.ui.results.bundles import e_type_of
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.fields import field
from ccwsim.ui.widgets.maps import CellMap, draw_map, facies_map, points_of, share_map
from ccwsim.ui.widgets.steps import panel_title

OTHERS = ("most likely", "entropy")


def draw_e_type(state: State, ensemble: Ensemble, colours: Sequence[str]) -> None:
    """Draw the map and the choice of what it shows."""
    names = ensemble.training_image.facies_names
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="e_type_row"):
        panel_title("E-type")
        e_type_field(state, names, lambda option: choose(state, option))
    shown = uncertainty_map(state, ensemble, colours)
    shown.points.extend(points_of(ensemble.hard_data, ensemble.training_image))
    name = f"{state.e_type}_{names[state.facies]}".replace(" ", "_")
    draw_map(shown, "map_e_type", link="grid", scale="maps", name=name)


def e_type_field(state: State, names: Sequence[str], write: Callable[[int | str], None]) -> None:
    """Draw the choice of what the uncertainty map shows."""
    field(
        st.selectbox, "What the uncertainty map shows", key="e_type",
        options=[*range(len(names)), *OTHERS],
        value=state.facies if state.e_type == "probability" else state.e_type,
        format_func=lambda k: said(k, names), write=write, label_visibility="collapsed", width=220,
    )  # fmt: skip


def said(option: int | str, names: Sequence[str]) -> str:
    """Return what a choice of the map is called.

    Examples
    --------
    >>> said(1, ["mud", "sand"]), said("entropy", [])
    ('probability of sand', 'entropy')
    """
    if isinstance(option, int):
        return f"probability of {names[option]}"
    return "most likely facies" if option == "most likely" else option


def choose(state: State, option: int | str) -> None:
    """Take a choice of the map; a facies also chooses whose curves are shown."""
    if isinstance(option, int):
        state.facies, state.e_type = option, "probability"
    else:
        state.e_type = "most likely" if option == "most likely" else "entropy"


def uncertainty_map(state: State, ensemble: Ensemble, colours: Sequence[str]) -> CellMap:
    """Return the map that is chosen."""
    image, found = ensemble.training_image, e_type_of(ensemble)
    if state.e_type == "most likely":
        return facies_map(found.most_likely, image, colours, "Most likely facies")
    if state.e_type == "entropy":
        return share_map(
            found.entropy, "entropy", "Entropy", colours=ENTROPY, point_colours=colours
        )
    name = image.facies_names[state.facies]
    return share_map(
        found.probability[state.facies], f"P({name}) =", f"Probability of {name}",
        point_colours=colours,
    )  # fmt: skip
