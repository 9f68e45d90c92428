"""Test hard data placed by hand: edits, undo, immediate updates, table, files, sampling."""

from __future__ import annotations

import re
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, strategies as st
from streamlit.testing.v1 import AppTest

from ccwsim import Ensemble, Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.datasets.sampling import sample_grid, sample_random, sample_wells
from ccwsim.io import training_image_as_bytes
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice, Upload
from ccwsim.ui.frontend.component import ENTRY, component_parts
from ccwsim.ui.hard_data import edits as editor_edits
from ccwsim.ui.hard_data.edits import (
    Editor,
    History,
    Moment,
    Sampling,
    answer,
    fits,
    take_data,
    take_edits,
    undo,
    with_changes,
)
from ccwsim.ui.hard_data.menus import reference_of, sample
from ccwsim.ui.hard_data.page import describe_data_status, status_of
from ccwsim.ui.hard_data.table import data_of_rows, edited_rows, painted, rows_of
from ccwsim.ui.session.resolve import data_of, study_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.run import is_current
from tests.ui.widgets import open_menus

ROOT = Path(__file__).parents[3]
GRID = Grid(48, 64, cell_size=(10.0, 20.0), origin=(500.0, -40.0))
PARAMETERS = Parameters(template_size=16, overlap_size=4)
SMALL = Choices(data=DataChoice(), grid=GRID, parameters=PARAMETERS, n_realizations=3)
TRIANGLE = ((500.0, -40.0), (1140.0, -40.0), (500.0, 920.0))  # about half of the grid
CELLS = st.tuples(st.integers(0, 9), st.integers(0, 9))


def studied(choices: Choices = SMALL) -> State:
    """Return a state with realizations of its study."""
    state = State(choices=choices)
    state.ensemble, state.ensemble_choices = run_of(choices), choices
    return state


def run_of(choices: Choices) -> Ensemble:
    study, n = study_of(choices), choices.n_realizations
    inputs = study.training_image, study.grid, study.parameters, study.hard_data
    return simulate(*inputs, n_realizations=n, secondary=study.secondary)


def edit(state: State, *changes) -> Ensemble | None:
    """Return the immediate update after an edit; None if only a run can show the edit."""
    seq = state.page(Editor).taken + 1
    take_edits(state, [{"seq": seq, "set": [list(change) for change in changes]}])
    return answer(state)


def data_as_dict(state: State) -> dict:
    data = data_of(state.choices)
    return {
        (row, column): code
        for (row, column), code in zip(data.cells.tolist(), data.facies.tolist(), strict=True)
    }


def ensemble_of(state: State) -> Ensemble:
    assert state.ensemble is not None
    return state.ensemble


@given(st.lists(st.tuples(CELLS, st.sampled_from([None, 0, 7, 250])), max_size=60))
def test_edits_one_by_one_leave_the_last_word_in_each_cell(changes):
    data, last = HardData([[3, 3]], [7]), {(3, 3): 7}
    for cell, code in changes:
        data = with_changes(data, {cell: code}, TrainingImage([[0, 7, 250]]))
        last[cell] = code
    kept = {cell: code for cell, code in last.items() if code is not None}
    cells = [tuple(cell) for cell in data.cells.tolist()]
    assert dict(zip(cells, data.facies.tolist(), strict=True)) == kept


def test_added_data_are_answered_locally_and_the_run_stays_what_it_is():
    state = studied()
    run = ensemble_of(state)
    one = edit(state, (5, 6, 1), (40, 60, 0))
    assert state.choices.data.source == "placed"
    assert data_as_dict(state) == {(5, 6): 1, (40, 60): 0}
    assert one is not None
    assert one.revised
    assert (one.realizations[:, 5, 6] == 1).all()
    two = edit(state, (20, 20, 1))
    assert two is not None
    assert two.n_mismatched.sum() == 0
    assert answer(state) is two
    assert state.ensemble is run
    assert not is_current(state)


