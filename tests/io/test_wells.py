"""Test wells in tables of collars, intervals and surveys: paths, cells and problems."""

from __future__ import annotations

from io import BytesIO
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ccwsim import CCWSIMError, Grid, Parameters, TrainingImage, read_hard_data, simulate
from ccwsim.cli.program import main
from ccwsim.io import WellColumns, import_hard_data, import_wells, preview_wells, read_wells
from ccwsim.io.hard_data.wells import Stations, positions_along_well
from tests.small_images import blobs

GRID = Grid(20, 30, (2.0, 4.0, 0.5), (100.0, 200.0, -7.0), nz=40)
COLLARS = b"Hole ID;East;North;Elev;EOH\nA-1;110,5;222,0;12,5;30\nB;131;250;9,75;30\n"
INTERVALS = b"BHID,From,To,Rock\nA-1,0,2.6,1\nA-1,2.6,7.1,0\nB,1.1,4.1,1\n"


def imported(collars=COLLARS, intervals=INTERVALS, surveys=None, grid=GRID, **options):
    files = [None if table is None else BytesIO(table) for table in (collars, intervals, surveys)]
    return import_wells(files[0], files[1], grid, surveys=files[2], **options)


def test_vertical_wells_are_those_of_one_table():
    one = b"x,y,z,from,to,facies\n110.5,222,12.5,0,2.6,1\n110.5,222,12.5,2.6,7.1,0\n"
    one += b"131,250,9.75,1.1,4.1,1\n"
    found = imported().hard_data
    assert found.digest == read_hard_data(BytesIO(one), GRID).digest
    straight = b"hole,depth,azimuth,inclination\nA-1,0,77,0\nB,5,0,0\n"
    assert imported(surveys=straight).hard_data.digest == found.digest


def test_data_alone_are_those_of_the_report():
    options = {"on_outside": "drop", "on_unknown": "drop", "on_collision": "majority"}
    image = TrainingImage([[0, 7]])
    tables = COLLARS, INTERVALS, b"well,depth,azimuth,dip\nB,0,90,-20\n"
    files = [BytesIO(table) for table in tables]
    wanted = imported(*tables, training_image=image, **options).hard_data
    found = read_wells(*files[:2], GRID, image, surveys=files[2], **options)
    assert found.n > 0
    assert found.digest == wanted.digest


def test_one_depth_a_row_is_a_point():
    points = b"well,depth,facies\nA-1,0.2,1\nA-1,3.1,0\n"
    found = imported(intervals=points)
    assert found.hard_data.triples == ((32, 5, 5, 0), (38, 5, 5, 1))
    assert "Wells without intervals: 1 (B)." in found.notes


@pytest.mark.parametrize(
    "names", [("42501201300001", "42501201300002"), ("007", "B"), ("1.5", "A")]
)
def test_names_of_wells_may_be_numbers(names):
    one, other = (name.encode() for name in names)
    collars = b"well,x,y,z\n%b,110.5,222,12.5\n %b ,131,250,12.5\n" % (one, other)
    alone = b"well,depth,facies\n%b,0.2,1\n" % one  # numbers in one table, words in the other
    assert imported(collars, alone).hard_data.triples == ((38, 5, 5, 1),)
    both = alone + b"%b,0.2,0\n" % other
    assert imported(collars, both).hard_data.triples == ((38, 5, 5, 1), (38, 12, 15, 0))


def test_what_was_taken_for_granted_of_paths_is_said():
    surveys = b"well,depth,azimuth,dip\nA-1,0,90,-80\nA-1,5,90,-70\n"
    found = imported(surveys=surveys)
    assert found.notes[:2] == (
        "Wells without stations, assumed vertical: 1 (B).",
        "Wells are straight below their last station (line 3 (A-1)).",
    )
    deeper = imported(surveys=surveys + b"A-1,7.1,90,-70\nB,30,0,-90\n")
    assert deeper.hard_data.digest == found.hard_data.digest
    assert not any("station" in note for note in deeper.notes)


