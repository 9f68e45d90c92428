"""Bring hard data in from a file, and take them home."""

from __future__ import annotations

from dataclasses import replace

import streamlit as st

from ccwsim.io.hard_data.files import hard_data_as_bytes
from ccwsim.model.choices import DataChoice, Upload
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.hard_data import HardData
from ccwsim.ui.hard_data.actions import moment_of
from ccwsim.ui.hard_data.state import Editor
from ccwsim.ui.session.resolve import imported_data
from ccwsim.ui.session.state import State
from ccwsim.ui.study.data_questions import ask_data
from ccwsim.ui.study.data_step import TYPES, problem_of_data, use_data
from ccwsim.ui.widgets.fields import button, file_uploader
from ccwsim.ui.widgets.literal import plain


def draw_import(state: State) -> None:
    """Draw a menu to open a file of hard data, with its questions."""
    with st.popover("Import", key="import_menu"):
        file_uploader(
            "Points or a grid with gaps", type=TYPES, key="import_file",
            on_change=_uploaded,
            args=(state,), help="CSV with x, y, facies or row, col, facies; GSLIB, SGeMS; NumPy; "
            "MATLAB v5",
        )  # fmt: skip
        draft = state.data_draft or state.choices.data
        if draft.source == "file" and draft.upload is not None:
            _report(state, draft)


def draw_problem(state: State, problem: str) -> None:
    """Say why the hard data of the study cannot be used, and ask what is to be done."""
    st.error(plain(problem))
    ask_data(
        state.choices.data,
        lambda answers: state.change(data=replace(state.choices.data, answers=answers)),
    )
    button(
        "Start without data", key="start_empty",
        on_click=lambda: state.change(data=DataChoice("placed", placed=HardData())),
    )  # fmt: skip


def draw_export(state: State, data: HardData) -> None:
    """Draw a menu of files of the hard data."""
    with st.popover("Export", key="export_menu", disabled=not data.n):
        for label, ending, mime in (
            ("CSV: x, y, facies", "csv", "text/csv"), ("GSLIB points", "gslib", "text/plain"),
        ):  # fmt: skip
            st.download_button(
                label, lambda kind=ending: hard_data_as_bytes(data, kind, state.choices.grid),
                file_name=f"hard_data.{ending}", mime=mime, key=f"export_{ending}",
                on_click="ignore", width="stretch",
            )  # fmt: skip


def use_file(state: State, choice: DataChoice) -> None:
    """Take the data of a file if they can be read; keep the choice as a draft where not."""
    before = moment_of(state)
    use_data(state, choice)
    if state.choices.data is choice:
        state.page(Editor).history.remember(before)
        state.reference = None


def _uploaded(state: State) -> None:
    file = st.session_state["import_file"]
    if file is not None:
        use_file(state, DataChoice("file", upload=Upload(file.name, file.getvalue())))


def _report(state: State, draft: DataChoice) -> None:
    assert draft.upload is not None
    st.caption(plain(f"From your file {draft.upload.name}"))
    choices = replace(state.choices, data=draft)
    problem = problem_of_data(choices)
    if problem:
        st.error(plain(f"{problem}. The study keeps the data that it has."))
    else:
        for note in _notes(state, draft):
            st.caption(plain(note))
    ask_data(draft, lambda answers: use_file(state, replace(draft, answers=answers)))
    if state.data_draft is not None:
        button(
            "Keep the data as they are",
            key="import_drop",
            on_click=_drop,
            args=(state,),
        )


def _notes(state: State, draft: DataChoice) -> tuple[str, ...]:
    try:
        return imported_data(replace(state.choices, data=draft)).notes
    except CCWSIMError as error:
        return (str(error),)


def _drop(state: State) -> None:
    state.data_draft = None
