"""Read wells from tables of collars, intervals and, for deviated wells, surveys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile
from ccwsim.io.formats.pictures import PictureFile
from ccwsim.io.hard_data.column_names import SURVEYS, WELL_TABLES
from ccwsim.io.hard_data.columns import GUESSED_WELLS, WellColumns, assign_well_columns
from ccwsim.io.hard_data.paths import Stations, bend_between, positions
from ccwsim.io.hard_data.placing import Conversion, HardDataImport, place_points, resolve_points
from ccwsim.io.hard_data.points import ImportedPoints, along_wells, heights_below
from ccwsim.io.hard_data.reading import (
    PointsPreview,
    lines_of,
    names_of_wells,
    numbers_of,
    points_of_rows,
    preview_of,
)
from ccwsim.io.limits import limits
from ccwsim.io.opening import PathOrFile, open_file
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage

STEPS_A_CELL = 16
"""Number of points on a deviated well's path within the length of the shortest cell side."""
MAX_BEND = np.radians(179.0)
"""Maximum bend between stations; near 180°, the plane of the arc is undefined."""


def import_wells(
    collars: PathOrFile,
    intervals: PathOrFile,
    grid: Grid | Sequence[int],
    training_image: TrainingImage | None = None,
    *,
    surveys: PathOrFile | None = None,
    **options: Any,
) -> HardDataImport:
    """Read the hard data of wells and return them with a report of the import.

    Raises `CCWSIMError`, with line numbers, for tables that cannot be read or contradict each
    other.

    Parameters
    ----------
    collars : path or binary file
        A table with one row per well: its name, x, y, z (the elevation of the collar) and, if
        known, its length (`length`, `total depth`, `EOH`).
    intervals : path or binary file
        A table with one row per interval: the name of the well, `from` and `to` (or one `depth`)
        along the well, and the facies.
    grid : Grid or triple of int
        The grid of the volume.
    training_image : TrainingImage, optional
        Defines the known facies and their names.
    surveys : path or binary file, optional
        A table with one row per station of a deviated well: name of the well, `depth` along it,
        `azimuth` (degrees from north, clockwise), and `inclination` (degrees from straight down) or
        `dip` (degrees from horizontal, negative downwards; not all dips may be positive).
        Between stations, a well is an arc of minimum curvature [1]_. Above the first and below the
        last station, the well is straight. Wells without stations are vertical.
    **options
        Fields of `WellColumns`, such as `collar_well="BHID"`, and of `Conversion`, such as
        `on_outside="drop"`.

    Returns
    -------
    HardDataImport
        A vertical well has a datum in each cell whose centre is in an interval. A deviated well has
        a datum in each cell on its path, with the facies at the middle of the path in the cell.

    References
    ----------
    .. [1] Sawaryn, S. J. and Thorogood, J. L. (2005). A compendium of directional calculations
       based on the minimum curvature method. SPE Drilling & Completion 20 (1), 24–36.

    Examples
    --------
    >>> from io import BytesIO
    >>> collars = BytesIO(b"well,x,y,z\\nA,10.5,2.5,8\\n")
    >>> log = b"well,from,to,facies\\nA,1,3,1\\nA,3,4,0\\n"
    >>> import_wells(collars, BytesIO(log), (8, 8, 16)).hard_data.triples
    ((4, 2, 10, 0), (5, 2, 10, 1), (6, 2, 10, 1))
    >>> surveys = BytesIO(b"well,depth,azimuth,dip\\nA,0,0,-45\\n")
    >>> collars.seek(0)
    0
    >>> import_wells(collars, BytesIO(log), (8, 8, 16), surveys=surveys).hard_data.n
    5
    """
    grid, conversion = Grid.of(grid), Conversion.taken_from(options)
    points = read_well_points(collars, intervals, grid, WellColumns(**options), surveys=surveys)
    return resolve_points(place_points(points, grid, training_image, conversion), conversion)


def read_wells(
    collars: PathOrFile,
    intervals: PathOrFile,
    grid: Grid | Sequence[int],
    training_image: TrainingImage | None = None,
    **options: Any,
) -> HardData:
    """Read the hard data of wells, without the report of `import_wells`.

    Parameters and errors are the same as in `import_wells`.

    Examples
    --------
    >>> from io import BytesIO
    >>> collars = BytesIO(b"well,x,y,z\\nA,10.5,2.5,8\\n")
    >>> read_wells(collars, BytesIO(b"well,depth,facies\\nA,1.2,1\\n"), (8, 8, 16)).triples
    ((6, 2, 10, 1),)
    """
    return import_wells(collars, intervals, grid, training_image, **options).hard_data


