"""Test that all formats of hard data are read alike, and that every problem can be settled."""

from __future__ import annotations

import json
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

import ccwsim.io as cio
from ccwsim import CCWSIMError, Grid, HardData, TrainingImage
from tests.io import sample_files as sample
from tests.io.sample_files import FACIES, POINTS

SAMPLES = sample.hard_data()
GRID = Grid(3, 4)
EXPECTED = HardData(POINTS[:, :2], POINTS[:, 2])

# lines:      2         3          4          5          6
CROWDED = b"x,y,facies\n0.5,0.5,0\n0.9,0.5,1\n0.6,0.4,1\n9.5,0.5,1\n2.5,2.5,7\n"


def load(content: bytes, grid: Grid | None = GRID, ti=None, **choices) -> cio.HardDataImport:
    return cio.import_hard_data(BytesIO(content), grid, ti, **choices)


@pytest.mark.parametrize("name", SAMPLES)
def test_every_format_reads_alike(name):
    assert load(SAMPLES[name]).hard_data.digest == EXPECTED.digest
    assert cio.read_hard_data(BytesIO(SAMPLES[name]), GRID).digest == EXPECTED.digest


@pytest.mark.parametrize("name", [n for n in SAMPLES if "np" not in n and "mat" not in n])
def test_texts_with_crlf_read_alike(name):
    assert load(sample.crlf(SAMPLES[name])).hard_data.digest == EXPECTED.digest


@pytest.mark.parametrize(
    "header", ["ROW,Col,Facies", "row,column,code", "j,i,value", "Row,COLUMNS,Class", "iy,ix,v"]
)
def test_synonyms_of_row_and_column(header):
    assert load(sample.csv(header)).hard_data.digest == EXPECTED.digest


def test_unclear_columns_are_taken_as_world_or_as_asked_and_noted():
    content = sample.csv("a,b,facies")
    as_cells = load(content, coordinates="cells")
    assert as_cells.hard_data.digest == EXPECTED.digest
    assert "a and b are read as row and col" in as_cells.notes[0]
    as_world = load(content, None)
    assert as_world.hard_data.digest == HardData(POINTS[:, 1::-1], POINTS[:, 2]).digest
    assert "a and b are read as x and y" in as_world.notes[0]
    with pytest.raises(CCWSIMError, match="must be"):
        load(content, coordinates="polar")


def test_other_columns_and_blank_lines_and_comments():
    text = b"# made by hand\nx,y,quality,facies,remark\n\n0.5,0.5,0.3,1,good\n1.5,0.5,,0,bad\n"
    points = cio.read_points(BytesIO(text))
    assert points.values.tolist() == [1, 0]
    assert points.lines.tolist() == [4, 5]
    with pytest.raises(CCWSIMError, match="not a facies code; for continuous values"):
        load(text, facies="quality")
    assert load(text, facies="quality", threshold=0.2).hard_data.facies.tolist() == [1]


def test_several_unknown_columns_ask_which():
    with pytest.raises(CCWSIMError, match="2 variables: 'gamma', 'sonic'; pick one"):
        load(b"x,y,gamma,sonic\n0.5,0.5,1,2\n")


@given(
    arrays(np.float64, st.tuples(st.integers(1, 30), st.just(2)), elements=st.floats(0, 0.999)),
    st.floats(0.1, 1000),
    st.floats(-1e6, 1e6),
)
def test_world_points_fall_in_their_cells(fractions, size, shift):
    grid = Grid(7, 5, cell_size=(size, 2 * size), origin=(shift, -shift))
    x = shift + fractions[:, 0] * 5 * size
    y = -shift + fractions[:, 1] * 14 * size
    rows = "\n".join(f"{float(a)!r},{float(b)!r},1" for a, b in zip(x, y, strict=True))
    imported = load(b"x,y,facies\n" + rows.encode(), grid, on_outside="drop")
    expected = grid.cells_of(x, y)
    expected = expected[grid.holds(expected)]
    assert imported.hard_data.cells.tolist() == np.unique(expected, axis=0).tolist()
    assert imported.n_read == len(x)


def test_off_centre_points_are_counted():
    imported = load(b"x,y,facies\n0.5,0.5,1\n1.5,0.7,1\n3,2,0\n")
    assert imported.n_off_centre == 2
    assert "2 of 3 data were not at the centre" in imported.notes[-1]
    assert imported.hard_data.cells.tolist() == [[0, 0], [0, 1], [2, 3]]


def test_a_collision_names_cell_lines_and_facies():
    inside = CROWDED.rsplit(b"\n", 3)[0]
    with pytest.raises(CCWSIMError) as caught:
        load(inside)
    assert "row 0, column 0 (line 2: 0, line 3: 1, line 4: 1)" in str(caught.value)


def test_an_outsider_is_named():
    with pytest.raises(CCWSIMError, match="line 5: 1 of 5 data lie outside the grid"):
        load(CROWDED)


def test_an_unknown_facies_is_named():
    ti = TrainingImage(FACIES)
    with pytest.raises(CCWSIMError, match="line 6: the training image has no facies 7"):
        load(CROWDED, ti=ti, on_outside="drop")