def test_data_taken_away_or_changed_are_answered_by_a_run_only():
    placed = replace(SMALL, data=DataChoice("placed", placed=HardData([[5, 6], [9, 9]], [1, 0])))
    for change in ((5, 6, -1), (5, 6, 0)):
        state = studied(placed)
        assert edit(state, change) is None
        assert not is_current(state)
    state = studied(placed)
    assert edit(state, (1, 1, 1)) is not None
    assert edit(state, (1, 1, -1)) is state.ensemble  # undone, so the data are those of the run
    assert is_current(state)


def test_an_edit_that_comes_twice_or_late_is_taken_once():
    state = studied()
    first = {"seq": 10, "set": [[1, 1, 1]]}
    second = {"seq": 12, "set": [[1, 1, -1]]}
    take_edits(state, [first])
    take_edits(state, [first, second])
    take_edits(state, [first])
    assert data_as_dict(state) == {}
    assert len(state.page(Editor).history.past) == 2


def test_a_datum_that_is_moved_is_one_edit():
    state = studied()
    edit(state, (5, 6, 1), (9, 9, 0))
    edit(state, (5, 6, -1), (20, 30, 1))
    assert data_as_dict(state) == {(9, 9): 0, (20, 30): 1}
    edit(state, (20, 30, -1), (9, 9, 1))  # dropped on another datum, which is replaced
    assert data_as_dict(state) == {(9, 9): 1}
    undo(state)
    undo(state)
    assert data_as_dict(state) == {(5, 6): 1, (9, 9): 0}


def test_an_edit_outside_the_grid_or_of_no_facies_changes_nothing():
    state = studied()
    edit(state, (48, 0, 1), (0, 64, 1), (-1, 0, 1), (0, 0, 2))
    assert data_as_dict(state) == {}
    assert not state.page(Editor).history.past


def test_undo_brings_back_data_and_redo_the_edit():
    state = studied()
    edit(state, (5, 6, 1))
    edit(state, (20, 20, 0), (21, 20, 0))
    undo(state)
    assert data_as_dict(state) == {(5, 6): 1}
    undo(state)
    assert state.choices.data == SMALL.data
    assert answer(state) is state.ensemble
    undo(state)
    assert state.choices.data == SMALL.data
    undo(state, again=True)
    undo(state, again=True)
    assert len(data_as_dict(state)) == 3
    undo(state)
    edit(state, (1, 1, 1))
    undo(state, again=True)
    assert data_as_dict(state) == {(5, 6): 1, (1, 1): 1}


def test_undo_by_the_canvas_is_in_line_with_its_edits():
    state = studied()
    cells = {1: [1, 1, 1], 2: [2, 2, 1], 4: [3, 3, 0]}
    edits = [{"seq": seq, "set": [cell]} for seq, cell in cells.items()]
    take_edits(state, [{"seq": 3, "do": "undo"}, *edits])
    assert data_as_dict(state) == {(1, 1): 1, (3, 3): 0}


def test_realizations_of_another_grid_or_seed_answer_nothing():
    state = studied()
    for changes in ({"grid": Grid(32, 32)}, {"seed": 7}):
        state.choices = replace(SMALL, **changes)
        assert not fits(ensemble_of(state), state.choices)
        assert answer(state) is None


def test_realizations_with_other_guides_answer_nothing():
    state = studied()
    for guides in (GuideChoice(active=TRIANGLE), GuideChoice(mirrored=("x",))):
        state.choices = replace(SMALL, guides=guides)
        assert not fits(ensemble_of(state), state.choices)
        assert answer(state) is None


def test_data_in_inactive_cells_change_no_answer():
    state = studied(replace(SMALL, guides=GuideChoice(active=TRIANGLE)))
    ensemble = ensemble_of(state)
    assert ensemble.active is not None
    inside, outside = (
        (*np.argwhere(where)[3].tolist(), 1) for where in (ensemble.active, ~ensemble.active)
    )
    assert edit(state, outside) is ensemble
    after = edit(state, inside)
    assert after is not None
    assert answer(state) is after
    assert (after.n_mismatched == 0).all()
    assert (after.indices[:, ~ensemble.active] == 255).all()
    data = data_of(state.choices)
    assert data.n == 2
    assert sorted(status_of(data, after, 0)) == sorted([0, *after.data_status[0].tolist()])


