"""Hard data as they stand in a file: locations, values and the lines they come from."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import MISSING_CODES, DataFile, layer
from ccwsim.io.formats.pictures import Picture
from ccwsim.io.limits import limits
from ccwsim.io.opening import PathOrFile, open_file
from ccwsim.model.arrays import frozen
from ccwsim.model.errors import CCWSIMError, shown

PREFERRED = ("hd", "hard_data")
"""Grids that are taken unasked where a file has several."""


@dataclass(frozen=True, eq=False)
class ImportedPoints:
    """Hard data of a file before they are put in cells.

    Attributes
    ----------
    places : ndarray of float64, shape (n, 2)
        x and y in the world where `world`, else row (from the south) and column.
    values : ndarray of float64, shape (n,)
        What was measured: a facies code or a continuous variable; never NaN.
    lines : ndarray of int64, shape (n,)
        Where in the file each datum stands, from 1.
    world : bool
        Whether places are world coordinates.
    counted : str
        What `lines` counts: "line" of a text, "row" or "cell" of an array.
    name, variable : str
        The file and the variable read.
    n_missing : int
        Rows left out because nothing is known there.
    notes : tuple of str
        What was taken for granted, one sentence each.
    """

    places: NDArray[np.float64]
    values: NDArray[np.float64]
    lines: NDArray[np.int64]
    world: bool
    counted: str
    name: str
    variable: str
    n_missing: int = 0
    notes: tuple[str, ...] = ()

    @property
    def n(self) -> int:
        """How many data there are."""
        return len(self.values)

    def named(self, which: NDArray[np.integer]) -> str:
        """Return where some of the data stand, in words: "lines 3, 7 and 12".

        Examples
        --------
        >>> none = np.empty(0)
        >>> points = ImportedPoints(none, none, np.array([2, 3]), True, "line", "a", "b")
        >>> points.named(np.array([0, 1]))
        'lines 2 and 3'
        """
        numbers = [str(line) for line in np.sort(self.lines[which])[:6]]
        if len(which) > 6:
            return f"{self.counted}s {', '.join(numbers)} and {len(which) - 6} more"
        if len(numbers) < 2:
            return f"{self.counted} {''.join(numbers)}"
        return f"{self.counted}s {', '.join(numbers[:-1])} and {numbers[-1]}"


def read_points(
    path_or_file: PathOrFile,
    *,
    grid_shape: tuple[int, int] | None = None,
    variable: str | None = None,
    coordinates: str | None = None,
    up: bool | None = None,
    slice_index: int | None = None,
) -> ImportedPoints:
    """Return the hard data of a file as they stand in it.

    Read are tables in text (CSV), Geo-EAS points, and grids of any format with NaN or a code for
    "missing" (−99, −999, −997799, −9977799) where nothing is known. An array or a headerless text
    of three columns that is not the grid itself is a list: row, col, facies in arrays, and
    x, y, facies (or x, y, z, facies) in texts.

    Parameters
    ----------
    path_or_file : str, Path or binary file
        Known by its content, not by its name.
    grid_shape : (ny, nx), optional
        The simulation grid: a file that holds a whole grid must have this shape.
    variable : str, optional
        Which column, variable or array holds the facies.
    coordinates : "world" or "cells", optional
        What two columns of unclear names mean: x and y, or row and col.
    up : bool, optional
        For whole grids: whether the first row is the south, as in `read_training_image`.
    slice_index : int, optional
        Which slice of a 3-D grid.

    Raises
    ------
    CCWSIMError
        For a file that cannot be read or has no columns of places and facies.

    Examples
    --------
    >>> from io import BytesIO
    >>> points = read_points(BytesIO(b"row,col,facies\\n3,4,1\\n"))
    >>> points.places.tolist(), points.values.tolist(), points.lines.tolist()
    ([[3.0, 4.0]], [1.0], [2])
    """
    known = isinstance(coordinates, str) and coordinates in ("world", "cells")
    if coordinates is not None and not known:
        raise CCWSIMError(f'coordinates = {shown(coordinates)} must be "world" or "cells"')
    file = open_file(path_or_file)
    if isinstance(file, Picture):
        raise CCWSIMError(f"{file.name} is a picture; hard data come as a table or a grid")
    if file.is_table:
        return _of_table(file, variable, coordinates)
    key = file.chosen(variable, PREFERRED)
    values = file.variables[key]
    if _is_list(values, file.lines is not None, grid_shape):
        return _of_list(file, key, coordinates)
    cells = layer(file.name, values, slice_index)
    south_first = file.south_first if up is None else up
    return _of_grid(file, key, cells if south_first else cells[::-1], grid_shape)


def _of_table(file: DataFile, variable: str | None, coordinates: str | None) -> ImportedPoints:
    names = list(file.variables)
    first, second, world, notes = place_columns(file, names, coordinates)
    rest = [name for name in names if name not in (first, second)]
    key = value_column(file, rest, variable)
    columns = file.variables
    _check_few(file.name, len(columns[key]), "rows")
    if file.lines is None:
        raise CCWSIMError(f"{file.name}: too many lines for hard data; leave out what is empty")
    height = height_column(rest, key)
    if height and len(np.unique(columns[height])) > 1:
        notes.append(f"The column {height} has several values; data are seen from above.")
    places = np.stack([columns[first], columns[second]], axis=1)
    return _known(file, key, places, columns[key], file.lines, world, "line", notes)


def _of_list(file: DataFile, key: str, coordinates: str | None) -> ImportedPoints:
    rows = file.variables[key][0]
    rows = rows[:, [0, 1, -1]]
    world = coordinates == "world" or (coordinates is None and file.lines is not None)
    said = "x, y and facies" if world else "row, column and facies"
    lines = file.lines if file.lines is not None else np.arange(1, len(rows) + 1)
    counted = "line" if file.lines is not None else "row"
    notes = [f"Columns without names were taken as {said}."]
    return _known(file, key, rows[:, :2], rows[:, 2], lines, world, counted, notes)


def _of_grid(
    file: DataFile, key: str, cells: NDArray, grid_shape: tuple[int, int] | None
) -> ImportedPoints:
    if grid_shape is not None and cells.shape != tuple(grid_shape):
        raise CCWSIMError(
            f"{file.name} is a grid of {cells.shape[0]} rows and {cells.shape[1]} columns, the "
            f"simulation grid has {grid_shape[0]} and {grid_shape[1]}; make them the same"
        )
    known = file.known(cells) & ~np.isin(cells, MISSING_CODES)
    _check_few(file.name, int(np.count_nonzero(known)), "known cells")
    places = np.argwhere(known)
    lines = np.flatnonzero(known) + 1
    return _known(file, key, places, cells[known], lines, False, "cell", [])


def _known(
    file: DataFile,
    key: str,
    places: NDArray,
    values: NDArray,
    lines: NDArray,
    world: bool,
    counted: str,
    notes: list[str],
) -> ImportedPoints:
    """Rows with a value; one that has a value but no place is an error."""
    _check_few(file.name, len(values), "rows")
    values, places = values.astype(np.float64), places.astype(np.float64)
    known = file.known(values) & ~np.isin(values, MISSING_CODES)
    points = ImportedPoints(
        frozen(places[known]),
        frozen(values[known]),
        frozen(lines[known]),
        world,
        counted,
        file.name,
        key,
        int(np.count_nonzero(~known)),
        tuple(notes),
    )
    lost = np.flatnonzero(~np.isfinite(points.places).all(axis=1))
    if len(lost):
        raise CCWSIMError(f"{file.name}, {points.named(lost)}: a coordinate is missing; add it")
    if not np.isfinite(points.values).all():
        bad = np.flatnonzero(~np.isfinite(points.values))
        raise CCWSIMError(f"{file.name}, {points.named(bad)}: the value is not finite; correct it")
    return points


def _check_few(name: str, n: int, what: str) -> None:
    if n > limits().points:
        raise CCWSIMError(
            f"{name}: {n} {what} are more than {limits().points} hard data; a grid without gaps "
            "is no hard data"
        )


def _is_list(values: NDArray, in_text: bool, grid_shape: tuple[int, int] | None) -> bool:
    """Three columns, or x, y, z, facies in a text, unless that is the grid itself."""
    one = values.shape[0] == 1 and (values.shape[2] == 3 or (in_text and values.shape[2] == 4))
    return one and (grid_shape is None or values.shape[1:] != tuple(grid_shape))


_X = ("x", "xcoord", "xcoordinate", "easting", "east", "lon", "longitude")
_Y = ("y", "ycoord", "ycoordinate", "northing", "north", "lat", "latitude")
_Z = ("z", "zcoord", "zcoordinate", "elevation", "depth")
_ROW = ("row", "rows", "i", "iy", "rowindex")
_COLUMN = ("col", "cols", "column", "columns", "j", "ix", "colindex", "columnindex")
_CODE = ("facies", "faciescode", "code", "codes", "class", "category", "lithology")
_VALUE = (*_CODE, "value", "var", "variable", "v")


def is_points(names: list[str]) -> bool:
    """Return whether columns of these names say where something is.

    Examples
    --------
    >>> is_points(["X [m]", "Y [m]", "facies"]), is_points(["facies", "porosity"])
    (True, False)
    """
    pairs = (_X, _Y), (_ROW, _COLUMN)
    return any(_first(names, first) and _first(names, second) for first, second in pairs)


def place_columns(
    file: DataFile, names: list[str], coordinates: str | None
) -> tuple[str, str, bool, list[str]]:
    """Return the columns of x and y, or of row and col; whether they are of the world; notes.

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