@pytest.mark.parametrize("tilt", [None, 30])
def test_an_interval_without_length_has_no_cells(tilt):
    surveys = None if tilt is None else b"well,depth,azimuth,inclination\nB,0,9,%d\n" % tilt
    found = imported(intervals=b"well,from,to,facies\nB,2.4,2.4,1\n", surveys=surveys)
    assert found.hard_data.n == 0
    assert any(note.startswith("Depth intervals") and "1." in note for note in found.notes)


def test_a_length_may_be_known_of_some_wells_alone():
    some = COLLARS.replace(b"12,5;30", b"12,5;")
    assert imported(some).hard_data.digest == imported().hard_data.digest
    with pytest.raises(CCWSIMError, match="below the end of 'B' at 30"):
        imported(some, b"well,from,to,facies\nA-1,1,31,1\nB,1,31,1\n")


@pytest.mark.parametrize("rate", [0.5, 3.0, 20.0])  # degrees per 30 m
@pytest.mark.parametrize("azimuth", [0.0, 65.0, 200.0])
def test_a_well_that_builds_at_a_constant_rate_is_a_circle(rate, azimuth):
    radius = 30 / np.radians(rate)
    depths = np.linspace(0, 80 / rate * 30, 5)
    tilts, way = np.radians(depths * rate / 30), np.radians(azimuth)
    directions = np.column_stack(
        [np.sin(tilts) * np.sin(way), np.sin(tilts) * np.cos(way), -np.cos(tilts)]
    )
    between = np.linspace(0, depths[-1], 41)
    found = positions_along_well(np.array([5.0, 6.0, 7.0]), Stations(depths, directions), between)
    tilt = between * np.radians(rate) / 30
    across = radius * (1 - np.cos(tilt))
    expected = np.column_stack(
        [5 + across * np.sin(way), 6 + across * np.cos(way), 7 - radius * np.sin(tilt)]
    )
    np.testing.assert_allclose(found, expected, atol=1e-9 * radius)


def test_two_stations_give_the_increments_of_the_published_formula():
    """Test ΔN, ΔE, ΔV = ΔMD / 2 (t₁ + t₂) · 2 / β tan β / 2, as in Sawaryn and Thorogood."""
    (i1, a1), (i2, a2), length = np.radians([15, 10]), np.radians([25, 40]), 100.0
    ways = [
        [np.sin(i) * np.sin(a), np.sin(i) * np.cos(a), -np.cos(i)] for i, a in ((i1, a1), (i2, a2))
    ]
    bend = np.arccos(np.dot(*ways))
    expected = length / 2 * np.sum(ways, axis=0) * 2 / bend * np.tan(bend / 2)
    stations = Stations(np.array([0.0, length]), np.array(ways))
    found = positions_along_well(np.zeros(3), stations, np.array([length]))
    np.testing.assert_allclose(found[0], expected)


