"""Hard data as they stand in a file: places, values and the lines they come from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import MISSING_CODES, DataFile, layer
from ccwsim.io.formats.pictures import Picture
from ccwsim.io.hard_data.point_columns import height_column, place_columns, value_column
from ccwsim.io.limits import limits
from ccwsim.io.opening import open_file
from ccwsim.io.source import PathOrFile
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
    file: DataFile, key: str, places: NDArray, values: NDArray, lines: NDArray,
    world: bool, counted: str, notes: list[str],
) -> ImportedPoints:  # fmt: skip
    """Rows with a value; one that has a value but no place is an error."""
    _check_few(file.name, len(values), "rows")
    values, places = values.astype(np.float64), places.astype(np.float64)
    known = file.known(values) & ~np.isin(values, MISSING_CODES)
    points = ImportedPoints(
        frozen(places[known]), frozen(values[known]), frozen(lines[known]), world, counted,
        file.name, key, int(np.count_nonzero(~known)), tuple(notes),
    )  # fmt: skip
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
