"""Guides, between hard data and grid: probabilities, active cells and an auxiliary variable."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, replace
from functools import partial
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import Secondary, TrainingImage
from ccwsim.metrics import warn_of_probabilities
from ccwsim.model.bounds import MAX_AUXILIARY_WEIGHT, MAX_SCALE, MAX_SOFT_WEIGHT, MIN_SCALE
from ccwsim.model.grid import Grid
from ccwsim.model.missing import UNKNOWN
from ccwsim.sharing.choices import (
    MAX_CORNERS,
    Choices,
    Corners,
    Directions,
    Gradient,
    GuideChoice,
    Stroke,
)
from ccwsim.ui.frontend.cells import CellMap, map_content, share_map
from ccwsim.ui.frontend.component import draw_component
from ccwsim.ui.results.maps import middle_layer
from ccwsim.ui.session.cached import cached
from ccwsim.ui.session.resolve import image_of, secondary_of, study_of
from ccwsim.ui.session.state import State
from ccwsim.ui.session.uploads import file_uploader
from ccwsim.ui.study.run import start_run_if_needed
from ccwsim.ui.widgets.errors import problem_in
from ccwsim.ui.widgets.fields import bound_to, button, field, options_of
from ccwsim.ui.widgets.text import pair, plain, step_note

_warnings = cached(max_entries=64)(warn_of_probabilities)
MAX_HEIGHT = 480  # maximum height of the map in pixels
ACTIVE = "#9AA9B8"  # colour of active cells, if there are no other guides
AZIMUTH = {"min_value": -360.0, "max_value": 360.0, "step": 15.0, "format": "%g"}


def guides_step(state: State) -> None:
    """Draw the secondary information of the study in a frame that is closed until it is used."""
    guides = state.guides_draft or state.choices.guides
    change = partial(_change, state)
    with st.expander("Guides", expanded=not guides.is_empty, key="guides"):
        _draw_problem(state)
        if not guides.is_empty:
            _draw_board(state, guides)
        if guides.saved is not None:
            step_note(f"From the project: {guides.saved.describe()}")
        else:
            _probabilities(state, guides, change)
            _active(state, guides, change)
            _auxiliary(guides, change)
            _copies(state, guides, change)
        if not guides.is_empty:
            button("No guides", key="guides_none", on_click=use_guides, args=(state, GuideChoice()))


def use_guides(state: State, choice: GuideChoice) -> None:
    """Use a choice of guides in the study if it fits the study; otherwise keep it as a draft."""
    changed = replace(state.choices, guides=choice)
    fits = not problem_of_guides(changed)
    state.guides_draft = None if fits else choice
    if fits:
        state.choices = changed


def problem_of_guides(choices: Choices) -> str:
    """Return the reason why the guides of a study cannot be used, or an empty text."""
    return problem_in(lambda: secondary_of(choices))


def _change(state: State, **changes: Any) -> None:
    use_guides(state, replace(state.guides_draft or state.choices.guides, **changes))


def _draw_problem(state: State) -> None:
    draft, problem = state.guides_draft, problem_of_guides(state.choices)
    if draft is not None:
        problem = problem_of_guides(replace(state.choices, guides=draft)) or problem
        if not problem:  # the study has changed, and the guides fit now
            use_guides(state, draft)
    if problem:
        st.error(plain(problem))
    if draft is not None and problem:
        keep = {"on_click": setattr, "args": (state, "guides_draft", None)}
        button("Keep the guides as they were", key="guides_keep", **keep)


def _choice(
    label: str, given: Any, shapes: Mapping[str, Any], change: Callable[..., None], attribute: str
) -> None:
    """Draw the choice between no guide, named shapes with default values, and uploaded files."""
    chosen = next((name for name, shape in shapes.items() if type(shape) is type(given)), "none")
    if files := GuideChoice(**{attribute: given}).files:
        chosen = f"file {' and '.join(file.name for file in files)}"

    def write(name: str) -> None:
        change(**{attribute: shapes.get(name)})

    options = options_of({name: name for name in ("none", *shapes, chosen)})
    field(st.selectbox, label, key=f"guides_{attribute}", value=chosen, write=write, **options)


def _probabilities(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    image, given = image_of(state.choices.image), guides.probabilities
    shapes = {"a gradient": Gradient(), "drawn on the map": ()}
    _choice("Probabilities of facies", given, shapes, change, "probabilities")
    if given is not None:
        names = options_of(dict(enumerate(image.facies_names)))
        facies = bound_to(guides, "facies", change)
        facies["value"] = min(guides.facies, image.n_facies - 1)
        field(st.selectbox, "Facies", key="guides_facies", **facies, **names)
    if isinstance(given, Gradient):

        def write(**changes: Any) -> None:
            change(probabilities=replace(given, **changes))

        for column, name, label in zip(pair(), ("start", "end"), ("From", "To"), strict=True):
            with column:
                number = bound_to(given, name, write, min_value=0.0, max_value=1.0, step=0.05)
                field(st.number_input, label, key=f"guides_{name}", **number)
        azimuth = bound_to(given, "azimuth", write, help="From north, clockwise, in degrees.")
        field(st.number_input, "Towards (azimuth)", key="guides_azimuth", **azimuth, **AZIMUTH)
    tip = "Any grid, with variables named P_facies; for a volume also a table with z and P_facies."
    take = {"take": lambda upload: change(probabilities=upload), "help": tip}
    file_uploader("or a map of probabilities", key="guides_soft_file", **take)
    if given is not None:
        weight = bound_to(guides, "soft_weight", change, min_value=0.0, max_value=MAX_SOFT_WEIGHT)
        field(st.slider, "Weight of the probabilities", key="guides_soft_weight", **weight)


def _active(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    shapes = {"inside an outline": frame(state.choices.grid)}
    _choice("Active cells", guides.active, shapes, change, "active")
    tip = "A grid with 0 or no value in inactive cells, or polygons in GeoJSON."
    take = {"take": lambda upload: change(active=upload), "help": tip}
    file_uploader("or a mask", key="guides_mask_file", **take)


def frame(grid: Grid) -> Corners:
    """Return the corners of a rectangle in the middle of a grid."""
    x, y = grid.axes[0], grid.axes[1]
    (west, east), (south, north) = (np.quantile(k, (0.1, 0.9)).round(6).tolist() for k in (x, y))
    return (west, south), (east, south), (east, north), (west, north)


def _auxiliary(guides: GuideChoice, change: Callable[..., None]) -> None:
    given = guides.auxiliary
    image, grid = given if isinstance(given, tuple) else (None, None)
    shapes = {"position along a direction": Directions()}
    _choice("Auxiliary variable", given, shapes, change, "auxiliary")
    if isinstance(given, Directions):

        def write(**changes: Any) -> None:
            change(auxiliary=replace(given, **changes))

        for column, of in zip(pair(), ("image", "grid"), strict=True):
            with column:
                number = bound_to(given, of, write, **AZIMUTH)
                field(st.number_input, f"Azimuth, {of}", key=f"guides_azimuth_{of}", **number)
    takes = {
        "image": lambda upload: change(auxiliary=(upload, grid)),
        "grid": lambda upload: change(auxiliary=(image, upload)),
    }
    for of, take in takes.items():
        tip = f"A grid of one variable with the cells of the {of}."
        file_uploader(f"or a map for the {of}", key=f"guides_{of}_file", take=take, help=tip)
    if given is not None:
        weight = bound_to(guides, "auxiliary_weight", change, min_value=0.0)
        weight["max_value"] = MAX_AUXILIARY_WEIGHT
        field(st.slider, "Weight of the variable", key="guides_auxiliary_weight", **weight)


def _copies(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    given = guides.angle
    shapes = {"one angle": 45.0, "turning across the grid": Gradient(90.0, 0.0, 90.0)}
    _choice("Turned image", given, shapes, change, "angle")
    if isinstance(given, float):
        tip = "Azimuth to which the north of the image is turned, clockwise, in degrees."
        number = bound_to(guides, "angle", change, help=tip)
        field(st.number_input, "Angle", key="guides_one_angle", **number, **AZIMUTH)
    elif isinstance(given, Gradient):

        def write(**changes: Any) -> None:
            change(angle=replace(given, **changes))

        for column, name, label in zip(pair(), ("start", "end"), ("From", "To"), strict=True):
            with column:
                number = bound_to(given, name, write)
                field(st.number_input, label, key=f"guides_angle_{name}", **number, **AZIMUTH)
        way = bound_to(given, "azimuth", write, help="From north, clockwise, in degrees.")
        field(st.number_input, "Towards (azimuth)", key="guides_angle_azimuth", **way, **AZIMUTH)
    tip = "A grid of angles: degrees clockwise from north to which the image is turned."
    take = {"take": lambda upload: change(angle=upload), "help": tip}
    file_uploader("or a map of angles", key="guides_angle_file", **take)
    scale = bound_to(guides, "scale", change, min_value=MIN_SCALE, max_value=MAX_SCALE, step=0.1)
    field(st.number_input, "Scale of the image", key="guides_scale", **scale)
    names = {"": "none", "x": "west–east", "y": "south–north", "xy": "both"}
    mirrored = bound_to(guides, "mirrored", change, help="Further patterns of a small image.")
    mirrored["value"] = guides.mirrored if guides.mirrored in names else "xy"  # z by a link
    field(st.selectbox, "Mirrored copies", key="guides_mirrored", **mirrored, **options_of(names))


def _draw_board(state: State, guides: GuideChoice) -> None:
    """Draw the first map of the guides with the tools to draw on it, and notes on the guides."""
    choices, image = state.choices, image_of(state.choices.image)
    study = None if problem_in(lambda: study_of(choices)) else study_of(choices)
    secondary = study.secondary if study else None
    soft, corners = guides.probabilities, guides.active
    strokes = isinstance(soft, tuple) and [(*astuple(s)[:3], s.points) for s in soft]
    tools = {"strokes": strokes, "corners": isinstance(corners, tuple) and corners}
    ground = _ground(secondary, image, min(guides.facies, image.n_facies - 1), choices.grid)
    options: dict[str, Any] = {"grid": choices.grid, "name": "guides", "max_height": MAX_HEIGHT}

    def take(drawn: Mapping[str, Any]) -> None:
        take_drawing(state, drawn)
        start_run_if_needed(state, live=True)

    content = map_content(ground, **options) | tools | {"axes": False}
    draw_component("guides", "guide_board", content, "drawn", take)
    if study is None or secondary is None:  # without a weight, nothing guides
        return
    notes = _warnings(secondary, image, choices.parameters)
    if n_left := study.inactive_data.n:
        notes = [f"{n_left} hard data are in inactive cells and are left out", *notes]
    for note in notes:
        st.caption(plain(f"{note[:1].upper()}{note[1:]}."))


def take_drawing(state: State, drawn: Mapping[str, Any]) -> None:
    """Take strokes (value, radius, softness, points) and corners, which are false if not drawn."""
    shapes: dict[str, Any] = {}
    if (corners := drawn["corners"]) is not False:
        shapes["active"] = _points(corners)
    if (lines := drawn["strokes"]) is not False:
        shapes["probabilities"] = tuple(Stroke(v, r, s, _points(line)) for v, r, s, line in lines)
    _change(state, **shapes)


def _points(given: Sequence[Sequence[float]]) -> Corners:
    return tuple((float(x), float(y)) for x, y in given[:MAX_CORNERS])


def _ground(secondary: Secondary | None, image: TrainingImage, facies: int, grid: Grid) -> CellMap:
    """Return the first map of secondary information; of a volume, the middle layer."""
    active = None if secondary is None else secondary.active
    active = np.ones(grid.shape, bool) if active is None else active
    if secondary is not None and secondary.probabilities is not None:
        values, name = secondary.probabilities[facies], f"P({image.facies_names[facies]}) ="
    elif secondary is not None and (angle := secondary.angle) is not None:
        turned = (angle + 180) % 360 / 360  # north is in the middle of the colours
        values, name = np.broadcast_to(turned, grid.shape), "angle / 360° + ½ ="
    elif secondary is not None and secondary.auxiliary:
        values, name = secondary.auxiliary[0].grid, "variable, scaled to 1:"
        values = (values - values.min()) / max(values.max() - values.min(), 1e-300)
    else:
        shown = np.where(active, np.uint8(0), np.uint8(UNKNOWN))
        return CellMap(middle_layer(shown), [ACTIVE], ["active"], "Active cells")
    shown = middle_layer(np.where(active, values, np.nan))
    return share_map(shown, name, f"Guides: {name.removesuffix(' =')}")
