"""Which columns of a table are the places and which the facies, by their names."""

from __future__ import annotations

import re
from dataclasses import replace

from ccwsim.io.data_file import DataFile
from ccwsim.model.errors import CCWSIMError

_X = ("x", "xcoord", "xcoordinate", "easting", "east", "lon", "longitude")
_Y = ("y", "ycoord", "ycoordinate", "northing", "north", "lat", "latitude")
_Z = ("z", "zcoord", "zcoordinate", "elevation", "depth")
_ROW = ("row", "rows", "i", "iy", "rowindex")
_COLUMN = ("col", "cols", "column", "columns", "j", "ix", "colindex", "columnindex")
_VALUE = ("facies", "code", "codes", "value", "var", "variable", "class", "category", "lithology",
          "faciescode", "v")  # fmt: skip


def place_columns(
    file: DataFile, names: list[str], coordinates: str | None
) -> tuple[str, str, bool, list[str]]:
    """Return the columns of x and y, or of row and col; whether they are of the world; notes.

    Raises
    ------
    CCWSIMError
        Where there are too few columns.

    Examples
    --------
    >>> file = DataFile("table", "a.csv", {}, is_table=True)
    >>> place_columns(file, ["Easting [m]", "Northing [m]", "facies"], None)
    ('Easting [m]', 'Northing [m]', True, [])
    """
    x, y = _first(names, _X), _first(names, _Y)
    row, column = _first(names, _ROW), _first(names, _COLUMN)
    if x and y and coordinates != "cells":
        return x, y, True, []
    if row and column and coordinates != "world":
        letters = {_plain(row), _plain(column)} == {"i", "j"}
        note = [f"{row} was taken as the row and {column} as the column."] if letters else []
        return row, column, False, note
    if len(names) < 3:
        there = ", ".join(names)
        raise CCWSIMError(
            f"{file.name} needs columns x, y, facies or row, col, facies; it has {there}"
        )
    world = coordinates != "cells"
    said = "x and y" if world else "row and col"
    note = f"No column is called so: {names[0]} and {names[1]} were taken as {said}."
    return names[0], names[1], world, [note]


def value_column(file: DataFile, rest: list[str], variable: str | None) -> str:
    """Return the column of facies among those that are no places.

    Raises
    ------
    CCWSIMError
        Where there is none, or several and none was picked.

    Examples
    --------
    >>> import numpy as np
    >>> columns = dict.fromkeys(["x", "y", "id", "Code"], np.zeros(1))
    >>> value_column(DataFile("table", "a.csv", columns, is_table=True), ["id", "Code"], None)
    'Code'
    """
    columns = replace(file, variables={name: file.variables[name] for name in rest})
    if not rest:
        raise CCWSIMError(f"{file.name} has no column of facies codes (whole numbers, no words)")
    if variable is not None:
        return columns.chosen(variable)
    named = [name for name in rest if _plain(name) in _VALUE]
    if len(named) == 1:
        return named[0]
    flat = [name for name in rest if _plain(name) not in _Z]
    if len(flat) == 2 and len(file.variables) == 4 and _unnamed(file):
        return flat[1]  # x, y, z, value without telling names
    if len(flat) == 1 or len(rest) == 1:
        return (flat or rest)[0]
    return columns.chosen(None)


def _unnamed(file: DataFile) -> bool:
    return all(re.match(r"(col|column|var)[ _]?\d", name.lower()) for name in file.variables)


def height_column(rest: list[str], key: str) -> str | None:
    """Return the column of heights among those that are no places, if there is one.

    Examples
    --------
    >>> height_column(["Z", "facies"], "facies")
    'Z'
    """
    return next((name for name in rest if _plain(name) in _Z and name != key), None)


def _first(names: list[str], known: tuple[str, ...]) -> str | None:
    return next((name for word in known for name in names if _plain(name) == word), None)


def _plain(name: str) -> str:
    """A column's name without units, case and marks: "X [m]" is x."""
    return re.sub(r"[^a-z0-9]", "", re.split(r"[\[(,]", name.lower())[0])
