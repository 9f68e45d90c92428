"""Guides, between hard data and grid: probabilities, active cells and an auxiliary variable."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import CCWSIMError, Secondary, TrainingImage
from ccwsim.figures import data_map_png, steps_of
from ccwsim.metrics import warn_of_probabilities
from ccwsim.model.bounds import MAX_AUXILIARY_WEIGHT, MAX_SOFT_WEIGHT
from ccwsim.model.grid import Grid
from ccwsim.sharing.choices import Choices, Corners, Directions, Gradient, GuideChoice
from ccwsim.ui.results.maps import middle_layer
from ccwsim.ui.session.cached import cached
from ccwsim.ui.session.resolve import image_of, secondary_of, study_of
from ccwsim.ui.session.state import State
from ccwsim.ui.session.uploads import file_uploader
from ccwsim.ui.widgets.errors import problem_in
from ccwsim.ui.widgets.fields import bound_to, button, field, options_of
from ccwsim.ui.widgets.text import pair, plain, step_note

_warnings = cached(max_entries=64)(warn_of_probabilities)
MAX_CORNERS = 1000  # maximum number of typed corners
PIXELS = 520  # length in pixels of the longer side of the picture of a map
AZIMUTH = {"min_value": -360.0, "max_value": 360.0, "step": 15.0, "format": "%g"}


def guides_step(state: State) -> None:
    """Draw the secondary information of the study in a frame that is closed until it is used."""
    guides = state.guides_draft or state.choices.guides
    change = partial(_change, state)
    with st.expander("Guides", expanded=not guides.is_empty, key="guides"):
        _draw_problem(state)
        if guides.saved is not None:
            step_note(f"From the project: {guides.saved.describe()}")
        else:
            _probabilities(state, guides, change)
            _active(state, guides, change)
            _auxiliary(guides, change)
        if not state.choices.guides.is_empty:
            _draw_maps(state)
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
    label: str, given: Any, shape: Any, name: str, change: Callable[..., None], attribute: str
) -> None:
    """Draw the choice between no guide, a shape with default values, and uploaded files."""
    options = {"none": "none", "shape": name}
    files = GuideChoice(**{attribute: given}).files
    if files:
        options["file"] = f"file {' and '.join(file.name for file in files)}"
    kind = "none" if given is None else "file" if files else "shape"

    def write(kind: str) -> None:
        change(**{attribute: shape if kind == "shape" else None})

    key = f"guides_{attribute}"
    field(st.selectbox, label, key=key, value=kind, write=write, **options_of(options))


def _probabilities(state: State, guides: GuideChoice, change: Callable[..., None]) -> None:
    image, given = image_of(state.choices.image), guides.probabilities
    _choice("Probabilities of facies", given, Gradient(), "a gradient", change, "probabilities")
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
    given = guides.active
    shape = octagon(state.choices.grid)
    _choice("Active cells", given, shape, "inside a polygon", change, "active")
    if isinstance(given, tuple):
        text = "\n".join(f"{x:.12g}, {y:.12g}" for x, y in given)
        tip = "One corner a line: x, y in world coordinates."
        corners = {"value": text, "write": lambda new: change(active=corners_of(new)), "help": tip}
        field(st.text_area, "Corners", key="guides_corners", **corners)
    tip = "A grid with 0 or no value in inactive cells, or polygons in GeoJSON."
    take = {"take": lambda upload: change(active=upload), "help": tip}
    file_uploader("or a mask", key="guides_mask_file", **take)


def octagon(grid: Grid) -> Corners:
    """Return the corners of a polygon in the middle of a grid."""
    (sx, sy), (x, y) = grid.cell_size[:2], grid.origin[:2]
    wide, high = grid.nx * sx, grid.ny * sy
    turns = np.arange(8) * np.pi / 4
    xs, ys = x + wide * (0.5 + 0.4 * np.cos(turns)), y + high * (0.5 + 0.4 * np.sin(turns))
    return tuple(zip(xs.round(6).tolist(), ys.round(6).tolist(), strict=True))


def corners_of(text: str) -> Corners:
    """Convert lines of "x, y" to the corners of a polygon."""
    corners = []
    for number, line in enumerate(filter(str.strip, text.splitlines()), 1):
        try:
            x, y = map(float, line.replace(",", " ").replace(";", " ").split())
        except ValueError:
            raise CCWSIMError(
                f"corner {number} of the polygon ({line.strip()[:40]}) is not a pair x, y; write "
                "two numbers a line"
            ) from None
        corners.append((x, y))
    if not 3 <= len(corners) <= MAX_CORNERS:
        raise CCWSIMError(f"{len(corners)} corners: give 3 to {MAX_CORNERS}, or a mask as file")
    return tuple(corners)


def _auxiliary(guides: GuideChoice, change: Callable[..., None]) -> None:
    given = guides.auxiliary
    image, grid = given if isinstance(given, tuple) else (None, None)
    name = "position along a direction"
    _choice("Auxiliary variable", given, Directions(), name, change, "auxiliary")
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


def _draw_maps(state: State) -> None:
    """Draw the maps of the study, and what the training image cannot provide."""
    choices = state.choices
    if problem_in(lambda: study_of(choices)):
        return
    secondary, image = study_of(choices).secondary, image_of(choices.image)
    if secondary is None:  # all weights are 0
        return
    facies = min(choices.guides.facies, image.n_facies - 1)
    picture, caption = _picture(secondary, image, facies)
    st.image(picture, width="stretch", caption=plain(caption), alt=caption)
    notes = _warnings(secondary, image, choices.parameters)
    if n_left := study_of(choices).inactive_data.n:
        notes = [f"{n_left} hard data are in inactive cells and are left out", *notes]
    for note in notes:
        st.caption(plain(f"{note[:1].upper()}{note[1:]}."))


@cached(max_entries=64)
def _picture(secondary: Secondary, image: TrainingImage, facies: int) -> tuple[bytes, str]:
    """Return a picture of the first map of secondary information, and its name."""
    if secondary.probabilities is not None:
        values, name = secondary.probabilities[facies], f"P({image.facies_names[facies]})"
    elif secondary.auxiliary:
        values, name = secondary.auxiliary[0].grid, "Auxiliary variable of the grid"
        values = (values - values.min()) / max(values.max() - values.min(), 1e-300)
    else:
        values, name = np.ones(secondary.active.shape), "Active cells"
    if secondary.active is not None:
        values = np.where(secondary.active, values, np.nan)
    return data_map_png(*steps_of(middle_layer(values)), longest=PIXELS), name
