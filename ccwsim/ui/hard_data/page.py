"""The page to place hard data by hand: a map or volume, a table, and the realizations."""

from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import streamlit as st

from ccwsim import Ensemble, HardData
from ccwsim.model import FORCED, WRONG, Integers
from ccwsim.sharing.choices import DataChoice
from ccwsim.ui.frontend.cells import CellMap, draw_editable, editor_points
from ccwsim.ui.hard_data import menus
from ccwsim.ui.hard_data.edits import Editor, answer, fits, take, take_edits, undo
from ccwsim.ui.hard_data.table import draw_data_table
from ccwsim.ui.hard_data.wells import draw_brush, draw_wells
from ccwsim.ui.results import maps
from ccwsim.ui.session import State, data_of, error_boundary, wells_of
from ccwsim.ui.study.data_step import problem_of_data
from ccwsim.ui.study.run import draw_news, start_run_if_needed
from ccwsim.ui.widgets import (
    bound_to,
    button,
    chart_theme,
    draw_facts,
    draw_style,
    field,
    in_row,
    menu,
    options_of,
    page_text,
    panel_title,
    plain,
    step_note,
)

EDITOR_BACKGROUNDS = {"realization": "realization", "e_type": "E-type", "empty": "empty grid"}
REST, REST_VOLUME = 0.4, 0.6
"""Number of seconds after the last edit at which a run with all edits begins."""
TOOLS = "“draw” places or moves a datum; “straight” and “freehand” place a line of data."


@st.fragment
def draw_editor(state: State) -> None:
    """Draw the editor over the realizations of the study; an edit redraws only the editor.

    Every edit starts a run. If data were added, the editor shows a local re-simulation until the
    new run is finished. All other results are from the previous run and are dimmed.
    """
    with error_boundary():
        draw_style("hard_data/editor.css")
        problem = problem_of_data(state.choices)
        local = None if problem else answer(state)
        delay = REST_VOLUME if state.grid.is_volume else REST
        start_run_if_needed(state, live=True, after=delay if local else 0.0)
        draw_news(state, wait=local is None)
        with st.container(key="editing"):
            if problem:
                menus.draw_problem(state, problem)
            else:
                _draw(state)


def _draw(state: State) -> None:
    data, image, grid = data_of(state.choices), state.image, state.grid
    colours, ground = maps.colours_of(state), state.page(Editor).ground
    ensemble, answered = state.ensemble, answer(state)
    if ensemble is not None and not fits(ensemble, state.choices):
        ensemble = None
    if ensemble is not None:
        state.fit_shown(ensemble)
        with in_row("facts_row"):
            draw_facts(ensemble)
    _draw_actions(state, data)
    if grid.nz is None:
        with st.container(key="maps"):
            left, middle, right = maps.map_columns((1.0, 1.0, 0.56), 0, grid)
    else:
        draw_brush(state, grid.nz)
        left, middle = st.columns(2, gap="medium")
        right = middle
    with left:
        with in_row("ground_row"):
            panel_title("Hard data on")
            field(
                st.segmented_control,
                "Map under the data",
                key="ground",
                label_visibility="collapsed",
                **bound_to(state.page(Editor), "ground"),
                **options_of(EDITOR_BACKGROUNDS),
            )
        of_run = ground == "e_type"  # a local re-simulation has no E-type
        draw_canvas(state, ensemble if of_run else answered or ensemble)
        if grid.nz is not None:
            step_note(page_text("Editing a volume"))
        # below the map, so that a long text does not move the map
        if ensemble is not None and (text := describe_answer(state, answered)):
            step_note(text)
    with middle, st.container(key="beside") if grid.nz is None else nullcontext():
        if ensemble is None:
            panel_title("Realizations and E-type")
            step_note("After the first run, realizations are shown here and follow every edit.")
        elif ground == "e_type" and grid.nz is None:
            maps.draw_realization(state, ensemble, colours, state.shown)
        else:
            maps.draw_e_type(state, ensemble, colours)
    with right:
        if grid.nz is None:
            draw_data_table(state, data, image, colours)
        else:
            draw_wells(state, data)
    if ensemble is not None and grid.nz is None:
        maps.draw_gallery(state, ensemble, colours)


def _draw_actions(state: State, data: HardData) -> None:
    """Draw the menus; buttons for undo and redo are drawn only for volumes."""
    page_state, volume = state.page(Editor), state.grid.is_volume
    with in_row("editor_top"):
        menu("Import", "import_menu", partial(menus.draw_import, state))
        if volume:
            menu("Wells in tables", "tables_menu", partial(menus.draw_tables, state))
        menu("Sample", "sample_menu", partial(menus.draw_sampling, state))
        export = partial(menus.draw_export, state, data)
        menu("Export", "export_menu", export, disabled=not data.n)
        if volume:
            past, future = page_state.history.past, page_state.history.future
            button("Undo", key="undo", on_click=undo, args=(state,), disabled=not past)
            button("Redo", key="redo", on_click=undo, args=(state, True), disabled=not future)
        button(
            "Clear",
            key="clear",
            on_click=take,
            args=(state, DataChoice("placed", placed=HardData())),
            disabled=not data.n,
            help="Remove all data; “undo” restores the data.",
        )
    if page_state.message:
        st.warning(plain(page_state.message))