@pytest.mark.parametrize(
    ("choice", "cells", "facies", "n_dropped"),
    [
        ("drop", [], [], 5),
        ("majority", [[0, 0]], [1], 3),
        ("nearest", [[0, 0]], [0], 4),
    ],
)
def test_choices_settle_all_troubles(choice, cells, facies, n_dropped):
    imported = load(
        CROWDED, ti=TrainingImage(FACIES), on_outside="drop", on_unknown="drop", on_collision=choice
    )
    assert imported.hard_data.cells.tolist() == cells
    assert imported.hard_data.facies.tolist() == facies
    assert imported.n_dropped == n_dropped
    assert (imported.n_outside, imported.n_unknown, imported.n_collisions) == (1, 1, 1)
    assert "line 5" in " ".join(imported.notes)
    assert "line 6" in " ".join(imported.notes)


def test_a_tie_goes_to_the_first_in_the_file_and_is_noted():
    content = b"row,col,facies\n1,1,2\n1,1,0\n"
    for choice in ("majority", "nearest"):
        imported = load(content, on_collision=choice)
        assert imported.hard_data.facies.tolist() == [2]
        assert "depends only on the order of data in the file: 1" in " ".join(imported.notes)


def test_unknown_choices_say_what_there_is():
    for name in ("on_collision", "on_outside", "on_unknown"):
        with pytest.raises(CCWSIMError, match=f"{name} = 'guess' must be one of error, drop"):
            load(CROWDED, **{name: "guess"})


@given(st.lists(st.tuples(st.integers(-1, 3), st.integers(-1, 4), st.integers(0, 3)), max_size=30))
def test_settling_agrees_with_brute_force(rows):
    content = "row,col,facies\n" + "".join(f"{r},{c},{f}\n" for r, c, f in rows)
    if not rows:
        return
    ti = TrainingImage(FACIES)
    inside = [(r, c, f) for r, c, f in rows if 0 <= r < 3 and 0 <= c < 4 and f in (0, 1, 2)]
    for choice in ("drop", "majority"):
        expected = {}
        for cell in {(r, c) for r, c, _ in inside}:
            codes = [f for r, c, f in inside if (r, c) == cell]
            if len(set(codes)) == 1 or choice == "majority":
                most = max(map(codes.count, codes))
                expected[cell] = next(f for f in codes if codes.count(f) == most)
        imported = load(
            content.encode(), ti=ti, on_outside="drop", on_unknown="drop", on_collision=choice
        )
        found = zip(imported.hard_data.cells.tolist(), imported.hard_data.facies, strict=True)
        assert {tuple(cell): code for cell, code in found} == expected
        assert imported.hard_data.n + imported.n_repeated + imported.n_dropped == len(rows)


def test_placed_points_show_every_trouble():
    points = cio.read_points(BytesIO(CROWDED))
    placed = cio.place_points(points, GRID, TrainingImage(FACIES))
    assert points.lines[placed.outside].tolist() == [5]
    assert points.lines[placed.unknown].tolist() == [6]
    assert [points.lines[c].tolist() for c in placed.collisions] == [[2, 3, 4]]
    assert np.count_nonzero(placed.offsets > 1e-6) == 2
    assert points.world


@pytest.mark.parametrize("missing", ["", "NaN", "NA", "-999", "-99", "-997799", "-9977799"])
def test_rows_without_a_value_are_left_out_and_counted(missing):
    imported = load(f"x,y,facies\n0.5,0.5,{missing}\n1.5,0.5,2\n".encode())
    assert imported.hard_data.n == 1
    assert imported.n_missing == 1
    assert "Rows without a value, left out: 1." in imported.notes


def test_a_grid_must_be_the_simulation_grid():
    with pytest.raises(CCWSIMError, match="of 4 × 3 cells, but the simulation grid has 6 × 5"):
        load(SAMPLES["grid"], Grid(5, 6))
    assert load(SAMPLES["grid"], None).hard_data.digest == EXPECTED.digest


def test_up_turns_a_grid():
    turned = load(SAMPLES["npy grid"], up=False).hard_data
    assert sorted(turned.cells.tolist()) == sorted([2 - r, c] for r, c, _ in POINTS.tolist())


def test_three_columns_are_a_list_unless_they_are_the_grid():
    square = np.array([[0, 1, 2], [1, 1, 0]])
    assert load(sample.npy(square), Grid(2, 3)).hard_data.n == 6
    assert load(sample.npy(square), Grid(5, 5)).hard_data.n == 2


def test_continuous_data_need_the_edges_of_the_training_image():
    content = b"x,y,v\n0.5,0.5,0.2\n1.5,0.5,0.8\n"
    with pytest.raises(CCWSIMError, match=r"line 2|lines 2 and 3"):
        load(content)
    with pytest.raises(CCWSIMError, match="give the class edges"):
        load(content, classes=2)
    assert load(content, classes=[0.5]).hard_data.facies.tolist() == [0, 1]


