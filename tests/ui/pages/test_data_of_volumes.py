"""Hard data of a volume by hand: wells and cells, undone, answered, in tables, sampled."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid, HardData, Parameters
from ccwsim.model.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.ui.hard_data.edits import (
    AS_SHOWN,
    ERASE,
    Editor,
    Sampling,
    answer,
    paint,
    redo,
    undo,
)
from ccwsim.ui.hard_data.menus import sample, sampled
from ccwsim.ui.hard_data.volume import layers_of_wells, remove_wells, wells_from, wells_of
from ccwsim.ui.session.resolve import data_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.run import collect, start_run
from tests.ui.widgets import html, named, opened, texts

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
    redo(state)
    assert data_of(state.choices).n == 8


def test_cells_are_read_off_the_realization_that_is_shown():
    state = state_of()
    state.page(Editor).brush = AS_SHOWN
    paint(state, "z", [(0, 7, 9)], range(12))
    assert "no realization to read" in state.page(Editor).message
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
    assert "Click the map: a vertical well" in html(app) + " ".join(
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
    table = wells_of(data, Grid(30, 40, (10.0, 10.0, 2.0), (100.0, 0.0, 50.0), nz=12))
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


def test_wells_in_tables_are_read_and_taken():
    state = state_of()
    page_state = state.page(Editor)
    page_state.tables = {"collars": Upload("c.csv", COLLARS), "intervals": Upload("i.csv", LOG)}
    found = wells_from(state)
    assert found.hard_data.n == 24
    app = opened("data", state).run()
    assert not app.exception
    named(app.button, "take_wells").click().run()
    assert data_of(app.session_state[KEY].choices).digest == found.hard_data.digest
    page_state.tables["intervals"] = Upload("i.csv", LOG + b"C,0,3,1\n")
    with pytest.raises(CCWSIMError, match="C"):
        wells_from(state)
    assert "C" in texts(opened("data", state).run())
    page_state.tables["intervals"] = Upload("my_log.csv", b"well,from,to,facies\nA,x,3,1\n")
    with pytest.raises(CCWSIMError, match="my_log"):
        wells_from(state)


def test_wells_are_sampled_from_a_realization_and_the_field_is_kept():
    state = run(state_of())
    state.page(Editor).sampling = Sampling("vertical", n=3, every=2)
    sample(state)
    data = data_of(state.choices)
    assert data.n == 18
    assert len(wells_of(data, GRID)) == 3
    assert (state.reference.array[tuple(data.cells.T)] == data.facies).all()
    assert sampled(state.reference, Sampling("grid", every=20)).n % 12 == 0
    app = opened("data", state).run()
    assert not app.exception
    assert named(app.selectbox, "sample_way").options == [
        "vertical wells", "cells at random", "vertical wells on a grid"
    ]  # fmt: skip
