"""Step 1: the training image, bundled or from a file."""

from base64 import b64encode
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import CCWSIMError, Grid, TrainingImage, datasets
from ccwsim.figures import contact_sheet, facies_colours, map_png
from ccwsim.model import MAX_GRID_SIDE_OFFERED, Bytes, describe_shape
from ccwsim.sharing.choices import Answers, DataChoice, ImageChoice, Upload
from ccwsim.ui.frontend.component import draw_tiles
from ccwsim.ui.results.maps import colours_of, pretty
from ccwsim.ui.session import (
    State,
    cached,
    file_uploader,
    fitted_grid,
    geometry_of,
    go_to,
    grid_of_image,
    image_of,
    page_link,
    refitted,
)
from ccwsim.ui.study.asking import keep_button
from ccwsim.ui.study.image_questions import asked_of, image_of_file
from ccwsim.ui.study.questions import answered
from ccwsim.ui.widgets import (
    field,
    in_row,
    menu,
    options_of,
    page_text,
    plain,
    problem_in,
    step_note,
    step_title,
)

THUMBNAIL_PIXELS = 76
MIDDLE = 128
"""Side in cells, and in pixels of a sharp screen, of the part of a bundled image in the menu."""
IMAGE_KEPT = "The study keeps its present image."
IMPORT_PAGE = "pages/import.py"


def image_step(state: State) -> None:
    """Draw a thumbnail, the name and size of the image, and a menu to choose another image."""
    step_title(1, "Training image")
    image = state.image
    with in_row("image_row", "top"):
        st.image(
            image_thumbnail(image, colours_of(state)),
            width=THUMBNAIL_PIXELS,
            alt=f"{image.name}, small",
        )
        with st.container(gap="small"):
            size = describe_shape(image.shape)
            what = f"values of {image.variable}" if image.values else f"{image.n_facies} facies"
            step_note(f"{pretty(image.name)}\n{size}, {what}")
            menu("Change", "image_menu", partial(_image_menu, state))
    draft = state.image_draft
    if draft is not None:
        problem = problem_of_image(draft)
        if problem:
            st.error(plain(f"{problem}. {IMAGE_KEPT}"))
        elif draft.upload is not None:
            step_note(f"There are open questions about reading {draft.upload.name}.")
        page_link(IMPORT_PAGE, "Open the page Import")
        keep_button(state, "image_draft", "image_keep")
    if state.visit_import:
        state.visit_import = False
        go_to(IMPORT_PAGE)


