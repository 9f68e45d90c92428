"""The state of the editor of hard data: edits, undo and redo, and the realizations shown."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal

import numpy as np

from ccwsim import Ensemble, HardData, TrainingImage, revise
from ccwsim.sharing.choices import CellsOfWells, Choices, DataChoice, ImageChoice
from ccwsim.ui.session import State, data_of, study_of, wells_of
from ccwsim.ui.widgets import if_possible, problem_in

Cell = tuple[int, ...]
Ground = Literal["realization", "e_type", "empty"]
Way = Literal["random", "N-S", "E-W", "vertical", "grid"]
ERASE, AS_SHOWN = -1, -2  # brushes other than facies: erase cells, or place the facies shown
MAX_MOMENTS = 200


@dataclass(frozen=True, eq=False)
class Moment:
    """The hard data at one moment, and the reference field if the data were sampled from one."""

    data: DataChoice
    reference: TrainingImage | None = None


@dataclass
class History:
    """The undo list and the redo list; the last moment of each list is nearest to the present."""

    past: list[Moment] = field(default_factory=list)
    future: list[Moment] = field(default_factory=list)

    def remember(self, now: Moment) -> None:
        """Store the moment before a change in the undo list, and clear the redo list."""
        self.past.append(now)
        self.future.clear()
        del self.past[:-MAX_MOMENTS]


@dataclass(frozen=True)
class Sampling:
    """The way to sample a reference field: at random, along wells, or on a regular grid."""

    way: Way = "random"
    n: int = 100  # number of data or of wells
    every: int = 8  # distance in cells between data along a well or on the grid
    seed: int = 1


@dataclass
class DataTable:
    """The table of hard data: its rows, and notes on the user's edits."""

    world: bool = True  # whether positions are x and y; otherwise row and column
    base: Any = None  # DataFrame of the rows before the widget's edits
    content_key: tuple = ()  # identifies the edited data; different data need a new base
    version: int = 0  # version number of `base`
    notes: list[str] = field(default_factory=list)


@dataclass
class Editor:
    """The state of the page of hard data."""

    ground: Ground = "realization"  # content of the map on which data are drawn
    history: History = field(default_factory=History)
    sampling: Sampling = Sampling()
    reference_choice: ImageChoice | None = None  # image to sample, or None
    table: DataTable = field(default_factory=DataTable)
    taken: int = 0  # number of the last edit that was applied
    local: Ensemble | None = None  # realizations after local re-simulation
    message: str = ""  # error message of the latest edit
    # only for volumes: `brush` is the index of the facies to place, or ERASE or AS_SHOWN; the
    # layers are the first and last layer of a well, or None for all layers
    brush: int = 1
    layers: tuple[int, int] | None = None


def by_cell(data: HardData) -> dict[Cell, float]:
    """Return the facies or value of each datum, by cell."""
    return dict(zip(map(tuple, data.cells.tolist()), data.measured.tolist(), strict=True))


def with_changes(
    data: HardData, changes: Mapping[Cell, float | None], image: TrainingImage
) -> HardData:
    """Return data of an image with `changes`, which map a cell to a facies code or value.

    A cell is mapped to None for removal.
    """
    merged = {**by_cell(data), **changes}
    merged = {cell: code for cell, code in merged.items() if code is not None}
    return HardData.measured_as(image, list(merged), list(merged.values()))


def brush_values(image: TrainingImage) -> list[float]:
    """Return the code that each brush places, or the median of its class of values."""
    return image.class_medians if image.values else image.codes.tolist()


def take(state: State, choice: DataChoice, reference: TrainingImage | None = None) -> None:
    """Replace the hard data of the study, and add the present data to the history."""
    state.page(Editor).history.remember(moment_of(state))
    state.change(data=choice)
    state.data_draft, state.reference = None, reference


def take_data(
    state: State, data: HardData, reference: TrainingImage | None = None, wells: CellsOfWells = ()
) -> None:
    """Put data placed by hand into the study if they differ, with the cells of named wells."""
    if data.digest != data_of(state.choices).digest:
        take(state, DataChoice("placed", placed=data, wells=wells), reference)


def moment_of(state: State) -> Moment:
    """Return the present hard data and reference field for the history."""
    return Moment(state.choices.data, state.reference)


def undo(state: State, again: bool = False) -> None:
    """Go back to the data before the last edit or, if `again`, redo the last undone edit."""
    history = state.page(Editor).history
    back, forth = history.past, history.future
    if again:
        back, forth = forth, back
    if back:
        forth.append(moment_of(state))
        moment = back.pop()
        state.change(data=moment.data)
        state.data_draft, state.reference = None, moment.reference


