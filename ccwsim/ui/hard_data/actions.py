"""Edits of the hard data: taken one by one, undone, and answered by the realizations at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ccwsim.engine.revision import revise
from ccwsim.model.choices import Choices, DataChoice
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.hard_data.history import Moment
from ccwsim.ui.hard_data.state import Editor
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.run import problem_of

Cell = tuple[int, int]


def with_changes(data: HardData, changes: Mapping[Cell, int | None]) -> HardData:
    """Return data with cells (row, column) set to a facies code, or freed by None.

    Examples
    --------
    >>> data = with_changes(HardData([[0, 0], [1, 1]], [5, 5]), {(0, 0): None, (2, 2): 7})
    >>> data.cells.tolist(), data.facies.tolist()
    ([[1, 1], [2, 2]], [5, 7])
    """
    there: dict[Cell, int | None] = {
        (row, column): code
        for (row, column), code in zip(data.cells.tolist(), data.facies.tolist(), strict=True)
    }
    known = {cell: code for cell, code in {**there, **changes}.items() if code is not None}
    return HardData(list(known), list(known.values()))


def take(state: State, choice: DataChoice, reference: TrainingImage | None = None) -> None:
    """Make other hard data the study's; the ones before can be got back."""
    state.page(Editor).history.remember(moment_of(state))
    state.change(data=choice)
    state.data_draft, state.reference = None, reference


def take_data(state: State, data: HardData, reference: TrainingImage | None = None) -> None:
    """Make data placed by hand the study's, unless they are the same."""
    if data.digest != data_of(state.choices).digest:
        take(state, DataChoice("placed", placed=data), reference)


def moment_of(state: State) -> Moment:
    """Return what an undo has to bring back."""
    return Moment(state.choices.data, state.ensemble, state.reference, is_revised(state))


def is_revised(state: State) -> bool:
    """Return whether the realizations were mended around edits since they were simulated."""
    return state.ensemble is not None and state.ensemble is state.page(Editor).answered


def undo(state: State) -> None:
    """Go back to the data before the last edit, and to the realizations that answered them."""
    _restore(state, state.page(Editor).history.undo(moment_of(state)))


def redo(state: State) -> None:
    """Take an edit again that was undone."""
    _restore(state, state.page(Editor).history.redo(moment_of(state)))


def _restore(state: State, moment: Moment | None) -> None:
    if moment is None:
        return
    state.change(data=moment.data)
    state.data_draft, state.reference = None, moment.reference
    if moment.ensemble is not None and fits(moment.ensemble, state.choices):
        state.ensemble = moment.ensemble
        state.page(Editor).answered = moment.ensemble if moment.revised else None


def take_edits(state: State, edits: Sequence[Mapping[str, Any]]) -> None:
    """Take the edits of the canvas that were not taken before, in their order.

    Parameters
    ----------
    state : State
    edits : sequence of mapping
        Each has `seq`, a growing number, and either `set`, a list of [row, column, place of the
        facies or −1 to erase], or `do`, "undo" or "redo".
    """
    page_state = state.page(Editor)
    page_state.message = ""
    for edit in sorted(edits, key=lambda edit: edit["seq"]):
        if edit["seq"] <= page_state.taken:
            continue
        page_state.taken = int(edit["seq"])
        try:
            _take_edit(state, edit)
        except CCWSIMError as error:
            page_state.message = str(error)


def _take_edit(state: State, edit: Mapping[str, Any]) -> None:
    if edit.get("do") == "undo":
        undo(state)
    elif edit.get("do") == "redo":
        redo(state)
    else:
        codes = image_of(state.choices.image).codes.tolist()
        ny, nx = state.choices.grid.shape
        changes = {
            (int(row), int(column)): codes[place] if place >= 0 else None
            for row, column, place in edit.get("set", [])
            if 0 <= row < ny and 0 <= column < nx and place < len(codes)
        }
        take_data(state, with_changes(data_of(state.choices), changes), state.reference)


def fits(ensemble: Ensemble, choices: Choices) -> bool:
    """Return whether an ensemble is of the study, its hard data and seed aside."""
    return (
        ensemble.grid == choices.grid
        and ensemble.parameters == choices.parameters
        and ensemble.training_image.digest == image_of(choices.image).digest
    )


def needs_run(state: State) -> bool:
    """Return whether the study has no realizations yet, and could have some."""
    missing = state.ensemble is None or not fits(state.ensemble, state.choices)
    return missing and state.job is None and not state.message and not problem_of(state)


def answer(state: State) -> None:
    """Let the realizations honour the data as they are now, changed only around what they miss."""
    ensemble = state.ensemble
    if ensemble is None or not fits(ensemble, state.choices):
        return
    data = data_of(state.choices)
    if ensemble.hard_data.digest != data.digest:
        state.ensemble = state.page(Editor).answered = revise(ensemble, data)