SURVEYS = st.lists(
    st.tuples(st.floats(0.5, 8), st.floats(0, 360), st.floats(0, 85)), min_size=1, max_size=4
)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(SURVEYS, st.integers(0, 2**16))
def test_a_deviated_well_has_a_datum_in_each_cell_it_goes_through(stations, seed):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(102, 158), rng.uniform(202, 278)  # rarely along an edge of cells
    depths = np.cumsum([depth for depth, *_ in stations])
    rows = [f"W,{d},{a},{i}" for d, (_, a, i) in zip(depths, stations, strict=True)]
    edges = np.sort(rng.uniform(0, 25, 4))
    logs = [f"W,{a},{b},{k % 2}" for k, (a, b) in enumerate(pairwise(edges))]
    found = imported(
        f"well,x,y,z\nW,{x},{y},12.9\n".encode(),
        "\n".join(["well,from,to,facies", *logs]).encode(),
        "\n".join(["well,depth,azimuth,inclination", *rows]).encode(),
        on_outside="drop",
        on_collision="nearest",
    ).hard_data
    ways = np.radians([[i, a] for _, a, i in stations])
    directions = np.column_stack(
        [
            np.sin(ways[:, 0]) * np.sin(ways[:, 1]),
            np.sin(ways[:, 0]) * np.cos(ways[:, 1]),
            -np.cos(ways[:, 0]),
        ]
    )
    path = Stations(np.r_[0, depths], np.concatenate([directions[:1], directions]))
    fine = np.linspace(edges[0], edges[-1], 40_000)
    cells = GRID.cells_of(*positions_along_well(np.array([x, y, 12.9]), path, fine).T)
    inside = GRID.holds(cells)
    facies = (np.searchsorted(edges, fine, side="right") - 1).clip(0, 2) % 2
    through: dict[tuple[int, ...], list[int]] = {}
    for cell, own in zip(map(tuple, cells[inside].tolist()), facies[inside].tolist(), strict=True):
        through.setdefault(cell, []).append(own)
    long = 40_000 * 0.1 / (edges[-1] - edges[0])  # any step finds paths of 0.1 or more
    data = {tuple(cell): code for *cell, code in found.triples}
    assert set(data) <= set(through)
    ends = {tuple(cells[0].tolist()), tuple(cells[-1].tolist())}
    for cell, codes in through.items():
        if len(codes) > long and cell not in ends:
            assert cell in data
            if len(set(codes)) == 1:
                assert data[cell] == codes[0]


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**16))
def test_data_of_deviated_wells_are_honoured(seed):
    rng = np.random.default_rng(seed)
    grid = Grid(20, 24, nz=10)
    collars, logs, stations = ["well,x,y,z"], ["well,from,to,facies"], ["well,depth,azimuth,dip"]
    for k in range(3):
        collars.append(f"{k},{rng.uniform(4, 20)},{rng.uniform(4, 16)},10")
        stations.append(f"{k},{rng.uniform(0, 3)},{rng.uniform(0, 360)},{-rng.uniform(30, 90)}")
        stations.append(f"{k},6,{rng.uniform(0, 360)},{-rng.uniform(30, 90)}")
        logs += [f"{k},{d},{d + 2},{rng.integers(2)}" for d in range(0, 8, 2)]
    tables = ("\n".join(table).encode() for table in (collars, logs, stations))
    settled = {"on_outside": "drop", "on_collision": "nearest"}
    data = imported(*tables, grid=grid, **settled).hard_data
    image = TrainingImage(blobs((14, 30, 33), 2))
    p = Parameters((8, 12, 12), (2, 4, 4), 1)
    e = simulate(image, grid, p, data, n_realizations=1, seed=seed)
    assert not e.n_mismatched.any()


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        (
            {"collars": b"x,y,z\n1,2,3\n"},
            "no column of the names of the wells; it has 'x', 'y', 'z'",
        ),
        ({"collars": b"well,x,y\nA-1,1,2\n"}, "no column of the elevations of the collars"),
        ({"collars": b"well;a;b;z\nB;1;2;3\n"}, "no column of x of the collars"),
        ({"collars": COLLARS + b"B;1;2;3;4\n"}, "lines 3 and 4: the well 'B' has two collars"),
        ({"collars": b"well;x;y;z\nB;;2;3\nA-1;1;2;3\n"}, "line 2: x is missing; add it"),
        (
            {"intervals": b"well,from,to,facies\nC,1,2,1\n"},
            "line 2: there is no collar of the well 'C'",
        ),
        ({"intervals": b"well,facies\nB,1\n"}, "no column of depths; it has 'well', 'facies'"),
        ({"intervals": b"well,from,to,facies\nB,5,2,1\n"}, "depth 5 is below the lower depth 2"),
        ({"intervals": b"well,from,to,facies\nB,-1,2,1\n"}, "the depth -1 is above the collar"),
        (
            {"intervals": b"well,from,to,facies\nB,1,31,1\n"},
            "the depth 31 is below the end of 'B' at 30",
        ),
        (
            {"intervals": b"well,from,to,facies\nB,4,6,1\nA-1,0,9,0\nB,1,5,0\n"},
            "lines 2 and 4: two intervals of 'B' overlap below the depth 4",
        ),
        ({"surveys": b"well,depth,azimuth\nB,1,2\n"}, "no column of the tilt of wells"),
        ({"surveys": b"well,depth,azimuth,dip\nC,1,2,-3\n"}, "no collar of the well 'C'"),
        ({"surveys": b"well,depth,azimuth,dip\nB,1,2,60\n"}, "dip is 60 to 60, above the horizon"),
        (
            {"surveys": b"well,depth,azimuth,dip\nB,1,2,60\nA-1,1,2,0\n"},
            "dip is 0 to 60, above the horizon",
        ),
        (
            {"surveys": b"well,depth,azimuth,inclination\nB,9,200,80\nB,1,20,100\n"},
            "lines 2 and 3: 'B' reverses its direction",
        ),
        (
            {"surveys": b"well,depth,azimuth,dip\nB,1,2,-95\n"},
            "line 2: dip -95 is not from -90 to 90",
        ),
        (
            {"surveys": b"well,depth,azimuth,inclination\nB,1,400,5\n"},
            "azimuth 400 is not from -180",
        ),
        (
            {"surveys": b"well,depth,azimuth,inclination\nB,1,4,5\nB,1,5,5\n"},
            "line 3: a station of 'B' at depth 1 is twice",
        ),
        ({"grid": Grid(20, 30)}, "wells need a grid with layers"),
    ],
)
def test_tables_that_cannot_be_are_said_with_their_rows(tables, said):
    with pytest.raises(CCWSIMError) as error:
        imported(**tables)
    assert said in str(error.value)