def test_rows_without_coordinates_are_left_out_and_named():
    imported = load(b"x,y,facies\n1,,0\n1,2,0\n")
    assert imported.hard_data.n == 1
    assert "Rows without coordinates, left out: 1 (line 2)." in imported.notes


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"x,y,facies\n1,2,0\n1,sand,0\n3,4,1\n", r"line 3: 'sand' is not a number"),
        (
            b"x,y,facies\n1,2,0\n1,3,sand\n3,2,1\n",
            r"line 3: .* no facies 'sand'; give codes, as",
        ),
        (b"x,y,facies\n1,2,0\n1,2\n", "line 3: 2 fields, but 3 are needed"),
        (b"x,y,facies\n1,2,sand\n1,2,clay\n", "no facies 'clay', 'sand'; give codes, as"),
        (b"x,y,facies\n", "contains no numbers"),
        (b"row,col,facies\n1.5,2,0\n", "line 2: rows and columns must be whole numbers"),
        (b"row,col,facies\n1e300,2,0\n", "line 2: rows and columns must be"),
        (b"x,y,facies\n1e300,2,0\n", "line 2: the coordinates are too far"),
        (b"x,facies\n1,2\n", "needs columns x, y, facies or row, col, facies"),
        (sample.geo_eas_points(b"9"), "states 9 points in line 1, but 4 follow"),
        (sample.geo_eas_points() + b"1 2 3\n", "19 values do not fill rows of 4 columns"),
        (sample.geo_eas_points() + b"1 2 3\n4\n", "line 11: 4 numbers are needed in every line"),
        (sample.picture(), "is a picture; hard data must be a table or a grid"),
    ],
)
def test_broken_tables_say_where(content, message):
    with pytest.raises(CCWSIMError, match=message):
        load(content)


def test_points_are_read_only():
    points = cio.read_points(BytesIO(SAMPLES["row col"]))
    with pytest.raises(ValueError, match="read-only"):
        points.places[0, 0] = 1


TWO = TrainingImage([[0, 1]], facies_names=("mud", "sand"))
THREE = TrainingImage([[0, 1, 2]], facies_names=("mud", "silt", "sand"))


@pytest.mark.parametrize("words", ["TRUE FALSE", "wahr falsch", "yes no", "1 0"])
@pytest.mark.parametrize(("name", "codes"), [("sand", [1, 0]), ("Mud", [0, 1])])
def test_a_column_with_the_name_of_a_facies_says_where_it_is(name, codes, words):
    yes, no = words.split()
    text = f"x,y,{name}\n0.5,0.5,{yes}\n1.5,0.5,{no}\n".encode()
    report = cio.import_hard_data(BytesIO(text), Grid(4, 4), TWO)
    assert report.hard_data.facies.tolist() == codes
    own = cio.import_hard_data(BytesIO(text), Grid(4, 4), THREE, on_unknown="drop").hard_data
    assert own.facies.tolist() == [2 if name == "sand" else 0]  # no facies is known elsewhere


@pytest.mark.parametrize(
    ("x", "y"),
    [("350.003", "4.505.002"), ("350'003", "4'505'002"), ("350003", "4505002")],
)
def test_thousands_have_any_separator(x, y):
    points = cio.read_points(BytesIO(f"x;y;facies\n{x};{y};1\n".encode()))
    assert points.places.tolist() == [[350003, 4505002]]


@pytest.mark.parametrize(
    "geometry",
    [
        None,
        {"type": "Point", "coordinates": []},
        {"type": "Point", "coordinates": [None, None]},
        {"type": "GeometryCollection", "geometries": []},
    ],
)
def test_a_feature_without_coordinates_is_one_row_left_out(geometry):
    features = json.loads(sample.geojson())["features"]
    features[0]["geometry"] = geometry
    features[1]["geometry"]["coordinates"] = [0, 0]
    content = json.dumps({"features": features}).encode()
    points = cio.read_points(BytesIO(content))
    assert points.n == len(features) - 1
    assert points.places[0].tolist() == [0, 0]
    assert points.notes == ("Rows without coordinates, left out: 1 (feature 1).",)


CURVES = "~C\n DEPT.M:\n DATE.:\n FACIES.:\n~A\n"
LOG = "~V\n VERS. {v}:\n DLM. {dlm}:\n~W\n WELL. {well}\n" + CURVES + "{row}\n"


@pytest.mark.parametrize(
    ("v", "dlm", "well", "row"),
    [
        ("2.0", "SPACE", "A 1: name", "0.5 2024-01-02 10:00:00 1"),
        ("2.0", "SPACE", "A 1: name", "0.5 01/02/2024 10:00 1"),
        ("3.0", "COMMA", "A 1: name", "0.5,01.02.2024 10:00,1"),
        ("1.2", "SPACE", "WELL: A 1", "0.5 2024-01-02 1"),
    ],
)
def test_dates_separators_and_wells_of_logs_are_known(v, dlm, well, row):
    text = LOG.format(v=v, dlm=dlm, well=well, row=row).encode()
    found = cio.preview_wells(BytesIO(text), "intervals")
    assert found.guess == {"well": "well", "depth": "DEPT", "facies": "FACIES"}
    assert [*found.rows[0]][:2] == ["A 1", "0.5"]
    assert found.rows[0][-1] == "1"
