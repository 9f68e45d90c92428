"""The hard data as a table that can be edited, pasted into and cleared."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import streamlit as st
from numpy.typing import ArrayLike
from pandas.io.formats.style import Styler

from ccwsim import Grid, HardData, TrainingImage
from ccwsim.sharing.choices import CellsOfWells
from ccwsim.ui.hard_data.edits import Editor, take_data
from ccwsim.ui.session import State, resolve
from ccwsim.ui.widgets import (
    bound_to,
    catch_callback_errors,
    field,
    in_row,
    options_of,
    panel_title,
    plain,
    problem_in,
)

TABLE_HEIGHT = 497  # height of the table in pixels, for the heading and exactly fourteen rows
MAX_NOTES = 4  # maximum number of notes below the table
MAX_COLOURED = 500
"""Maximum number of rows with facies colours; Streamlit takes 0.2 ms to colour a row."""
COLOUR = " "  # heading and name of the column that shows the colours of facies
WELL = "well"  # name of the column of well names, if data have any


def draw_data_table(
    state: State, data: HardData, image: TrainingImage, colours: Sequence[str]
) -> None:
    """Draw the table; the user's edits change the hard data of the study."""
    table, grid = state.page(Editor).table, state.grid
    with in_row("table_row"):
        panel_title(f"{data.n} data" if data.n != 1 else "1 datum")
        field(
            st.segmented_control,
            "Positions as",
            key="table_world",
            label_visibility="collapsed",
            **bound_to(table, "world"),
            **options_of({True: "x, y", False: "row, col"}),
        )
    if table.content_key != _content_key(state, data.digest, image):
        wells = resolve.wells_of(state.choices)
        table.base = rows_of(data, grid, table.world, wells, name_of(image))
        table.notes = []
        table.content_key = _content_key(state, data.digest, image)
        table.version += 1
    key = f"table_{table.version}"
    tip = ", ".join(f"{code} {name}" for code, name in image.names_by_code.items())
    columns = {name: st.column_config.NumberColumn(width=68) for name in table.base.columns}
    name = name_of(image)
    columns[name] = st.column_config.NumberColumn(width=68, help=None if image.values else tip)
    columns[WELL] = st.column_config.TextColumn(width=68, disabled=True)
    columns[COLOUR] = st.column_config.TextColumn(width=24, disabled=True)
    rows = table.base
    if len(rows) <= MAX_COLOURED:
        edits = st.session_state.get(key, {})
        rows = painted(rows, edits, image, colours)
    st.data_editor(
        rows,
        key=key,
        num_rows="dynamic",
        height=TABLE_HEIGHT,
        width="stretch",
        hide_index=True,
        on_change=catch_callback_errors(_edited),
        args=(state, key, image),
        column_config=columns,
    )
    for note in table.notes:
        st.caption(plain(note))


def _content_key(state: State, digest: str, image: TrainingImage) -> tuple:
    return digest, state.grid, state.page(Editor).table.world, image.digest


def _edited(state: State, key: str, image: TrainingImage) -> None:
    page_state = state.page(Editor)
    table = page_state.table
    frame = edited_rows(table.base, st.session_state[key])
    data, table.notes = data_of_rows(frame, state.grid, image, table.world)
    if problem := problem_in(lambda: take_data(state, data, state.reference)):
        page_state.message = problem
        return
    table.content_key = _content_key(state, data.digest, image)


def rows_of(
    data: HardData, grid: Grid, world: bool, wells: CellsOfWells = (), name: str = "facies"
) -> pd.DataFrame:
    """Return a table of positions (x, y of cell centres, or row, col), facies or values, and wells.

    `name` is that of the column of facies or values.
    """
    labels, places = ("row", "col"), data.cells
    if world:
        labels, places = ("x", "y"), grid.centers_of(data.cells)
    frame = pd.DataFrame({name: places[:, k] for k, name in enumerate(labels)})
    frame[name] = data.measured
    names = {cell: name for name, cells in wells for cell in cells}
    if names:
        frame[WELL] = [names.get(tuple(cell), "") for cell in data.cells.tolist()]
    return frame


