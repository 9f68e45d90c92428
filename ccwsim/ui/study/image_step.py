"""Step 1: the training image, bundled or from a file, turned and named as it should be."""

from __future__ import annotations

from dataclasses import replace

import streamlit as st

from ccwsim import datasets
from ccwsim.figures import map_png
from ccwsim.metrics import Diagnosis, diagnose
from ccwsim.model.choices import Choices, ImageChoice, Upload
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.results.facies import colours_of, pretty
from ccwsim.ui.session.fitting import fitted, fitted_to_image
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.diagnosis_panel import draw_advice
from ccwsim.ui.study.questions import ask_image
from ccwsim.ui.widgets.fields import button, field, file_uploader
from ccwsim.ui.widgets.literal import plain
from ccwsim.ui.widgets.steps import step_note, step_title

THUMB = 76
MAX_FACIES = 12
TYPES = ["dat", "sgems", "gslib", "out", "txt", "csv", "asc", "npy", "npz", "mat", "png", "jpg",
         "jpeg", "gif", "tif", "tiff", "bmp"]  # fmt: skip


def image_step(state: State) -> None:
    """Draw the step: a thumbnail, what it is, and a way to change it."""
    step_title(1, "Training image")
    image = image_of(state.choices.image)
    with st.container(horizontal=True, gap="small", key="image_row"):
        st.image(thumbnail(image, colours_of(state)), width=THUMB, alt=f"{image.name}, small")
        with st.container(gap="small"):
            ny, nx = image.shape
            step_note(f"{pretty(image.name)}\n{nx} × {ny}, {image.n_facies} facies")
            with st.popover("Change", key="image_menu"):
                _menu(state)
    if state.image_draft is not None:
        problem = problem_of_image(state.image_draft)
        st.error(plain(f"{problem or 'Not taken yet'}. The study keeps the image that it has."))


def problem_of_image(choice: ImageChoice) -> str:
    """Return why a training image cannot be read, or an empty text."""
    try:
        image_of(choice)
    except CCWSIMError as error:
        return str(error)
    return ""


def thumbnail(image: TrainingImage, colours: list[str], pixels: int = 2 * THUMB) -> bytes:
    """Return a training image as a small picture with whole pixels a cell where it can."""
    scale = max(1, pixels // max(image.shape))
    return map_png(image.indices, colours, scale=scale)


def use_image(state: State, choice: ImageChoice) -> None:
    """Take a choice that can be read; keep one that cannot as a draft, and the study as it is."""
    if problem_of_image(choice):
        state.image_draft = choice
        return
    state.image_draft = None
    state.choices = fitted_to_image(replace(state.choices, image=choice), image_of(choice))


def _menu(state: State) -> None:
    current = state.image_draft or state.choices.image
    names = datasets.names()
    field(
        st.selectbox, "Bundled with the program", key="image_bundled",
        value=None if current.upload else current.bundled, options=names, format_func=pretty,
        write=lambda name: use_image(state, ImageChoice(bundled=name)),
        placeholder="choose one",
    )  # fmt: skip
    if not current.upload:
        st.caption(datasets.describe(current.bundled))
    file_uploader(
        "or a file of yours", type=TYPES, key="image_file", on_change=_uploaded,
        args=(state,),
        help="SGeMS, GSLIB, MPSLIB, ESRI ASCII, NumPy, MATLAB v5 or a picture",
    )  # fmt: skip
    if current.upload:
        st.caption(plain(f"From your file {current.upload.name}"))
        _answers(state, current)
    _turns(state)
    _facies(state)
    _advice(state)


def _advice(state: State) -> None:
    """Say, where it is asked for and after an import, which parameters suit the image."""
    if not st.toggle("Which parameters suit it?", key="image_advice"):
        return
    image = image_of(state.choices.image)
    try:
        found = _diagnosed((image.digest, image.facies_names), image)
    except CCWSIMError as error:  # too small to judge, which is no fault of the study
        st.caption(plain(f"No advice: {error}."))
        return
    draw_advice(found, image, state.choices.parameters, lambda chosen: use_advice(state, chosen))


@st.cache_data(max_entries=16, show_spinner="Looking at the training image …")
def _diagnosed(key: tuple, _image: TrainingImage) -> Diagnosis:
    """Return the diagnosis; it calls facies by names, which another user's may not share."""
    return diagnose(_image)


def use_advice(state: State, advised: dict[str, int]) -> None:
    """Take advised parameters into the study."""
    shape = image_of(state.choices.image).shape
    state.change(parameters=fitted(state.choices.parameters, shape, **advised))


def _uploaded(state: State) -> None:
    file = st.session_state["image_file"]
    if file is not None:
        use_image(state, ImageChoice(upload=Upload(file.name, file.getvalue())))
        st.session_state["image_advice"] = True


def _answers(state: State, current: ImageChoice) -> None:
    assert current.upload is not None
    problem = problem_of_image(current)
    if problem:
        st.error(plain(problem))
    ask_image(
        current.upload, current.answers,
        lambda answers: use_image(state, replace(current, answers=answers)),
    )  # fmt: skip
    if problem:
        button("Keep the image as it was", on_click=_drop_draft, args=(state,))


def _drop_draft(state: State) -> None:
    state.image_draft = None


def _turns(state: State) -> None:
    choice = state.choices.image
    image = image_of(choice)
    st.image(
        thumbnail(image, colours_of(state), 320), width="stretch",
        alt=f"Preview of {image.name}, north at the top",
    )  # fmt: skip
    with st.container(horizontal=True, gap="small"):
        for name, label in (
            ("flip_ew", "Flip E–W"), ("flip_ns", "Flip N–S"), ("transpose", "Transpose"),
        ):  # fmt: skip
            field(
                st.checkbox, label, key=f"image_{name}", value=getattr(choice, name),
                write=lambda on, name=name: use_image(
                    state, replace(state.choices.image, **{name: on})
                ),
            )  # fmt: skip


def _facies(state: State) -> None:
    image, colours = image_of(state.choices.image), colours_of(state)
    for k, code in enumerate(image.codes[:MAX_FACIES].tolist()):
        with st.container(horizontal=True, vertical_alignment="center", gap="small"):
            field(
                st.color_picker, f"Colour of code {code}", key=f"image_colour_{code}",
                value=colours[k], label_visibility="collapsed",
                write=lambda new, code=code: _recolour(state, code, new),
            )  # fmt: skip
            field(
                st.text_input, f"Name of code {code}", key=f"image_name_{code}",
                value=image.facies_names[k], label_visibility="collapsed", max_chars=40,
                write=lambda new, k=k: _rename(state, k, new),
            )  # fmt: skip
            st.html(f'<div class="note">{100 * image.proportions[k]:.1f} %</div>')


def _recolour(state: State, code: int, colour: str) -> None:
    image = state.choices.image
    colours = {**dict(image.colours), code: colour}
    state.change(image=replace(image, colours=tuple(sorted(colours.items()))))


def _rename(state: State, place: int, name: str) -> None:
    choice: ImageChoice = state.choices.image
    names = list(image_of(choice).facies_names)
    names[place] = name.strip() or names[place]
    changed: Choices = replace(state.choices, image=replace(choice, names=tuple(names)))
    state.choices = changed
