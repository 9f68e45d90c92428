"""Test the import of wells on one page: columns, names, thresholds and rows with problems."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, HardData
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.ui.session.resolve import data_of
from ccwsim.ui.session.state import KEY, State
from tests.io import sample_files as sample
from tests.ui.widgets import html, named, opened, texts

NAMED = replace(Choices(), image=ImageChoice(names=("clay", "Sand")), data=DataChoice())


def launched(content: bytes | str, choices: Choices = NAMED, name: str = "wells.csv") -> AppTest:
    """Return the page Import with a file of wells."""
    app = opened("import", State(choices=choices)).run()
    app.button_group(key="import_subject").set_value("data").run()
    content = content if isinstance(content, bytes) else content.encode()
    app.file_uploader(key="wells_file").upload(name, content, "text/plain").run()
    assert not app.exception
    return app


def state_of(app: AppTest) -> State:
    return app.session_state[KEY]


def captions(app: AppTest) -> str:
    return " ".join(element.value for element in app.caption)


def keys(app: AppTest) -> set[str]:
    kinds = (app.selectbox, app.number_input, app.button)
    return {(widget.key or "").rstrip() for kind in kinds for widget in kind}


@pytest.mark.slow
def test_a_german_spreadsheet_in_utm_needs_two_answers():
    app = launched(sample.in_utm())
    assert not app.error
    assert "outside the grid" not in texts(app)
    assert state_of(app).data_draft is not None
    assert [named(app.selectbox, f"ask_column_{role}").value for role in ("x", "y", "facies")] == [
        "Rechtswert", "Hochwert", "Fazies",
    ]  # fmt: skip
    frame = app.dataframe[-1].value
    assert list(frame.columns)[1:3] == ["Rechtswert → x", "Hochwert → y"]
    assert frame.iloc[0].tolist()[1] == "436120.5"
    assert named(app.selectbox, "ask_name_1").value is None  # Ton
    assert named(app.selectbox, "ask_name_0").value == 1  # Sand
    before = state_of(app).fitted
    assert before is not None
    assert state_of(app).choices.grid == before[1]
    assert "does not fit yet: 1 of 3 data of facies that the image does not have" in texts(app)
    assert "outside" not in texts(app)
    assert "facies_names" not in texts(app)
    named(app.selectbox, "ask_name_1").set_value(0).run()
    state = state_of(app)
    assert not app.exception
    assert state.data_draft is None
    assert sorted(data_of(state.choices).facies.tolist()) == [0, 1, 1]
    assert hash(state.choices.data.answers)
    assert "ask_on_outside" not in keys(app)
    assert "3 data of wells.csv are in the study" in " ".join(e.value for e in app.success)


def test_forty_wells_five_kilometres_wide_are_one_click_away():
    rng = np.random.default_rng(2)
    places = rng.uniform((436000, 4505000), (441000, 4509000), (40, 2)).round(1)
    rows = "".join(f"W{k},{x},{y},{k % 2}\n" for k, (x, y) in enumerate(places.tolist()))
    app = launched("Well,Easting,Northing,facies\n" + rows)
    state = state_of(app)
    assert state.data_draft is None
    assert data_of(state.choices).n == 40
    assert state.fitted == ("The grid follows wells.csv.", state.choices.grid, Grid(512, 512))


def test_what_fits_is_taken_without_a_question():
    app = launched("x,y,facies\n10,20,1\n30,40,0\n")
    state = state_of(app)
    assert state.data_draft is None
    assert data_of(state.choices).n == 2
    assert {"wells_simulate", "wells_drop"} & keys(app) == {"wells_simulate"}
    assert {key for key in keys(app) if key.startswith("ask_")} == {
        "ask_column_x", "ask_column_y", "ask_column_facies", "ask_column_well",
    }  # fmt: skip


def test_columns_that_cannot_be_guessed_are_asked():
    app = launched("a,b,gamma,sonic\n10,20,1,0\n30,40,0,0\n")
    assert not app.error
    assert "pick one" in texts(app)
    assert named(app.selectbox, "ask_column_facies").value is None
    named(app.selectbox, "ask_column_facies").set_value("gamma").run()
    assert data_of(state_of(app).choices).triples == ((20, 10, 1), (40, 30, 0))
    named(app.selectbox, "ask_column_x").set_value("b").run()
    answers = dict(state_of(app).choices.data.answers)
    assert (answers["x"], answers["y"]) == ("b", "a")
    assert data_of(state_of(app).choices).triples == ((10, 20, 1), (30, 40, 0))
    named(app.selectbox, "ask_coordinates").set_value(1).run()
    assert dict(state_of(app).choices.data.answers)["coordinates"] == "cells"


def test_a_continuous_log_asks_for_a_threshold_and_nothing_else_does():
    app = launched("x,y,porosity\n10,20,0.1\n30,40,0.3\n50,60,0.2\n")
    assert "ask_threshold" in keys(app)
    named(app.button, "ask_median").click().run()
    assert data_of(state_of(app).choices).facies.tolist() == [0, 1, 1]
    named(app.number_input, "ask_threshold").set_value(0.25).run()
    assert data_of(state_of(app).choices).facies.tolist() == [0, 1, 0]
    assert "ask_median" not in keys(app)


def test_rows_that_do_not_fit_are_listed_with_a_choice():
    rows = "x,y,facies\n10,20,1\n10,20,0\n900,20,1\n30,40,7\n"
    app = launched(rows)
    lists = [frame.value for frame in app.dataframe[:-1]]
    assert [frame.iloc[:, 0].tolist() for frame in lists] == [[4], [2, 3], [5]]
    assert lists[2]["facies"].tolist() == ["7"]
    named(app.selectbox, "ask_on_outside").set_value(1).run()
    named(app.selectbox, "ask_name_0").set_value(1).run()
    named(app.selectbox, "ask_on_collision").set_value(1).run()
    state = state_of(app)
    assert state.data_draft is None
    assert data_of(state.choices).triples == ((20, 10, 1), (40, 30, 1))
    assert "ask_on_unknown" not in keys(app)


def test_a_grid_with_gaps_brings_its_own_grid():
    grid = np.full((60, 80), -999)
    grid[3, 4] = 1
    app = launched(sample.sgems(grid, b"80 60 1 5.0 5.0 1.0 100 200 0"), name="hd.sgems")
    assert "80 × 60 cells of 5 × 5 from (100, 200)" in html(app)
    assert state_of(app).data_draft is None
    assert state_of(app).choices.grid == Grid(60, 80, (5, 5), (100, 200))


def test_a_file_that_is_no_data_changes_nothing_and_can_be_left():
    before = replace(NAMED, data=DataChoice("placed", placed=HardData([[3, 4]], [1])))
    app = launched(b"%PDF-1.7\x00\x01", before)
    assert "is a PDF file" in " ".join(e.value for e in app.error)
    assert state_of(app).choices == before
    named(app.button, "wells_drop").click().run()
    assert state_of(app).data_draft is None
    assert not app.error


@pytest.mark.slow
@pytest.mark.parametrize("page", ["simulate", "data"])
def test_the_menus_ask_the_same_in_short(page):
    draft = DataChoice("file", upload=Upload("wells.csv", sample.in_utm()))
    app = opened(page, State(choices=NAMED, data_draft=draft)).run()
    assert not app.exception
    assert not app.error
    assert {"ask_fit", "ask_on_outside"} <= keys(app)
    assert "ask_column_x" not in keys(app)
    named(app.button, "ask_fit").click().run()
    named(app.selectbox, "ask_name_0").set_value(0).run()
    assert state_of(app).data_draft is None
    assert data_of(state_of(app).choices).n == 3


def test_data_that_wait_are_what_the_page_opens_with():
    draft = DataChoice("file", upload=Upload("wells.csv", sample.in_utm()))
    app = opened("import", State(choices=NAMED, data_draft=draft)).run()
    assert "ask_fit" in keys(app)


def test_a_file_is_given_in_the_study_whatever_the_source():
    app = opened("simulate", State(choices=NAMED)).run()
    assert "a file of yours" not in app.selectbox(key="data_source").options
    app.file_uploader(key="data_file").upload("w.csv", b"x,y,facies\n10,20,1\n", "text/csv").run()
    assert data_of(state_of(app).choices).triples == ((20, 10, 1),)
    named(app.selectbox, "data_source").set_value("none").run()
    assert data_of(state_of(app).choices).n == 0
    named(app.selectbox, "data_source").set_value("file").run()
    assert data_of(state_of(app).choices).n == 1