def test_data_that_lie_outside_a_smaller_grid_are_not_answered_but_said():
    state = studied()
    edit(state, (40, 60, 1))
    state.change(grid=Grid(32, 32))
    app = open_menus(AppTest.from_file(str(ROOT / "pages/data.py"), default_timeout=120))
    app.session_state[KEY] = state
    app.run()
    assert not app.exception
    assert "outside the grid" in " ".join(error.value for error in app.error)
    app.button("start_empty").click().run()
    assert not app.error
    assert data_as_dict(app.session_state[KEY]) == {}


def test_history_is_bounded(monkeypatch):
    monkeypatch.setattr(editor_edits, "MAX_MOMENTS", 5)
    history = History()
    for k in range(8):
        history.remember(Moment(DataChoice(seed_sampled=k)))
    assert [moment.data.seed_sampled for moment in history.past] == [3, 4, 5, 6, 7]


@given(st.integers(0, 40), st.integers(0, 99), st.booleans())
def test_a_table_stands_for_its_data(n, seed, world):
    rng = np.random.default_rng(seed)
    grid = SMALL.grid
    cells = rng.choice(48 * 64, n, replace=False)
    data = HardData(np.column_stack(np.divmod(cells, 64)), rng.integers(0, 2, n))
    image = TrainingImage([[0, 1]])
    again, notes = data_of_rows(rows_of(data, grid, world), grid, image, world)
    assert again.digest == data.digest
    assert not notes


def test_edits_of_the_table_are_added_up_from_its_base():
    base = rows_of(HardData([[1, 1], [2, 2], [3, 3]], [0, 0, 0]), SMALL.grid, False)
    edits = {
        "edited_rows": {2: {"facies": 1, "col": 60}},
        "deleted_rows": [0],
        "added_rows": [{"row": 9, "col": 9, "facies": 1}, {"row": 4}],
    }
    frame = edited_rows(base, edits)
    data, notes = data_of_rows(frame, SMALL.grid, TrainingImage([[0, 1]]), False)
    assert data.cells.tolist() == [[2, 2], [3, 60], [9, 9]]
    assert data.facies.tolist() == [0, 1, 1]
    assert notes == ["Row 4 is not complete yet."]
    nothing = edited_rows(base, {"deleted_rows": [0, 1, 2]})
    data, notes = data_of_rows(nothing, SMALL.grid, TrainingImage([[0]]), False)
    assert (data.n, notes) == (0, [])


def test_a_row_has_the_colour_of_its_facies_as_it_is_edited():
    base = rows_of(HardData([[1, 1], [2, 2], [3, 3]], [0, 7, 9]), SMALL.grid, False)
    image, facies_colours = TrainingImage([[0, 7]]), ["#111111", "#777777"]

    def colours(edits: dict) -> list[str]:
        html = painted(base, edits, image, facies_colours).to_html()
        shared = re.findall(r"((?:#T_\w+?_row\d+_col3,?\s*)+)\{\s*background-color: (#\w+)", html)
        found = {int(k): c for names, c in shared for k in re.findall(r"row(\d+)", names)}
        return [found.get(k, "") for k in range(len(base))]

    assert colours({}) == ["#111111", "#777777", ""]
    edits = {"edited_rows": {0: {"facies": 7}, 1: {"facies": None}}, "deleted_rows": [2]}
    assert colours(edits) == ["#777777", "", ""]


