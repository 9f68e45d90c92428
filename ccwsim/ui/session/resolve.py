"""From what was chosen to what `simulate` takes; cached by content, never by large arrays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from io import BytesIO

import numpy as np
import streamlit as st

from ccwsim import datasets
from ccwsim.datasets.sampling import sample_random
from ccwsim.io import (
    HardDataImport,
    ImportedPoints,
    import_hard_data,
    place_points,
    read_training_image,
    resolve_points,
)
from ccwsim.io.limits import limited, upload_limits
from ccwsim.model.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate
from ccwsim.ui.jobs.job import result_in_turn
from ccwsim.ui.jobs.limits import demand_of

SETTLED = ("on_outside", "on_unknown")
"""Answers that any hard data may need, when the grid or the training image has changed."""


def image_of(choice: ImageChoice) -> TrainingImage:
    """Return the training image of a choice, turned and named as the user wants it.

    Raises
    ------
    CCWSIMError
        Where the file cannot be read, or a question of the reader is open.
    """
    return _image(choice.digest, choice)


@st.cache_resource(max_entries=32, show_spinner=False)
def _image(digest: str, _choice: ImageChoice) -> TrainingImage:
    read = _read_image(_choice)
    array = read.array
    if _choice.transpose:
        array = array.T
    if _choice.flip_ew:
        array = array[:, ::-1]
    if _choice.flip_ns:
        array = array[::-1]
    names = _choice.names if len(_choice.names) == read.n_facies else read.facies_names
    return TrainingImage(array, name=read.name, facies_names=names)


def _read_image(choice: ImageChoice) -> TrainingImage:
    if choice.upload is None:
        return datasets.load(choice.bundled)
    with opened(choice.upload) as file:
        return read_training_image(file, **dict(choice.answers))


@contextmanager
def opened(upload: Upload) -> Iterator[BytesIO]:
    """Yield an upload as a file object that carries its name, and read under its limits."""
    file = BytesIO(upload.content)
    file.name = upload.name
    with limited(upload_limits()):
        yield file


def data_of(choices: Choices) -> HardData:
    """Return the hard data of a study on its grid.

    Raises
    ------
    CCWSIMError
        Where the file cannot be read, or data do not fit the grid or the training image.
    """
    return imported_data(choices).hard_data


def imported_data(choices: Choices) -> HardDataImport:
    """Return the hard data of a study with a report of what happened on the way.

    Raises
    ------
    CCWSIMError
        As `data_of`.
    """
    choice, image, grid = choices.data, image_of(choices.image), choices.grid
    if choice.source == "file" and choice.upload is not None:
        key = (choice.upload.digest, choice.answers, repr(grid), image.digest)
        return _of_file(key, choice.upload, choice, grid, image)
    if choice.source == "bundled":
        data = datasets.load_hard_data(choice.bundled)
    elif choice.source == "sampled":
        data = sampled_data(image, grid, choices.parameters, choice)
    else:
        data = choice.placed if choice.source == "placed" and choice.placed else HardData()
    return _settled(data, choice, grid, image)


@st.cache_resource(max_entries=32, show_spinner=False)
def _of_file(
    key: tuple, _upload: Upload, _choice: DataChoice, _grid: Grid, _image: TrainingImage
) -> HardDataImport:
    with opened(_upload) as file:
        return import_hard_data(file, _grid, _image, **dict(_choice.answers))


def _settled(
    data: HardData, choice: DataChoice, grid: Grid, image: TrainingImage
) -> HardDataImport:
    points = ImportedPoints(
        places=data.cells.astype(float), values=data.facies.astype(float),
        lines=np.arange(1, data.n + 1), world=False, counted="datum",
        name="hard data", variable="facies",
    )  # fmt: skip
    answers = {name: how for name, how in choice.answers if name in SETTLED}
    return resolve_points(place_points(points, grid, image, classes="codes"), **answers)


def sampled_data(
    image: TrainingImage, grid: Grid, parameters: Parameters, choice: DataChoice
) -> HardData:
    """Return data read off a fresh unconditional realization, as section 5.2 of the paper does."""
    key = (image.digest, grid.shape, parameters.digest, choice.n_sampled, choice.seed_sampled)
    return _sampled(key, image, grid, parameters)


@st.cache_resource(max_entries=32, show_spinner="Drawing a reference to sample …")
def _sampled(key: tuple, _image: TrainingImage, _grid: Grid, _parameters: Parameters) -> HardData:
    n, seed = key[-2:]
    demand = demand_of(Study(_image, _grid, _parameters), 1)
    reference = result_in_turn(partial(simulate, _image, _grid, _parameters, seed=seed), demand)
    return sample_random(reference.realizations[0], n, seed)