@cached()
def _bundled_sheet() -> dict[str, Any]:
    """Return the middles of the bundled images, at equal scale, as the picture of tiles."""
    images = [datasets.load(name) for name in datasets.BUNDLED_IMAGES]
    maps = [_fullest_layer(image) for image in images]
    corners = [[(side - MIDDLE) // 2 for side in layer.shape] for layer in maps]
    parts = [k[y : y + MIDDLE, x : x + MIDDLE] for k, (y, x) in zip(maps, corners, strict=True)]
    colours = facies_colours(max(images, key=lambda image: image.n_facies))
    png, columns = contact_sheet(np.stack(parts), colours, longest=MIDDLE)
    return {
        "png": b64encode(png).decode(),
        "columns": columns,
        "width": MIDDLE // 2,
        "height": MIDDLE // 2,
    }


def _fullest_layer(image: TrainingImage) -> Bytes:
    """Return the layer with the fewest cells of the most frequent facies."""
    if image.n_dimensions == 2:
        return image.indices
    rarer = image.indices != np.argmax(image.proportions)
    return image.indices[np.argmax(rarer.mean(axis=(1, 2)))]


def problem_of_image(choice: ImageChoice) -> str:
    """Return the reason why a training image cannot be read, or an empty text."""
    return problem_in(lambda: image_of(choice))


@cached(max_entries=64)
def image_thumbnail(
    image: TrainingImage, colours: list[str], pixels: int = 2 * THUMBNAIL_PIXELS
) -> bytes:
    """Return a picture of an image, or its fullest layer, with the largest cells that fit."""
    layer = _fullest_layer(image)
    return map_png(layer, colours, scale=max(1, pixels // max(layer.shape)))


def image_uploader(label: str, key: str, take: Callable[[Upload], object]) -> None:
    """Draw an uploader of training images; `take` is called with a chosen file."""
    file_uploader(label, key=key, take=take, help=page_text("Formats of training images"))


def import_image(state: State, upload: Upload) -> bool:
    """Use the image of a file if no question is open; return whether the page Import must ask."""
    try:
        choice = image_of_file(upload)
    except CCWSIMError:  # the error is shown with the draft
        choice = ImageChoice(upload=upload)
    if set(asked_of(choice)) <= {"up", "gaps"}:
        use_image(state, choice)
        return False
    state.image_draft = choice
    return True


def use_image(state: State, choice: ImageChoice) -> None:
    """Use a choice of image in the study if the image can be read; otherwise keep it as a draft."""
    if problem_of_image(choice):
        state.image_draft = choice
        return
    state.image_draft = None
    image = image_of(choice)
    parameters, state.moved = refitted(state.choices.parameters, image, state.moved)
    before = state.choices
    grid = fitted_grid(before.grid, image.shape)
    state.change(image=choice, parameters=parameters, grid=grid)
    fitting = grid_of_image(choice, grid)
    is_new = choice.upload is not None and fitting != grid_of_image(before.image, grid)
    is_new &= max(fitting.shape) <= MAX_GRID_SIDE_OFFERED
    if is_new and (geometry_of(choice) or grid == Grid.of(grid.shape)):  # coordinates are kept
        state.fit_grid(f"The grid follows the image {image.name}.", fitting)
    grid = state.grid
    same_file = (choice.bundled, choice.upload) == (before.image.bundled, before.image.upload)
    numbering = image_of(before.image).numbering
    if not same_file or _of_facies(choice.answers) != _of_facies(before.image.answers):
        state.change(data=before.data.without_facies(), guides=before.guides.without_facies())
        state.data_draft = state.data_draft and state.data_draft.without_facies()
        state.guides_draft = state.guides_draft and state.guides_draft.without_facies()
        has_codes = {numbering, image.numbering} == {"codes"}
        by_number = before.data.source == "placed" and not has_codes
        same_file = same_file and state.choices.data == before.data and not by_number
    if not same_file or grid.n_dimensions != before.grid.n_dimensions:
        _part_from_data(state, state.choices.data, numbering)


def _of_facies(answers: Answers) -> Answers:
    """Return the answers about an image file that decide on its facies."""
    return answered(answers, up=None, z_up=None)


def _part_from_data(state: State, choice: DataChoice, numbering: str) -> None:
    """Remove the hard data of the previous image; ask whether to keep the user's data.

    Numbers that are no codes belong to the previous image.
    """
    image_choice = state.choices.image
    if choice.source in ("file", "placed"):
        numbers = None if {numbering, image_of(image_choice).numbering} == {"codes"} else "other"
        answers = answered(choice.answers, numbering=numbers)
        state.data_draft = replace(choice, answers=answers)
        state.change(data=DataChoice())
    elif choice.source == "bundled":
        data_image = datasets.hard_data_training_image(choice.bundled)
        if image_choice.upload is not None or image_choice.bundled != data_image:
            state.change(data=DataChoice())
            st.toast(
                f"Removed data {pretty(choice.bundled)} with their image {pretty(data_image)}."
            )
    elif choice.source == "sampled" and state.grid.is_volume:
        state.change(data=DataChoice())  # the bundled data are sampled from maps


def _image_menu(state: State) -> None:
    current = state.image_draft or state.choices.image

    def choose(name: str) -> None:
        use_image(state, ImageChoice(bundled=name))

    volumes = datasets.volume_names()
    labels = {
        name: f"{pretty(name)}{' (volume)' if name in volumes else ''}"
        for name in datasets.BUNDLED_IMAGES
    }
    tiles = [{"value": name, "name": text, "title": text} for name, text in labels.items()]
    draw_tiles(
        "image_sheet",
        "Bundled images",
        tiles,
        choose,
        kind="sheet named",
        shown=None if current.upload else list(labels).index(current.bundled),
        arrows="choose",
        **_bundled_sheet(),
    )
    field(
        st.selectbox,
        "Bundled with the program",
        key="image_bundled",
        value=None if current.upload else current.bundled,
        write=choose,
        placeholder="choose one",
        **options_of(labels),
    )
    if not current.upload:
        st.caption(datasets.describe(current.bundled))

    def take(upload: Upload) -> None:
        state.visit_import = import_image(state, upload)

    image_uploader("or a file of yours", "image_file", take)
    if current.upload:
        st.caption(plain(f"From your file {current.upload.name}"))
    preview = image_thumbnail(state.image, colours_of(state), 320)
    name = state.image.name
    subject = "The fullest layer" if state.grid.is_volume else "Preview"
    st.image(preview, width="stretch", alt=f"{subject} of {name}, north at the top")
    page_link(IMPORT_PAGE, "Facies, colours, turns, advice")