def read_well_points(
    collars: PathOrFile,
    intervals: PathOrFile,
    grid: Grid | Sequence[int],
    columns: WellColumns = GUESSED_WELLS,
    *,
    surveys: PathOrFile | None = None,
) -> ImportedPoints:
    """Read the data of wells as points: one per single depth, or one per cell of each interval.

    Parameters
    ----------
    collars, intervals, grid, surveys
        As in `import_wells`; the errors are the same.
    columns : WellColumns
        Names of columns, which are guessed by default.

    Examples
    --------
    >>> from io import BytesIO
    >>> collars, log = BytesIO(b"a,b,c,d\\nA,10.5,2.5,8\\n"), BytesIO(b"a,b,c\\nA,1.2,1\\n")
    >>> columns = WellColumns(collar_well="a", x="b", y="c", z="d", well="a", depth="b")
    >>> points = read_well_points(collars, log, (8, 8, 16), columns)
    >>> points.places.tolist(), points.wells
    ([[10.5, 2.5, 6.8]], {2: 'A'})
    """
    grid = Grid.of(grid)
    if grid.nz is None:
        raise CCWSIMError(f"wells need a grid with layers, but {grid} is a map; give nz")
    wells = _collars(_table(collars), columns)
    if surveys is not None:
        _add_stations(_table(surveys), wells, columns)
    elif lost := next((name for name in SURVEYS if getattr(columns, name)), None):
        named = shown(getattr(columns, lost))
        raise CCWSIMError(
            f"{lost} = {named} belongs to a table of surveys; give surveys, or leave the column out"
        )
    return _points(_table(intervals), wells, grid, columns)


def preview_wells(
    path_or_file: PathOrFile, table: str, columns: WellColumns = GUESSED_WELLS, *, n_rows: int = 6
) -> PointsPreview:
    """Return the first rows of a table of wells and the roles of its columns.

    Raises `CCWSIMError` if the file is not a table, but not if columns cannot be guessed.

    Parameters
    ----------
    path_or_file : path or binary file
    table : "collars", "intervals" or "surveys"
    columns : WellColumns
        Names of columns, which are guessed by default; columns of other tables are ignored.
    n_rows : int
        The number of rows to show, at least 1.

    Examples
    --------
    >>> from io import BytesIO
    >>> preview = preview_wells(BytesIO(b"BHID,From,To,Rock\\nA,1,3,1\\n"), "intervals")
    >>> preview.guess
    {'well': 'BHID', 'depth_from': 'From', 'depth_to': 'To', 'facies': 'Rock'}
    >>> preview = preview_wells(BytesIO(b"a,b,c,d\\nA,1,3,1\\n"), "collars", WellColumns(x="b"))
    >>> preview.guess, preview.reasons[0].split(";")[0]
    ({'x': 'b'}, 'file has no column of the names of the wells')
    """
    if table not in WELL_TABLES:
        raise CCWSIMError(f"table = {shown(table)} must be one of {', '.join(WELL_TABLES)}")
    file = _table(path_or_file)
    return preview_of(file, assign_well_columns(file, table, columns), n_rows)


class Well(NamedTuple):
    """A well: its collar, its length (infinite if unknown), and its stations."""

    line: int  # line number in the table of collars
    collar: NDArray[np.float64]  # x, y, z
    length: float
    stations: list[Stations]  # empty for a vertical well


def _table(path_or_file: PathOrFile) -> DataFile:
    file = open_file(path_or_file)
    if isinstance(file, PictureFile) or not file.is_table or file.lines is None:
        raise CCWSIMError(f"{file.name} is not a table; wells need tables with named columns")
    return file


def _known_numbers(file: DataFile, column: str) -> NDArray[np.float64]:
    """Return a column of numbers; raise an error if a number is missing."""
    values = numbers_of(file, column).astype(np.float64)
    bad = lines_of(file)[~np.isfinite(values)]
    if len(bad):
        raise CCWSIMError(f"{file.name}, line {bad[0]}: {column} is missing; add it")
    return values


def _collars(file: DataFile, asked: WellColumns) -> dict[str, Well]:
    """Return the wells in a table of collars, by name of the well."""
    columns = assign_well_columns(file, "collars", asked).complete().columns
    places = np.column_stack([_known_numbers(file, columns[name]) for name in ("x", "y", "z")])
    lengths = np.full(len(places), np.nan)
    if "collar_length" in columns:
        lengths = numbers_of(file, columns["collar_length"])
    lengths = np.where(np.isnan(lengths), np.inf, lengths)
    wells: dict[str, Well] = {}
    names, lines = names_of_wells(file, columns["collar_well"]), lines_of(file).tolist()
    for line, name, place, length in zip(lines, names, places, lengths, strict=True):
        if not name:
            raise CCWSIMError(f"{file.name}, line {line}: the name of the well is missing; add it")
        if name in wells:
            raise CCWSIMError(
                f"{file.name}, lines {wells[name].line} and {line}: the well {shown(name)} has two "
                "collars; leave one out"
            )
        wells[name] = Well(line, place, float(length), [])
    return wells


