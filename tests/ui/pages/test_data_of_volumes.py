"""Test hard data of a volume placed by hand: wells and cells, undo, updates, tables, sampling."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

from ccwsim import Grid, HardData, Parameters
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload, WellTables
from ccwsim.ui.hard_data.edits import (
    AS_SHOWN,
    ERASE,
    Editor,
    Sampling,
    answer,
    layers_of_wells,
    paint,
    take_edits,
    undo,
)
from ccwsim.ui.hard_data.menus import reference_of, sample, sampled, use_file
from ccwsim.ui.hard_data.wells import (
    describe_wells,
    remove_wells,
    rows_of_wells,
    table_of_wells,
)
from ccwsim.ui.session.resolve import data_of, wells_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.run import collect, start_run
from tests.ui.widgets import html, named, opened, texts

pytestmark = pytest.mark.slow
"""The tests are slow; `test_volume_study` tests a volume on the main pages in the quick tests."""

P = Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1))
GRID = Grid(30, 40, nz=12)
VOLUME = Choices(ImageChoice("sinuous_channels"), DataChoice(), GRID, P, n_realizations=2)
COLLARS = b"well,x,y,z\nA,10.5,2.5,12\nB,20.5,9.5,12\n"
LOG = b"well,from,to,facies\nA,0,3,1\nA,3,12,0\nB,0,12,1\n"


def state_of(data: HardData | None = None) -> State:
    choice = DataChoice("placed", placed=data) if data is not None else DataChoice()
    state = State(choices=VOLUME)
    state.change(data=choice)
    return state


def run(state: State) -> State:
    start_run(state)
    assert state.job is not None, state.message
    assert state.job.wait(120)
    collect(state)
    return state


def test_a_click_on_the_map_places_a_well_and_a_stroke_in_a_section_cells():
    state = state_of()
    paint(state, "z", [(5, 3, 4)], range(2, 9))
    assert data_of(state.choices).triples == tuple((k, 3, 4, 1) for k in range(2, 9))
    state.page(Editor).brush = 0
    paint(state, "y", [(2, 3, 4), (2, 3, 5), (99, 3, 4)], range(12))
    assert (2, 3, 4, 0) in data_of(state.choices).triples
    assert (2, 3, 5, 0) in data_of(state.choices).triples
    assert data_of(state.choices).n == 8
    state.page(Editor).brush = ERASE
    paint(state, "x", [(2, 3, 5)], range(12))
    assert data_of(state.choices).n == 7
    undo(state)
    undo(state)
    assert data_of(state.choices).triples == tuple((k, 3, 4, 1) for k in range(2, 9))
    undo(state, again=True)
    assert data_of(state.choices).n == 8


def test_edits_of_the_canvas_are_taken_once_and_in_their_order():
    state = state_of()
    well = {"seq": 5, "axis": "z", "cells": [[0, 3, 4]]}
    cell = {"seq": 6, "axis": "y", "cells": [[2, 8, 9], [99, 8, 9]]}
    take_edits(state, [cell, well])
    take_edits(state, [well, cell, {"seq": 7, "do": "undo"}])
    assert data_of(state.choices).triples == tuple((k, 3, 4, 1) for k in range(12))
    take_edits(state, [{"seq": 7, "do": "undo"}, {"seq": 8, "do": "redo"}])
    assert data_of(state.choices).n == 13
    take_edits(state, [{"seq": 9, "set": [[1, 1, 1]]}, {"seq": 10}])  # a map edit, an empty one
    assert data_of(state.choices).n == 13
    state.page(Editor).layers = (2, 4)
    take_edits(state, [{"seq": 11, "axis": "z", "cells": [[0, 20, 20]]}])
    assert data_of(state.choices).n == 16


def test_cells_are_read_off_the_realization_that_is_shown():
    state = state_of()
    state.page(Editor).brush = AS_SHOWN
    paint(state, "z", [(0, 7, 9)], range(12))
    assert "no realization yet to read from" in state.page(Editor).message
    run(state)
    state.shown = 1
    paint(state, "z", [(0, 7, 9)], range(12))
    shown = state.ensemble.realizations[1][:, 7, 9]
    assert data_of(state.choices).facies.tolist() == shown.tolist()


def test_as_shown_reads_the_local_answer_to_the_edits_before():
    state = run(state_of())
    state.page(Editor).brush = 1 - int(state.ensemble.indices[0][6, 7, 9])
    paint(state, "x", [(6, 7, 9)], range(12))
    shown = answer(state)
    assert shown is not None
    assert shown.revised
    differs = np.argwhere(shown.realizations[0] != state.ensemble.realizations[0])
    cell = tuple(next(c for c in differs.tolist() if c != [6, 7, 9]))
    state.page(Editor).brush = AS_SHOWN
    paint(state, "x", [cell], range(12))
    assert (*cell, int(shown.realizations[0][cell])) in data_of(state.choices).triples


def test_the_realizations_honour_what_was_placed_at_once_and_after_the_run():
    state = run(state_of(HardData([(0, 1, 1)], [1])))
    paint(state, "z", [(0, 20, 30)], range(12))
    app = opened("data", state).run()
    assert not app.exception
    assert "A click on the map places a vertical well" in html(app) + " ".join(
        str(m.value) for m in app.markdown
    )
    after = app.session_state[KEY]
    if after.job is not None:
        assert after.job.wait(120)
        collect(after)
    cells = tuple(data_of(after.choices).cells.T)
    for one in after.ensemble.realizations:
        np.testing.assert_array_equal(one[cells], data_of(after.choices).facies)


def test_the_page_shows_wells_and_takes_them_away():
    wells = [(k, 3, 4) for k in range(12)] + [(k, 8, 9) for k in range(3, 6)]
    data = HardData(wells, [k % 2 for k in range(15)])
    grid = Grid(30, 40, (10.0, 10.0, 2.0), (100.0, 0.0, 50.0), nz=12)
    table = table_of_wells(data, grid, rows_of_wells(data))
    assert table.to_dict("list") == {
        "x": [145.0, 195.0], "y": [35.0, 85.0], "from z": [50.0, 56.0], "to z": [74.0, 62.0],
        "data": [12, 3],
    }  # fmt: skip
    state = state_of(data)
    app = opened("data", state).run()
    assert not app.exception
    remove_wells(app.session_state[KEY], [0])
    assert {cell[1] for cell in data_of(app.session_state[KEY].choices).cells.tolist()} == {8}
    undo(app.session_state[KEY])
    assert data_of(app.session_state[KEY].choices).digest == data.digest


def test_layers_of_wells_follow_the_grid():
    page_state = Editor()
    assert layers_of_wells(page_state, 12) == (0, 11)
    page_state.layers = (3, 40)
    assert layers_of_wells(page_state, 12) == (3, 11)


def with_tables(app, tables: dict[str, bytes]):
    """Upload tables of wells, one after another."""
    for name, content in tables.items():
        app.file_uploader(key=f"table_{name}").upload(f"{name}.csv", content, "text/csv").run()
        assert not app.exception
    return app


def captions(app) -> str:
    return " ".join(element.value for element in app.caption)


def test_wells_in_tables_are_taken_as_soon_as_they_fit():
    app = with_tables(opened("data", state_of()).run(), {"collars": COLLARS})
    state = app.session_state[KEY]
    assert data_of(state.choices).n == 0
    assert state.data_draft.waits
    assert texts(app) == ""
    with_tables(app, {"intervals": LOG})
    assert data_of(state.choices).n == 24
    assert state.data_draft is None
    assert "Collars: well → well, x → x, y → y, z → z" in captions(app)
    assert "depth from" in captions(app)
    with_tables(app, {"surveys": b"well,depth,azimuth,dip\nB,0,90,-60\n"})
    assert data_of(state.choices).n > 24
    assert [file.name for file in state.choices.data.files] == [
        "intervals.csv", "collars.csv", "surveys.csv"
    ]  # fmt: skip
    assert "assumed vertical: 1 (A)" in captions(app)
    named(app.button, "undo").click().run()
    assert data_of(state.choices).n == 24


def test_tables_that_contradict_each_other_change_nothing():
    app = with_tables(opened("data", state_of()).run(), {"collars": COLLARS})
    with_tables(app, {"intervals": LOG + b"C,0,3,1\n"})
    state = app.session_state[KEY]
    assert "line 5: there is no collar of the well 'C'" in captions(app)
    assert data_of(state.choices).n == 0
    with_tables(app, {"intervals": b"%PDF-1.7\x00"})
    assert "is a PDF file" in " ".join(e.value for e in app.error)
    named(app.button, "import_drop").click().run()
    assert state.data_draft is None
    assert texts(app) == ""


def test_columns_of_tables_are_asked_where_their_names_do_not_tell():
    collars = b"p;q;r;s;t\nA;10,5;2,5;12;40\nB;20,5;9,5;12;40\n"
    app = with_tables(opened("data", state_of()).run(), {"collars": collars, "intervals": LOG})
    state = app.session_state[KEY]
    assert data_of(state.choices).n == 0
    assert "no column of the names of the wells" in texts(app)
    assert "(collar_well=)" not in texts(app)
    assert not app.error
    columns = {"collar_well": "p", "x": "q", "y": "r", "z": "s"}
    for role, column in columns.items():
        assert named(app.selectbox, f"ask_column_{role}").value is None
        named(app.selectbox, f"ask_column_{role}").set_value(column).run()
    assert data_of(state.choices).n == 24
    assert dict(state.choices.data.answers) == columns
    assert columns_of_cells(state) == {(2, 10), (9, 20)}
    named(app.selectbox, "ask_column_x").set_value("r").run()
    assert dict(state.choices.data.answers) == columns | {"x": "r", "y": "q"}
    assert columns_of_cells(state) == {(10, 2), (20, 9)}
    assert not app.exception


def columns_of_cells(state: State) -> set[tuple[int, int]]:
    return {(row, column) for _, row, column in data_of(state.choices).cells.tolist()}


def state_with_names(surveys: bytes | None = b"well,depth,azimuth,dip\nB,0,0,-50\n") -> State:
    """Return a state with two named wells (B is deviated), and with a column and a cell by hand."""
    tables = WellTables(Upload("c.csv", COLLARS), surveys and Upload("s.csv", surveys))
    state = state_of()
    use_file(state, DataChoice("file", upload=Upload("i.csv", LOG), tables=tables))
    assert state.data_draft is None
    paint(state, "z", [(0, 25, 35)], range(4))
    paint(state, "y", [(5, 25, 36)], range(12))
    assert state.choices.data.source == "placed"
    return state


def test_wells_are_listed_by_name_a_deviated_one_in_one_row():
    state = state_with_names()
    data = data_of(state.choices)
    rows = rows_of_wells(data, wells_of(state.choices))
    assert rows.names == ("A", "B", "", "")
    assert sum(map(len, rows.data)) == data.n
    assert len({*map(tuple, data.cells[rows.data[1]][:, 1:].tolist())}) > 1
    table = table_of_wells(data, GRID, rows)
    assert table["well"].tolist() == ["A", "B", "", ""]
    assert table.iloc[0].tolist() == ["A", 10.5, 2.5, 0.0, 12.0, 12]
    assert table["x"][1] == 20.5
    assert table["y"][1] in (9.5, 10.5)  # in the highest layer the well crosses two cells
    assert describe_wells(data, rows) == f"2 wells, 2 columns, {data.n} cells"
    app = opened("data", state).run()
    assert not app.exception
    shown = next(frame.value for frame in app.dataframe if "data" in frame.value)
    assert shown["well"].tolist() == table["well"].tolist()


@pytest.mark.parametrize("rows", [[0], [1], [2], [0, 1], [1, 3], [0, 1, 2, 3]])
def test_a_well_that_is_removed_loses_all_its_data(rows):
    state = state_with_names()
    data = data_of(state.choices)
    wells = rows_of_wells(data, wells_of(state.choices))
    remove_wells(state, rows)
    left = data_of(state.choices)
    kept = [k for k in range(4) if k not in rows]
    wanted = {data.triples[k] for row in kept for k in wells.data[row]}
    assert {*left.triples} == wanted
    now = rows_of_wells(left, wells_of(state.choices))
    assert now.names == tuple(wells.names[k] for k in kept)
    undo(state)
    assert data_of(state.choices).digest == data.digest
    assert rows_of_wells(data, wells_of(state.choices)).names == wells.names


def test_wells_keep_their_names_when_a_cell_is_erased_and_lose_them_when_all_are():
    state = state_with_names(None)
    state.page(Editor).brush = ERASE
    paint(state, "x", [(3, 2, 10)], range(12))
    rows = rows_of_wells(data_of(state.choices), wells_of(state.choices))
    assert (rows.names[0], len(rows.data[0])) == ("A", 11)
    paint(state, "z", [(0, 2, 10)], range(12))
    assert rows_of_wells(data_of(state.choices), wells_of(state.choices)).names == ("B", "", "")


def test_a_cell_of_two_wells_stays_with_the_one_that_stays():
    state = state_of()
    log = b"well,x,y,z,facies\nA,1.5,2.5,0.5,1\nA,1.5,2.5,1.5,1\n"
    log += b"B,1.5,2.5,1.5,1\nB,1.5,2.5,2.5,0\n"
    use_file(state, DataChoice("file", upload=Upload("points.csv", log)))
    assert rows_of_wells(data_of(state.choices), wells_of(state.choices)).names == ("A", "B")
    remove_wells(state, [0])
    assert data_of(state.choices).triples == ((1, 2, 1, 1), (2, 2, 1, 0))
    assert rows_of_wells(data_of(state.choices), wells_of(state.choices)).names == ("B",)
    remove_wells(state, [0])
    assert data_of(state.choices).n == 0


def test_data_that_replace_others_have_no_wells_of_theirs():
    state = run(state_with_names())
    state.page(Editor).sampling = Sampling("vertical", n=2, every=1)
    sample(state)
    assert not any(rows_of_wells(data_of(state.choices), wells_of(state.choices)).names)


def test_wells_are_sampled_from_a_realization_and_the_field_is_kept():
    state = run(state_of())
    state.page(Editor).sampling = Sampling("vertical", n=3, every=2)
    sample(state)
    data = data_of(state.choices)
    assert data.n == 18
    assert len(rows_of_wells(data).names) == 3
    assert (state.reference.array[tuple(data.cells.T)] == data.facies).all()
    assert sampled(state.reference, Sampling("grid", every=20)).n % 12 == 0
    app = opened("data", state).run()
    assert not app.exception
    assert named(app.selectbox, "sample_way").options == [
        "vertical wells", "cells at random", "vertical wells on a grid"
    ]  # fmt: skip


@pytest.mark.parametrize("volume", [True, False])
def test_a_reference_file_with_layers_is_read_as_the_grid_is(volume):
    field = np.zeros((12, 30, 40), np.uint8)
    field[6, :, 20:] = 1
    content = BytesIO()
    np.save(content, field)
    map_ = Choices(data=DataChoice(), grid=Grid(30, 40), parameters=Parameters(16, 4, 1))
    app = opened("data", State(choices=VOLUME if volume else map_)).run()
    named(app.selectbox, "sample_from").set_value(True).run()
    app.file_uploader(key="reference_file").upload("f.npy", content.getvalue(), "x/y").run()
    assert not app.exception
    state = app.session_state[KEY]
    wanted = field if volume else field[6]
    assert (reference_of(state).array == wanted).all()