PLAIN = {
    "collars": ["collar_well,x,y,z,collar_length", "A-1,110.5,222.0,12.5,30", "B,131,250,9.75,30"],
    "intervals": ["well,depth_from,depth_to,facies", "A-1,0,2.6,1", "A-1,2.6,7.1,0", "B,1.1,4.1,1"],
    "surveys": ["survey_well,survey_depth,survey_azimuth,survey_dip", "B,0,90,-70", "B,5,80,-60"],
}
"""Tables whose columns have the names of the arguments that name them."""
TILTED = b"well,depth,azi,dip,inc\nB,0,0,-90,0\n"
WORDS = [*"abcdefg", "x", "y", "z", "depth", "from", "to", "well", "top", "dip", "length", "facies"]


@st.composite
def renamed(draw):
    """Return the plain tables with renamed columns in any order, and the arguments to read them."""
    tables, columns = {}, {}
    for table, rows in PLAIN.items():
        cells = [row.split(",") for row in rows]
        order = draw(st.permutations(range(len(cells[0]))))
        names = draw(st.lists(st.sampled_from(WORDS), min_size=5, max_size=5, unique=True))
        columns |= {cells[0][k]: name for k, name in zip(order, names, strict=False)}
        lines = [names[: len(order)], *([row[k] for k in order] for row in cells[1:])]
        tables[table] = "\n".join(map(",".join, lines)).encode()
    return tables, columns


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(renamed())
def test_columns_may_be_called_anything_where_they_are_named(drawn):
    tables, columns = drawn
    plain = {name: "\n".join(rows) for name, rows in PLAIN.items()}
    plain["collars"] = plain["collars"].replace("collar_", "")
    plain["surveys"] = plain["surveys"].replace("survey_", "")
    plain["intervals"] = plain["intervals"].replace("depth_", "")
    wanted = imported(**{name: text.encode() for name, text in plain.items()})
    found = imported(**tables, **columns)
    assert found.hard_data.digest == wanted.hard_data.digest
    assert {name: c.tolist() for name, c in found.wells.items()} == {
        name: c.tolist() for name, c in wanted.wells.items()
    }
    for table, content in tables.items():
        first = preview_wells(BytesIO(content), table, WellColumns(**columns))
        roles = PLAIN[table][0].split(",")
        assert first.guess == {role: columns[role] for role in roles}
        assert first.reasons == ()


