"""Hard data of a volume by hand: wells in the map, cells in the sections, tables of wells."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import streamlit as st
from numpy.typing import NDArray

from ccwsim.io import import_wells
from ccwsim.io.hard_data.placing import HardDataImport
from ccwsim.model.choices import DataChoice, Upload
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.ui.hard_data.edits import (
    AS_SHOWN,
    ERASE,
    Editor,
    answer,
    fits,
    paint,
    redo,
    take,
    take_data,
    undo,
    with_changes,
)
from ccwsim.ui.hard_data.menus import draw_export, draw_import, draw_problem, draw_sampling
from ccwsim.ui.jobs.uploads import file_uploader
from ccwsim.ui.results.maps import VOLUMES, colours_of, draw_e_type, uncertainty_map
from ccwsim.ui.session.fragments import error_boundary
from ccwsim.ui.session.resolve import data_of, image_of
from ccwsim.ui.session.state import State
from ccwsim.ui.study.data_step import problem_of_data
from ccwsim.ui.study.news import draw_news
from ccwsim.ui.study.run import keep_up
from ccwsim.ui.widgets.facts import draw_facts
from ccwsim.ui.widgets.fields import bound_to, button, field, options_of
from ccwsim.ui.widgets.maps import CellMap, facies_map, points_of
from ccwsim.ui.widgets.text import panel_title, plain, step_note
from ccwsim.ui.widgets.theme import chart_theme
from ccwsim.ui.widgets.volumes import draw_volume

STYLE = Path(__file__).with_name("editor.css")
REST = 0.6
"""Seconds without another edit before the run that answers all of them begins."""
GROUNDS = {"realization": "realization", "e_type": "E-type", "empty": "empty grid"}
TABLES = {
    "collars": ("Collars", "One row a well: name, x, y, z and, if known, its length."),
    "intervals": ("Intervals", "Name of the well, from, to (or one depth), facies."),
    "surveys": ("Surveys, if wells deviate", "Name, depth, azimuth, and inclination or dip."),
}
OUTSIDE = {"error": "refuse them", "drop": "leave them out"}
TYPES = ("csv", "txt", "dat", "tsv")
HOW_TO = (
    "Click the map: a vertical well through the layers chosen. Press and draw in a section: cells. "
    "With the keyboard: arrow keys move the slices, Enter does what a click does."
)


@st.fragment
def draw_volume_editor(state: State) -> None:
    """Draw the editor of a volume over its realizations; an edit redraws only this."""
    with error_boundary():
        st.html(f"<style>{STYLE.read_text('utf-8')}</style>")
        problem = problem_of_data(state.choices)
        local = None if problem else answer(state)
        keep_up(state, live=True, after=REST if local else 0.0)
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


def layers_of_wells(page_state: Editor, nz: int) -> tuple[int, int]:
    """Return the first and the last layer of a well that is placed: all of them at first."""
    low, high = page_state.layers or (0, nz - 1)
    return min(low, nz - 1), min(high, nz - 1)


def _draw_ground(state: State, data: HardData, ensemble: Ensemble | None) -> None:
    """Draw the volume that takes the edits, with the data in it."""
    page_state, grid, colours = state.page(Editor), state.choices.grid, colours_of(state)
    with st.container(horizontal=True, vertical_alignment="center", gap="small", key="ground_row"):
        panel_title("Hard data on")
        ground = bound_to(page_state, "ground", label_visibility="collapsed") | options_of(GROUNDS)
        field(st.segmented_control, "What is under the data", key="ground", **ground)
    points = points_of(data, image_of(state.choices.image))
    shown = replace(ground_of(state, ensemble), points=points, point_colours=colours)
    low, high = layers_of_wells(page_state, _layers(state))

    def edited(axis: str, cells: list[tuple[int, int, int]]) -> None:
        paint(state, axis, cells, range(low, high + 1))

    options: dict[str, Any] = {"grid": grid, "link": VOLUMES, "name": "hard_data"}
    draw_volume(shown, "volume_editor", on_cells=edited, **options)
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


def wells_of(data: HardData, grid: Grid) -> pd.DataFrame:
    """Return one row a vertical column of data: where it is, and how far it reaches.

    Examples
    --------
    >>> wells_of(HardData([[2, 3, 4], [5, 3, 4], [0, 1, 1]], [0, 1, 1]), Grid(8, 8, nz=6))
         x    y  from z  to z  data
    0  1.5  1.5     0.0   1.0     1
    1  4.5  3.5     2.0   6.0     2
    """
    columns, first, n = _columns(data)
    places = grid.centers_of(data.cells[first])
    top = np.zeros(len(columns), np.int64)
    np.maximum.at(top, _column_of(data), data.cells[:, 0])
    bottom = data.cells[first, 0]
    height, base = grid.cell_size[-1], grid.origin[-1]
    reach = base + height * bottom, base + height * (top + 1)
    return pd.DataFrame(
        {"x": places[:, 0], "y": places[:, 1], "from z": reach[0], "to z": reach[1], "data": n}
    )


def _columns(data: HardData) -> tuple[NDArray, NDArray, NDArray]:
    """Return rows and columns of the wells, the lowest datum of each, and how many it has."""
    order = np.lexsort((data.cells[:, 0], data.cells[:, 2], data.cells[:, 1]))
    sorted_cells = data.cells[order][:, 1:]
    wells, first, n = np.unique(sorted_cells, axis=0, return_index=True, return_counts=True)
    return wells, order[first], n


def _column_of(data: HardData) -> NDArray[np.int64]:
    return np.unique(data.cells[:, 1:], axis=0, return_inverse=True)[1].ravel()


def draw_wells(state: State, data: HardData) -> None:
    """Draw the wells as a table; those that are chosen can be taken away."""
    if not data.n:
        panel_title("Wells", "none yet")
        return
    table = wells_of(data, state.choices.grid)
    panel_title("Wells", f"{len(table)} columns, {data.n} cells")
    options: dict[str, Any] = {"on_select": "rerun", "selection_mode": "multi-row", "height": 300}
    chosen = st.dataframe(table, hide_index=True, key=f"wells_{data.digest}", **options)
    rows = list(chosen["selection"]["rows"])
    words = f"Remove {len(rows)} of them" if rows else "Choose rows to remove wells"
    remove = {"on_click": remove_wells, "args": (state, rows), "disabled": not rows}
    button(words, key="remove_wells", **remove)


def remove_wells(state: State, rows: list[int]) -> None:
    """Take wells away, by their rows in the table."""
    data = data_of(state.choices)
    out = np.isin(_column_of(data), rows)
    changes = {tuple(cell): None for cell in data.cells[out].tolist()}
    take_data(state, with_changes(data, changes), state.reference)


def draw_tables(state: State) -> None:
    """Draw a menu for wells in two or three tables, as drill-hole data bases have them."""
    page_state = state.page(Editor)
    with st.popover("Wells in tables", key="tables_menu"):
        for name, (label, tip) in TABLES.items():

            def use(upload: Upload | None, name: str = name) -> None:
                page_state.tables = {**page_state.tables, name: upload}

            file_uploader(label, key=f"table_{name}", take=use, type=list(TYPES), help=tip)
        column = bound_to(page_state, "facies_column")
        tip = "Where its name does not tell which it is."
        field(st.text_input, "Column of facies", key="facies_column", help=tip, **column)
        outside = bound_to(page_state, "outside") | options_of(OUTSIDE)
        field(st.selectbox, "Cells outside the grid", key="wells_outside", **outside)
        if not (page_state.tables.get("collars") and page_state.tables.get("intervals")):
            st.caption("Collars and intervals are needed; depths are along the well.")
            return
        try:
            found = wells_from(state)
        except CCWSIMError as error:
            st.error(plain(str(error)))
            return
        for note in found.notes:
            st.caption(plain(note))
        words = f"Take these {found.hard_data.n} data"
        use_them = {"on_click": take_data, "args": (state, found.hard_data)}
        button(words, key="take_wells", type="primary", **use_them)


def _named(upload: Upload) -> BytesIO:
    """Return a file whose name messages say."""
    file = BytesIO(upload.content)
    file.name = upload.name
    return file


def wells_from(state: State) -> HardDataImport:
    """Return the data of the tables of wells.

    Raises CCWSIMError for tables that cannot be read or contradict each other.
    """
    page_state, choices = state.page(Editor), state.choices
    files = {name: _named(upload) for name, upload in page_state.tables.items() if upload}
    found = import_wells(
        files["collars"],
        files["intervals"],
        choices.grid,
        image_of(choices.image),
        surveys=files.get("surveys"),
        facies=page_state.facies_column.strip() or None,
        on_outside=page_state.outside,
    )
    found.hard_data.check(choices.grid, image_of(choices.image))
    return found
