"""Test hard data of volumes: points with z, vertical wells with depths, grids with gaps."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, strategies as st

import ccwsim.io as cio
from ccwsim import CCWSIMError, Grid, HardData, TrainingImage
from ccwsim.io.limits import limited, upload_limits
from tests.io import sample_files as sample

GRID = Grid(8, 9, (10.0, 20.0, 0.5), (350000.0, 4505000.0, -10.0), nz=20)
DATA = HardData([[0, 0, 0], [3, 4, 5], [3, 4, 6], [19, 7, 8]], [1, 0, 1, 2])
IMAGE = TrainingImage([[[0, 1, 2]]], facies_names=["clay", "silt", "sand"])


def read(text: str | bytes, grid: Grid = GRID, **choices) -> HardData:
    content = text if isinstance(text, bytes) else text.encode()
    return cio.read_hard_data(BytesIO(content), grid, IMAGE, **choices)


def well(rows: str, header: str = "well,x,y,z,from,to,facies") -> str:
    return f"{header}\n{rows}\n"


@pytest.mark.parametrize("kind", ["csv", "gslib"])
def test_written_data_come_back(kind):
    assert read(cio.hard_data_as_bytes(DATA, kind, GRID)).triples == DATA.triples
    unit = Grid(8, 9, nz=20)
    assert read(cio.hard_data_as_bytes(DATA, kind), unit).triples == DATA.triples


def test_cells_have_layer_row_and_column():
    rows = "\n".join(",".join(map(str, row)) for row in DATA.triples)
    assert read(f"layer,row,col,facies\n{rows}\n").triples == DATA.triples
    swapped = "\n".join(f"{r},{k},{c},{f}" for k, r, c, f in DATA.triples)
    assert read(f"row,k,col,facies\n{swapped}\n").triples == DATA.triples
    content = sample.npz(cells=DATA.cells, facies=DATA.facies)
    assert read(content).triples == DATA.triples
    table = np.array(DATA.triples)
    assert read(sample.npy(table)).triples == DATA.triples


def test_points_without_names_of_columns_are_x_y_z_facies():
    points = GRID.centers_of(DATA.cells)
    rows = zip(points.tolist(), DATA.facies, strict=True)
    text = "\n".join(f"{x} {y} {z} {code}" for (x, y, z), code in rows)
    assert read(text).triples == DATA.triples


@pytest.mark.parametrize("kind", ["npy", "sgems", "vti"])
def test_a_grid_with_gaps_has_layers(kind):
    values = np.full(GRID.shape, -999.0)
    values[tuple(DATA.cells.T)] = DATA.facies
    if kind == "npy":
        values[values < 0] = np.nan
        content = sample.npy(values)
        top_first = read(sample.npy(values[::-1]), z_up=False)
        assert top_first.triples == DATA.triples
    else:
        content = cio.maps_as_bytes({"facies": values}, GRID, kind)
    assert read(content).triples == DATA.triples
    with pytest.raises(
        CCWSIMError, match="grid of 9 × 8 × 20 cells, but the simulation grid has 9 × 8"
    ):
        read(content, Grid(8, 9, nz=4))


def test_names_of_facies_and_columns_of_other_origins():
    text = "Bohrung;Rechtswert;Hochwert;Hoehe;Litho\nB1;350005,0;4505010,0;-9,8;Sand\n"
    assert read(text).triples == ((0, 0, 0, 2),)
    text = "East,North,Elev,code\n350005,4505010,-9.8,1\n"
    assert read(text).triples == ((0, 0, 0, 1),)
    text = "x,y,height above,facies\n350005,4505010,-9.8,1\n"
    assert read(text, z="height above").triples == ((0, 0, 0, 1),)


class TestWells:
    def test_a_depth_is_below_the_collar(self):
        rows = "A,350005,4505010,-1,8.8,1\nA,350005,4505010,-1,2.1,2"
        found = read(well(rows, "well,x,y,z,depth,facies"))
        assert found.triples == ((0, 0, 0, 1), (13, 0, 0, 2))

    @given(
        st.lists(st.floats(0.01, 3.0), min_size=1, max_size=8),
        st.floats(-3.0, 3.0),
        st.sampled_from([0.25, 0.5, 0.7]),
    )
    def test_intervals_fill_the_cells_whose_centres_they_hold(self, lengths, collar, height):
        grid = Grid(3, 4, (10.0, 10.0, height), (0.0, 0.0, -40.0), nz=200)
        ends = np.cumsum(lengths)
        starts = np.concatenate([[0.0], ends[:-1]])
        facies = np.arange(len(lengths)) % 3
        rows = [
            f"W,25,15,{collar!r},{a!r},{b!r},{f}"
            for a, b, f in zip(starts.tolist(), ends.tolist(), facies, strict=True)
        ]
        found = read(well("\n".join(rows)), grid)
        expected = {}
        for layer, z in enumerate(grid.axes[2]):
            if collar - ends[-1] + 1e-9 < z < collar - 1e-9:
                k = int(np.searchsorted(ends, collar - z))
                if np.abs(ends - (collar - z)).min() > 1e-9:
                    expected[layer] = facies[k]
        got = {layer: code for layer, row, column, code in found.triples}
        assert all(got[layer] == code for layer, code in expected.items())
        assert len(got) - len(expected) <= len(lengths) + 1  # centres on an end
        assert {cell[1:3] for cell in found.triples} <= {(1, 2)}

    def test_intervals_that_meet_do_not_clash(self):
        rows = "A,350005,4505010,0,0,0.25,0\nA,350005,4505010,0,0.25,0.75,1\n"
        rows += "A,350005,4505010,0,0.75,5,2"
        found = read(well(rows))
        assert found.facies.tolist() == [2] * 8 + [1, 0]
        assert found.cells[-1].tolist() == [19, 0, 0]

    def test_what_is_too_thin_for_a_cell_is_said(self):
        rows = "A,350005,4505010,0,0,0.1,0\nA,350005,4505010,0,0.1,2,1"
        report = cio.import_hard_data(BytesIO(well(rows).encode()), GRID, IMAGE)
        assert "Depth intervals left out because they contain no cell centre: 1." in report.notes
        assert report.hard_data.facies.tolist() == [1] * 4

    def test_wells_that_leave_the_grid_are_named(self):
        rows = "A,350005,4505010,0,0,12,0"
        with pytest.raises(CCWSIMError, match=r"line 2.*: 4 of 24 data lie outside the grid"):
            read(well(rows))
        assert read(well(rows), on_outside="drop").n == 20

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            (
                well("A,1,1,0,1", "well,x,y,depth,facies"),
                "no column of heights of points or collars",
            ),
            (
                well("A,1,1,0,1,1", "well,x,y,from,to,facies"),
                "rename a column to 'z', or set z= to",
            ),
            (well("A,1,1,0,1", "well,x,y,porosity,facies"), "no column of heights"),
            (well("A,1,1,0,1,1", "well,x,y,z,from,facies"), "no column of ends of intervals"),
            (well("A,1,1,0,1,1", "well,x,y,z,to,facies"), "no column of starts of intervals"),
            (well("A,1,1,0,3,2,1"), r"line 2 \(A\): the upper depth is below the lower depth"),
            (well("A,1,1,0,0,1e300,1"), "too far"),
            (well("3,4,1", "row,col,facies"), "no column of layers"),
            ("1 2 0\n3 4 1\n", "four: x, y, z and facies|no column of heights"),
        ],
    )
    def test_what_is_missing_or_wrong_is_named(self, text, said):
        with pytest.raises(CCWSIMError, match=said):
            read(text)

    def test_two_facies_in_a_cell_are_said_with_the_layer(self):
        rows = "A,350005,4505010,0,1,2,0\nB,350006,4505011,0,1,2,1"
        with pytest.raises(CCWSIMError, match=r"layer 16, row 0, column 0 \(line 2: 0, line 3"):
            read(well(rows))
        assert read(well(rows), on_collision="drop").n == 0

    def test_cells_of_wells_are_counted_before_they_are_made(self):
        grid = Grid(8, 9, (10.0, 20.0, 1e-6), nz=2)
        with limited(upload_limits({})), pytest.raises(CCWSIMError, match="more than 100000 hard"):
            read(well("A,1,1,0,0,2,1"), grid)


@pytest.mark.parametrize("kind", ["points", "intervals", "cells"])
def test_a_grid_fits_all_data(kind):
    text = {
        "points": cio.hard_data_as_bytes(DATA, "csv", GRID),
        "intervals": well("A,0,50,10,0,12,0\nB,700,300,8,1,90,1").encode(),
        "cells": b"layer,row,col,facies\n3,4,5,0\n6,2,1,1\n",
    }[kind]
    points = cio.read_points(BytesIO(text), grid_shape=(1, 1, 1))
    grid = cio.fit_grid(points)
    assert grid.nz is not None
    placed = cio.place_points(points, grid, IMAGE)
    assert not len(placed.outside)
    if kind == "cells":
        assert grid == Grid(5, 6, nz=7)


def test_a_map_reads_files_with_z_as_before():
    text = well("A,5,5,0,1,2,1")
    found = cio.import_hard_data(BytesIO(text.encode()), (8, 9))
    assert found.hard_data.triples == ((5, 5, 1),)
    with pytest.raises(CCWSIMError, match="applies only to volumes; give a grid with nz"):
        cio.read_hard_data(BytesIO(text.encode()), (8, 9), z="z")


# --- roles of columns ----------------------------------------------------------------------
UNNAMED = "a,b,c,d\n350005,4505010,-9.8,1\n350015,4505030,-9.3,2\n"


def preview(text: str, **choices) -> cio.PointsPreview:
    columns = cio.PointColumns(**choices)
    return cio.preview_points(BytesIO(text.encode()), columns, grid_shape=GRID.shape)


@given(st.permutations(["x", "y", "z", "facies"]), st.permutations(list("abcd")))
def test_columns_of_points_may_be_called_anything_where_they_are_named(roles, names):
    rows = [{"x": 350005, "y": 4505010, "z": -9.8, "facies": 1}]
    rows.append({"x": 350015, "y": 4505030, "z": -9.3, "facies": 2})
    lines = [names, *([str(row[role]) for role in roles] for row in rows)]
    text = "\n".join(map(",".join, lines))
    columns = dict(zip(roles, names, strict=True))
    assert read(text, **columns).triples == ((0, 0, 0, 1), (1, 1, 1, 2))
    first = preview(text, **columns)
    assert first.guess == columns
    assert first.reasons == ()


@pytest.mark.parametrize("header", ["well,x,y,z,from,to,facies", "Hole;East;North;Elev;MD;Litho"])
def test_a_preview_of_a_volume_shows_heights_and_wells(header):
    mark = ";" if ";" in header else ","
    names = header.split(mark)
    text = f"{header}\nA{mark}" + mark.join("123456"[: len(names) - 1]) + "\n"
    roles = ["well", "x", "y", "z", "depth_from", "depth_to", "facies"]
    if len(names) == 6:
        roles = ["well", "x", "y", "z", "depth", "facies"]
    found = preview(text)
    assert found.guess == dict(zip(roles, names, strict=True))
    assert (found.reasons, found.assignment.unclear) == ((), False)
    of_map = cio.preview_points(BytesIO(text.encode()))
    assert {*of_map.guess} == {"well", "x", "y", "facies"}


def test_what_is_not_told_of_a_volume_is_asked():
    found = preview(UNNAMED)
    assert found.guess == {"x": "a", "y": "b"}
    assert found.assignment.unclear
    assert "no column of heights" in found.reasons[1]
    assert "pick one (facies=)" in found.reasons[2]
    assert preview(UNNAMED, facies="a").guess == {"x": "b", "y": "c", "facies": "a"}
    cells = preview("row,col,k,facies\n1,2,3,1\n")
    assert cells.guess == {"x": "col", "y": "row", "z": "k", "facies": "facies"}
    assert not cells.assignment.world


def test_depths_below_z_are_said_and_may_be_left_out():
    rows = "A,350005,4505010,-1,8.8,1"
    text = well(rows, "well,x,y,z,depth,facies")
    report = cio.import_hard_data(BytesIO(text.encode()), GRID, IMAGE)
    assert report.notes[0] == "z is the height of the collar. Depths below it: depth."
    assert report.hard_data.triples == ((0, 0, 0, 1),)
    assert [*report.wells] == ["A"]
    own = cio.import_hard_data(BytesIO(text.encode()), GRID, IMAGE, depth="", well="")
    assert own.hard_data.triples == ((18, 0, 0, 1),)
    assert not own.wells
    assert not any("collar" in note for note in own.notes)
    named = well("A,350005,4505010,-1,1,2,1", "a,x,y,z,b,c,facies")
    assert read(named, depth_from="b", depth_to="c").n == 2
    assert read(named, depth="b").triples == ((16, 0, 0, 1),)
    numbers = cio.read_points(
        BytesIO(named.encode()), cio.PointColumns(well="b"), grid_shape=GRID.shape
    ).wells
    assert numbers == {2: "1"}


@pytest.mark.parametrize("head", ["well,x,y,z,MD,facies", "hole,x,y,z,depth,facies"])
def test_heights_that_differ_within_a_well_are_those_of_the_rows(head):
    rows = ("A,350005,4505010,8.5,1,1", "A,350006,4505010,7.5,2,0", "B,350015,4505010,8.5,1,1")
    text = well("\n".join(rows), head)
    found = cio.read_points(BytesIO(text.encode()), grid_shape=GRID.shape)
    assert found.places[:, 2].tolist() == [8.5, 7.5, 8.5]
    depth = head.split(",")[4]
    assert found.notes[0] == f"{depth} is not used, because z is the height of each row."
    collars = well("\n".join((rows[0], rows[2], ",350015,4505010,,1,1")), head)
    assert preview(collars).guess["depth"] == depth


TOPS = """# Petrel well tops
# Unit in X and Y direction: m
VERSION 2
BEGIN HEADER
X
Y
Z
TWT picked
Geological age
MD
Type
Surface
Well
FLOAT,Dip angle
STRING "Interpreter"
END HEADER
350005.5 4505010.2 8.5 -999 -999 1540.2 Horizon "sand" "15/9-A 1" -999 "J D"
350015.5 4505010.2 7.5 -999 -999 1540.2 Horizon "mud" "15/9-A 2" 3.5 "J D"
"""


@pytest.mark.parametrize("volume", [True, False])
def test_well_tops_of_petrel_need_no_answer(volume):
    shape = GRID.shape if volume else None
    found = cio.preview_points(BytesIO(TOPS.encode()), grid_shape=shape)
    named = {"x": "X", "y": "Y", "well": "Well", "facies": "Surface"}
    assert found.guess == (named | {"z": "Z"} if volume else named)
    assert found.columns[-2:] == ("Dip angle", "Interpreter")
    points = cio.read_points(BytesIO(TOPS.encode()), grid_shape=shape)
    assert points.words == ("mud", "sand")
    assert points.values.tolist() == [1, 0]
    assert points.places[0].tolist() == [350005.5, 4505010.2, 8.5][: 3 if volume else 2]
    assert [*points.wells.values()] == ["15/9-A 1", "15/9-A 2"]


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"z": "a", "x": "a"}, "x and z are both 'a'; name two columns"),
        ({"well": "e"}, "no variable 'e'; choose from 'a', 'b', 'c', 'd'"),
        ({"z": ""}, "no column of heights of points or collars; it has"),
        ({"x": "a", "y": "b", "depth": "c", "depth_to": "d"}, "depth and depth_to are both named"),
        ({"z": "c", "depth_to": "d"}, "rename a column to 'from', or set depth_from= to a column"),
        (
            {"z": "c", "depth": "d", "coordinates": "cells"},
            "depth = 'd' is a depth below z, but ce",
        ),
    ],
)
def test_columns_that_cannot_be_are_said(columns, said):
    with pytest.raises(CCWSIMError, match=said):
        read(UNNAMED, **columns)


@pytest.mark.parametrize("name", ["z", "depth_from", "depth_to", "depth"])
def test_columns_of_a_volume_are_refused_for_a_map(name):
    text = BytesIO(UNNAMED.encode())
    with pytest.raises(
        CCWSIMError, match=f"{name} = 'c' applies only to volumes; give a grid with nz"
    ):
        cio.read_hard_data(text, (8, 9), **{name: "c"})
    array = BytesIO(sample.npy(np.array(DATA.triples)))
    with pytest.raises(CCWSIMError, match=f"no named columns; leave {name} out"):
        cio.read_hard_data(array, GRID, **{name: "c"})
