"""Step 1: the training image, bundled or from a file, turned and named as it should be."""

from __future__ import annotations

from dataclasses import replace

import streamlit as st

from ccwsim import datasets
from ccwsim.figures import map_png
from ccwsim.metrics import Diagnosis, diagnose
from ccwsim.model.choices import DataChoice, ImageChoice, Upload
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.jobs.uploads import file_uploader
from ccwsim.ui.results.maps import colours_of, pretty
from ccwsim.ui.session.resolve import fitted, image_of, refitted
from ccwsim.ui.session.state import State
from ccwsim.ui.study.diagnosis_panel import draw_advice
from ccwsim.ui.study.questions import ask_image
from ccwsim.ui.widgets.fields import bound_to, button, field, options_of
from ccwsim.ui.widgets.text import plain, step_note, step_title

THUMB = 76
MAX_FACIES = 12
PICTURES = ["png", "jpg", "jpeg", "gif", "tif", "tiff", "bmp"]
TYPES = ["dat", "sgems", "gslib", "out", "txt", "csv", "asc", "npy", "npz", "mat", *PICTURES]
FORMATS = "SGeMS, GSLIB, MPSLIB, ESRI ASCII, NumPy, MATLAB v5 or a picture"
TURNS = {"flip_ew": "Flip E–W", "flip_ns": "Flip N–S", "transpose": "Transpose"}


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
    shape = image_of(choice).shape
    parameters, state.moved = refitted(state.choices.parameters, shape, state.moved)
    before = state.choices
    state.change(image=choice, parameters=parameters)
    if (choice.bundled, choice.upload) != (before.image.bundled, before.image.upload):
        _part_from_data(state, before.data)


def _part_from_data(state: State, data: DataChoice) -> None:
    """Take out hard data of the image before; whether the user's own are kept is asked."""
    image = state.choices.image
    if data.source in ("file", "placed"):
        state.data_draft = data
        state.change(data=DataChoice())
    elif data.source == "bundled":
        own = datasets.hard_data_training_image(data.bundled)
        if image.upload is not None or image.bundled != own:
            state.change(data=DataChoice())
            st.toast(f"{pretty(data.bundled)} left with their training image, {pretty(own)}.")


def _menu(state: State) -> None:
    current = state.image_draft or state.choices.image

    def use_bundled(name: str) -> None:
        use_image(state, ImageChoice(bundled=name))

    def use_upload(upload: Upload | None) -> None:
        if upload is not None:
            use_image(state, ImageChoice(upload=upload))
            st.session_state["image_advice"] = True

    chosen = {"value": None if current.upload else current.bundled, "write": use_bundled}
    bundled = options_of({name: pretty(name) for name in datasets.names()})
    bundled |= {"placeholder": "choose one"}
    field(st.selectbox, "Bundled with the program", key="image_bundled", **chosen, **bundled)
    if not current.upload:
        st.caption(datasets.describe(current.bundled))
    label = "or a file of yours"
    file_uploader(label, key="image_file", take=use_upload, type=TYPES, help=FORMATS)
    if current.upload:
        st.caption(plain(f"From your file {current.upload.name}"))
        _questions(state, current, current.upload)
    if state.image_draft is None:  # the rest is of the image that the study has
        _turns(state)
        _facies(state)
        _advice(state)


def _questions(state: State, current: ImageChoice, upload: Upload) -> None:
    problem = problem_of_image(current)
    if problem:
        st.error(plain(problem))
    ask_image(upload, current.answers, lambda a: use_image(state, replace(current, answers=a)))
    if problem:
        drop = (state, "image_draft", None)
        button("Keep the image as it was", on_click=setattr, args=drop)


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


def _turns(state: State) -> None:
    choice = state.choices.image
    image = image_of(choice)
    preview = thumbnail(image, colours_of(state), 320)
    st.image(preview, width="stretch", alt=f"Preview of {image.name}, north at the top")

    def turn(**turned: bool) -> None:
        use_image(state, replace(state.choices.image, **turned))

    with st.container(horizontal=True, gap="small"):
        for name, label in TURNS.items():
            field(st.checkbox, label, key=f"image_{name}", **bound_to(choice, name, turn))


def _facies(state: State) -> None:
    image, colours = image_of(state.choices.image), colours_of(state)
    hidden = {"label_visibility": "collapsed"}
    for k, code in enumerate(image.codes[:MAX_FACIES].tolist()):

        def recolour(colour: str, code: int = code) -> None:
            choice = state.choices.image
            changed = {**dict(choice.colours), code: colour}
            state.change(image=replace(choice, colours=tuple(sorted(changed.items()))))

        def rename(name: str, k: int = k) -> None:
            choice = state.choices.image
            names = list(image_of(choice).facies_names)
            names[k] = name.strip() or names[k]
            state.change(image=replace(choice, names=tuple(names)))

        with st.container(horizontal=True, vertical_alignment="center", gap="small"):
            colour = {"value": colours[k], "write": recolour, **hidden}
            name = {"value": image.facies_names[k], "write": rename, "max_chars": 40, **hidden}
            field(st.color_picker, f"Colour of code {code}", key=f"image_colour_{code}", **colour)
            field(st.text_input, f"Name of code {code}", key=f"image_name_{code}", **name)
            st.html(f'<div class="note">{100 * image.proportions[k]:.1f} %</div>')