def name_of(image: TrainingImage) -> str:
    """Return the name of the column of facies or, for a continuous variable, of values."""
    return image.variable or "facies"


def painted(
    base: pd.DataFrame, edits: Mapping[str, Any], image: TrainingImage, colours: Sequence[str]
) -> Styler:
    """Return a table with a column that shows the colour of each row's facies after the edits.

    `st.data_editor` keeps its edits when colours change, because colours are not content. A row
    that is being added has no colour yet.
    """
    now = edited_rows(base, {"edited_rows": edits.get("edited_rows", {})})[name_of(image)]
    places = dict(zip(image.codes.tolist(), colours, strict=True))
    classes = image.class_indices(now.to_numpy()) if image.values else now
    css = [f"background-color: {places[k]}" if k in places else "" for k in classes]
    return base.assign(**{COLOUR: ""}).style.apply(lambda _: css, subset=[COLOUR])


def edited_rows(base: pd.DataFrame, edits: Mapping[str, Any]) -> pd.DataFrame:
    """Return positions and facies of a table with the edits of `st.data_editor` applied."""
    frame = base.drop(columns=WELL, errors="ignore").astype(float)
    for row, changes in edits.get("edited_rows", {}).items():
        for name, value in changes.items():
            frame.loc[int(row), name] = np.nan if value is None else float(value)
    frame = frame.drop(index=list(edits.get("deleted_rows", [])))
    added = [{n: row.get(n) for n in frame.columns} for row in edits.get("added_rows", [])]
    if added:
        new_rows = pd.DataFrame(added, columns=frame.columns).astype(float)
        frame = new_rows if frame.empty else pd.concat([frame, new_rows], ignore_index=True)
    return frame.reset_index(drop=True)


def data_of_rows(
    frame: pd.DataFrame, grid: Grid, image: TrainingImage, world: bool
) -> tuple[HardData, list[str]]:
    """Return the hard data in valid rows, and notes on invalid rows."""
    values = frame.to_numpy(float)
    whole = np.isfinite(values).all(axis=1)
    notes = _noted(~whole, "is not complete yet", "are not complete yet")
    cells = np.full((len(values), 2), -1, np.int64)
    near = whole & (np.abs(values) < 2.0**40).all(axis=1)
    positions = values[near, :2]
    x, y = positions.T
    cells[near] = grid.cells_of(x, y) if world else np.floor(positions).astype(np.int64)
    inside = grid.holds(cells) if len(cells) else whole
    singular, plural = "is outside the grid and is ignored", "are outside the grid and are ignored"
    notes += _noted(whole & ~inside, singular, plural)
    in_image = np.isin(values[:, 2], image.codes) | bool(image.values)
    codes = ", ".join(map(str, image.codes))
    tail = f"no facies of the training image ({codes}) and"
    notes += _noted(
        whole & inside & ~in_image, f"has {tail} is left out", f"have {tail} are left out"
    )
    taken: dict[tuple[int, int], int] = {}
    for k in np.flatnonzero(whole & inside & in_image).tolist():
        cell = (int(cells[k, 0]), int(cells[k, 1]))
        if cell in taken and values[taken[cell], 2] != values[k, 2]:
            notes.append(f"Rows {k + 1} and {taken[cell] + 1} share a cell; row {k + 1} is used.")
        taken[cell] = k
    measured = values[list(taken.values()), 2]
    if len(notes) > MAX_NOTES:
        notes[MAX_NOTES:] = [f"Notes not listed: {len(notes) - MAX_NOTES}."]
    return HardData.measured_as(image, list(taken), measured), notes


def _noted(mask: ArrayLike, singular: str, plural: str) -> list[str]:
    rows = (np.flatnonzero(mask) + 1).tolist()
    if not rows:
        return []
    if len(rows) == 1:
        return [f"Row {rows[0]} {singular}."]
    listed = ", ".join(map(str, rows[:6])) + (" …" if len(rows) > 6 else "")
    return [f"Rows {listed} {plural}."]
