"""Test files with secondary information: probabilities, curves, variables, and active cells."""

import json
from io import BytesIO

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid
from ccwsim.io import (
    angles_along,
    limits,
    read_active,
    read_lines,
    read_probabilities,
    read_values,
)
from tests.io import sample_files as sample

RING = [[0, 0], [9, 0], [0, 9]]


def collection(*geometries: dict) -> BytesIO:
    features = [{"type": "Feature", "geometry": one} for one in geometries]
    return BytesIO(json.dumps({"type": "FeatureCollection", "features": features}).encode())


def test_a_grid_has_one_variable_for_each_facies():
    found = read_probabilities(BytesIO(sample.probabilities()), Grid(3, 4))
    assert list(found) == [0, 1]
    assert found[0].shape == (3, 4)
    np.testing.assert_allclose(found[0].ravel()[:11] + found[1].ravel()[:11], 1)
    assert np.isnan(found[0][2, 3])


def test_curves_are_sorted_by_height():
    head, *rows = sample.vertical_curves().splitlines()
    upside_down = b"\n".join([head, *rows[::-1]])
    found = read_probabilities(BytesIO(upside_down), Grid(3, 4, nz=5))
    np.testing.assert_allclose(found[0], [0.1, 0.2, 0.3, 0.4, 0.5])
    with pytest.raises(CCWSIMError, match="5 rows, but the grid has 4 layers"):
        read_probabilities(BytesIO(upside_down), Grid(3, 4, nz=4))
    with pytest.raises(CCWSIMError, match="the grid has no layers"):
        read_probabilities(BytesIO(upside_down), Grid(3, 4))


def test_a_map_of_another_place_is_refused():
    esri = b"ncols 4\nnrows 3\nxllcorner 100\nyllcorner 50\ncellsize 10\n" + b"1 2 3 4\n" * 3
    own = Grid(3, 4, (10.0, 10.0), (100.0, 50.0))
    assert read_values(BytesIO(esri), own).shape == (3, 4)
    assert read_values(BytesIO(esri), Grid(3, 4)).shape == (3, 4)  # without world coordinates
    with pytest.raises(CCWSIMError, match=r"x from 100 to 140, .* but the grid has x from 120"):
        read_values(BytesIO(esri), Grid(3, 4, (10.0, 10.0), (120.0, 50.0)))


def test_polygons_have_holes_and_may_overlap():
    active = read_active(BytesIO(sample.polygons()), Grid(3, 4))
    assert active.all()  # the second polygon covers the hole of the first
    ring = [[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]
    hole = [[1, 1], [2, 1], [2, 2], [1, 2], [1, 1]]
    active = read_active(collection({"type": "Polygon", "coordinates": [ring, hole]}), Grid(3, 4))
    assert np.argwhere(~active).tolist() == [[1, 1]]


def test_polygons_that_would_take_minutes_are_refused():
    many = {"type": "MultiPolygon", "coordinates": [[RING]] * 1001}
    with pytest.raises(CCWSIMError, match="has 1001 polygons with 3003 points; 1000 with"):
        read_active(collection(many), Grid(3, 4))
    long = {"type": "Polygon", "coordinates": [RING * 40_000]}
    with (
        limits.limited(limits.UPLOAD_LIMITS),
        pytest.raises(CCWSIMError, match="has 1 polygon with 120000 points"),
    ):
        read_active(collection(long), Grid(3, 4))


@pytest.mark.parametrize(
    ("geometry", "said"),
    [
        ({"type": "Point", "coordinates": [0, 0]}, "has no polygon"),
        ({"type": "Polygon", "coordinates": [RING[:2]]}, "a polygon needs at least 3 points"),
        ({"type": "Polygon", "coordinates": [[["a", "b"]] * 3]}, "not valid GeoJSON"),
        ({"type": "Polygon"}, "not valid GeoJSON|has no polygon"),
    ],
)
def test_other_geometries_are_refused(geometry, said):
    with pytest.raises(CCWSIMError, match=said):
        read_active(collection(geometry), Grid(3, 4))


LINES = [[0, 0], [9, 3]], [[2.5, 1, 8], [2, 7, 8], [4, 9, 12]]


@pytest.mark.parametrize(
    "geometry",
    [
        {"type": "MultiLineString", "coordinates": LINES},
        {"type": "GeometryCollection", "geometries": [
            {"type": "LineString", "coordinates": line} for line in LINES
        ]},
    ],
)  # fmt: skip
def test_lines_are_read_from_geojson(geometry):
    one, two = read_lines(collection(geometry))
    np.testing.assert_array_equal(one, LINES[0])
    np.testing.assert_array_equal(two, [[2.5, 1], [2, 7], [4, 9]])


def test_files_without_lines_are_refused_or_not_geojson():
    assert read_lines(BytesIO(b"2 1 1")) is None
    with pytest.raises(CCWSIMError, match="has no line; give a LineString"):
        read_lines(collection({"type": "Polygon", "coordinates": [RING]}))
    with pytest.raises(CCWSIMError, match="a line needs at least 2 points"):
        read_lines(collection({"type": "LineString", "coordinates": [[1, 2]]}))


@pytest.mark.parametrize("azimuth", [0.0, 37.5, 90.0, 180.0, 271.0])
def test_a_straight_line_gives_its_azimuth_everywhere(azimuth):
    a, grid = np.deg2rad(azimuth), Grid(30, 200, (2.0, 5.0), (1e6, -50.0))
    way = 70 * np.array([np.sin(a), np.cos(a)])
    middle = np.array([1e6 + 150, 30.0])
    found = angles_along([[middle - way, middle, middle + way]], grid, azimuth=20.0)
    np.testing.assert_allclose(found, (azimuth - 20) % 360, atol=1e-6)


def test_angles_equal_the_direction_on_a_line_and_change_smoothly_between_lines():
    turn = np.linspace(0, np.pi / 2, 40)
    arc = np.column_stack([90 - 80 * np.cos(turn), 10 + 80 * np.sin(turn)])  # north, then east
    found = angles_along([arc], Grid(100, 100))
    for k in (5, 15, 25, 34):
        column, row = arc[k].astype(int)
        assert abs(found[row, column] - np.degrees(turn[k])) < 4
    both = angles_along([[(10, 0), (10, 100)], [(90, 0), (140, 50)]], Grid(100, 100))
    assert abs(both[50, 10]) < 2
    along = (both[50] + 180) % 360 - 180
    assert np.abs(np.diff(along)).max() < 3
    assert 0 < along[50] < 45


def test_layers_of_a_volume_have_equal_angles():
    found = angles_along([[(0, 0), (5, 0)]], Grid(4, 6, nz=3))
    assert found.shape == (3, 4, 6)
    np.testing.assert_allclose(found, 90)


@pytest.mark.parametrize("lines", [[], [[(1, 2)]], [[(1, 2), (1, 2)]]])
def test_lines_without_length_are_refused(lines):
    with pytest.raises(CCWSIMError, match="two different points"):
        angles_along(lines, Grid(3, 4))
