"""Sample a known field: the shown realization, or a reference image that stays hidden."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import streamlit as st

from ccwsim.datasets.sampling import sample_grid, sample_random, sample_wells
from ccwsim.model.bounds import MAX_SAMPLED, MAX_SAMPLING_STEP
from ccwsim.model.choices import ImageChoice, Upload
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.hard_data.actions import fits, take_data
from ccwsim.ui.hard_data.state import Editor, Sampling
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.image_step import TYPES, problem_of_image
from ccwsim.ui.study.questions import ask_image
from ccwsim.ui.widgets.fields import button, field, file_uploader
from ccwsim.ui.widgets.literal import plain

WAYS = {
    "random": "cells at random",
    "N-S": "along wells N–S",
    "E-W": "along wells E–W",
    "grid": "on a regular grid",
}


def draw_sampling(state: State) -> None:
    """Draw a menu to sample data; they replace those of the study."""
    with st.popover("Sample", key="sample_menu"):
        st.caption(
            "Reads data off a known field, which is kept hidden as the reference to score "
            "realizations against."
        )
        own = state.page(Editor).reference_choice is not None
        field(
            st.selectbox, "Read from", key="sample_from", value=own, options=[False, True],
            format_func=lambda own: "an image of yours" if own else "the shown realization",
            write=lambda own: _read_from(state, own),
        )  # fmt: skip
        if own:
            _ask_reference(state)
        _ask_way(state)
        button(
            "Take these data",
            key="sample_take",
            on_click=sample,
            args=(state,),
        )


def sample(state: State) -> None:
    """Take data sampled as the menu says, and keep the field that they came from."""
    page_state = state.page(Editor)
    page_state.message = ""
    try:
        truth = truth_of(state)
        data = sampled(truth, page_state.sampling)
        data.check(state.choices.grid, image_of(state.choices.image))
        take_data(state, data, truth)
        state.reference = truth
    except CCWSIMError as error:
        page_state.message = str(error)


def sampled(truth: TrainingImage, how: Sampling) -> HardData:
    """Return the data of a field at the places that are asked for."""
    if how.way == "random":
        return sample_random(truth.array, how.n, how.seed)
    if how.way == "grid":
        return sample_grid(truth.array, how.every)
    return sample_wells(truth.array, how.n, how.seed, direction=how.way, every=how.every)


def truth_of(state: State) -> TrainingImage:
    """Return the field to sample, on the grid of the study.

    Raises
    ------
    CCWSIMError
        Where there is none, or it has another shape than the grid.
    """
    grid, choice, ensemble = state.choices.grid, state.page(Editor).reference_choice, state.ensemble
    if choice is None:
        if ensemble is None or not fits(ensemble, state.choices):
            raise CCWSIMError("there is no realization to sample yet; run the study first")
        return TrainingImage(ensemble.realizations[state.shown], name="a realization")
    if choice.upload is None:
        raise CCWSIMError("there is no image to sample yet; choose a file")
    truth = image_of(choice)
    if truth.shape != grid.shape:
        ny, nx = truth.shape
        raise CCWSIMError(
            f"{choice.upload.name} has {nx} × {ny} cells and the grid {grid.nx} × {grid.ny}; "
            "make the grid the same in step 3 of Simulate"
        )
    return truth


def _read_from(state: State, own: bool) -> None:
    state.page(Editor).reference_choice = ImageChoice() if own else None


def _ask_reference(state: State) -> None:
    choice = state.page(Editor).reference_choice
    file_uploader(
        "Reference image", type=TYPES, key="reference_file", on_change=_uploaded,
        args=(state,),
        help="A field of the size of the grid, in any format of a training image.",
    )  # fmt: skip
    if choice is not None and choice.upload is not None:
        problem = problem_of_image(choice)
        if problem:
            st.error(plain(problem))
        ask_image(choice.upload, choice.answers, lambda answers: _answer(state, answers))


def _uploaded(state: State) -> None:
    file = st.session_state["reference_file"]
    upload = Upload(file.name, file.getvalue()) if file is not None else None
    state.page(Editor).reference_choice = ImageChoice(upload=upload)


def _answer(state: State, answers: tuple) -> None:
    page_state = state.page(Editor)
    choice = page_state.reference_choice or ImageChoice()
    page_state.reference_choice = replace(choice, answers=answers)


def _ask_way(state: State) -> None:
    page_state = state.page(Editor)
    how = page_state.sampling

    def change(**changes: Any) -> None:
        page_state.sampling = replace(page_state.sampling, **changes)

    field(
        st.selectbox, "Where", key="sample_way", value=how.way, options=list(WAYS),
        format_func=WAYS.get, write=lambda way: change(way=way),
    )  # fmt: skip
    if how.way != "grid":
        field(
            st.number_input, "How many data" if how.way == "random" else "How many wells",
            key="sample_n", value=how.n, min_value=1, max_value=MAX_SAMPLED,
            write=lambda n: change(n=int(n)),
        )  # fmt: skip
    if how.way != "random":
        field(
            st.number_input, "A datum every so many cells", key="sample_every", value=how.every,
            min_value=1, max_value=MAX_SAMPLING_STEP, write=lambda every: change(every=int(every)),
        )  # fmt: skip
    if how.way != "grid":
        field(
            st.number_input, "Their own seed", key="sample_seed", value=how.seed, min_value=0,
            write=lambda seed: change(seed=int(seed)),
        )  # fmt: skip