def take_edits(state: State, edits: Sequence[Mapping[str, Any]]) -> None:
    """Apply new edits in order; `draw_editable` describes their format."""
    page_state = state.page(Editor)
    page_state.message = ""
    for edit in sorted(edits, key=lambda edit: edit["seq"]):
        if edit["seq"] <= page_state.taken:
            continue
        page_state.taken = int(edit["seq"])
        page_state.message = problem_in(partial(_take_edit, state, edit)) or page_state.message


def _take_edit(state: State, edit: Mapping[str, Any]) -> None:
    if edit.get("do") in ("undo", "redo"):
        undo(state, again=edit["do"] == "redo")
    elif state.grid.nz is not None:
        low, high = layers_of_wells(state.page(Editor), state.grid.nz)
        cells = [(int(z), int(y), int(x)) for z, y, x in edit.get("cells", [])]
        paint(state, str(edit.get("axis")), cells, range(low, high + 1))
    else:
        image, data = state.image, data_of(state.choices)
        (ny, nx), codes = state.grid.shape, brush_values(image)
        changes = {
            (int(row), int(column)): codes[facies] if facies >= 0 else None
            for row, column, facies in edit.get("set", [])
            if 0 <= row < ny and 0 <= column < nx and facies < len(codes)
        }
        before = by_cell(data)
        left = [cell for cell, code in changes.items() if code is None and cell in before]
        placed = [cell for cell, code in changes.items() if code is not None]
        if image.values and len(left) == len(placed) == 1:  # a moved datum keeps its value
            changes[placed[0]] = before[left[0]]
        take_data(state, with_changes(data, changes, image), state.reference)


def layers_of_wells(page_state: Editor, nz: int) -> tuple[int, int]:
    """Return the first and last layer of a new well; by default, the well crosses all layers."""
    low, high = page_state.layers or (0, nz - 1)
    return min(low, nz - 1), min(high, nz - 1)


def paint(state: State, axis: str, cells: Sequence[Cell], layers: range) -> None:
    """Edit `cells` in a slice across an `axis`; across z, place a well through the `layers`."""
    page_state, grid = state.page(Editor), state.grid
    page_state.message = ""
    codes = state.image.codes.tolist()
    inside = grid.holds(np.array(cells, np.int64).reshape(-1, 3))
    edited = [cell for cell, is_inside in zip(cells, inside, strict=True) if is_inside]
    if axis == "z" and edited:
        edited = [(layer, *edited[-1][1:]) for layer in layers]
    brush = page_state.brush
    if brush == AS_SHOWN:
        ensemble = answer(state) or state.ensemble
        if ensemble is None or not fits(ensemble, state.choices):
            page_state.message = "there is no realization yet to read from; choose a facies"
            return
        realization = ensemble.realizations[min(state.shown, ensemble.n - 1)]
        changes = {cell: int(realization[cell]) for cell in edited}
    else:
        code = None if brush == ERASE else codes[min(brush, len(codes) - 1)]
        changes = dict.fromkeys(edited, code)
    data = with_changes(data_of(state.choices), changes, state.image)
    take_data(state, data, state.reference, wells_of(state.choices))


def fits(ensemble: Ensemble, choices: Choices) -> bool:
    """Return whether an ensemble belongs to the study if the hard data are ignored."""
    study = if_possible(lambda: study_of(choices))
    return study is not None and set(ensemble.study.differs_from(study)) <= {"hard data"}


def answer(state: State) -> Ensemble | None:
    """Return realizations that honour the present data, or None if a run is needed.

    If the latest run had the present data, return its realizations. If data were only added,
    re-simulate realizations locally; until a run is finished, only this page shows the result. If
    data were removed, a run is needed, because removed data affected surrounding cells.
    """
    study, page_state = if_possible(lambda: study_of(state.choices)), state.page(Editor)
    if study is None:
        return None
    data = study.hard_data
    fitting = [e for e in (state.ensemble, page_state.local) if e and fits(e, state.choices)]
    answered = next((e for e in fitting if e.hard_data.digest == data.digest), None)
    if answered is None:
        extensible = [e for e in fitting if set(e.hard_data.triples) <= set(data.triples)]
        if not extensible:
            return None
        answered = revise(max(extensible, key=lambda ensemble: ensemble.hard_data.n), data)
    page_state.local = None if answered is state.ensemble else answered
    return answered
