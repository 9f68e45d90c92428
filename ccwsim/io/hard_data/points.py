"""Hard data as they stand in a file: locations, values and the lines they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import MISSING_CODES, DataFile, layer, printable
from ccwsim.io.formats.classes import are_codes
from ccwsim.io.formats.pictures import Picture
from ccwsim.io.formats.text_tables import UNKNOWN, is_number, not_a_number
from ccwsim.io.hard_data.columns import (
    DEPTHS,
    HEIGHTS,
    LAYERS,
    WELL_OF_POINTS,
    Asked,
    HeightRoles,
    Roles,
    asked_columns,
    columns_of,
    height_column,
    height_roles,
    place_columns,
    table_roles,
    value_column,
)
from ccwsim.io.hard_data.depths import heights_below
from ccwsim.io.limits import limits
from ccwsim.io.opening import PathOrFile, open_file
from ccwsim.model.arrays import Shape, check_int, describe_shape, frozen
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid

PREFERRED = ("hd", "hard_data")
"""Grids that are taken unasked where a file has several."""


@dataclass(frozen=True, eq=False)
class ImportedPoints:
    """Hard data of a file before they are put in cells.

    Attributes
    ----------
    places : ndarray of float64, shape (n, 2) or, of a volume, (n, 3)
        x, y (and z) in the world where `world`, else (layer,) row (from the south) and column.
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
    words : tuple of str
        Where facies are given by name: the different names; `values` are places in it.
    grid : Grid, optional
        Where the file is a whole grid with gaps: that grid, placed where the file says.
    spans : ndarray of float64, shape (n, 2), optional
        Of intervals in vertical wells: z of their bottoms and tops; z in `places` is the middle.
    wells : dict of int to str
        Of a volume, where the file names wells: the name of the well of each line.
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
    words: tuple[str, ...] = ()
    grid: Grid | None = None
    spans: NDArray[np.float64] | None = None
    wells: Mapping[int, str] = field(default_factory=dict)

    @property
    def n(self) -> int:
        """How many data there are."""
        return len(self.values)

    @property
    def continuous(self) -> bool:
        """Whether the values need a threshold or classes to become facies."""
        return not self.words and self.n > 0 and not are_codes(self.values)

    def said(self, k: int) -> str:
        """Return the value of a datum as the file has it, a name or a number."""
        value = self.values[k]
        return self.words[int(value)] if self.words else f"{value:g}"

    def named(self, which: NDArray[np.integer]) -> str:
        """Return where some of the data stand, in words: "lines 3, 7 and 12".

        Examples
        --------
        >>> none = np.empty(0)
        >>> points = ImportedPoints(none, none, np.array([2, 3]), True, "line", "a", "b")
        >>> points.named(np.array([0, 1]))
        'lines 2 and 3'
        """
        different = np.unique(self.lines[which])  # a well has many cells from one line
        numbers = [str(line) for line in different[:6]]
        if len(different) > 6:
            return f"{self.counted}s {', '.join(numbers)} and {len(different) - 6} more"
        if len(numbers) < 2:
            return f"{self.counted} {''.join(numbers)}"
        return f"{self.counted}s {', '.join(numbers[:-1])} and {numbers[-1]}"


