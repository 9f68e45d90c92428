"""The contents of the menus Import, Sample and Export of hard data."""

from dataclasses import replace
from functools import partial
from typing import Any

import streamlit as st

from ccwsim import CCWSIMError, Grid, HardData, TrainingImage
from ccwsim.datasets.sampling import sample_grid, sample_random, sample_wells, values_in_cells
from ccwsim.io.hard_data.files import hard_data_as_bytes, names_of_data
from ccwsim.model import MAX_SAMPLED, MAX_SAMPLING_STEP, describe_shape
from ccwsim.sharing.choices import DataChoice, ImageChoice, Upload
from ccwsim.ui.hard_data.edits import Editor, Sampling, fits, moment_of, take_data
from ccwsim.ui.session import NO_FILE_YET, State, file_uploader, grid_part, image_of, wells_of
from ccwsim.ui.study import data_step
from ccwsim.ui.study.asking import keep_button
from ccwsim.ui.study.image_questions import ask_about_image, image_of_file
from ccwsim.ui.study.image_step import problem_of_image
from ccwsim.ui.study.questions import ask_data
from ccwsim.ui.widgets import (
    bound_to,
    button,
    download,
    field,
    options_of,
    page_labels,
    page_text,
    plain,
    problem_in,
)

SAMPLING_LABELS, SAMPLING_LABELS_VOLUME = page_labels("sampling"), page_labels("sampling_volume")
SAMPLED_FIELDS = {False: "the shown realization", True: "an image from a file"}
EXPORTS = {"csv": "CSV: x, y, facies", "geojson": "GeoJSON points", "gslib": "GSLIB points"}


def draw_import(state: State) -> None:
    """Draw the menu to open a file of hard data and to answer questions about the file."""
    use = partial(use_file, state)
    data_step.data_uploader("import_file", lambda file: use(DataChoice("file", upload=file)))
    draft = state.data_draft or state.choices.data
    if draft.source == "file" and draft.upload is not None and draft.tables is None:
        st.caption(plain(f"From your file {draft.upload.name}"))
        data_step.draw_report(state, draft, use, "import_drop")


def draw_tables(state: State) -> None:
    """Draw the menu to open wells in tables, as exported by drill-hole databases."""
    draft, use = state.data_draft or state.choices.data, partial(use_file, state)
    data_step.draw_table_uploaders("table", draft, use)
    if draft.source != "file" or draft.tables is None or draft.waits:
        st.caption("Collars and intervals are required. Depths are measured along the well.")
        keep_button(state, "data_draft", "tables_drop")
    else:
        data_step.draw_report(state, draft, use, "import_drop")


def draw_problem(state: State, problem: str) -> None:
    """State why the study's hard data cannot be used, and ask the questions of the file reader."""

    def use(choice: DataChoice, grid: Grid | None = None) -> None:
        state.change(data=choice, grid=grid or state.grid)

    st.error(plain(problem))
    ask_data(state.choices, use)
    no_data = DataChoice("placed", placed=HardData())
    button("Start without data", key="start_empty", on_click=use, args=(no_data,))


def draw_export(state: State, data: HardData) -> None:
    """Draw file formats in which the hard data can be saved."""
    grid, image = state.grid, state.image
    name = f"{grid_part(image, grid)}_hard_data"
    names = names_of_data(data, image, wells_of(state.choices))
    for kind, label in EXPORTS.items():
        label = label.replace("y,", "y, z,") if grid.is_volume else label
        content = partial(hard_data_as_bytes, data, kind, grid, names)
        download(label, content, f"{name}.{kind}", key=f"export_{kind}", width="stretch")


def use_file(state: State, choice: DataChoice, grid: Grid | None = None) -> None:
    """Use the data in a file if the file can be read; otherwise keep the choice as a draft."""
    before = moment_of(state)
    data_step.use_data(state, choice, grid)
    if state.choices.data is choice:
        state.page(Editor).history.remember(before)
        state.reference = None


def draw_sampling(state: State) -> None:
    """Draw the menu to sample data, which replace the data of the study."""
    page_state, volume = state.page(Editor), state.grid.is_volume

    def read_from(a_file: bool) -> None:
        page_state.reference_choice = ImageChoice() if a_file else None

    st.caption(page_text("Sampling"))
    choice = page_state.reference_choice
    field(
        st.selectbox,
        "Read from",
        key="sample_from",
        value=choice is not None,
        write=read_from,
        **options_of(SAMPLED_FIELDS),
    )
    if choice is not None:
        _ask_reference(page_state, choice, volume)
    _ask_way(page_state, volume)
    button("Take these data", key="sample_take", on_click=sample, args=(state,))


