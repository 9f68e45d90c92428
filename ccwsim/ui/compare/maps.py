"""The same realization of every setting side by side, with the E-types below."""

from __future__ import annotations

from collections.abc import Sequence

import streamlit as st

from ccwsim.experiments.comparison import Comparison
from ccwsim.figures import compared_proportions_chart, compared_times_chart
from ccwsim.ui.compare.choice import called, said_setting, said_whole
from ccwsim.ui.compare.name import draw_name
from ccwsim.ui.compare.run import want_curves
from ccwsim.ui.compare.state import Asked, Comparing
from ccwsim.ui.results.e_type import choose, e_type_field, uncertainty_map
from ccwsim.ui.results.titled_chart import titled_chart
from ccwsim.ui.session.state import State
from ccwsim.ui.widgets.facts import seconds
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.maps import draw_map, facies_map, points_of
from ccwsim.ui.widgets.steps import panel_title
from ccwsim.ui.widgets.theme import chart_theme

NARROWEST = 0.8
"""The training image's column is never narrower than this share of a setting's."""
MAP_HEIGHT = 460
SCALE = "compared"


def draw_maps(state: State, found: Comparison, asked: Asked, colours: Sequence[str]) -> None:
    """Draw one column for the training image and one for each setting."""
    _controls(state, found)
    image, grid = found.ensembles[0].training_image, asked.grid
    share = min(max(image.shape[1] / grid.nx, NARROWEST), 1.0)
    with st.container(key="maps"):
        places = st.columns([share] + [1.0] * len(asked.settings), gap="medium")
    with places[0]:
        panel_title("Training image")
        shown = facies_map(image.indices, image, colours, f"Training image {image.name}")
        draw_map(
            shown, "map_image", name="training_image", link="image", scale=SCALE, leads=False,
            max_height=MAP_HEIGHT,
        )  # fmt: skip
        _beside(found)
    for k, letter in enumerate(called(len(asked.settings))):
        with places[k + 1]:
            draw_name(letter, note_of(asked, k))
            if k < len(found.ensembles):
                _maps_of(state, found, k, colours)
            else:
                st.html(f'<div class="ghost" style="aspect-ratio: {grid.nx} / {grid.ny}"></div>')


def note_of(asked: Asked, k: int) -> str:
    """Return what a compared setting is."""
    own = asked.settings[0]
    return said_setting(asked.settings[k], own) if k else said_whole(own)


def _controls(state: State, found: Comparison) -> None:
    n, names = found.ensembles[0].n, found.ensembles[0].training_image.facies_names
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="shown_row"):
        panel_title(f"Realization {state.page(Comparing).shown + 1} of {n}")
        for step, label, name in ((-1, "‹", "previous"), (1, "›", "next")):
            button(
                label, key=f"shown_{name}", on_click=_step, args=(state, n, step),
                help=f"The {name} realization of all settings", disabled=n == 1,
            )  # fmt: skip
        st.html('<div class="panel below">E-type below</div>', width="content")

        def write(option: int | str) -> None:
            choose(state, option)
            want_curves(state)

        e_type_field(state, names, write)


def _step(state: State, n: int, step: int) -> None:
    page_state = state.page(Comparing)
    page_state.shown = (page_state.shown + step) % n


def _maps_of(state: State, found: Comparison, k: int, colours: Sequence[str]) -> None:
    ensemble, name, r = found.ensembles[k], found.names[k], state.page(Comparing).shown
    image = ensemble.training_image
    shown = facies_map(ensemble.indices[r], image, colours, f"{name}, realization {r + 1}")
    shown.points.extend(points_of(ensemble.hard_data, image, ensemble.realizations[r]))
    draw_map(
        shown, f"map_{name}", link="grid", scale=SCALE, name=f"{name}_realization_{r + 1}",
        max_height=MAP_HEIGHT,
    )  # fmt: skip
    below = uncertainty_map(state, ensemble, colours)
    draw_map(
        below, f"map_e_type_{name}", link="grid", scale=SCALE, name=f"{name}_e_type",
        max_height=MAP_HEIGHT,
    )  # fmt: skip


def _beside(found: Comparison) -> None:
    image, theme = found.ensembles[0].training_image, chart_theme()
    each = [1000 * e.cpu_seconds for e in found.ensembles]
    labels = [seconds(t) for t in found.cpu_seconds]
    milliseconds = dict(zip(found.names, each, strict=True))
    times = compared_times_chart(milliseconds, 1000 * found.cpu_seconds, labels, theme)
    titled_chart("CPU time", "", times, "compared_times", "CPU time of a realization by setting")
    proportions = dict(zip(found.names, found.proportions, strict=True))
    shares = compared_proportions_chart(image.facies_names, image.proportions, proportions, theme)
    alt = "Facies proportions of the realizations by setting, and of the training image"
    titled_chart("Proportions", "", shares, "compared_proportions", alt)
