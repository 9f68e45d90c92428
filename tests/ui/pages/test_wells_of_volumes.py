"""Test the import of hard data for a volume: columns of points and of tables of wells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, Parameters
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload, WellTables
from ccwsim.sharing.link import own_choices
from ccwsim.ui.session.kept import bytes_of_choice
from ccwsim.ui.session.resolve import data_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.questions import (
    EITHER_ROLES,
    ROLES,
    ROLES_OF_VOLUME,
    ROLES_OF_WELLS,
    with_column,
)
from tests.io import sample_files as sample
from tests.ui.widgets import html, named, opened, texts

pytestmark = pytest.mark.slow
"""The tests are slow; `test_volume_study` tests a volume on the main pages in the quick tests."""

GRID = Grid(30, 40, nz=12)
P = Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1))
IMAGE = ImageChoice("sinuous_channels", names=("clay", "Sand"))
VOLUME = Choices(IMAGE, DataChoice(), GRID, P, n_realizations=1)
COLLARS = "p;q;r;s;t\nA;10,5;2,5;12;40\nB;20,5;9,5;12;40\n"
LOG = "p,q,r,s\nA,0,3,sand\nA,3,12,clay\nB,0,12,Sand\n"
SURVEYS = "p,q,r,s\nB,0,90,-80\n"
NAMED = {
    "collar_well": "p", "x": "q", "y": "r", "z": "s", "well": "p", "depth_from": "q",
    "depth_to": "r", "facies": "s", "survey_well": "p", "survey_depth": "q",
    "survey_azimuth": "r", "survey_dip": "s",
}  # fmt: skip
POINTS = "p,q,r,s\n10.5,2.5,0.5,sand\n10.5,2.5,1.5,clay\n"


def launched(*, tables: bool = False, choices: Choices = VOLUME) -> AppTest:
    """Return the page Import for hard data of a volume."""
    app = opened("import", State(choices=choices)).run()
    app.button_group(key="import_subject").set_value("data").run()
    if tables:
        named(app.button_group, "import_tables").set_value(True).run()
    assert not app.exception
    return app


def bring(app: AppTest, name: str, content: str | bytes) -> AppTest:
    content = content if isinstance(content, bytes) else content.encode()
    key = "wells_file" if name == "file" else f"wells_{name}"
    app.file_uploader(key=key).upload(f"{name}.csv", content, "text/csv").run()
    assert not app.exception
    return app


def choose(app: AppTest, **columns: str) -> None:
    for role, column in columns.items():
        named(app.selectbox, f"ask_column_{role}").set_value(column).run()
        assert not app.exception


def state_of(app: AppTest) -> State:
    return app.session_state[KEY]


def listed(app: AppTest) -> str:
    """Return all rows that are listed with a problem."""
    frames = [frame.value for frame in app.dataframe if "problem" in frame.value]
    return "; ".join(f"{r['rows']}: {r['problem']}" for f in frames for _, r in f.iterrows())


def value(app: AppTest, role: str) -> str | None:
    return named(app.selectbox, f"ask_column_{role}").value


def test_points_of_a_volume_ask_for_z_and_facies():
    app = bring(launched(), "file", POINTS)
    assert state_of(app).data_draft is not None
    assert "no column of heights" in texts(app)
    assert "(z=)" not in texts(app)
    assert [value(app, role) for role in ("x", "y", "z")] == ["p", "q", None]
    choose(app, z="r")
    assert data_of(state_of(app).choices).triples == ((0, 2, 10, 1), (1, 2, 10, 0))
    assert value(app, "well") == value(app, "depth") == ""
    assert "Positions of the data" in html(app)
    choose(app, x="q")
    assert dict(state_of(app).choices.data.answers)["y"] == "p"


def test_a_depth_that_was_guessed_can_be_left_out():
    text = "well,x,y,z,depth,facies\nA,10.5,2.5,9.5,3,1\n"
    app = bring(launched(), "file", text)
    assert data_of(state_of(app).choices).triples == ((6, 2, 10, 1),)
    captions = " ".join(c.value for c in app.caption)
    assert "z is the height of the collar. Depths below it: depth." in captions
    heads = list(app.dataframe[0].value.columns)
    assert {"well → well", "z → z", "depth → depth"} <= {*heads}
    choose(app, depth="")
    assert data_of(state_of(app).choices).triples == ((9, 2, 10, 1),)
    choose(app, depth_from="z", depth_to="depth", z="x")
    answers = dict(state_of(app).data_draft.answers)
    assert "depth" not in answers
    assert (answers["depth_from"], answers["depth_to"], answers["z"]) == ("z", "depth", "x")
    assert answers.get("x") is None  # the column is now used as z


def test_layers_rows_and_columns_of_cells():
    app = bring(launched(), "file", "a,b,c,facies\n2,10,1,1\n")
    choose(app, z="c")
    named(app.selectbox, "ask_coordinates").set_value(1).run()
    assert not app.exception
    assert dict(state_of(app).choices.data.answers)["coordinates"] == "cells"
    assert data_of(state_of(app).choices).triples == ((1, 10, 2, 1),)


def test_wells_in_tables_need_a_volume():
    app = launched(choices=replace(Choices(), data=DataChoice()))
    assert not [group for group in app.button_group if (group.key or "") == "import_tables"]
    tables = WellTables(Upload("c.csv", COLLARS.encode()))
    draft = DataChoice("file", upload=Upload("i.csv", LOG.encode()), tables=tables)
    app = opened("import", State(choices=Choices(), data_draft=draft)).run()
    assert not app.exception
    assert "need a volume, but the study is a map" in texts(app)


def test_every_column_of_every_table_can_be_chosen():
    app = launched(tables=True)
    for name, content in (("collars", COLLARS), ("intervals", LOG), ("surveys", SURVEYS)):
        bring(app, name, content)
    assert state_of(app).data_draft is not None
    assert not app.error
    choose(app, **NAMED)
    state = state_of(app)
    assert state.data_draft is None
    assert state.choices.data.answers == tuple(
        sorted((role, own) for role, own in NAMED.items() if role != "facies")
    )  # the remaining column has the facies
    assert value(app, "facies") == "s"
    data = data_of(state.choices)
    assert data.n > 24
    assert {cell[1:] for cell in map(tuple, data.cells.tolist())} >= {(2, 10), (9, 20), (9, 21)}
    assert [len(frame.value) for frame in app.dataframe[:3]] == [2, 3, 1]
    assert "p → well" in app.dataframe[2].value.columns
    choose(app, survey_inclination="s")  # an inclination of −80 is impossible
    assert "line 2: s -80 is not from 0 to 180" in listed(app)
    assert "survey_dip" not in dict(state_of(app).data_draft.answers)
    choose(app, survey_dip="s")
    assert state_of(app).data_draft is None


def test_names_troubles_and_the_grid_are_asked_as_of_maps():
    app = launched(tables=True)
    collars = "well,x,y,z\nA,10.5,2.5,12\nB,10.6,2.6,12\nC,80.5,2.5,12\n"
    log = "well,from,to,facies\nA,0,3,sand\nB,0,3,clay\nC,0,3,Ton\nA,3,6,Ton\n"
    bring(bring(app, "collars", collars), "intervals", log)
    said = texts(app)
    assert "3 of 12 data outside the grid" in said
    assert "3 of 12 data of facies that the image does not have" in said
    assert "cells with more than one facies: 3" in said
    lists = [frame.value.iloc[:, 0].tolist() for frame in app.dataframe[:3]]
    assert lists == [[4, 4, 4], [2, 3, 2, 3, 2, 3], [5, 5, 5]]
    ton = next(box for box in app.selectbox if box.label == "Ton is")
    ton.set_value(0).run()
    named(app.selectbox, "ask_on_collision").set_value(2).run()
    named(app.button, "ask_fit").click().run()
    state = state_of(app)
    assert state.data_draft is None
    data = data_of(state.choices)
    assert len({*map(tuple, data.cells[:, 1:].tolist())}) == 2
    assert sorted(data.facies.tolist()).count(0) >= 3


def test_problems_of_tables_of_wells_are_listed_together_each_with_a_choice():
    app = launched(tables=True)
    bring(app, "collars", "well,x,y,z,td\nA,10.5,2.5,12,12\nB,20.5,9.5,12,\n")
    log = "well,from,to,facies\nA,0,4,sand\nA,3,,clay\nB,0,2,sand\nB,2,3,\nC,0,1,clay\nB,9,6,clay\n"
    bring(app, "intervals", log)
    said = texts(app)
    assert "pairs of intervals that overlap: 1" in said
    assert "wells without a collar: 1" in said
    assert "rows that cannot be used: 1" in said
    assert "only one depth" not in said  # the other depth is that of the neighbouring row
    assert "intervals.csv, lines 2 and 3: two intervals of 'A' overlap below the dep" in listed(app)
    assert "intervals.csv, line 5: an interval of 'B' has no facies" in listed(app)
    assert data_of(state_of(app).choices).n == 0
    named(app.selectbox, "ask_on_overlap").set_value(2).run()
    assert "overlap" not in texts(app)
    named(app.selectbox, "ask_on_no_collar").set_value(1).run()
    named(app.selectbox, "ask_on_bad_row").set_value(1).run()
    state = state_of(app)
    assert not app.exception
    assert state.data_draft is None
    assert data_of(state.choices).n == 12 + 2
    assert named(app.selectbox, "ask_on_overlap").value == 2
    named(app.selectbox, "ask_on_no_facies").set_value(1).run()
    assert data_of(state_of(app).choices).n == 12 + 3
    named(app.selectbox, "ask_on_one_depth").set_value(1).run()
    assert data_of(state_of(app).choices).n == 4 + 3


def test_a_porosity_log_asks_for_a_threshold():
    app = launched(tables=True)
    bring(app, "collars", "well,x,y,z\nA,10.5,2.5,12\n")
    bring(app, "intervals", "well,from,to,porosity\nA,0,3,0.1\nA,3,12,0.3\n")
    named(app.button, "ask_median").click().run()
    assert sorted(data_of(state_of(app).choices).facies.tolist()) == [0] * 3 + [1] * 9


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("collars", b"%PDF-1.7\x00\x01", "is a PDF file"),
        ("collars", sample.npy(np.zeros((3, 4))), "is not a table"),
        ("collars", "well,x,y,z\nA,1,b,12\n", "line 2: 'b'"),
        ("collars", "well,x,y,z\nA,1,2,12\nA,1,2,12\n", "lines 2 and 3: the well 'A' has two coll"),
        ("intervals", "well,from,to,facies\nA,5,3,1\n", "line 2: the upper depth 5 is below"),
        ("intervals", "well,from,facies\nA,5,1\n", "line 2: the lower depth is missing"),
        ("intervals", "well,from,to\nA,5,6\n", "no column that looks like facies"),
        ("surveys", "well,depth,azimuth\nA,5,3\n", "no column of the tilt of wells"),
        ("surveys", "well,depth,azimuth,dip\nZ,5,3,-80\n", "no collar of the well 'Z'"),
    ],
)
def test_what_is_wrong_with_a_table_is_said_and_changes_nothing(name, content, said):
    tables = {
        "collars": "well,x,y,z\nA,10.5,2.5,12\n",
        "intervals": "well,from,to,facies\nA,0,3,1\n",
    }
    app = launched(tables=True)
    for other in (*tables, "surveys"):
        if other == name or other in tables:
            bring(app, other, content if other == name else tables[other])
    assert said in f"{texts(app)} {listed(app)}"
    before = state_of(app).choices.data
    assert data_of(state_of(app).choices).n == (3 if name == "surveys" else 0)
    named(app.button, "wells_drop").click().run()
    assert state_of(app).data_draft is None
    assert state_of(app).choices.data == before


def test_another_table_forgets_the_columns_of_the_one_before():
    app = launched(tables=True)
    for name, content in (("collars", COLLARS), ("intervals", LOG), ("surveys", SURVEYS)):
        bring(app, name, content)
    choose(app, **NAMED)
    bring(app, "intervals", "Hole,Top,Base,Litho\nA,0,3,1\n")
    answers = dict(state_of(app).choices.data.answers)
    assert {"well", "facies", "depth_from"}.isdisjoint(answers)
    assert answers["collar_well"] == "p"
    assert data_of(state_of(app).choices).n == 3


def test_tables_are_asked_in_short_on_other_pages_and_kept_for_a_reload():
    tables = WellTables(Upload("c.csv", COLLARS.encode()))
    draft = DataChoice("file", upload=Upload("i.csv", LOG.encode()), tables=tables)
    app = opened("simulate", State(choices=VOLUME, data_draft=draft)).run()
    assert not app.exception
    assert not app.error
    lost = ("facies", *(role for role in NAMED if role.startswith("survey")))
    columns = {role: name for role, name in NAMED.items() if role not in lost}
    for role in ("well", "depth_from", "depth_to"):
        assert value(app, role) in (None, "")
    choose(app, **columns)
    state = state_of(app)
    assert state.data_draft is None
    assert data_of(state.choices).n == 24
    assert "24 data" in html(app)
    (kept,) = own_choices(state.choices).values()
    assert kept == state.choices.data
    assert bytes_of_choice(kept) >= len(COLLARS) + len(LOG)
    surveyed = replace(tables, surveys=Upload("s.csv", SURVEYS.encode()))
    other = replace(state.choices, data=replace(state.choices.data, tables=surveyed))
    assert own_choices(other).keys() != own_choices(state.choices).keys()


def test_a_grid_with_gaps_of_a_volume_asks_for_its_ends_and_no_slice():
    values = np.full(GRID.shape, np.nan)
    values[0, 2, 10] = 1
    app = launched()
    app.file_uploader(key="wells_file").upload("hd.npy", sample.npy(values), "x/y").run()
    assert not app.exception
    assert data_of(state_of(app).choices).triples == ((0, 2, 10, 1),)
    assert not [box for box in app.selectbox if (box.key or "").startswith("ask_slice")]
    named(app.selectbox, "ask_z_up").set_value(2).run()
    assert data_of(state_of(app).choices).triples == ((11, 2, 10, 1),)


@pytest.mark.parametrize("roles", [ROLES, ROLES_OF_VOLUME, *ROLES_OF_WELLS.values()])
@given(data=st.data())
def test_whatever_is_chosen_a_column_has_one_role(roles, data):
    taken: dict[str, str | None] = dict.fromkeys(roles)
    for _ in range(data.draw(st.integers(1, 8))):
        role = data.draw(st.sampled_from(list(roles)))
        column = data.draw(st.sampled_from(["a", "b", "c", "d", "e", ""]))
        taken = with_column(taken, role, column)
        assert taken.keys() == {*roles}
        assert taken[role] == column
        used = [own for own in taken.values() if own]
        assert len({*used}) == len(used)
        for ones, others in EITHER_ROLES:
            assert not (any(taken.get(x) for x in ones) and any(taken.get(x) for x in others))