def test_rows_that_cannot_be_taken_are_named():
    x = [505.0, 505.0, 0.0, 515.0, np.nan, 1e300]
    y = [-30.0, -30.0, 0.0, -30.0, 1.0, 0.0]
    frame = pd.DataFrame({"x": x, "y": y, "facies": [0.0, 1.0, 0.0, 0.5, 1.0, 0.0]})
    data, notes = data_of_rows(frame, SMALL.grid, TrainingImage([[0, 1]]), True)
    assert (data.cells.tolist(), data.facies.tolist()) == ([[0, 0]], [1])
    said = " ".join(notes)
    left_out = ("Row 5 is not complete", "Rows 3, 6 are outside", "Row 4 has no facies")
    for note in (*left_out, "Rows 2 and 1 share a cell; row 2 is used"):
        assert note in said


def test_help_is_marked_for_the_shown_realization_only_where_it_is_known():
    state = studied()
    ensemble = ensemble_of(state)
    shares = ensemble.realizations.mean(axis=0)
    row, column = np.argwhere(shares == 0)[0].tolist()
    after = edit(state, (row, column, 1))
    assert after is not None
    assert (after.data_status != 0).all()
    data = data_of(state.choices)
    assert status_of(data, after, 1) == after.data_status[1].tolist()
    assert status_of(data, after, None) == [0]
    assert status_of(HardData([[47, 63]], [1]), after, 1) == [0]
    said = describe_data_status(after.data_status[1])
    assert "re-simulation" in said or "forced" in said


def test_samples_are_of_the_shown_realization_which_becomes_the_reference():
    state = studied()
    state.shown = 2
    truth = ensemble_of(state).realizations[2]
    for how, expected in (
        (Sampling("random", n=20, seed=4), sample_random(truth, 20, 4)),
        (Sampling("N-S", n=2, every=3), sample_wells(truth, 2, 1, direction="N-S", every=3)),
        (Sampling("E-W", n=3), sample_wells(truth, 3, 1, direction="E-W", every=8)),
        (Sampling("grid", every=7), sample_grid(truth, 7)),
    ):
        state.page(Editor).sampling = how
        state.reference = None
        sample(state)
        assert not state.page(Editor).message
        assert data_of(state.choices).digest == expected.digest
        assert state.reference is not None
        assert np.array_equal(state.reference.array, truth)
    edit(state, (0, 0, 1))
    assert state.reference is not None


def test_a_reference_image_must_have_the_grid_and_its_facies():
    state = studied()
    field = np.random.default_rng(0).integers(0, 2, SMALL.grid.shape)
    upload = Upload("truth.npy", _npy(field))
    state.page(Editor).reference_choice = ImageChoice(upload=upload)
    sample(state)
    assert np.array_equal(reference_of(state).array, field)
    assert data_of(state.choices).n_mismatched(field) == 0
    n = data_of(state.choices).n
    for bad, words in ((field[:-1], "64 × 47"), (field + 5, "does not have")):
        state.page(Editor).reference_choice = ImageChoice(upload=Upload("bad.npy", _npy(bad)))
        sample(state)
        assert words in state.page(Editor).message
        assert data_of(state.choices).n == n


def _npy(array) -> bytes:
    file = BytesIO()
    np.save(file, array)
    return file.getvalue()


def opened(state: State) -> AppTest:
    app = open_menus(AppTest.from_file(str(ROOT / "pages/data.py"), default_timeout=120))
    app.session_state[KEY] = state
    app.run()
    assert not app.exception
    return app


def said(app: AppTest) -> str:
    return " ".join(element.proto.body for element in app.get("html"))


def rested(app: AppTest) -> State:
    """Return the state of the page when its run is finished."""
    while (job := app.session_state[KEY].job) is not None:
        assert job.wait(60)
        app.run()
    assert not app.exception
    return app.session_state[KEY]


def assert_of_study(state: State) -> None:
    """Check that pages, files and links use a run of the present study."""
    assert is_current(state)
    assert np.array_equal(ensemble_of(state).indices, run_of(state.choices).indices)
    assert not ensemble_of(state).revised
    assert state.runs.runs[0].ensemble is state.ensemble


