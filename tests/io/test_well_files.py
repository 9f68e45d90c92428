"""Test files of wells from many programs: columns are guessed or named, and the grid is fitted."""

from __future__ import annotations

import sys
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, strategies as st

import ccwsim.io as cio
from ccwsim import CCWSIMError, Grid, TrainingImage
from ccwsim.io.limits import limited, upload_limits
from tests.io import sample_files as sample
from tests.io.sample_files import POINTS

SAND = TrainingImage([[0, 1, 1], [0, 0, 1]], facies_names=["clay", "Sand"])
UTM = Grid(512, 512, (10.0, 10.0), (435400.0, 4504600.0))


def points(content: bytes | str, **columns: str) -> cio.ImportedPoints:
    file = BytesIO(content if isinstance(content, bytes) else content.encode())
    return cio.read_points(file, cio.PointColumns(**columns))


def preview(content: str, n_rows: int = 6, **columns: str) -> cio.PointsPreview:
    named = cio.PointColumns(**columns)
    return cio.preview_points(BytesIO(content.encode()), named, n_rows=n_rows)


def test_a_german_spreadsheet_in_utm_with_names():
    found = points(sample.in_utm())
    assert found.places.tolist() == [[436120.5, 4505250], [439880, 4509100.5], [437500, 4507000]]
    assert (found.words, found.n_missing) == (("Sand", "Ton", "sand"), 1)
    assert found.lines.tolist() == [3, 4, 5]
    data = cio.read_hard_data(BytesIO(sample.in_utm()), UTM, SAND, facies_names={"ton": 0})
    assert data.facies.tolist() == [1, 1, 0]
    with pytest.raises(
        CCWSIMError, match=r"line 4 \(B 2\): .* no facies 'Ton'; give .*names=\{'Ton': 1\}"
    ):
        cio.read_hard_data(BytesIO(sample.in_utm()), UTM, SAND)
    left = cio.import_hard_data(BytesIO(sample.in_utm()), UTM, SAND, on_unknown="drop")
    assert (left.hard_data.n, left.n_unknown) == (2, 1)


@pytest.mark.parametrize(
    "header",
    [
        "easting,northing,facies",
        "Ostwert,Nordwert,Fazies",
        "Rechtswert,Hochwert,Lithologie",
        "lon,lat,class",
        "longitude,latitude,code",
        "utm_x,utm_y,value",
        "UTM_E,UTM_N,Rock type",
        "X_UTM32,Y_UTM32,lithofacies",
        "East [m],North [m],porosity",
        "X-Koordinate,Y-Koordinate,v",
        "Easting (UTM 33N),Northing (UTM 33N),facies_code",
        "xcoord,ycoord,soil",
    ],
)
@pytest.mark.parametrize("heights", [("z", "depth"), ("Elevation", "MD"), ("Teufe", "TVDSS")])
def test_headers_are_guessed_and_heights_are_no_facies(header, heights):
    x, y, facies = header.split(",")
    names = [heights[0], facies, "well", y, heights[1], x]
    found = preview(",".join(names) + "\n1,2,3,4,5,6\n")
    assert found.guess == {"x": x, "y": y, "well": "well", "facies": facies}
    assert found.reasons == ()


@pytest.mark.parametrize("height", ["z", "depth", "Elevation [m]", "Tiefe", "TVD"])
def test_a_height_or_the_name_of_a_well_is_taken_only_when_named(height):
    text = f"x,y,{height},well\n1,2,3,W1\n"
    with pytest.raises(
        CCWSIMError, match=r"no column that looks like facies .*name the column \(facies="
    ):
        cio.read_points(BytesIO(text.encode()))
    assert "facies" not in preview(text).guess
    assert points(text, facies=height).values.tolist() == [3]
    assert points(text, facies="well").words == ("W1",)


def test_columns_are_named():
    text = b"a,b,c,d\n1,2,3,4\n"
    found = points(text, x="b", y="D", facies="a")
    assert (found.places.tolist(), found.values.tolist()) == ([[2, 4]], [1])
    cells = points(text, x="b", y="d", facies="a", coordinates="cells")
    assert cells.places.tolist() == [[4, 2]]
    assert not cells.world
    with pytest.raises(CCWSIMError, match="no variable 'e'; choose from 'a', 'b', 'c', 'd'"):
        points(text, x="e")
    with pytest.raises(CCWSIMError, match="x and y are both 'a'"):
        points(text, x="a", y="a")
    with pytest.raises(CCWSIMError, match="no named columns; leave x out"):
        points(sample.npy(POINTS), x="a")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("x;y;facies\n1.234,5;2,5;1\n", [1234.5, 2.5]),
        ("x;y;facies\n436.000;2,5;1\n", [436000, 2.5]),
        ("x\ty\tfacies\n1,234.5\t4,505,250.0\t1\n", [1234.5, 4505250]),
        ("x\ty\tfacies\n10,5\t2\t1\n", [10.5, 2]),
        ("x,y,facies\n10.5,2,1\n", [10.5, 2]),
        ("x y facies\n10,5 2 1\n", [10.5, 2]),
        ('"x";"y";"note";"facies"\n10,5;2;"a; b";1\n', [10.5, 2]),
        ("Wells of 2021\nx,y,facies\n10.5,2,1\n", [10.5, 2]),
        ("x y facies\nm m -\n10.5 2 1\n", [10.5, 2]),
    ],
)
def test_separators_marks_of_numbers_and_units(text, place):
    found = points(text)
    assert (found.places.tolist(), found.values.tolist()) == ([place], [1])