def read_points(
    path_or_file: PathOrFile,
    *,
    grid_shape: Shape | None = None,
    x: str | None = None,
    y: str | None = None,
    facies: str | None = None,
    variable: str | None = None,
    coordinates: str | None = None,
    up: bool | None = None,
    slice_index: int | None = None,
    z: str | None = None,
    z_up: bool | None = None,
    well: str | None = None,
    depth_from: str | None = None,
    depth_to: str | None = None,
    depth: str | None = None,
) -> ImportedPoints:
    """Return the hard data of a file as they stand in it.

    Read are tables in text (CSV, Petrel points, well logs), Geo-EAS points, GeoJSON, GeoPackage and
    Shapefile points (the last two with pyogrio), and grids of any format with NaN or a code for
    "missing" (−99, −999, −997799, −9977799) where nothing is known. An array or a headerless text
    of three columns that is not the grid itself is a list: row, col, facies in arrays, and
    x, y, facies (or x, y, z, facies) in texts.

    Parameters
    ----------
    path_or_file : str, Path or binary file
        Known by its content, not by its name.
    grid_shape : (ny, nx) or (nz, ny, nx), optional
        The simulation grid: a file that holds a whole grid must have this shape. For a volume, data
        have heights as well: z, or the layer of a cell.
    x, y : str, optional
        Which columns of a table hold the places; guessed by their names where not given. With
        `coordinates="cells"`, x is the column and y the row of a cell.
    facies : str, optional
        Which column, variable or array holds the facies, as numbers or names. A column of heights
        or of the names of wells is never taken unasked.
    variable : str, optional
        The same as `facies`.
    coordinates : "world" or "cells", optional
        What two columns of unclear names mean: x and y, or row and col.
    up : bool, optional
        For whole grids: whether the first row is the south, as in `read_training_image`.
    slice_index : int, optional
        Which slice of a 3-D grid.
    z : str, optional
        For a volume: which column holds the elevation of points, or of the collars of vertical
        wells where depths stand beside it: one a row, or from and to of intervals; or, with
        `coordinates="cells"`, the layer. Guessed by the names where not given.
    z_up : bool, optional
        For whole grids of a volume: whether the first layer is the bottom, as it is by default.
    well : str, optional
        For a volume: which column holds the names of wells.
    depth_from, depth_to, depth : str, optional
        For a volume: which columns hold depths below z, two of intervals or one of points. Guessed
        by the names where not given, as `well` is; "" says that there is none, so that z is that of
        the points.

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
    if facies is not None and variable is not None and shown(facies) != shown(variable):
        raise CCWSIMError(
            f"facies = {shown(facies)} and variable = {shown(variable)} mean the same; give one"
        )
    variable = facies if variable is None else variable
    heights = {"z": z, "depth_from": depth_from, "depth_to": depth_to, "depth": depth}
    asked = {"x": x, "y": y, "facies": variable, "well": well, **heights}
    if file.is_table:
        return _of_table(file, *_roles(file, asked, coordinates, grid_shape))
    named = [name for name, column in asked.items() if column and name != "facies"]
    if named:
        said = " and ".join(named[:2])
        raise CCWSIMError(f"{file.name} has no named columns; leave {said} out")
    key = file.chosen(variable, PREFERRED)
    values = file.variables[key]
    if _is_list(values, file.lines is not None, grid_shape):
        return _of_list(file, key, coordinates, _is_volume(grid_shape))
    if not _is_volume(grid_shape):
        cells = layer(file.name, values, slice_index)
    else:
        cells = values[::-1] if z_up is False else values
    south_first = file.south_first if up is None else up
    return _of_grid(file, key, cells if south_first else np.flip(cells, -2), grid_shape)


def _is_volume(grid_shape: Shape | None) -> bool:
    return grid_shape is not None and len(grid_shape) == 3


def _roles(
    file: DataFile, asked: Asked, coordinates: str | None, grid_shape: Shape | None
) -> tuple[Roles, HeightRoles, str]:
    """Columns of places and facies; where the grid is a volume those of heights and wells too."""
    of_volume = {name: asked[name] for name in ("z", *DEPTHS, "well")}
    if not _is_volume(grid_shape):
        for name, column in of_volume.items():
            if column:
                raise CCWSIMError(
                    f"{name} = {shown(column)} is of a volume; give a grid with nz, or leave it out"
                )
        roles = table_roles(file, asked["x"], asked["y"], asked["facies"], coordinates)
        return roles, HeightRoles(), ""
    named = asked_columns(file, asked)
    others = [column for name, column in named.items() if name not in ("x", "y")]
    first, second, world, notes = place_columns(file, asked["x"], asked["y"], coordinates, others)
    taken = [named[name] for name in ("facies", "well") if name in named]
    heights = height_roles(file, of_volume, [first, second, *taken], world)
    taken = [first, second, *taken, heights.z, *heights.depths]
    well = columns_of(file, WELL_OF_POINTS, of_volume, taken).get("well", "")
    rest = [name for name in file.names if name not in (*taken, well)]
    return (
        Roles(first, second, world, value_column(file, rest, asked["facies"]), notes),
        heights,
        well,
    )


@dataclass(frozen=True)
class PointsPreview:
    """A table of hard data at a first look: its columns, first rows, and what is guessed of them.

    Attributes
    ----------
    name : str
        The file.
    columns : tuple of str
        All columns in their order; empty where the file is a grid or a list without names.
    numeric : tuple of str
        Those that hold numbers.
    rows : tuple of tuple of str
        The first rows, as they are read: a number written as 2,5 is 2.5 here.
    lines : tuple of int
        Where in the file each of them stands.
    n_rows : int
        How many rows there are.
    guess : dict of str
        For "x", "y" and "facies" the column that is taken, where one is; of a volume, and of tables
        of wells, by the other arguments that name columns, too.
    reasons : tuple of str
        What was taken for granted, and what has to be asked, one sentence each.
    world : bool
        Whether the places are world coordinates, and not rows and columns.
    unclear : bool
        Whether the names of the columns do not say which of them hold the places.
    """

    name: str
    columns: tuple[str, ...]
    numeric: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    n_rows: int
    guess: dict[str, str]
    reasons: tuple[str, ...]
    world: bool = True
    unclear: bool = False


def preview_points(
    path_or_file: PathOrFile,
    *,
    grid_shape: Shape | None = None,
    x: str | None = None,
    y: str | None = None,
    facies: str | None = None,
    coordinates: str | None = None,
    n_rows: int = 6,
    z: str | None = None,
    well: str | None = None,
    depth_from: str | None = None,
    depth_to: str | None = None,
    depth: str | None = None,
) -> PointsPreview:
    """Return what a table of hard data holds and which columns are taken for what.

    Parameters
    ----------
    path_or_file, x, y, facies, coordinates, z, well, depth_from, depth_to, depth
        As in `read_points`.
    grid_shape : (ny, nx) or (nz, ny, nx), optional
        The simulation grid: for a volume, columns of heights and of wells are looked for as well.
    n_rows : int
        How many rows to show, at least 1.

    Raises
    ------
    CCWSIMError
        For a file that cannot be read; columns that cannot be guessed are no error here.

    Examples
    --------
    >>> from io import BytesIO
    >>> found = preview_points(BytesIO(b"Well;Ostwert;Hochwert;Litho\\nA;1,5;2,5;Sand\\n"))
    >>> found.guess
    {'x': 'Ostwert', 'y': 'Hochwert', 'facies': 'Litho'}
    >>> found.rows
    (('A', '1.5', '2.5', 'Sand'),)
    """
    n_rows = check_int("n_rows", n_rows, 1)
    file = open_file(path_or_file)
    if isinstance(file, Picture) or not file.is_table:
        return PointsPreview(file.name, (), (), (), (), 0, {}, ())
    heights = {"z": z, "depth_from": depth_from, "depth_to": depth_to, "depth": depth}
    volume = _is_volume(grid_shape)
    asked = {"x": x, "y": y, "facies": facies, **(heights | {"well": well} if volume else {})}
    named: dict[str, str] = {}
    guess: dict[str, str] = {}
    reasons: list[str] = []
    world = coordinates != "cells"
    try:
        named = asked_columns(file, asked)
        others = [column for role, column in named.items() if role not in ("x", "y")]
        guess["x"], guess["y"], world, reasons = place_columns(file, x, y, coordinates, others)
    except CCWSIMError as error:
        reasons.append(str(error))
    unclear = bool(reasons)
    if volume:
        try:
            roles = {**(HEIGHTS if world else LAYERS), **WELL_OF_POINTS}
            taken = [*guess.values(), *(named[role] for role in ("facies",) if role in named)]
            guess |= columns_of(file, roles, asked, taken)
            height_roles(file, asked, taken, world)
        except CCWSIMError as error:
            reasons.append(str(error))
    return preview_of(file, guess, reasons, facies, n_rows, world=world, unclear=unclear)


def preview_of(
    file: DataFile,
    guess: dict[str, str],
    reasons: Sequence[str],
    facies: str | None,
    n_rows: int,
    **found: bool,
) -> PointsPreview:
    """Return a first look at a table, with the column of facies among those that are left.

    An empty `facies` is none at all.
    """
    said = list(reasons)
    if facies != "":
        try:
            rest = [name for name in file.names if name not in guess.values()]
            guess = guess | {"facies": value_column(file, rest, facies)}
        except CCWSIMError as error:
            said.append(str(error))
    texts = [_texts(file, name, n_rows) for name in file.names]
    n = len(next(iter(file.variables.values())))
    lines = file.lines if file.lines is not None else np.arange(1, n + 1)
    return PointsPreview(
        file.name,
        file.names,
        tuple(file.variables),
        tuple(zip(*texts, strict=True)),
        tuple(lines[:n_rows].tolist()),
        n,
        guess,
        tuple(dict.fromkeys(said)),
        **found,
    )


def _texts(file: DataFile, column: str, n: int) -> Sequence[str]:
    if column in file.words:
        return [printable(field) for field in file.words[column][:n]]
    return ["" if v != v else f"{v:.12g}" for v in file.variables[column][:n].tolist()]


def _of_table(file: DataFile, roles: Roles, heights: HeightRoles, well: str) -> ImportedPoints:
    _check_few(file.name, len(next(iter(file.variables.values()))), "rows")
    lines = file.lines
    if lines is None:
        raise CCWSIMError(f"{file.name}: too many lines for hard data; leave out what is empty")
    first, second = (place_numbers(file, name, lines) for name in (roles.x, roles.y))
    notes = list(roles.notes)
    height = None if heights.z else height_column(list(file.variables), roles.facies)
    if height and len(np.unique(file.variables[height])) > 1:
        notes.append(f"The column {height} has several values; data are seen from above.")
    along, spans = [first, second], None
    if heights.z:
        columns = [place_numbers(file, name, lines) for name in (heights.z, *heights.depths)]
        z, spans = heights_below(file.name, lines, columns[0], columns[1:])
        along.append(z)
        if heights.depths:
            below = " and ".join(heights.depths)
            notes.append(f"{heights.z} is that of the collar, and {below} below it.")
    places = np.stack(along if roles.world else along[::-1], axis=1)
    values, words = facies_column(file, roles.facies)
    own = replace(file, missing=()) if words else file  # a place in the names is no value
    how = roles.world, file.counted, notes, spans
    points = known_points(own, roles.facies, places, values, lines, *how)
    names = zip(lines.tolist(), names_of_wells(file, well), strict=True) if well else ()
    return replace(points, words=words, wells=dict(names))


def names_of_wells(file: DataFile, column: str) -> list[str]:
    """Return the names of wells, equal for a number in a column of words and in one of numbers."""
    if column in file.words:
        words = [name.strip() for name in file.words[column]]
        return [(is_number(word) and _name_of(float(word))) or word for word in words]
    return [_name_of(value) for value in file.variables[column].tolist()]


def _name_of(number: float) -> str:
    """A number as the name of a well, with all its digits: those of a sidetrack are the last."""
    if not np.isfinite(number):
        return ""
    return str(int(number)) if number.is_integer() else repr(number)


def place_numbers(file: DataFile, column: str, lines: NDArray[np.int64]) -> NDArray[np.float64]:
    """A column of places; the first word in it is said."""
    if column in file.words:
        fields = file.words[column]
        bad = next((k for k, f in enumerate(fields) if not is_number(f) and f), 0)
        raise CCWSIMError(not_a_number(file.name, int(lines[bad]), fields[bad]))
    return file.variables[column]


def facies_column(file: DataFile, column: str) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Codes, or places in the different names, which are returned too; NaN where none is known."""
    if column in file.variables:
        return file.variables[column], ()
    fields = file.words[column]
    unknown = {field for field in fields if field.lower() in UNKNOWN}
    unknown |= {f for f in fields if is_number(f) and float(f) in (*MISSING_CODES, *file.missing)}
    words = tuple(sorted({*fields} - unknown))
    places = {word: float(k) for k, word in enumerate(words)}
    return np.array([places.get(field, np.nan) for field in fields]), words


