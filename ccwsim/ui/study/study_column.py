"""The study column: five numbered steps and the guides; this module draws Grid and Method."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import streamlit as st
from streamlit.delta_generator import DeltaGenerator

from ccwsim.metrics import default_parameters, warn_of_edges, warn_of_level
from ccwsim.metrics.diagnosis import TREND_WEIGHT
from ccwsim.model import (
    PER_AXIS,
    VARIANT_SETTINGS,
    WITHOUT_ADDITIONS,
    WORLD_AXES,
    Parameters,
    Shape,
    bounds,
    fitted,
    levels,
    overlap_sizes,
    template_sizes,
)
from ccwsim.report.settings import VALUES
from ccwsim.ui.session import State, cached, error_boundary, page_link, resolve
from ccwsim.ui.study.asking import draw_fits, draw_fitted
from ccwsim.ui.study.data_step import data_step, problem_of_data
from ccwsim.ui.study.guides_step import guides_step
from ccwsim.ui.study.image_step import image_step
from ccwsim.ui.study.run import describe_prices_of_levels, is_live, run_step
from ccwsim.ui.study.trials import advice_on, find_button
from ccwsim.ui.widgets import (
    PARAMETER_ROWS,
    bound_to,
    button,
    field,
    help_of,
    in_row,
    menu,
    options_of,
    page_labels,
    pair,
    plain,
    step_note,
    step_title,
)

SIDE_LABELS = {"nx": "Cells E–W", "ny": "Cells N–S", "nz": "Layers"}
ON_TOP = ("variant", "template_size", "overlap_size", "wavelet_level", "n_candidates")
NOT_IN_PAPER = "⁺"  # after the names of parameters that the paper does not have
NUMBER_RANGES = {
    "n_candidates": (1, bounds.MAX_CANDIDATES_OFFERED, 1),
    "search_fraction": (0.01, 1.0, 0.01),
    "co_template": (1, bounds.MAX_CO_TEMPLATE, 1),
    "template_variation": (0.0, bounds.MAX_TEMPLATE_VARIATION, 0.05),
    "location_weight": (0.0, bounds.MAX_LOCATION_WEIGHT, 0.5),
}
"""Minimum, maximum and step of the number fields of parameters."""
_warn_of_edges = cached(max_entries=64)(warn_of_edges)
STEP_LABELS = page_labels("steps")
"""Names, on the screen, of parameters that have other names in code."""
SOME_K = (1, 2, 3, 5, 8, 12, 20, 30, 50, 80, 120, 200)  # numbers of candidates on the slider
SLIDER = partial(st.select_slider, label_visibility="collapsed")
"""A slider below a field that has its label and takes exact values."""


def study_column(state: State) -> None:
    """Draw the study column, with all steps, in the sidebar."""
    with st.sidebar:
        for step in (image_step, data_step, guides_step, grid_step, method_step, run_step):
            with error_boundary(way_back=True):  # an error in one step does not affect other steps
                step(state)


def grid_step(state: State) -> None:
    """Draw the numbers of cells along x and y, and a menu with cell size and origin."""
    step_title(3, "Grid")
    grid = state.grid
    change = partial(_change_grid, state)
    n_axes = grid.n_dimensions
    places = [place for _ in range(n_axes - 1) for place in pair()]
    for column, (name, label) in zip(places, SIDE_LABELS.items(), strict=False):
        with column:
            limits = {"min_value": 1, "max_value": bounds.MAX_GRID_SIDE_OFFERED}
            field(
                st.number_input,
                label,
                key=f"grid_{name}",
                step=8 if name == "nz" else 32,
                help=f"{label} of the simulation grid. Time grows with the number of cells.",
                **bound_to(grid, name, change, **limits),
            )
    if grid.crs or max(grid.cell_size) != 1:
        step_note(resolve.described(grid))
    menu("Fit and coordinates", "grid_menu", partial(_world, state, n_axes))
    draw_fitted(state)


def _world(state: State, n_axes: int) -> None:
    """Draw buttons for grids that fit wells, guides or the image, and fields of coordinates."""
    guides, data = state.guides_draft or state.choices.guides, state.data_draft
    tried = replace(state.choices, data=data or state.choices.data)
    draw_fits(state, resolve.fitting_grids(tried, guides), "grid_to_")
    st.caption("Used for data in world coordinates, axes of maps and exported files.")
    for name, k in product(("cell_size", "origin"), range(n_axes)):
        _world_field(state, name, k)


def _world_field(state: State, name: str, k: int) -> None:
    """Draw a number field for one component (x, y or z) of an attribute of the grid."""

    def write(value: float) -> None:
        numbers = list(getattr(state.grid, name))
        numbers[k] = value
        _change_grid(state, **{name: tuple(numbers)})

    axis = WORLD_AXES[k]
    field(
        st.number_input,
        page_labels(name)[axis],
        key=f"grid_{name}_{axis}",
        value=getattr(state.grid, name)[k],
        write=write,
        format="%g",
        min_value=1e-9 if name == "cell_size" else None,
    )


def _change_grid(state: State, **changes: object) -> None:
    state.change(grid=replace(state.grid, **changes))


def method_step(state: State) -> None:
    """Draw the step Method, which offers only values that are valid together."""
    step_title(4, "Method")
    p, image = state.choices.parameters, state.image
    shape, change = image.shape, partial(set_parameters, state)
    sweeps = is_live(state) and len(shape) == 2
    variant_field(p, shape, change)
    with size_fields(p, shape, change, along_z=(False,), slider=sweeps) or nullcontext():
        parameter_field(p, "n_candidates", change, "", st.number_input)
        if sweeps:
            field(
                SLIDER,
                STEP_LABELS["n_candidates"],
                key="n_candidates_slider",
                **bound_to(p, "n_candidates", change, options=sorted({*SOME_K, p.n_candidates})),
            )
    if price := describe_prices_of_levels(state.choices):
        step_note(price)
    if not problem_of_data(state.choices):
        grid, n_data = state.grid, resolve.data_of(state.choices).n
        if warning := warn_of_level(p, grid.shape, n_data):
            st.warning(plain(warning))
    if warning := _warn_of_edges(p, image):
        st.warning(plain(warning))
    with in_row("method_row"):
        menu("Advanced", "method_menu", partial(_advanced, state, p, image.shape, change))
        find_button(state)


def _advanced(state: State, p: Parameters, shape: Shape, change: Callable[..., None]) -> None:
    """Draw the fields of the menu of parameters that are seldom changed."""
    page_link("pages/paper_and_ours.py", f"{NOT_IN_PAPER} not in the paper: the paper's and ours")
    if len(shape) == 3:
        size_fields(p, shape, change, along_z=(True,))
    for name in PARAMETER_ROWS:
        if name not in ON_TOP:
            parameter_field(p, name, change)
    if len(shape) == 3:
        _trend_field(p, change)
    image = state.image
    step_note(advice_on(image, p))
    defaults = fitted(default_parameters(image), shape)
    button("Back to the defaults", on_click=state.change, kwargs={"parameters": defaults})


def size_fields(
    p: Parameters,
    shape: Shape,
    change: Callable[..., None],
    prefix: str = "",
    along_z: Sequence[bool] = (False, True),
    slider: bool = False,
) -> DeltaGenerator | None:
    """Draw template, overlap and level in two columns; return the place for a fourth field, if any.

    Each parameter has one number for maps, and two numbers (horizontal and along z) for volumes.
    `change` is called with the parameter that the user changes; keys start with `prefix`. `along_z`
    selects horizontal numbers (False), numbers along z (True), or both. With `slider`, each field
    also has a slider; if Live is on, releasing the slider starts a run.
    """
    volume, ccsim = len(shape) == 3, p.method == "ccsim"
    lengths = p.along(shape)
    along: dict[str, tuple[int, int, int]] = dict(zip(PER_AXIS, lengths, strict=True))
    sides = [(name, z) for name in PER_AXIS for z in along_z[: 1 + volume]]
    places = [place for _ in sides[::2] for place in pair()]
    for place, (name, z) in zip(places, sides, strict=False):
        sizes, axis = along[name], 0 if z else -1
        level, template = lengths.level[axis], lengths.template[axis]
        offered: dict[str, list[int]] = {
            "template_size": template_sizes(level, shape, z),
            "overlap_size": overlap_sizes(level, template, z),
            "wavelet_level": [0] if ccsim else levels(shape, z),
        }

        def write(value: int, name=name, sizes=sizes, z=z) -> None:
            triple = (value, *sizes[1:]) if z else (sizes[0], value, value)
            change(**{name: triple if volume else value})

        chosen: dict[str, Any] = {"value": sizes[axis], "write": write, "options": offered[name]}
        chosen["disabled"] = ccsim and name == "wavelet_level"
        label = f"{STEP_LABELS[name]}{' along z' if z else ''}"
        if not volume and name != "wavelet_level":
            label = f"{label} (cells)"
        with place:
            key = f"{prefix}{name}{'_z' if z else ''}"
            field(st.selectbox, label, key=key, help=help_of(name), **chosen)
            if slider and sizes[axis] in offered[name] and len(offered[name]) > 1:
                field(SLIDER, label, key=f"{key}_slider", **chosen)
    return places[-1] if len(places) > len(sides) else None


def _trend_field(p: Parameters, change: Callable[..., None]) -> None:
    """Ask whether to apply the location weight only along z."""
    weight = max(p.location_weights)

    def write(only_z: bool) -> None:
        change(location_weight=(weight or TREND_WEIGHT, 0.0, 0.0) if only_z else weight)

    only_z = isinstance(p.location_weight, tuple) and not any(p.location_weights[1:])
    field(
        st.checkbox,
        "Location weight only along z",
        key="p_vertical_trend",
        value=only_z,
        write=write,
        help="The location weight applies only along z: patches keep their height in the image.",
    )


def set_parameters(state: State, **changes: object) -> None:
    """Change parameters; sizes that no longer fit become the nearest valid sizes."""
    shape = state.image.shape
    state.change(parameters=fitted(state.choices.parameters, shape, **changes))


def variant_field(
    p: Parameters, shape: Shape, change: Callable[..., None], prefix: str = "p_"
) -> None:
    """Ask whose method is simulated; the published methods are for maps."""
    if len(shape) == 2:
        parameter_field(p, "variant", change, prefix)


def parameter_field(
    p: Parameters,
    name: str,
    change: Callable[..., None],
    prefix: str = "p_",
    of_numbers: Callable[..., Any] = st.slider,
) -> None:
    """Draw a control for the type of a parameter; the key of the control starts with `prefix`.

    A parameter that the paper does not have is marked; it is disabled if a variant switches it off.
    """
    value = getattr(p, name)
    label = STEP_LABELS.get(name, name.replace("_", " ").capitalize())
    if name in WITHOUT_ADDITIONS:
        label = f"{label} {NOT_IN_PAPER}"
    fixed = name in VARIANT_SETTINGS[p.variant]
    key = f"{prefix}{name}"
    options = bound_to(p, name, change, key=key, help=help_of(name), disabled=fixed)
    if isinstance(value, bool):
        field(st.checkbox, label, **options)
    elif isinstance(value, str):
        allowed = PARAMETER_ROWS[name]["allowed"].split(", ")
        field(
            st.selectbox,
            label,
            **options_of({value: VALUES.get(value, value) for value in allowed}),
            **options,
        )
    else:
        if isinstance(value, tuple):  # weights of 0 remain 0

            def write_per_axis(new: float) -> None:
                per_axis = tuple(new if weight else 0.0 for weight in value)
                change(**{name: per_axis if any(value) else new})

            options |= {"value": max(value), "write": write_per_axis}
        low, high, step = NUMBER_RANGES[name]
        field(of_numbers, label, min_value=low, max_value=high, step=step, **options)
