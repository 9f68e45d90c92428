"""Read hard data from one file: a table, a list without column names, or a grid with gaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ccwsim import CCWSIMError, Grid
from ccwsim.io.data_file import DataFile, Geometry, first_of, named_lines, printable
from ccwsim.io.formats.pictures import PictureFile
from ccwsim.io.formats.text_tables import is_missing, is_number, not_a_number, numbered
from ccwsim.io.hard_data.columns import (
    GUESSED,
    NOTHING_ASSIGNED,
    Assignment,
    PointColumns,
    assign_columns,
    height_column,
)
from ccwsim.io.hard_data.rows import RowProblem
from ccwsim.io.limits import check
from ccwsim.io.opening import PathOrFile, open_file
from ccwsim.model import (
    CUSTOMARY_CODES,
    WORLD_AXES,
    Array,
    Floats,
    Integers,
    Ints,
    Mask,
    Shape,
    are_codes,
    check_int,
    describe_shape,
    frozen,
    refused,
)

MAX_DISTANCE_CELLS = (
    2.0**40
)  # maximum distance of data from the grid, in cells; a larger distance is an error

MAX_NAMED_WELLS = 5  # maximum number of wells in a message


@dataclass(frozen=True, eq=False)
class ImportedPoints:
    """Hard data of a file before they are placed in cells."""

    places: Floats
    """Coordinates, shape (n, 2) or (n, 3): x, y (and z) in world units if `world` is true,
    otherwise (layer,) row (from the south) and column."""
    values: Floats
    """Facies codes or values of a continuous variable, shape (n,); `known` removes NaN."""
    lines: Ints
    """The line number of each datum in the file, from 1, shape (n,)."""
    world: bool
    """Whether `places` are world coordinates."""
    counted: str
    """The unit of `lines`: "line" for a text, "row" or "cell" for an array."""
    name: str
    variable: str
    """Names of the file and of the variable."""
    n_missing: int = 0
    """Number of rows that are left out because they have no value."""
    notes: tuple[str, ...] = ()
    """Assumptions made in reading the file, one sentence each."""
    words: tuple[str, ...] = ()
    """Distinct facies names, if the file contains names; `values` are then indices of `words`."""
    grid: Grid | None = None
    """The grid of the file, if the file is a grid with gaps."""
    place: Geometry = field(default_factory=Geometry)
    """The geometry that such a file states."""
    spans: Floats | None = None
    """Heights z of bottom and top of each interval, shape (n, 2); `places` has the middle."""
    wells: Mapping[int, str] = field(default_factory=dict)
    """Well names by line number; empty if the file has no well names."""
    numbering: str = "codes"
    """The numbering of the values, as in `match_facies`."""
    problems: tuple[RowProblem, ...] = ()
    """Rows of tables of wells that need a decision, whether or not it is taken."""

    @property
    def n(self) -> int:
        """The number of data."""
        return len(self.values)

    @property
    def continuous(self) -> bool:
        """Whether the values need a threshold or classes to become facies."""
        return not self.words and self.n > 0 and not are_codes(self.values)

    def said(self, k: int) -> str:
        """Return the value of a datum in the file (a name or a number) as text."""
        value = self.values[k]
        return self.words[int(value)] if self.words else f"{value:g}"

    def named(self, which: Integers) -> str:
        """Return the lines and wells of some data as a phrase: "lines 3 and 7 (F1, F5)"."""
        lines = self.lines[which]
        wells = [*dict.fromkeys(self.wells[n] for n in lines.tolist() if n in self.wells)]
        more = ["…"] if len(wells) > MAX_NAMED_WELLS else []
        names = ", ".join(wells[:MAX_NAMED_WELLS] + more)
        return named_lines(self.counted, lines) + (f" ({names})" if names else "")

    def refuse(self, bad: Mask, message: str) -> None:
        """Raise an error with the lines of bad data, if there are any."""
        if bad.any():
            raise CCWSIMError(f"{self.name}, {self.named(np.flatnonzero(bad))}: {message}")

    def taken(self, which: Array | list[int]) -> ImportedPoints:
        """Return the data selected by a mask or by indices."""
        return replace(
            self,
            places=frozen(self.places[which]),
            values=frozen(self.values[which]),
            lines=frozen(self.lines[which]),
            spans=None if self.spans is None else frozen(self.spans[which]),
        )

    def known(self) -> ImportedPoints:
        """Return the data with a value and coordinates; note rows without coordinates."""
        check(self.name, points=self.n)
        has_value, placed = ~np.isnan(self.values), np.isfinite(self.places).all(axis=1)
        notes = self.notes
        if lost := self.lines[has_value & ~placed].tolist():
            rows = f"{len(lost)} ({self.counted} {first_of(lost)})"
            notes += (f"Rows without coordinates, left out: {rows}.",)
        n_missing = self.n - int(np.count_nonzero(has_value & placed))
        points = replace(self.taken(has_value & placed), n_missing=n_missing, notes=notes)
        points.refuse(np.isinf(points.values), "the value is not finite; correct it")
        if points.spans is not None:
            bottom, top = points.spans.T
            points.refuse(bottom > top, "the upper depth is below the lower depth; exchange them")
        return points


def heights_below(z: Floats, depths: list[Floats]) -> tuple[Floats, Floats | None]:
    """Return heights (middles of intervals) and spans from z and up to two columns of depths."""
    if len(depths) < 2:
        return z - depths[0] if depths else z, None
    start, end = depths
    return z - (start + end) / 2, np.stack([z - end, z - start], axis=1)


def along_wells(points: ImportedPoints, grid: Grid | None) -> ImportedPoints:
    """Replace intervals by a datum per cell centre; on a border, the upper one counts."""
    if points.spans is None:
        return points
    if grid is None or not grid.is_volume:
        raise CCWSIMError(f"{points.name}: depth intervals need a grid with nz; give such a grid")
    bottom, top = ((points.spans - grid.origin[2]) / grid.cell_size[2] - 0.5).T
    far = ~(np.maximum(np.abs(bottom), np.abs(top)) <= MAX_DISTANCE_CELLS)  # also NaN
    points.refuse(far, "the depths are too far from the grid; correct them")
    first = np.ceil(bottom).astype(np.int64)
    counts = np.ceil(top).astype(np.int64) - first
    n = int(counts.sum())
    check(points.name, points=n)
    which = np.repeat(np.arange(points.n), counts)
    layers = first[which] + np.arange(n) - (np.cumsum(counts) - counts)[which]
    places = points.places[which]
    places[:, 2] = grid.origin[2] + (layers + 0.5) * grid.cell_size[2]
    empty, notes = int(np.count_nonzero(counts == 0)), points.notes
    if empty:
        notes += (f"Depth intervals left out because they contain no cell centre: {empty}.",)
    return replace(points.taken(which), places=places, spans=None, notes=notes)


PREFERRED_GRIDS = (
    "hd",
    "hard_data",
)  # names of grids that are preferred if a file has several grids


def read_points(
    path_or_file: PathOrFile, columns: PointColumns = GUESSED, *, grid_shape: Shape | None = None
) -> ImportedPoints:
    """Read the hard data of a file, without placing them in cells.

    Formats are tables in text (CSV, Petrel points, well logs), points in Geo-EAS, GeoJSON,
    GeoPackage and Shapefile (the last two need pyogrio), and all formats of grids. Unknown cells of
    grids are NaN or a code for missing values (−99, −999, −997799, −9977799). An array or
    text of three unnamed columns is read as a list of data, unless it has the size of the grid. The
    columns are row, col, facies in an array, and x, y, facies (or x, y, z, facies) in a text.

    A file that is a grid must have the shape `grid_shape`. Data in a volume need heights, which are
    z or the layer of a cell. Raises `CCWSIMError` without columns of coordinates and facies.

    Examples
    --------
    >>> from io import BytesIO
    >>> points = read_points(BytesIO(b"row,col,facies\\n3,4,1\\n"))
    >>> points.places.tolist(), points.values.tolist(), points.lines.tolist()
    ([[3.0, 4.0]], [1.0], [2])
    """
    file, volume = open_file(path_or_file), _is_volume(grid_shape)
    if isinstance(file, PictureFile):
        raise CCWSIMError(f"{file.name} is a picture; hard data must be a table or a grid")
    if file.is_table:
        return _of_table(file, assign_columns(file, columns, volume=volume).complete())
    named = [name for name, column in columns.named().items() if column and name != "facies"]
    if named:
        roles = " and ".join(named[:2])
        raise CCWSIMError(f"{file.name} has no named columns; leave {roles} out")
    key = file.chosen(columns.facies, PREFERRED_GRIDS, "facies")
    values = file.variables[key]
    if _is_list(values, file.lines is not None, grid_shape):
        return _of_list(file, key, columns.coordinates, volume)
    orientation = {"up": columns.up, "slice_index": columns.slice_index, "z_up": columns.z_up}
    return _of_grid(file, key, file.oriented(values, volume=volume, **orientation), grid_shape)


@dataclass(frozen=True)
class PointsPreview:
    """The columns and first rows of a table of hard data, and the roles of its columns."""

    name: str
    columns: tuple[str, ...] = ()
    """Names of all columns in file order; empty if the file is a grid or a list without names."""
    numeric: tuple[str, ...] = ()
    """Names of the columns of numbers."""
    rows: tuple[tuple[str, ...], ...] = ()
    """The first rows, with decimal points: 2,5 in the file is returned as 2.5."""
    lines: tuple[int, ...] = ()
    """For each row of `rows`, its line number in the file."""
    n_rows: int = 0
    """The total number of rows in the file."""
    assignment: Assignment = NOTHING_ASSIGNED
    """The assignment of columns to roles."""

    @property
    def guess(self) -> dict[str, str]:
        """The given or guessed column of each role."""
        return self.assignment.columns

    @property
    def reasons(self) -> tuple[str, ...]:
        """Assumptions and open questions about columns, one sentence each."""
        return (*self.assignment.notes, *self.assignment.problems)


def preview_points(
    path_or_file: PathOrFile,
    columns: PointColumns = GUESSED,
    *,
    grid_shape: Shape | None = None,
    n_rows: int = 6,
) -> PointsPreview:
    """Return the first rows of a table of hard data and the roles of its columns.

    Raises `CCWSIMError` if the file cannot be read, but not if columns cannot be guessed.

    Examples
    --------
    >>> from io import BytesIO
    >>> preview = preview_points(BytesIO(b"Well;Ostwert;Hochwert;Litho\\nA;1,5;2,5;Sand\\n"))
    >>> preview.guess
    {'x': 'Ostwert', 'y': 'Hochwert', 'well': 'Well', 'facies': 'Litho'}
    >>> preview.rows
    (('A', '1.5', '2.5', 'Sand'),)
    """
    file = open_file(path_or_file)
    if isinstance(file, PictureFile) or not file.is_table:
        return PointsPreview(file.name)
    assignment = assign_columns(file, columns, volume=_is_volume(grid_shape))
    return make_preview(file, assignment, n_rows)


def make_preview(file: DataFile, assignment: Assignment, n_rows: int) -> PointsPreview:
    """Return the first rows of a table."""
    n_rows = check_int("n_rows", n_rows, 1)
    texts = [_texts(file, name, n_rows) for name in file.names]
    n = len(next(iter(file.variables.values())))
    lines = file.lines if file.lines is not None else np.arange(1, n + 1)
    rows, numbers = tuple(zip(*texts, strict=True)), tuple(lines[:n_rows].tolist())
    numeric = tuple(file.variables)
    return PointsPreview(
        name=file.name,
        columns=file.names,
        numeric=numeric,
        rows=rows,
        lines=numbers,
        n_rows=n,
        assignment=assignment,
    )


def _texts(file: DataFile, column: str, n: int) -> Sequence[str]:
    if column in file.words:
        return [printable(field) for field in file.words[column][:n]]
    return ["" if v != v else f"{v:.12g}" for v in file.variables[column][:n].tolist()]


def _is_volume(grid_shape: Shape | None) -> bool:
    return grid_shape is not None and len(grid_shape) == 3


def _of_table(file: DataFile, assigned: Assignment) -> ImportedPoints:
    lines, roles = row_lines(file), assigned.columns
    along = [coordinates_of(file, column) for column in assigned.of("x", "y")]
    notes, spans = list(assigned.notes), None
    if "z" in roles:
        depths = assigned.of("depth_from", "depth_to", "depth")
        z, *below = (coordinates_of(file, column) for column in (roles["z"], *depths))
        z, spans = heights_below(z, below)
        along.append(z)
        if depths:
            names = " and ".join(depths)
            notes.append(f"{roles['z']} is the height of the collar. Depths below it: {names}.")
    else:
        height = height_column(list(file.variables), roles["facies"])
        if height and len(np.unique(file.variables[height])) > 1:
            notes.append(f"The column {height} is ignored, because the grid is a map.")
    if assigned.from_one and min(np.nanmin(numbers, initial=1) for numbers in along) >= 1:
        along = [numbers - 1 for numbers in along]
        notes.append("Cells are counted from 1, because no number is 0.")
    values, words = facies_of(file, roles["facies"])
    wells = names_of_wells(file, roles["well"]) if "well" in roles else ()
    return ImportedPoints(
        places=np.stack(along if assigned.world else along[::-1], axis=1),
        values=values,
        lines=lines,
        world=assigned.world,
        counted=file.counted,
        name=file.name,
        variable=roles["facies"],
        notes=tuple(notes),
        words=words,
        spans=spans,
        wells=dict(zip(lines.tolist(), wells, strict=False)),
    ).known()


def facies_of(file: DataFile, column: str) -> tuple[Floats, tuple[str, ...]]:
    """Return the values of facies, NaN if unknown, and their names if values are indices."""
    if column not in file.words:
        values = file.variables[column]
        return np.where(file.known(values), values, np.nan).astype(np.float64), ()
    fields = file.words[column]
    unknown = {field for field in fields if is_missing(field)}
    unknown |= {f for f in fields if is_number(f) and float(f) in (*CUSTOMARY_CODES, *file.missing)}
    return numbered(fields, unknown)


def row_lines(file: DataFile) -> Ints:
    """Return the line number of each row of a table."""
    if file.lines is None:
        raise CCWSIMError(f"{file.name}: too many lines for hard data; remove empty lines")
    return file.lines


def names_of_wells(file: DataFile, column: str) -> list[str]:
    """Return the names of wells; a number gives the same name in text and numeric columns."""
    if column in file.words:
        words = [name.strip() for name in file.words[column]]
        return [(is_number(word) and _name_of(float(word))) or word for word in words]
    return [_name_of(value) for value in file.variables[column].tolist()]


def _name_of(number: float) -> str:
    """Return a number as a well name with all digits; the last digit can mark a sidetrack."""
    if not np.isfinite(number):
        return ""
    return str(int(number)) if number.is_integer() else repr(number)


def coordinates_of(file: DataFile, column: str) -> Floats:
    """Return a column of coordinates; raise an error if it contains a word."""
    if column in file.words:
        fields = file.words[column]
        bad = next((k for k, f in enumerate(fields) if not is_number(f) and f), 0)
        line = int(row_lines(file)[bad])
        raise CCWSIMError(not_a_number(file.name, line, fields[bad], file.counted))
    return file.variables[column].astype(np.float64)


def _of_list(file: DataFile, key: str, coordinates: str | None, volume: bool) -> ImportedPoints:
    """Read a matrix as a table whose columns are coordinates and, in the last column, facies."""
    rows, in_text = file.variables[key][0], file.lines is not None
    if volume and rows.shape[1] < 4:
        raise refused("three_columns_of_volume", name=file.name)
    world = coordinates == "world" or (coordinates is None and in_text)
    columns = (
        {axis: axis for axis in WORLD_AXES} if world else {"z": "layer", "y": "row", "x": "column"}
    )
    if not volume:
        del columns["z"]
    note = f"Columns without names are read as {', '.join(columns.values())} and facies."
    values = rows[:, [*range(len(columns)), -1]]
    columns["facies"] = "facies"
    variables = dict(zip(columns.values(), values.T, strict=True))
    table = replace(file, variables=variables, is_table=True)
    if not in_text:
        table = replace(table, lines=np.arange(1, len(rows) + 1), counted="row")
    return _of_table(table, Assignment(columns, (note,), world=world))


def _of_grid(file: DataFile, key: str, values: Array, grid_shape: Shape | None) -> ImportedPoints:
    if grid_shape is not None and values.shape != tuple(grid_shape):
        raise CCWSIMError(
            f"{file.name} is a grid of {describe_shape(values.shape)} cells, but the simulation "
            f"grid has {describe_shape(grid_shape)}; use equal sizes"
        )
    has_value = file.known(values)
    check(file.name, points=int(np.count_nonzero(has_value)))
    return ImportedPoints(
        places=np.argwhere(has_value).astype(np.float64),
        values=values[has_value].astype(np.float64),
        lines=np.flatnonzero(has_value) + 1,
        world=False,
        counted="cell",
        name=file.name,
        variable=key,
        grid=file.geometry.grid(values.shape),
        place=file.geometry,
        words=file.labels.get(key, ()),
        numbering=file.numbering,
    ).known()


def _is_list(values: Array, in_text: bool, grid_shape: Shape | None) -> bool:
    """Return whether a file lists data in 3 or 4 columns (x, y, (z,) facies) and is no grid."""
    four = in_text or _is_volume(grid_shape)
    one = values.shape[0] == 1 and (values.shape[2] == 3 or (four and values.shape[2] == 4))
    return one and (grid_shape is None or values.shape[-len(grid_shape) :] != tuple(grid_shape))
