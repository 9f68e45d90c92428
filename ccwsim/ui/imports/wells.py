"""The import of wells: the first rows, the roles of columns, and a map of the data."""

from dataclasses import replace
from functools import partial

import pandas as pd
import streamlit as st

from ccwsim.figures import placement_svg
from ccwsim.io import PlacedPoints, PointsPreview
from ccwsim.model.errors import CCWSIMError
from ccwsim.sharing.choices import Choices, DataChoice, WellTables
from ccwsim.ui.results.maps import colours_of
from ccwsim.ui.session import resolve
from ccwsim.ui.session.state import State
from ccwsim.ui.study import data_step, questions
from ccwsim.ui.study.run import simulate_button
from ccwsim.ui.widgets.fields import button
from ccwsim.ui.widgets.text import page_text, panel_title, plain

MAX_DRAWN = 2000
"""Maximum number of data on the map."""
MAX_NAMED = 40
"""Maximum number of wells with names on the map."""


def draw_wells_import(state: State, tables: bool = False) -> None:
    """Draw a file of wells, or several `tables`; the study uses it as soon as all data fit."""
    use = partial(data_step.use_data, state)
    choice = state.data_draft or state.choices.data
    if choice.source != "file" or (choice.tables is not None) != tables:
        choice = DataChoice("file", tables=WellTables() if tables else None)
    if tables:
        with st.container(horizontal=True, gap="medium", key="import_well_tables"):
            data_step.draw_table_uploaders("wells", choice, use)
    else:
        data_step.data_uploader("wells_file", lambda file: use(DataChoice("file", upload=file)))
    if not choice.files:
        kind = "tables of wells" if tables else "points"
        st.caption(page_text(f"Import of {kind}"))
        return
    tried = replace(state.choices, data=choice)
    _say_state(state, tried)
    questions.ask_troubles(tried, use, wide=True)
    if tables:
        for table, preview in resolve.previews_of_wells(choice).items():
            if isinstance(preview, PointsPreview):
                _draw_rows(preview)
            questions.ask_columns_of_wells(choice, table, preview, use, wide=True)
    elif questions.summary_of(choice.upload) is None:
        return
    else:
        preview = resolve.preview_of(choice, tried.grid)
        if preview.columns:
            _draw_rows(preview)
    left, right = st.columns([3, 2], gap="large")
    with right:
        questions.ask_data(tried, use, wide=True)
    with left:
        _draw_map(state, tried)
        questions.offer_fit(tried, use)


def _say_state(state: State, tried: Choices) -> None:
    """State whether the study uses the file and, if not, the reason."""
    choice = tried.data
    name = data_step.names_of_files(choice)
    if choice.waits:
        st.info("Collars and intervals are required. Surveys are required only if wells deviate.")
        data_step.keep_data_button(state, "wells_drop")
        return
    try:
        report = resolve.imported_data(tried)
    except CCWSIMError as error:
        questions.say_open(tried, str(error))
    else:
        n = report.hard_data.n
        if state.data_draft is None:
            st.success(plain(f"{n} data of {name} are in the study."))
            simulate_button(state, "wells_simulate")
        else:
            st.info(plain(f"{n} data of {name} fit the grid but are not in the study yet."))
            button("Use them", key="wells_use", on_click=data_step.use_data, args=(state, choice))
        for note in report.notes:
            st.caption(plain(note))
    data_step.keep_data_button(state, "wells_drop")


def _draw_rows(preview: PointsPreview) -> None:
    """Draw the first rows of the file, with the role of each column in the heading."""
    shown = min(len(preview.rows), preview.n_rows)
    panel_title("First rows", f"{shown} of {preview.n_rows} of {preview.name}")
    roles = {column: questions.role_of(role) for role, column in preview.guess.items()}
    heads = [f"{name} → {roles[name]}" if name in roles else name for name in preview.columns]
    table = pd.DataFrame(
        list(preview.rows), columns=heads, index=[f"line {k}" for k in preview.lines]
    )
    st.dataframe(table, height="content")
    for reason in preview.reasons:
        st.caption(plain(questions.IN_SCRIPTS.sub("", reason)))


def _draw_map(state: State, tried: Choices) -> None:
    """Draw a map of the data, on a larger grid if none is inside; rings are data not used."""
    try:
        placed, fitting = resolve.placed_data(tried), resolve.grid_for_data(tried)
        title = "Positions of the data"
        n, n_out = placed.points.n, len(placed.outside)
        if fitting is not None and n_out == n:
            title, tried = "Positions of the data in a larger grid", replace(tried, grid=fitting)
            placed = resolve.placed_data(tried)
    except CCWSIMError:  # the error is reported above
        return
    panel_title(title, f"grid of {questions.described(tried.grid)}")
    step = max(1, -(-placed.points.n // MAX_DRAWN))
    colours = _colours(state, tried, placed)[::step]
    above = placed.cells[::step, -2:]  # the map shows the data of a volume from above
    wells: dict[str, list[int]] = {}
    for k, line in enumerate(placed.points.lines[::step].tolist()):
        if name := placed.points.wells.get(line):
            wells.setdefault(name, []).append(k)
    wells = wells if len(wells) <= MAX_NAMED else {}
    svg = placement_svg(above, colours, tried.grid.shape[-2:], wells)
    st.image(svg, alt="Positions of the data in the grid", width=520)
    if fitting is not None and n_out == n:
        st.caption("No datum is in the study's grid. The frame shows a larger grid.")
    elif n_out:
        st.caption(f"The frame shows the study's grid; {n_out} of {n} data are outside.")


def _colours(state: State, tried: Choices, placed: PlacedPoints) -> list[str | None]:
    """Return the colour of each datum, or None for each datum that is not used."""
    image = resolve.image_of(tried.image)
    known = dict(zip(image.codes.tolist(), colours_of(state), strict=False))
    lost = {*placed.outside.tolist(), *placed.unknown.tolist()}
    codes = placed.facies.tolist()
    return [None if k in lost else known.get(code) for k, code in enumerate(codes)]