@settings(max_examples=100, deadline=None)
@given(st.lists(st.sampled_from(WORDS), min_size=2, max_size=6, unique=True), st.data())
def test_a_preview_shows_the_columns_that_are_read(names, data):
    """Test that naming the guessed columns changes neither the guess nor its reasons."""
    table = data.draw(st.sampled_from(list(PLAIN)))
    content = "\n".join([",".join(names), ",".join("1" for _ in names)]).encode()
    first = preview_wells(BytesIO(content), table)
    assert first.columns == tuple(names)
    assert len({*first.guess.values()}) == len(first.guess)
    second = preview_wells(BytesIO(content), table, WellColumns(**first.guess))
    assert (second.guess, second.reasons) == (first.guess, first.reasons)


def test_an_empty_name_says_that_there_is_no_such_column():
    collars = COLLARS.replace(b"EOH", b"depth")
    deep = b"well,from,to,facies\nB,1,31,1\n"
    with pytest.raises(CCWSIMError, match="below the end of 'B' at 30"):
        imported(collars, deep, on_outside="drop")
    assert imported(collars, deep, collar_length="", on_outside="drop").hard_data.n > 0
    both = b"well,from,to,depth,facies\nB,1,3,2,1\n"
    assert imported(intervals=both).hard_data.n == 4
    assert imported(intervals=both, depth="depth").hard_data.n == 1
    assert imported(intervals=both, depth_from="", depth_to="").hard_data.n == 1


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"x": "Ost"}, "file has no variable 'Ost'; choose from 'Hole ID', 'East', 'North'"),
        ({"x": "East", "y": "east"}, "x and y are both 'East'; name two columns"),
        ({"facies": "To", "depth_to": "To"}, "facies and depth_to are both 'To'"),
        ({"depth": "From", "depth_to": "To"}, "depth and depth_to are both named"),
        ({"z": ""}, "no column of the elevations of the collars"),
        ({"collar_well": ""}, "rename a column to 'well', or set collar_well= to a column"),
        ({"well": 3}, "file has no variable 3"),
        ({"survey_dip": "a"}, "survey_dip = 'a' belongs to a table of surveys; give surveys"),
        (
            {"surveys": TILTED, "survey_dip": "dip", "survey_inclination": "inc"},
            "survey_dip and survey_inclination are both named",
        ),
        (
            {"surveys": b"a,depth,azi,dip\nB,0,0,-90\n"},
            "rename a column to 'well', or set survey_well= to a column",
        ),
        ({"depth_from": "BHID", "well": "From"}, "line 2: 'A-1'"),
    ],
)
def test_columns_that_cannot_be_are_said(tables, said):
    with pytest.raises(CCWSIMError) as error:
        imported(**tables)
    assert said in str(error.value)


def test_an_argument_that_names_no_column_is_a_mistake():
    with pytest.raises(TypeError, match="'colour'"):
        imported(colour="a")
    with pytest.raises(CCWSIMError, match="table = 'logs' must be one of collars, intervals, surv"):
        preview_wells(BytesIO(COLLARS), "logs")