def _add_stations(file: DataFile, wells: dict[str, Well], asked: WellColumns) -> None:
    """Add the stations of a table of surveys to the wells."""
    assigned = assign_well_columns(file, "surveys", asked).complete()
    well, depth, azimuth = assigned.of("survey_well", "survey_depth", "survey_azimuth")
    (tilt,) = assigned.of("survey_inclination", "survey_dip")
    is_dip = "survey_dip" in assigned.columns
    depths, bearings, tilts = (_known_numbers(file, name) for name in (depth, azimuth, tilt))
    lines = lines_of(file)
    if is_dip and tilts.max(initial=0) > 0 and tilts.min() >= 0:
        raise CCWSIMError(
            f"{file.name}: {tilt} is {tilts.min():g} to {tilts.max():g}, above the horizon; give "
            "downward dips as negative numbers, or call the column inclination if 0 is straight "
            "down"
        )
    least, most = (-90, 90) if is_dip else (0, 180)
    for what, values, low, high in ((azimuth, bearings, -180, 360), (tilt, tilts, least, most)):
        bad = np.flatnonzero((values < low) | (values > high))
        if len(bad):
            raise CCWSIMError(
                f"{file.name}, line {lines[bad[0]]}: {what} {values[bad[0]]:g} is not from {low} "
                f"to {high} degrees; correct it"
            )
    # after subtracting `least`, dips and inclinations are both angles from straight down
    radians, bearing = np.radians(tilts - least), np.radians(bearings)
    flat = np.sin(radians)
    ways = np.column_stack([flat * np.sin(bearing), flat * np.cos(bearing), -np.cos(radians)])
    names = np.array(names_of_wells(file, well))
    for name in dict.fromkeys(names.tolist()):
        rows = np.flatnonzero(names == name)
        _check_collar(file, int(lines[rows[0]]), name, wells)
        rows = rows[np.argsort(depths[rows], kind="stable")]
        twice = np.flatnonzero(np.diff(depths[rows]) == 0)
        if depths[rows[0]] < 0 or len(twice):
            k, said = (rows[twice[0] + 1], "twice") if len(twice) else (rows[0], "above the collar")
            raise CCWSIMError(
                f"{file.name}, line {lines[k]}: a station of {shown(name)} at depth {depths[k]:g} "
                f"is {said}; correct it"
            )
        for k, after in pairwise(rows):
            if bend_between(ways[k], ways[after]) > MAX_BEND:
                raise CCWSIMError(
                    f"{file.name}, lines {lines[k]} and {lines[after]}: {shown(name)} reverses "
                    f"its direction between these stations; correct {azimuth} or {tilt}"
                )
        stations = Stations(depths[rows], ways[rows])
        if depths[rows[0]] > 0:  # above its first station, a well keeps this station's direction
            stations = Stations(np.r_[0.0, depths[rows]], ways[np.r_[rows[0], rows]])
        wells[name].stations.append(stations)


def _check_collar(file: DataFile, line: int, name: str, wells: Mapping[str, Well]) -> None:
    if name not in wells:
        raise CCWSIMError(
            f"{file.name}, line {line}: there is no collar of the well {shown(name)}; "
            "add it to the collars"
        )


def _points(
    file: DataFile, wells: dict[str, Well], grid: Grid, asked: WellColumns
) -> ImportedPoints:
    """Return the points of all wells: one per single depth, or one per cell of each interval."""
    assigned = assign_well_columns(file, "intervals", asked).complete()
    depths = assigned.of("depth_from", "depth_to", "depth")
    columns = [_known_numbers(file, name) for name in depths]
    start, end, lines = columns[0], columns[-1], lines_of(file)
    below, spans = heights_below(file.name, lines, np.zeros(len(lines)), columns)
    names = names_of_wells(file, assigned.columns["well"])
    _check(file, names, start, end, wells)
    collars = np.array([wells[name].collar for name in names]).reshape(-1, 3)
    places = collars + np.outer(below, [0, 0, 1])
    spans = None if spans is None else spans + collars[:, 2:]
    points = points_of_rows(file, assigned.columns["facies"], places, names, spans=spans)
    known = np.isin(lines, points.lines)
    names, start, end = np.array(names)[known], start[known], end[known]
    bent = np.array([bool(wells[name].stations) for name in names.tolist()], bool)
    parts = [along_wells(points.taken(~bent), grid)]
    parts += [
        _along_path(points.taken([k]), wells[names[k]], start[k], end[k], grid)
        for k in np.flatnonzero(bent).tolist()
    ]
    n_empty = sum(not part.n for part in parts[1:])
    notes = parts[0].notes
    if n_empty:
        notes += (f"Depth intervals that are too short to give any cell a datum: {n_empty}.",)
    notes += _notes_on_paths(points, names, end, wells)
    arrays = {
        name: [getattr(part, name) for part in parts] for name in ("places", "values", "lines")
    }
    joined = {name: np.concatenate(arrays_of_parts) for name, arrays_of_parts in arrays.items()}
    return replace(parts[0], notes=notes, **joined)