def describe_answer(state: State, answered: Ensemble | None) -> str:
    """Describe how the realization shown honours the data, or state that a run is needed."""
    number = f"Realization {state.shown + 1}"
    if state.page(Editor).ground == "e_type" and answered is not state.ensemble:
        return "The E-type is from before your edits, until the run with all data is finished."
    if answered is None:
        return f"{number} with the earlier data; because data were removed, a new run is needed."
    if not answered.hard_data.n:
        return "" if state.grid.is_volume else TOOLS
    text = f"{number}: {describe_data_status(answered.data_status[state.shown])}."
    if not answered.revised:
        return text
    if not answered.parameters.exact_data:
        return f"{text} “Honour data exactly” is off: edits condition only the next run's search."
    until = ", until the new run is finished" if state.job is not None else ""
    return f"{text} Re-simulated locally around your edits{until}."


def draw_canvas(state: State, ensemble: Ensemble | None) -> None:
    """Draw the map or volume with the data on top, and apply the user's edits."""
    page_state, grid = state.page(Editor), state.grid
    data, image = data_of(state.choices), state.image
    colours = maps.colours_of(state)
    ground = page_state.ground if ensemble is not None else "empty"
    alt = "Hard data; arrow keys move, Enter places, Delete erases"
    if grid.is_volume:
        alt = "Hard data of the volume; a click on the map places a well"
    if ensemble is None or ground == "empty":
        empty = np.zeros(grid.shape, np.uint8)
        cell_map = CellMap(empty, [chart_theme().paper], ["no datum"], "Empty grid")
    elif ground == "realization":
        r = min(state.shown, ensemble.n - 1)
        cell_map = maps.map_of(ensemble, r, colours, alt)
        if not grid.is_volume:  # the tools show the facies
            cell_map = replace(cell_map, keys=())
    else:
        cell_map = maps.uncertainty_map(state, ensemble, colours)
    statuses = status_of(data, ensemble, state.shown if ground == "realization" else None)
    points = [
        [*point[:-1], int(datum_status == WRONG), 0 if datum_status == WRONG else datum_status]
        for point, datum_status in zip(editor_points(data, image), statuses, strict=True)
    ]
    wells = wells_of(state.choices)
    cell_map = replace(cell_map, point_colours=colours, alt=alt, points=points, wells=wells)
    history, brushes = page_state.history, zip(image.facies_names, colours, strict=True)
    editing: dict[str, Any] = {
        "brushes": [{"label": name, "colour": colour} for name, colour in brushes],
        "reads": ground == "realization",
        "empty": ground == "empty",
        "ack": page_state.taken,
        "can_undo": bool(history.past),
        "can_redo": bool(history.future),
    }
    draw_editable(
        cell_map,
        lambda edits: take_edits(state, edits),
        editing,
        grid=grid,
        link="grid",
        name="hard_data",
    )


def status_of(data: HardData, ensemble: Ensemble | None, shown: int | None) -> list[int]:
    """Return the `Ensemble.data_status` of each datum in a realization; an unknown status is 0."""
    status_by_datum = {}
    if ensemble is not None and shown is not None:
        statuses = ensemble.data_status[shown].tolist()
        status_by_datum = dict(zip(ensemble.hard_data.triples, statuses, strict=True))
    return [status_by_datum.get(datum, 0) for datum in data.triples]


def describe_data_status(data_status: Integers) -> str:
    """Describe how a realization honours the data, given its row of `Ensemble.data_status`."""
    sizes = data_status[data_status > 0]
    n_raster, n_forced = np.count_nonzero(data_status == 0), np.count_nonzero(data_status == FORCED)
    n_wrong = np.count_nonzero(data_status == WRONG)
    if n_raster == len(data_status):
        return f"{f'all {n_raster} ' if n_raster > 1 else ''}honoured in the raster pass"
    parts = [f"{n_raster} honoured in the raster pass"] if n_raster else []
    if len(sizes):
        low, high = sizes.min(), sizes.max()
        span = f"{low} cells" if low == high else f"{low} to {high} cells"
        windows = "a window" if len(sizes) == 1 else "windows"
        parts.append(f"{len(sizes)} by local re-simulation in {windows} of {span}")
    if n_forced:
        parts.append(f"{n_forced} forced")
    if n_wrong:
        parts.append(f"{n_wrong} wrong, because “Honour data exactly” is off")
    return ", ".join(parts)