def test_wells_are_known_by_their_names():
    found = imported(on_outside="drop", surveys=b"well,depth,azimuth,dip\nB,0,90,-60\n")
    assert [*found.wells] == ["A-1", "B"]
    both = np.concatenate([*found.wells.values()])
    assert sorted(map(tuple, both.tolist())) == sorted(map(tuple, found.hard_data.cells.tolist()))
    assert len({*map(tuple, found.wells["B"][:, 1:].tolist())}) > 1  # it is not vertical
    crossing = imported(
        b"well,x,y,z\nA,110.5,222,12.5\nB,110.6,222.1,12.5\n",
        b"well,depth,facies\nA,1,1\nB,1,1\nB,2,0\n",
    )
    assert {name: len(cells) for name, cells in crossing.wells.items()} == {"A": 1, "B": 2}
    assert crossing.hard_data.n == 2
    one = b"x,y,z,from,to,facies,Hole\n110.5,222,12.5,0,2.6,1,A\n131,250,9.75,1.1,4.1,1,\n"
    alone = import_hard_data(BytesIO(one), GRID)
    assert {name: len(cells) for name, cells in alone.wells.items()} == {"A": 5}
    on_map = import_hard_data(BytesIO(b"hole,x,y,facies\nA,1,1,0\nB,5,2,1\n"), (8, 8))
    assert {name: c.tolist() for name, c in on_map.wells.items()} == {"A": [[1, 1]], "B": [[2, 5]]}


def test_the_command_line_takes_names_of_columns(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    tables = {
        "collars.csv": b"a;b;c;d;e\n" + COLLARS.split(b"\n", 1)[1],
        "logs.csv": b"a,b,c,d\n" + INTERVALS.split(b"\n", 1)[1],
        "surveys.csv": b"a,b,c,d\nB,0,90,-80\n",
    }
    for name, content in tables.items():
        (tmp_path / name).write_bytes(content)
    np.save(tmp_path / "ti.npy", blobs((20, 40, 40), 2))
    line = (
        "simulate ti.npy --grid 30x20x40 --cell-size 2 4 --cell-height 0.5 --origin 100 200 "
        "--bottom -7 --template 16x16x8 --overlap 4x4x4 --level 1 --hard-data logs.csv "
        "--output out.npz --hard-well a --hard-from b --hard-to c --hard-facies d "
    )
    of_collars = "--collar-well a --hard-x b --hard-y c --hard-z d --collar-length e "
    of_surveys = "--survey-well a --survey-depth b --survey-azimuth c --survey-dip d "
    whole = f"--collars collars.csv {of_collars} --surveys surveys.csv {of_surveys}"
    assert main((line + whole).split()) == 0
    data = imported(surveys=b"well,depth,azimuth,dip\nB,0,90,-80\n").hard_data
    with np.load(tmp_path / "out.npz") as saved:
        assert saved["realizations"][0][tuple(data.cells.T)].tolist() == data.facies.tolist()
    assert main((line + "--collars collars.csv " + of_collars + of_surveys).split()) != 0
    assert (
        "--survey-well names a column of a table of surveys; give --surv" in capsys.readouterr().err
    )
    assert main((line + of_collars).split()) != 0
    assert (
        "--collar-well names a column of a table of collars; give --coll" in capsys.readouterr().err
    )


def test_the_command_line_takes_wells(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    surveys = b"well,depth,azimuth,dip\nB,0,90,-80\n"
    tables = {"collars.csv": COLLARS, "logs.csv": INTERVALS, "surveys.csv": surveys}
    for name, content in tables.items():
        (tmp_path / name).write_bytes(content)
    np.save(tmp_path / "ti.npy", blobs((20, 40, 40), 2))
    line = (
        "simulate ti.npy --grid 30x20x40 --cell-size 2 4 --cell-height 0.5 --origin 100 200 "
        "--bottom -7 --template 16x16x8 --overlap 4x4x4 --level 1 --hard-data logs.csv "
        "--collars collars.csv --surveys surveys.csv --output out.npz"
    )
    assert main(line.split()) == 0
    data = imported(surveys=surveys).hard_data
    with np.load(tmp_path / "out.npz") as saved:
        assert saved["realizations"][0][tuple(data.cells.T)].tolist() == data.facies.tolist()


def test_a_quarter_circle_has_minimum_curvature():
    down, east = [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]
    quarter = Stations(np.array([0.0, 50 * np.pi]), np.array([down, east]))
    end = positions_along_well(np.zeros(3), quarter, np.array([50 * np.pi]))
    assert np.allclose(end, [[100.0, 0.0, -100.0]])
