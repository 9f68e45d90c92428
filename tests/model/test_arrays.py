"""Test the checks, conversions and words that all folders share."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import CCWSIMError
from ccwsim.model.arrays import (
    LazyStack,
    as_integers,
    check_int,
    is_integer,
    is_table,
    labelled_axes,
    listing,
    oriented_values,
    ratio,
)
from ccwsim.model.classes import are_codes, merge_facies
from ccwsim.model.errors import shown
from ccwsim.model.grid import fault_of_crs
from ccwsim.model.missing import known_values, unknown_note
from ccwsim.model.numbers import duration, format_bytes, plural, with_power
from ccwsim.model.parameters import describe_weight


def test_words():
    assert [listing(letters) for letters in ("x", "xy", "xyz")] == ["x", "x and y", "x, y and z"]
    assert (plural(1, "cell"), plural(3, "cell")) == ("1 cell", "3 cells")
    assert [duration(s) for s in (0.0123, 0.9997, 75.0)] == ["12.3 ms", "1 s", "75 s"]
    assert [duration(s, rough=True) for s in (0.2, 59.7, 125, 7260)] == [
        "1 s",
        "60 s",
        "2 min",
        "2.0 h",
    ]
    travel = [duration(s) for s in (86400.0, 3.2e8, float("inf"))]
    assert travel == ["1 d", "10.1 years", "never"]
    assert [format_bytes(n) for n in (12.3e9, 45e6)] == ["12.3 GB", "45 MB"]
    small = [with_power(x) for x in (3.214e-5, -2e-12, 0.0, 12.5, 1.0)]
    assert small == ["3.21 × 10⁻⁵", "−2 × 10⁻¹²", "0", "12.5", "1"]
    assert [shown(v) for v in ("sand", (3, 4))] == ["'sand'", "(3, 4)"]
    assert (shown(10**5000), len(shown("a" * 10**6))) == ("a value of type int", 80)
    weights = [describe_weight(w) for w in (0.5, (2, 0, 0), (1, 0.5, 0.5))]
    assert weights == ["0.5", "2 along z", "1 along z, 0.5 along y and 0.5 along x"]
    assert fault_of_crs("EPSG:32632") == ""
    assert fault_of_crs("UTM 32").startswith("is not a coordinate system; give a code such as EPSG")


def test_integers():
    assert [is_integer(v) for v in (np.uint8(3), 3.0, True)] == [True, False, False]
    assert check_int("size", 4, 1, 8) == 4
    with pytest.raises(CCWSIMError, match="size = 9 must be a whole number from 1 to 8"):
        check_int("size", 9, 1, 8)
    assert as_integers([0.9999, 3], "codes").tolist() == [1, 3]
    assert as_integers(np.array([7], np.uint64), "numbers", 0).tolist() == [7]


def test_arrays():
    assert is_table({"x": [1.0], "facies": [0]})
    assert not is_table([[1.0, 0]])
    assert np.array_equal(ratio(np.array([1, 2]), np.array([2, 0])), [0.5, np.nan], equal_nan=True)
    stack = LazyStack(np.array([[[2, 7]], [[7, 7]]]), np.array([2, 7]))
    assert (stack[1].tolist(), stack.shape, np.mean(stack)) == ([[1, 1]], (2, 1, 2), 0.75)


def test_codes():
    merged = merge_facies(np.array([[0, 2, 2, 9, 5, 5]]), {2: 0, 9: None})
    assert merged.tolist() == [[0, 0, 0, 0, 5, 5]]
    assert are_codes(np.array([0, 0.9999, 2]))
    assert not are_codes(np.array([0.1, 0.2]))
    known = known_values(np.array([0.0, np.nan, -9999.0, -1.0]), [-1.0])
    assert known.tolist() == [True, False, False, False]
    said = unknown_note(np.array([0, 1, -9999]))
    assert said == "1 of 3 cells have no value (-9999 means unknown)"


def test_arrays_with_named_axes():
    xarray = pytest.importorskip("xarray")
    down = xarray.DataArray([[1, 2], [3, 4]], {"y": [20.0, 10.0]}, dims=("y", "x"))
    assert oriented_values(down).tolist() == [[3, 4], [1, 2]]
    array = xarray.DataArray(np.zeros((2, 3)), {"x": [5.0, 15.0, 25.0]}, dims=("y", "x"))
    assert labelled_axes(array) == [(10.0, 0.0), (1.0, 0.0)]