def test_a_local_answer_is_marked_and_replaced_by_a_run():
    state = studied()
    edit(state, (5, 6, 1), (30, 30, 0))
    app = opened(state)
    assert "Re-simulated locally around your edits" in said(app)
    state = rested(app)
    assert "2 of 2 data honoured" in said(app)
    assert "Re-simulated locally" not in said(app)
    assert_of_study(state)
    assert state.page(Editor).local is None


def test_cleared_data_leave_nothing_behind():
    data = HardData([[k, k] for k in range(40)], [k % 2 for k in range(40)])
    app = opened(studied(replace(SMALL, data=DataChoice("placed", placed=data))))
    app.button("clear").click().run()
    state = rested(app)
    assert "no hard data" in said(app)
    assert_of_study(state)
    assert ensemble_of(state).hard_data.n == 0
    assert data.n_mismatched(ensemble_of(state).realizations[0]) > 0
    undo(state)
    app.run()
    assert_of_study(rested(app))
    assert "40 of 40 data honoured" in said(app)


@pytest.mark.slow
def test_a_file_with_collisions_waits_for_an_answer_and_can_be_undone():
    state = studied()
    app = opened(state)
    rows = b"row,col,facies\n3,4,1\n3,4,0\n3,4,1\n90,4,1\n"
    app.file_uploader(key="import_file").set_value(("wells.csv", rows, "text/csv")).run()
    assert app.session_state[KEY].data_draft is not None
    assert "outside the grid" in " ".join(warning.value for warning in app.warning)
    app.selectbox("ask_on_outside").select_index(1).run()
    assert "more than one facies: 1" in " ".join(warning.value for warning in app.warning)
    app.selectbox("ask_on_collision").select_index(1).run()
    state = app.session_state[KEY]
    assert not app.error
    assert state.data_draft is None
    assert data_as_dict(state) == {(3, 4): 1}
    rested(app)
    assert "1 of 1 data honoured" in said(app)
    edit(state, (4, 4, 1))
    assert state.choices.data.source == "placed"
    undo(state)
    assert state.choices.data.source == "file"
    undo(state)
    assert data_as_dict(state) == {}


def test_placed_data_are_the_studys_on_simulate_too():
    state = studied()
    take_data(state, HardData([[7, 8]], [1]))
    app = open_menus(AppTest.from_file(str(ROOT / "pages/simulate.py"), default_timeout=120))
    app.session_state[KEY] = state
    app.run()
    assert not app.exception
    assert "placed by hand" in said(app)
    assert "1 data" in said(app) or "1 datum" in said(app)


@pytest.mark.parametrize("name", ["map", "editor", "volume"])
def test_a_component_has_one_entry_whatever_it_builds_on(name):
    _, css, js = component_parts(name)
    assert js.count(ENTRY) == 1
    assert js.count("function drawData(") == 1
    assert css.count(".legend {") == 1


def test_training_image_bytes_can_be_sampled_as_a_reference():
    state = studied(replace(SMALL, grid=Grid(40, 50)))
    image = TrainingImage(np.tile([[0, 1], [1, 0]], (20, 25)))
    upload = Upload("truth.sgems", training_image_as_bytes(image, "sgems"))
    state.page(Editor).reference_choice = ImageChoice(upload=upload)
    sample(state)
    assert not state.page(Editor).message
    assert data_of(state.choices).n_mismatched(image.array) == 0


def test_the_table_names_the_wells_and_keeps_its_edits():
    wells = (("A-1", ((1, 1),)), ("B", ((3, 3),)))
    base = rows_of(HardData([[1, 1], [2, 2], [3, 3]], [0, 0, 0]), SMALL.grid, False, wells)
    assert base["well"].tolist() == ["A-1", "", "B"]
    frame = edited_rows(base, {"edited_rows": {"2": {"facies": 1}}, "added_rows": [{"row": 4}]})
    assert frame.columns.tolist() == ["row", "col", "facies"]
    assert frame["facies"].tolist()[:3] == [0, 0, 1]
    html = painted(base, {}, TrainingImage([[0]]), ["#112233"]).to_html()
    assert html.count("A-1") == 1