def _notes_on_paths(
    points: ImportedPoints,
    names: NDArray[np.str_],
    end: NDArray[np.float64],
    wells: dict[str, Well],
) -> tuple[str, ...]:
    """Return notes on wells without data and on assumed paths."""
    logged = set(names.tolist())
    surveyed = any(well.stations for well in wells.values())
    empty = [name for name in wells if name not in logged]
    straight = [name for name in wells if name in logged and not wells[name].stations and surveyed]
    kinds = {
        "Wells without intervals": empty,
        "Wells without stations, assumed vertical": straight,
    }
    notes = [
        f"{kind}: {len(which)} ({', '.join(which[:6])}{' …' if len(which) > 6 else ''})."
        for kind, which in kinds.items()
        if which
    ]
    stations = [wells[name].stations for name in names.tolist()]
    last = np.array([known[0].depths[-1] if known else np.inf for known in stations])
    below = np.flatnonzero(end > last)
    if len(below):
        notes.append(f"Wells are straight below their last station ({points.named(below)}).")
    return tuple(notes)


def _check(
    file: DataFile,
    names: list[str],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    wells: dict[str, Well],
) -> None:
    """Raise an error, with line numbers, for impossible intervals."""
    lines = lines_of(file).tolist()
    for k, name in enumerate(names):
        where = f"{file.name}, line {lines[k]}"
        _check_collar(file, lines[k], name, wells)
        if start[k] < 0:
            raise CCWSIMError(f"{where}: the depth {start[k]:g} is above the collar; correct it")
        if end[k] > wells[name].length:
            raise CCWSIMError(
                f"{where}: the depth {end[k]:g} is below the end of {shown(name)} at "
                f"{wells[name].length:g}; correct one of them"
            )
    order = np.lexsort((start, np.array(names)))
    for a, b in pairwise(order):
        if names[a] == names[b] and start[b] < end[a]:
            first, second = sorted((lines[a], lines[b]))
            raise CCWSIMError(
                f"{file.name}, lines {first} and {second}: two intervals of {shown(names[a])} "
                f"overlap below the depth {start[b]:g}; correct one of them"
            )


def _along_path(
    point: ImportedPoints, well: Well, start: float, end: float, grid: Grid
) -> ImportedPoints:
    """Return the data of an interval of a deviated well, one point per cell.

    A cell belongs to the interval that contains the middle of the well's path in the cell.
    """
    (stations,) = well.stations
    if point.spans is None:
        places = positions(well.collar, stations, np.array([start]))
        return replace(point, places=places, spans=None)
    step = min(grid.cell_size) / STEPS_A_CELL
    reach = sum(grid.cell_size)  # follow the path up to the borders of the first and last cell
    first, last = max(start - reach, 0.0), min(end + reach, well.length)
    first, n = int(first / step), int(last / step) - int(first / step) + 1
    if n > STEPS_A_CELL * limits().points:
        raise CCWSIMError(
            f"{point.name}, {point.named(np.array([0]))}: the interval is {(end - start):g} long, "
            f"but cells are only {min(grid.cell_size):g} wide or high; correct the depths"
        )
    depths = step * np.arange(first, first + n, dtype=np.float64)  # multiples of `step`
    path = positions(well.collar, stations, depths)
    cells = grid.cells_of(*path.T)
    changes = np.flatnonzero((np.diff(cells, axis=0) != 0).any(axis=1)) + 1
    begins, ends = np.r_[0, changes], np.r_[changes, n] - 1
    edges = np.r_[depths[0], (depths[changes - 1] + depths[changes]) / 2, depths[-1]]
    middle = (edges[:-1] + edges[1:]) / 2
    inside = (middle > start) & (middle <= end) & (ends > begins)  # skip cells with one point
    points = point.taken([0] * int(inside.sum()))
    return replace(points, places=grid.centers_of(cells[begins[inside]]), spans=None)
