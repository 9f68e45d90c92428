"""Hard data of a volume by hand: wells in the map, cells in the sections, tables of wells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import streamlit as st
from numpy.typing import NDArray

from ccwsim.model.arrays import digest
from ccwsim.model.choices import CellsOfWells, DataChoice
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.ui.frontend.cell_map import CellMap, facies_map, points_of
from ccwsim.ui.frontend.volume import draw_volume
from ccwsim.ui.hard_data.edits import (
    AS_SHOWN,
    ERASE,
    Editor,
    answer,
    fits,
    layers_of_wells,
    redo,
    take,
    take_edits,
    undo,
)
from ccwsim.ui.hard_data.menus import (
    draw_export,
    draw_import,
    draw_problem,
    draw_sampling,
    draw_tables,
)
from ccwsim.ui.results.maps import VOLUMES, colours_of, draw_e_type, uncertainty_map
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.resolve import data_of, image_of, wells_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.data_step import problem_of_data
from ccwsim.ui.study.news import draw_news
from ccwsim.ui.study.run import start_run_if_needed
from ccwsim.ui.widgets.facts import draw_facts
from ccwsim.ui.widgets.fields import bound_to, button, field, options_of
from ccwsim.ui.widgets.text import panel_title, plain, step_note
from ccwsim.ui.widgets.theme import chart_theme

STYLE = Path(__file__).with_name("editor.css")
REST = 0.6
"""Seconds without another edit before the run that answers all of them begins."""
GROUNDS = {"realization": "realization", "e_type": "E-type", "empty": "empty grid"}
HOW_TO = (
    "Click the map: a vertical well through the layers chosen. Press and draw in a section: cells. "
    "With the keyboard: arrow keys move the slices, Enter does what a click does, Ctrl+Z undoes it."
)


@st.fragment
def draw_volume_editor(state: State) -> None:
    """Draw the editor of a volume over its realizations; an edit redraws only this."""
    with error_boundary():
        st.html(f"<style>{STYLE.read_text('utf-8')}</style>")
        problem = problem_of_data(state.choices)
        local = None if problem else answer(state)
        start_run_if_needed(state, live=True, after=REST if local else 0.0)
        draw_news(state, wait=local is None)
        with st.container(key="editing"):
            if problem:
                draw_problem(state, problem)
            else:
                _draw(state)


def _draw(state: State) -> None:
    data, ensemble, answered = data_of(state.choices), state.ensemble, answer(state)
    if ensemble is not None and not fits(ensemble, state.choices):
        ensemble = None
    if ensemble is not None:
        state.shown = min(state.shown, ensemble.n - 1)
        state.facies = min(state.facies, ensemble.training_image.n_facies - 1)
        with st.container(key="facts_row"):
            draw_facts(ensemble)
    _draw_actions(state, data)
    _draw_brush(state)
    left, right = st.columns(2, gap="medium")
    with left:
        _draw_ground(state, data, answered or ensemble)
    with right:
        if ensemble is not None:
            draw_e_type(state, ensemble, colours_of(state))
        else:
            panel_title("Realizations and E-type")
            step_note("They answer every edit here, once the study has been simulated.")
        draw_wells(state, data)


def _draw_actions(state: State, data: HardData) -> None:
    page_state = state.page(Editor)
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="editor_top"):
        draw_import(state)
        draw_tables(state)
        draw_sampling(state)
        draw_export(state, data)
        history, args = page_state.history, {"args": (state,)}
        button("Undo", key="undo", on_click=undo, disabled=not history.past, **args)
        button("Redo", key="redo", on_click=redo, disabled=not history.future, **args)
        clear = {"args": (state, DataChoice("placed", placed=HardData())), "disabled": not data.n}
        clear["help"] = "Take all data away; undo brings them back."
        button("Clear", key="clear", on_click=take, **clear)
    if page_state.message:
        st.warning(plain(page_state.message))


def _draw_brush(state: State) -> None:
    """Draw what is placed: a facies, what is shown, or nothing; and the layers of a well."""
    page_state, image, nz = state.page(Editor), image_of(state.choices.image), _layers(state)
    names = dict(enumerate(image.facies_names)) | {AS_SHOWN: "as shown", ERASE: "erase"}
    low, high = layers_of_wells(page_state, nz)
    with st.container(horizontal=True, vertical_alignment="bottom", gap="medium", key="brush_row"):
        brush = bound_to(page_state, "brush") | options_of(names)
        tip = "“as shown” reads the realization; “erase” frees cells."
        field(st.segmented_control, "Facies to place", key="brush", help=tip, **brush)
        for k, (label, layer) in enumerate((("Wells from layer", low), ("to layer", high))):

            def write(new: int, k: int = k) -> None:
                page_state.layers = (int(new), high) if k == 0 else (low, int(new))

            number: dict[str, Any] = {"value": layer, "write": write, "width": 120}
            number |= {"min_value": 0 if k == 0 else low, "max_value": high if k == 0 else nz - 1}
            help_ = "0 is the bottom." if k == 0 else None
            field(st.number_input, label, key=f"well_layer_{k}", help=help_, **number)


def _layers(state: State) -> int:
    nz = state.choices.grid.nz
    assert nz is not None
    return nz


def _draw_ground(state: State, data: HardData, ensemble: Ensemble | None) -> None:
    """Draw the volume that takes the edits, with the data in it."""
    page_state, grid, colours = state.page(Editor), state.choices.grid, colours_of(state)
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="ground_row"):
        panel_title("Hard data on")
        ground = bound_to(page_state, "ground", label_visibility="collapsed") | options_of(GROUNDS)
        field(st.segmented_control, "What is under the data", key="ground", **ground)
    points = points_of(data, image_of(state.choices.image))
    shown = replace(ground_of(state, ensemble), points=points, point_colours=colours)

    def edited(edits: list[dict[str, Any]]) -> None:
        take_edits(state, edits)

    history = page_state.history
    editing = {"ack": page_state.taken}
    editing |= {"can_undo": bool(history.past), "can_redo": bool(history.future)}
    options: dict[str, Any] = {"grid": grid, "link": VOLUMES, "name": "hard_data"}
    draw_volume(shown, "volume_editor", on_edits=edited, editing=editing, **options)
    step_note(HOW_TO)
    if ensemble is not None and ensemble.revised and ensemble.hard_data.digest == data.digest:
        step_note("Local answer to your edits, until the run with all data is finished.")
    elif ensemble is not None and ensemble.hard_data.digest != data.digest:
        step_note("Of the data before your edits, until the run with all data is finished.")


def ground_of(state: State, ensemble: Ensemble | None) -> CellMap:
    """Return the volume under the data: a realization, the E-type, or an empty grid."""
    ground, grid = state.page(Editor).ground, state.choices.grid
    colours, alt = colours_of(state), "Hard data of the volume; a click on the map places a well"
    if ensemble is None or ground == "empty":
        nothing = np.zeros(grid.shape, np.uint8)
        return CellMap(nothing, [chart_theme().paper], ["no datum"], alt)
    if ground == "e_type":
        return uncertainty_map(state, ensemble, colours)
    indices = ensemble.indices[min(state.shown, ensemble.n - 1)]
    return facies_map(indices, ensemble.training_image, colours, alt)


class WellRows(NamedTuple):
    """The wells of a volume: those with a name, then the columns of cells that belong to none."""

    names: tuple[str, ...]  # "" of a column
    data: tuple[NDArray[np.int64], ...]  # which data each has, the lowest first


def rows_of_wells(data: HardData, wells: CellsOfWells = ()) -> WellRows:
    """Return the wells of hard data; a deviated one with a name is one, a column without is one.

    Examples
    --------
    >>> data = HardData([[0, 3, 4], [1, 3, 5], [0, 1, 1], [2, 1, 1]], [0, 1, 1, 0])
    >>> found = rows_of_wells(data, (("A", ((0, 3, 4), (1, 3, 5), (9, 9, 9))),))
    >>> found.names, [data.cells[k].tolist() for k in found.data]
    (('A', ''), [[[0, 3, 4], [1, 3, 5]], [[0, 1, 1], [2, 1, 1]]])
    """
    place_of = {cell: k for k, cell in enumerate(map(tuple, data.cells.tolist()))} if wells else {}
    names, parts = [], []
    unnamed = np.ones(data.n, bool)
    for name, cells in wells:
        own = np.array(sorted(place_of[cell] for cell in cells if cell in place_of), np.int64)
        if len(own):
            names.append(name)
            parts.append(own)
            unnamed[own] = False
    left = np.flatnonzero(unnamed)
    if len(left):
        layer, row, column = data.cells[left].T
        order = np.lexsort((layer, column, row))
        new = (np.diff(row[order]) != 0) | (np.diff(column[order]) != 0)
        parts += np.split(left[order], np.flatnonzero(new) + 1)
        names += [""] * (len(parts) - len(names))
    return WellRows(tuple(names), tuple(parts))


def table_of_wells(data: HardData, grid: Grid, rows: WellRows) -> pd.DataFrame:
    """Return one row a well: its name, where its highest datum is, and how far it reaches.

    Examples
    --------
    >>> data = HardData([[2, 3, 4], [5, 3, 4], [0, 1, 1]], [0, 1, 1])
    >>> table_of_wells(data, Grid(8, 8, nz=6), rows_of_wells(data))
         x    y  from z  to z  data
    0  1.5  1.5     0.0   1.0     1
    1  4.5  3.5     2.0   6.0     2
    """
    low = data.cells[[which[0] for which in rows.data]]
    high = data.cells[[which[-1] for which in rows.data]]
    places = grid.centers_of(high)
    height, base = grid.cell_size[-1], grid.origin[-1]
    columns: dict[str, Any] = {"well": rows.names} if any(rows.names) else {}
    columns |= {"x": places[:, 0], "y": places[:, 1]}
    columns |= {"from z": base + height * low[:, 0], "to z": base + height * (high[:, 0] + 1)}
    return pd.DataFrame(columns | {"data": [len(which) for which in rows.data]})


def describe_wells(data: HardData, rows: WellRows) -> str:
    """Say how many wells there are.

    Examples
    --------
    >>> data = HardData([[2, 3, 4], [5, 3, 4], [0, 1, 1]], [0, 1, 1])
    >>> describe_wells(data, rows_of_wells(data))
    '2 columns, 3 cells'
    """
    n = sum(map(bool, rows.names))
    counts = {"well": n, "column": len(rows.names) - n, "cell": data.n}
    said = [f"{count} {what}{'' if count == 1 else 's'}" for what, count in counts.items() if count]
    return ", ".join(said)


def draw_wells(state: State, data: HardData) -> None:
    """Draw the wells as a table; those that are chosen can be taken away."""
    if not data.n:
        panel_title("Wells", "none yet")
        return
    wells = rows_of_wells(data, wells_of(state.choices))
    panel_title("Wells", describe_wells(data, wells))
    options: dict[str, Any] = {"on_select": "rerun", "selection_mode": "multi-row", "height": 300}
    table = table_of_wells(data, state.choices.grid, wells)
    key = f"wells_{digest(data.digest, wells.names)}"
    chosen = st.dataframe(table, hide_index=True, key=key, **options)
    rows = list(chosen["selection"]["rows"])
    words = f"Remove {len(rows)} of them" if rows else "Choose rows to remove wells"
    remove = {"on_click": remove_wells, "args": (state, rows), "disabled": not rows}
    button(words, key="remove_wells", **remove)


def remove_wells(state: State, rows: list[int]) -> None:
    """Take wells away with all their data, by their rows in the table.

    A cell that another well goes through, too, keeps its datum.
    """
    data, named = data_of(state.choices), wells_of(state.choices)
    wells = rows_of_wells(data, named)
    out = np.zeros(data.n, bool)
    for k, own in enumerate(wells.data):
        out[own] |= k in rows
    for k, own in enumerate(wells.data):
        if k not in rows:
            out[own] = False
    gone = {wells.names[k] for k in rows}
    left = HardData(data.cells[~out], data.facies[~out])
    kept = tuple(well for well in named if well[0] not in gone)
    take(state, DataChoice("placed", placed=left, wells=kept), state.reference)