def test_wells_have_names_with_digits():
    found = points("well,x,y,facies\n12,1,2,0\n13A,3,4,1\n")
    assert found.values.tolist() == [0, 1]
    text = 'well x y facies\n"W 1" 1 2 0\n"W 2" 3 4 1\n'
    assert points(text).places.tolist() == [[1, 2], [3, 4]]


def test_names_are_matched_without_case_and_numbers_stay_numbers():
    content = b"x,y,facies\n0.5,0.5, SAND \n1.5,0.5,1\n2.5,0.5,clay\n0.5,1.5,7\n"
    placed = cio.place_points(cio.read_points(BytesIO(content)), Grid(2, 3), SAND)
    assert placed.facies.tolist()[:3] == [1, 1, 0]
    assert placed.unknown_facies == ("7",)
    again = cio.place_points(placed.points, Grid(2, 3), SAND, cio.Conversion((("7", 0),)))
    assert again.facies.tolist() == [1, 1, 0, 0]
    assert not len(again.unknown)


def test_unknown_codes_can_be_recoded():
    content = BytesIO(b"x,y,facies\n0.5,0.5,2\n1.5,0.5,1\n")
    assert cio.read_hard_data(content, (2, 3), SAND, facies_names={2: 0}).facies.tolist() == [0, 1]


@pytest.mark.parametrize("names", [3, {"a": "b"}, {"": 1}, {"a": 10**30}, [1, 2], "ab", {"a": 0.5}])
def test_absurd_names_are_refused(names):
    with pytest.raises(CCWSIMError, match="facies_names"):
        cio.read_hard_data(BytesIO(sample.csv()), (3, 4), facies_names=names)


def test_two_names_in_one_cell_are_told():
    with pytest.raises(CCWSIMError, match="line 2: Sand, line 3: clay"):
        cio.read_hard_data(BytesIO(b"x,y,f\n0,0,Sand\n0,0,clay\n"), (2, 3), SAND)


def test_a_continuous_log_says_so():
    found = points("x,y,porosity\n0,0,0.12\n1,1,0.31\n")
    assert found.continuous
    data = cio.read_hard_data(BytesIO(b"x,y,phi\n0,0,0.12\n1,1,0.31\n"), (2, 3), threshold=0.2)
    assert data.facies.tolist() == [0, 1]


def test_a_log_without_a_value_is_left_out():
    assert points(sample.las()).n_missing == 1
    with pytest.raises(CCWSIMError, match="needs columns x, y, facies"):
        points(b"~W\n NULL. -9 : N\n~C\n DEPT.M :\n GR. :\n~A\n 1 2\n")


def test_a_preview_shows_the_first_rows_and_what_has_to_be_asked():
    rows = "".join(f"{k};{k},5;sand;{k}\n" for k in range(20))
    found = preview(f"Ost;Nord;f;g\n{rows}", n_rows=3)
    assert found.columns == ("Ost", "Nord", "f", "g")
    assert found.numeric == ("Ost", "Nord", "g")
    assert found.rows == (
        ("0", "0.5", "sand", "0"),
        ("1", "1.5", "sand", "1"),
        ("2", "2.5", "sand", "2"),
    )
    assert (found.lines, found.n_rows) == ((2, 3, 4), 20)
    assert found.guess == {"x": "Ost", "y": "Nord"}
    assert "2 variables: 'f', 'g'; pick one" in found.reasons[0]
    named = preview(f"Ost;Nord;f;g\n{rows}", facies="f", x="Nord", y="Ost")
    assert named.guess == {"x": "Nord", "y": "Ost", "facies": "f"}
    assert cio.preview_points(BytesIO(sample.npy())).columns == ()


# --- grids that hold the points -------------------------------------------------------------