def _of_list(file: DataFile, key: str, coordinates: str | None, is_volume: bool) -> ImportedPoints:
    rows = file.variables[key][0]
    if is_volume and rows.shape[1] < 4:
        raise CCWSIMError(
            f"{file.name} has three columns without names, and data of a volume need four: x, y, z "
            "and facies"
        )
    rows = rows[:, [0, 1, 2, -1] if is_volume else [0, 1, -1]]
    world = coordinates == "world" or (coordinates is None and file.lines is not None)
    said = "x, y and facies" if world else "row, column and facies"
    if is_volume:
        said = "x, y, z and facies" if world else "layer, row, column and facies"
    lines = file.lines if file.lines is not None else np.arange(1, len(rows) + 1)
    counted = "line" if file.lines is not None else "row"
    notes = [f"Columns without names were taken as {said}."]
    return known_points(file, key, rows[:, :-1], rows[:, -1], lines, world, counted, notes)


def _of_grid(file: DataFile, key: str, cells: NDArray, grid_shape: Shape | None) -> ImportedPoints:
    if grid_shape is not None and cells.shape != tuple(grid_shape):
        if _is_volume(grid_shape):
            raise CCWSIMError(
                f"{file.name} is a grid of {describe_shape(cells.shape)} cells, the simulation "
                f"grid has {describe_shape(grid_shape)}; make them the same"
            )
        raise CCWSIMError(
            f"{file.name} is a grid of {cells.shape[0]} rows and {cells.shape[1]} columns, the "
            f"simulation grid has {grid_shape[0]} and {grid_shape[1]}; make them the same"
        )
    known = file.known(cells) & ~np.isin(cells, MISSING_CODES)
    _check_few(file.name, int(np.count_nonzero(known)), "known cells")
    places = np.argwhere(known)
    lines = np.flatnonzero(known) + 1
    found = known_points(file, key, places, cells[known], lines, False, "cell", [])
    return replace(found, grid=file.placed(cells.shape))


def known_points(
    file: DataFile,
    key: str,
    places: NDArray,
    values: NDArray,
    lines: NDArray,
    world: bool,
    counted: str,
    notes: list[str],
    spans: NDArray | None = None,
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
        spans=None if spans is None else frozen(spans[known]),
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


def _is_list(values: NDArray, in_text: bool, grid_shape: Shape | None) -> bool:
    """Three columns, or x, y, z, facies in a text or for a volume, unless it is the grid itself."""
    four = in_text or _is_volume(grid_shape)
    one = values.shape[0] == 1 and (values.shape[2] == 3 or (four and values.shape[2] == 4))
    return one and (grid_shape is None or values.shape[-len(grid_shape) :] != tuple(grid_shape))
