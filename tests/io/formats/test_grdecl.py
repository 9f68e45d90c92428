"""Test Eclipse GRDECL files of reservoir programs: geometry, inactive cells, repeat counts."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid
from ccwsim.io import inspect, maps_as_bytes, read_geometry, read_grid, read_training_image

CODES = np.array([[0, 0, 1, 2], [0, 1, 1, 2], [2, 1, 0, 0]])
FROM_NORTH = "\n".join(" ".join(map(str, row)) for row in CODES[::-1])
FROM_SOUTH = "\n".join(" ".join(map(str, row)) for row in CODES)
PLACED = Grid(3, 4, (10.0, 20.0), (500.0, 100.0))


def text(*keywords: str, rows: str = FROM_NORTH) -> BytesIO:
    parts = ["SPECGRID", "4 3 1 1 F /", *keywords, "FACIES", rows, "/", ""]
    return BytesIO("\n".join(parts).encode())


def coord(x: np.ndarray, y: np.ndarray) -> str:
    pillars = "\n".join(f"{a} {b} 0 {a} {b} 1" for b in y for a in x)
    return f"COORD\n{pillars}\n/\nZCORN\n48*0 48*1 /"


X, Y = 500 + 10.0 * np.arange(5), 100 + 20.0 * np.arange(4)


@pytest.mark.parametrize(
    ("keywords", "rows", "grid"),
    [
        ([], FROM_NORTH, None),
        ([coord(X, Y[::-1])], FROM_NORTH, PLACED),
        ([coord(X, Y)], FROM_SOUTH, PLACED),
        ([coord(X - 500, Y - 100), "MAPAXES", "500 200 500 100 600 100 /"], FROM_SOUTH, PLACED),
        ([coord(X - 500, Y - 100), "MAPAXES", "500 0 500 160 600 160 /"], FROM_NORTH, PLACED),
        (["DXV", "4*10 /", "DYV", "3*20 /", "DZV", "1 /"], FROM_NORTH, Grid(3, 4, (10.0, 20.0))),
        (["DX", "12*10 /", "DY", "12*20 /", "DZ", "12*1 /"], FROM_NORTH, Grid(3, 4, (10.0, 20.0))),
        (["DXV", "10 20 30 40 /", "DYV", "3*20 /"], FROM_NORTH, None),
        ([coord(X**1.1, Y[::-1])], FROM_NORTH, None),
    ],
)
def test_the_geometry_of_equal_cells_is_known(keywords, rows, grid):
    assert read_geometry(text(*keywords, rows=rows)) == grid
    assert np.array_equal(read_grid(text(*keywords, rows=rows)), CODES)


def test_columns_from_the_east_are_turned():
    rows = "\n".join(" ".join(map(str, row[::-1])) for row in CODES[::-1])
    keywords = coord(X[::-1], Y[::-1])
    assert np.array_equal(read_grid(text(keywords, rows=rows)), CODES)
    assert read_geometry(text(keywords, rows=rows)) == PLACED


def test_inactive_cells_are_unknown():
    active = text("ACTNUM", "4*1 2*0 6*1 /")
    values = read_grid(active)
    assert np.flatnonzero(np.isnan(values.ravel())).tolist() == [4, 5]
    with pytest.warns(UserWarning, match="2 of 12 cells have no value"):
        assert np.count_nonzero(~read_training_image(active).known) == 2
    alone = BytesIO(b"DIMENS\n2 1 1 /\nACTNUM\n0 1 /\n")
    assert read_training_image(alone).array.tolist() == [[0, 1]]


def test_words_between_keywords_and_comments_are_passed_over():
    content = text("NOECHO", "INCLUDE", "'a/b.inc' /", "-- PORO 12*1 /", "PORO 12*0.25 /")
    assert [v.name for v in inspect(content).variables] == ["PORO", "FACIES"]
    assert np.array_equal(read_grid(content, variable="facies"), CODES)


def test_a_broken_geometry_is_named():
    with pytest.raises(CCWSIMError, match="the geometry is broken"):
        read_grid(text("COORD", "1 2 3 /"))
    with pytest.raises(CCWSIMError, match="geometry is broken"):
        read_grid(text("DXV", "4*-10 /", "DYV", "3*20 /", "MAPAXES", "1 2 /"))


def test_a_file_has_the_geometry_once_and_short_keywords():
    grid = Grid(2, 3, (10.0, 20.0, 2.5), (500.0, 100.0, -20.0), nz=2)
    cells = np.arange(12).reshape(grid.shape) % 2
    given = {"facies": cells, "probability of mud": cells, "probability of sand": cells / 4}
    content = maps_as_bytes({**given, "run 10": cells, "COORD": cells, "1": cells}, grid, "grdecl")
    lines = content.decode().splitlines()
    keywords = [line for line in lines if line[:1].isalpha()]
    assert keywords[:5] == ["SPECGRID", "COORD", "ZCORN", "FACIES", "PROBABIL"]
    assert len(set(keywords)) == len(keywords) == 9
    assert all(len(word) <= 8 for word in keywords)
    assert max(map(len, lines)) <= 128
    assert "RUN_10" in keywords
    assert "-- MAP-3 is probability of sand" in lines