@given(
    st.lists(st.tuples(st.floats(-1e7, 1e7), st.floats(-1e7, 1e7)), min_size=1, max_size=20),
    st.sampled_from([None, (64, 64), (100, 7), (1, 1)]),
)
def test_a_fitted_grid_holds_all_points(places, shape):
    grid = Grid.fit(places, shape=shape)
    assert grid.holds(grid.cells_of(*np.array(places).T)).all()
    assert shape is None or grid.shape == shape
    assert grid.cell_size[0] == grid.cell_size[1]
    assert f"{grid.cell_size[0]:.0e}"[0] in "125"


def test_wells_five_kilometres_wide_fit():
    rng = np.random.default_rng(4)
    places = rng.uniform((436000, 4505000), (441000, 4509500), (40, 2))
    rows = "".join(f"{x:.1f},{y:.1f},{k % 2}\n" for k, (x, y) in enumerate(places))
    found = points("Easting,Northing,facies\n" + rows)
    kept = cio.fit_grid(found, shape=(512, 512))
    assert (kept.shape, kept.cell_size) == ((512, 512), (10.0, 10.0))
    assert np.mod(kept.origin, 100).tolist() == [0, 0]
    free = cio.fit_grid(found)
    assert 100 <= max(free.shape) <= 300
    sized = cio.fit_grid(found, cell_size=25)
    assert sized.cell_size == (25, 25)
    for grid in (kept, free, sized):
        data = cio.read_hard_data(
            BytesIO(("x,y,facies\n" + rows).encode()), grid, on_collision="nearest"
        )
        assert data.n >= 38


def test_rows_and_columns_fit_as_they_are():
    found = points("row,col,facies\n9,30,1\n2,2,0\n")
    assert cio.fit_grid(found).shape == (10, 31)
    assert cio.fit_grid(found, shape=(64, 16)).shape == (64, 31)


@pytest.mark.parametrize(
    ("places", "options", "message"),
    [
        ([], {}, "n above 0"),
        ([[0, np.nan]], {}, "finite numbers"),
        ([[0, 1e300]], {}, "finite numbers"),
        ([[0, 0], [9, 9]], {"shape": (2, 2), "cell_size": 1.0}, "do not cover points"),
        ([[0, 0]], {"cell_size": 0}, "must be positive"),
        ([[0, 0], [1e12, 1]], {"cell_size": 1e-3}, "from 1 to"),
    ],
)
def test_points_that_no_grid_fits_are_said(places, options, message):
    with pytest.raises(CCWSIMError, match=message):
        Grid.fit(places, **options)


# --- files of geographic information systems --------------------------------------------------


def test_geojson_of_names_and_other_shapes():
    found = points(sample.geojson(["sand", "clay", None, "sand"]))
    assert (found.words, found.n_missing, found.counted) == (("clay", "sand"), 1, "feature")
    with pytest.raises(CCWSIMError, match="feature 1: the geometry is a LineString, not a Point"):
        points(sample.geojson().replace(b'"Point"', b'"LineString"', 1))
    for broken in (
        b'{"features": 3}',
        b'{"features": [{}]}',
        b'{"features": [',
        b'{"features": []}',
    ):
        with pytest.raises(CCWSIMError, match=r"GeoJSON|no rows"):
            points(broken)


def test_a_large_geojson_is_refused_before_it_is_decoded():
    with (
        limited(upload_limits({})),
        pytest.raises(CCWSIMError, match="in JSON are more than"),
    ):
        points(b'{"features": [' + b"[]," * 600_000 + b"[]]}")


@pytest.mark.filterwarnings("ignore:File /vsimem")
@pytest.mark.parametrize("ending", ["gpkg", "shz"])
def test_geopackage_and_shapefile_read_alike(ending):
    pytest.importorskip("pyogrio")
    content = sample.gis(ending)
    data = cio.read_hard_data(BytesIO(content), (3, 4))
    assert data.digest == cio.read_hard_data(BytesIO(sample.csv()), (3, 4)).digest
    few, said = (
        upload_limits({"CCWSIM_MAX_UPLOAD_POINTS": "3"}),
        "4 points or known cells are more than 3",
    )
    with limited(few), pytest.raises(CCWSIMError, match=said):
        cio.read_points(BytesIO(content))
    with pytest.raises(CCWSIMError, match="file"):
        cio.read_points(BytesIO(content[: len(content) // 3]))


def test_without_pyogrio_the_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyogrio", None)
    with pytest.raises(CCWSIMError, match=r"need the package pyogrio; install .*\[files\]"):
        points(b"SQLite format 3\0" + bytes(84))


def test_a_shape_alone_says_what_it_lacks():
    with pytest.raises(CCWSIMError, match=r"without its table \(.dbf\)"):
        points(b"\0\0\x27\x0a" + bytes(96))
