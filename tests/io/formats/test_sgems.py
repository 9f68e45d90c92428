"""Test binary files of SGeMS: grids with their geometry, points, and refused files."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid, TrainingImage
from ccwsim.io import (
    import_hard_data,
    inspect,
    read_geometry,
    read_grid,
    read_training_image,
)
from tests.io.every_reader import CELLS, sgems, sgems_points

FLOATS = CELLS.astype(float)


def test_the_origin_is_the_centre_of_the_first_cell():
    content = sgems(FLOATS, cell=10.0, centre=505.0)
    assert np.array_equal(read_grid(BytesIO(content)), CELLS)
    assert read_geometry(BytesIO(content)) == Grid(6, 8, (10.0, 10.0), (500.0, 500.0))


def test_cells_without_a_value_are_unknown_and_said():
    values = np.where(CELLS == 2, np.nan, FLOATS)
    read = read_grid(BytesIO(sgems(values)))
    assert np.array_equal(read, values, equal_nan=True)
    with pytest.warns(UserWarning, match=r"16 of 48 cells have no value \(-9966699 means unk"):
        image = read_training_image(BytesIO(sgems(values)))
    assert np.array_equal(image.known, CELLS != 2)


def test_regions_after_the_values_are_passed_over():
    regions = b"\0\0\0\x0cRegionBlock\0\0\0\0\x01\0\0\0\x02r\0" + bytes(48)
    assert np.array_equal(read_grid(BytesIO(sgems(FLOATS) + regions)), CELLS)


def test_points_are_hard_data():
    content = sgems_points(FLOATS)
    assert [one.name for one in inspect(BytesIO(content)).variables] == ["X", "Y", "Z", "facies"]
    data = import_hard_data(BytesIO(content), Grid(6, 8), TrainingImage(CELLS)).hard_data
    assert data.n == 48
    assert np.array_equal(CELLS[tuple(data.cells.T)], data.facies)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (sgems(FLOATS)[:-1], "ends before the values"),
        (sgems(FLOATS)[:30], "ends before the values"),
        (sgems_points(FLOATS)[:-4], "ends before the values"),
        (sgems(FLOATS).replace(b"Cgrid", b"Mgrid"), "an SGeMS Mgrid is not read; save it in SG"),
        (sgems(FLOATS).replace(b"\0\0\0\x08\0\0\0\x06", b"\xff" * 8), "more than|values"),
        (sgems(FLOATS).replace(b"\0\0\0\x08\0\0\0\x06", bytes(8)), "empty or impossible"),
        (
            sgems(FLOATS).replace(b"\0\0\0\x01\0\0\0\x07facies", b"\xff" * 14),
            "more than 1000; save fewer",
        ),
    ],
)
def test_what_is_broken_or_not_read_is_named(content, said):
    with pytest.raises(CCWSIMError, match=said):
        read_grid(BytesIO(content))