def sample(state: State) -> None:
    """Sample data as set in the menu, put them into the study, and keep the reference field."""
    page_state = state.page(Editor)

    def take() -> None:
        reference = reference_of(state)
        data = sampled(reference, page_state.sampling).of_image(state.image)
        data.check(state.grid, state.image)
        field = None if reference.values else reference  # classes of its own
        take_data(state, data, field)
        state.reference = field

    page_state.message = problem_in(take)


def sampled(reference: TrainingImage, sampling: Sampling) -> HardData:
    """Return data sampled from a field in the cells that `sampling` selects."""
    codes, n, seed = reference.array, sampling.n, sampling.seed
    if sampling.way == "random":
        data = sample_random(codes, n, seed)
    elif sampling.way == "grid":
        data = sample_grid(codes, sampling.every)
    else:
        data = sample_wells(codes, n, seed, direction=sampling.way, every=sampling.every)
    return values_in_cells(data, reference.values)


def reference_of(state: State) -> TrainingImage:
    """Return the field to sample; raise an error if no field has the shape of the grid."""
    grid, choice, ensemble = state.grid, state.page(Editor).reference_choice, state.ensemble
    if choice is None:
        if ensemble is None or not fits(ensemble, state.choices):
            raise CCWSIMError("there is no realization to sample yet; run the study first")
        name, image = "a realization", ensemble.training_image
        if ensemble.values:
            return TrainingImage.from_array(
                ensemble.values_of()[state.shown],
                name=name,
                continuous=True,
                variable=image.variable,
                units=image.units,
            )
        return TrainingImage(ensemble.realizations[state.shown], name=name)
    if choice.upload is None:
        raise CCWSIMError(f"there is no image to sample {NO_FILE_YET}")
    reference = image_of(choice)
    if reference.shape != grid.shape:
        size, wanted = describe_shape(reference.shape), describe_shape(grid.shape)
        raise CCWSIMError(
            f"{choice.upload.name} has {size} cells, but the grid has {wanted}; change the grid "
            "in step 3 of Simulate"
        )
    return reference


def _ask_reference(page_state: Editor, choice: ImageChoice, volume: bool) -> None:
    change = partial(setattr, page_state, "reference_choice")

    def take(upload: Upload) -> None:
        change(ImageChoice())  # if the file cannot be read, the earlier field is kept
        change(image_of_file(upload, volume=volume))

    tip = "An image with the grid's number of cells, in any format that a training image can have."
    file_uploader(
        "Reference image",
        key="reference_file",
        take=take,
        removed=partial(change, ImageChoice()),
        help=tip,
    )
    if choice.upload is not None:
        problem = problem_of_image(choice)
        if problem:
            st.error(plain(problem))
        ask_about_image(choice, change, volume=volume)


def _ask_way(page_state: Editor, volume: bool) -> None:
    labels = SAMPLING_LABELS_VOLUME if volume else SAMPLING_LABELS
    if page_state.sampling.way not in labels or (volume and page_state.sampling == Sampling()):
        page_state.sampling = Sampling("vertical", n=10, every=1) if volume else Sampling()
    sampling = page_state.sampling

    def change(**changes: Any) -> None:
        page_state.sampling = replace(page_state.sampling, **changes)

    way = bound_to(sampling, "way", change)
    field(st.selectbox, "Where", key="sample_way", **way, **options_of(labels))
    if sampling.way != "grid":
        label = "How many data" if sampling.way == "random" else "How many wells"
        number = bound_to(sampling, "n", change, min_value=1, max_value=MAX_SAMPLED)
        field(st.number_input, label, key="sample_n", **number)
    if sampling.way != "random":
        number = bound_to(sampling, "every", change, min_value=1, max_value=MAX_SAMPLING_STEP)
        field(st.number_input, "Distance between data, in cells", key="sample_every", **number)
    if sampling.way != "grid":
        seed = bound_to(sampling, "seed", change, min_value=0)
        field(st.number_input, "Their own seed", key="sample_seed", **seed)
