"""Test how fields, names and tables in text are read and written."""

from __future__ import annotations

import numpy as np

from ccwsim import Grid
from ccwsim.io.data_file import DataFile, distinct_names, printable
from ccwsim.io.formats.csv_table import csv_as_bytes
from ccwsim.io.formats.text_grids import grid_as_bytes
from ccwsim.io.formats.text_tables import (
    column_of_numbers,
    decimal_of,
    field_number,
    separator_of,
    split_fields,
)
from ccwsim.io.hard_data.columns import INTERVAL_ROLES, columns_by_role


def test_names_are_short_printable_and_distinct():
    assert printable(" sand" + chr(7) + chr(10)) == "sand"
    assert distinct_names(["a", "a", ""]) == ["a", "a (2)", "column 3"]


def test_fields():
    assert split_fields('"W 1"; 2,5;', ";") == ["W 1", "2,5", ""]
    assert split_fields('"W 1"  2.5', None) == ["W 1", "2.5"]
    numbers = [field_number(*given) for given in (("2,5", ","), ("1.234,5", ","), ("1,234.5", "."))]
    assert numbers == [2.5, 1234.5, 1234.5]
    assert np.isnan(field_number("NA", ".") or 0.0)
    assert field_number("sand", ".") is None


def test_columns():
    columns = [column_of_numbers(fields) for fields in (["2", "NA"], ["yes", ""])]
    assert np.array_equal(columns, [[2, np.nan], [1, np.nan]], equal_nan=True)
    assert column_of_numbers(["sand"]) is None


def test_separators_and_decimal_marks():
    lines = "10,5;20;1", "1, 2, 3", "1,5 2,5 1"
    assert [separator_of([line]) for line in lines] == [";", ",", None]
    assert [decimal_of([line], ";") for line in ("10,5;20;1", "1,234.5;2;1")] == [",", "."]


def test_formulas_are_texts_in_spreadsheets():
    table = csv_as_bytes(["name", "value"], [["sand", -3.5], ["=1+1", "-2"]])
    assert table == b"name,value\nsand,-3.5\n'=1+1,-2\n"


def test_grids_with_another_cell_size_state_their_place():
    assert grid_as_bytes([np.array([[0, 1], [1, 1]])], ["f"]) == b"2 2 1\n1\nf\n0\n1\n1\n1\n"
    placed = Grid(1, 2, cell_size=(10.0, 5.0), origin=(350000.0, 4505000.0))
    content = grid_as_bytes([np.array([[0, 1]])], ["f"], placed)
    assert content == b"2 1 1 10.0 5.0 1 350000.0 4505000.0 0\n1\nf\n0\n1\n"


def test_roles_of_columns_are_guessed_or_given():
    columns = ("hole", "from", "to", "depth", "rock")
    file = DataFile("table", "a.csv", {}, is_table=True, columns=columns)
    guessed = {"well": "hole", "depth_from": "from", "depth_to": "to"}
    assert columns_by_role(file, INTERVAL_ROLES, {}) == guessed
    assert columns_by_role(file, INTERVAL_ROLES, {"depth": "DEPTH", "well": ""}) == {
        "depth": "depth"
    }
