"""Read wells from tables of collars, intervals and, for deviated wells, surveys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim import Grid, HardData, TrainingImage
from ccwsim.io.data_file import DataFile, first_of
from ccwsim.io.formats.pictures import PictureFile
from ccwsim.io.hard_data import placing
from ccwsim.io.hard_data.columns import (
    GUESSED_WELLS,
    SURVEY_ROLES,
    WELL_TABLES,
    WellColumns,
    assign_well_columns,
)
from ccwsim.io.hard_data.points import (
    ImportedPoints,
    PointsPreview,
    along_wells,
    coordinates_of,
    facies_of,
    heights_below,
    make_preview,
    names_of_wells,
    row_lines,
)
from ccwsim.io.hard_data.rows import Intervals, RowProblems
from ccwsim.io.limits import check, limits
from ccwsim.io.opening import PathOrFile, open_file
from ccwsim.model import CCWSIMError, Floats, Ints, Mask, check_choice, refused, shown

STEPS_A_CELL = 16  # points on a deviated well's path within the length of the shortest side
MAX_BEND = np.radians(179.0)  # between stations; near 180°, the plane of the arc is undefined


def import_wells(
    collars: PathOrFile,
    intervals: PathOrFile,
    grid: Grid | Sequence[int],
    training_image: TrainingImage | None = None,
    *,
    surveys: PathOrFile | None = None,
    **options: Any,
) -> placing.HardDataImport:
    """Read the hard data of wells and return them with a report of the import.

    Raises `CCWSIMError` for tables that contradict each other.

    Parameters
    ----------
    collars : path or binary file
        A table with one row per well: its name, x, y, z (the elevation of the collar) and, if
        known, its length (`length`, `total depth`, `EOH`).
    intervals : path or binary file
        A table with one row per interval: the name of the well, `from` and `to` (or one `depth`)
        along the well, and the facies.
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
    """
    grid, conversion = Grid.of(grid), placing.Conversion.taken_from(options)
    columns = WellColumns(**options)
    points = read_well_points(
        collars, intervals, grid, columns, surveys=surveys, conversion=conversion
    )
    return placing.resolve_points(
        placing.place_points(points, grid, training_image, conversion), conversion
    )


def read_wells(
    collars: PathOrFile,
    intervals: PathOrFile,
    grid: Grid | Sequence[int],
    training_image: TrainingImage | None = None,
    **options: Any,
) -> HardData:
    """Read the hard data of wells, without the report of `import_wells`.

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
    conversion: placing.Conversion = placing.STRICT,
) -> ImportedPoints:
    """Read the data of wells as points: one per single depth, or one per cell of each interval.

    Tables are those of `import_wells`. Rows that need a decision, such as `on_overlap="upper"` of
    the conversion, are noted in `problems`. `resolve_points` raises an error for rows without a
    decision.

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
    if not grid.is_volume:
        raise CCWSIMError(f"wells need a grid with layers, but {grid} is a map; give nz")
    decisions = {name: getattr(conversion, name) for name in placing.ROW_CHOICES}
    problems = RowProblems(_table(collars), decisions, [])
    wells = _collars(problems, columns)
    if surveys is not None:
        _add_stations(problems._replace(file=_table(surveys)), wells, columns)
    elif lost := next((name for name in SURVEY_ROLES if getattr(columns, name)), None):
        named = shown(getattr(columns, lost))
        raise refused("only_with_surveys", lost=lost, value=named)
    return _points(problems._replace(file=_table(intervals)), wells, grid, columns)


def preview_wells(
    path_or_file: PathOrFile, table: str, columns: WellColumns = GUESSED_WELLS, *, n_rows: int = 6
) -> PointsPreview:
    """Return the first rows of a table of wells and the roles of its columns.

    `table` is "collars", "intervals" or "surveys"; columns of other tables are ignored. Raises
    `CCWSIMError` if the file is not a table, but not if columns cannot be guessed.

    Examples
    --------
    >>> from io import BytesIO
    >>> preview = preview_wells(BytesIO(b"BHID,From,To,Rock\\nA,1,3,1\\n"), "intervals")
    >>> preview.guess
    {'well': 'BHID', 'depth_from': 'From', 'depth_to': 'To', 'facies': 'Rock'}
    """
    check_choice("table", table, WELL_TABLES)
    file = _table(path_or_file)
    return make_preview(file, assign_well_columns(file, table, columns), n_rows)


class Well(NamedTuple):
    """A well: its collar, its length (infinite if unknown), and its stations."""

    row: int  # index of its row in the table of collars
    collar: Floats  # x, y, z
    length: float
    stations: Stations | None = None  # None for a vertical well


def _table(path_or_file: PathOrFile) -> DataFile:
    file = open_file(path_or_file)
    if isinstance(file, PictureFile) or not file.is_table or file.lines is None:
        raise CCWSIMError(f"{file.name} is not a table; wells need tables with named columns")
    return file


def _complete_rows(problems: RowProblems, columns: Sequence[str]) -> tuple[list[Floats], Mask]:
    """Return columns of numbers and a mask of the rows with all of them; note other rows."""
    numbers = [coordinates_of(problems.file, column) for column in columns]
    usable = np.ones(len(row_lines(problems.file)), bool)
    for column, values in zip(columns, numbers, strict=True):
        usable &= problems.usable(~np.isfinite(values), f"{column} is missing", "add it")
    return numbers, usable


def _collars(problems: RowProblems, asked: WellColumns) -> dict[str, Well]:
    """Return the wells in a table of collars, by name of the well."""
    file, wells = problems.file, dict[str, Well]()
    columns = assign_well_columns(file, "collars", asked).complete().columns
    places, usable = _complete_rows(problems, [columns[name] for name in ("x", "y", "z")])
    lengths = np.full(len(usable), np.nan)
    if "collar_length" in columns:
        lengths = coordinates_of(file, columns["collar_length"])
    lengths = np.where(np.isnan(lengths), np.inf, lengths)
    names = names_of_wells(file, columns["collar_well"])
    usable &= problems.with_name(names)
    for k, place in enumerate(np.column_stack(places)):
        if usable[k] and (name := names[k]) in wells:
            message = f"the well {shown(name)} has two collars"
            problems.add("on_bad_row", [wells[name].row, k], message, "leave one out")
        elif usable[k]:
            wells[name] = Well(k, place, float(lengths[k]))
    return wells


def _add_stations(problems: RowProblems, wells: dict[str, Well], asked: WellColumns) -> None:
    """Add the stations of a table of surveys to the wells."""
    file = problems.file
    assigned = assign_well_columns(file, "surveys", asked).complete()
    well, depth, azimuth = assigned.of("survey_well", "survey_depth", "survey_azimuth")
    (tilt,) = assigned.of("survey_inclination", "survey_dip")
    is_dip = "survey_dip" in assigned.columns
    (depths, bearings, tilts), usable = _complete_rows(problems, (depth, azimuth, tilt))
    if is_dip and usable.any() and tilts[usable].max() > 0 and tilts[usable].min() >= 0:
        raise CCWSIMError(
            f"{file.name}: {tilt} is {tilts[usable].min():g} to {tilts[usable].max():g}, above "
            "the horizon; give downward dips as negative numbers, or call the column inclination "
            "if 0 is straight down"
        )
    least, most = (-90, 90) if is_dip else (0, 180)
    for what, values, low, high in ((azimuth, bearings, -180, 360), (tilt, tilts, least, most)):
        for k in np.flatnonzero((values < low) | (values > high)).tolist():
            message = f"{what} {values[k]:g} is not from {low} to {high} degrees"
            problems.add("on_bad_row", [k], message, "correct it")
            usable[k] = False
    usable &= problems.usable(
        depths < 0, lambda k: f"a station at depth {depths[k]:g} is above the collar", "correct it"
    )
    # after subtracting `least`, dips and inclinations are both angles from straight down
    radians, bearing = np.radians(tilts - least), np.radians(bearings)
    flat = np.sin(radians)
    directions = np.column_stack([flat * np.sin(bearing), flat * np.cos(bearing), -np.cos(radians)])
    names = np.array(names_of_wells(file, well))
    usable &= problems.with_collar(names.tolist(), wells)
    for name in dict.fromkeys(names[usable].tolist()):
        rows = np.flatnonzero(usable & (names == name))
        rows = rows[np.argsort(depths[rows], kind="stable")]
        used = rows[:1].tolist()
        for k in rows[1:].tolist():
            before = used[-1]
            if depths[k] == depths[before]:
                message = f"a station of {shown(name)} at depth {depths[k]:g} is twice"
                problems.add("on_bad_row", [k], message, "correct it")
            elif bend_between(directions[before], directions[k]) > MAX_BEND:
                message = f"{shown(name)} reverses its direction between these stations"
                problems.add("on_bad_row", [before, k], message, f"correct {azimuth} or {tilt}")
            else:
                used.append(k)
        stations = Stations(depths[used], directions[used])
        if depths[used[0]] > 0:  # above its first station, a well keeps this station's direction
            stations = Stations(np.r_[0.0, depths[used]], directions[np.r_[used[0], used]])
        wells[name] = wells[name]._replace(stations=stations)


def _points(
    problems: RowProblems, wells: dict[str, Well], grid: Grid, asked: WellColumns
) -> ImportedPoints:
    """Return the points of all wells: one per single depth, or one per cell of each interval."""
    file = problems.file
    columns = assign_well_columns(file, "intervals", asked).complete().columns
    lines = row_lines(file)
    check(file.name, points=len(lines))
    single = "depth" in columns
    roles = ("depth", "depth") if single else ("depth_from", "depth_to")
    missing = np.full(len(lines), np.nan)
    depths = [coordinates_of(file, columns[r]) if r in columns else missing for r in roles]
    names = names_of_wells(file, columns["well"])
    lengths = {name: well.length for name, well in wells.items()}
    intervals = Intervals(names, depths, lengths, problems)
    rows = intervals.usable_rows()
    start, end = intervals.start[rows], intervals.end[rows]
    names, lines = np.array(names)[rows], lines[rows]
    places = np.array([wells[name].collar for name in names.tolist()]).reshape(-1, 3)
    below = [start] if single else [start, end]
    places[:, 2], spans = heights_below(places[:, 2], below)
    values, words = facies_of(file, columns["facies"])
    points = ImportedPoints(
        places=places,
        values=_with_facies(values[rows], rows, names, problems),
        lines=lines,
        world=True,
        counted=file.counted,
        name=file.name,
        variable=columns["facies"],
        words=words,
        spans=spans,
        wells=dict(zip(lines.tolist(), names.tolist(), strict=True)),
        problems=tuple(problems.noted),
    ).known()
    used = np.isin(lines, points.lines)
    names, start, end = names[used], start[used], end[used]
    bent = np.array([wells[name].stations is not None for name in names.tolist()], bool)
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
    joined = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("places", "values", "lines")
    }
    return replace(parts[0], notes=notes, **joined)


def _notes_on_paths(
    points: ImportedPoints, names: NDArray[np.str_], end: Floats, wells: dict[str, Well]
) -> tuple[str, ...]:
    """Return notes on wells without data and on assumed paths."""
    logged = set(names.tolist())
    straight = [name for name, well in wells.items() if name in logged and not well.stations]
    surveyed = any(well.stations for well in wells.values())
    kinds = {
        "Wells without intervals": [name for name in wells if name not in logged],
        "Wells without stations, assumed vertical": straight if surveyed else [],
    }
    notes = [f"{k}: {len(which)} ({first_of(which)})." for k, which in kinds.items() if which]
    stations = [wells[name].stations for name in names.tolist()]
    last = np.array([np.inf if path is None else path.depths[-1] for path in stations])
    below = np.flatnonzero(end > last)
    if len(below):
        notes.append(f"Wells are straight below their last station ({points.named(below)}).")
    return tuple(notes)


def _with_facies(
    values: Floats, rows: Ints, names: NDArray[np.str_], problems: RowProblems
) -> Floats:
    """Note missing values of facies; by decision, replace them by those of the interval above."""
    for k in np.flatnonzero(np.isnan(values)).tolist():
        message = f"an interval of {shown(str(names[k]))} has no facies"
        problems.add("on_no_facies", [rows[k]], message, "add it")
        if problems.decisions["on_no_facies"] == "above" and k and names[k] == names[k - 1]:
            values[k] = values[k - 1]
    return values


def _along_path(
    point: ImportedPoints, well: Well, start: float, end: float, grid: Grid
) -> ImportedPoints:
    """Return a point per cell whose middle of the path is in an interval of a deviated well."""
    assert well.stations is not None
    if point.spans is None:
        places = positions_along_well(well.collar, well.stations, np.array([start]))
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
    path = positions_along_well(well.collar, well.stations, depths)
    cells = grid.cells_of(*path.T)
    changes = np.flatnonzero((np.diff(cells, axis=0) != 0).any(axis=1)) + 1
    begins, ends = np.r_[0, changes], np.r_[changes, n] - 1
    edges = np.r_[depths[0], (depths[changes - 1] + depths[changes]) / 2, depths[-1]]
    middle = (edges[:-1] + edges[1:]) / 2
    inside = (middle > start) & (middle <= end) & (ends > begins)  # skip cells with one point
    points = point.taken([0] * int(inside.sum()))
    return replace(points, places=grid.centers_of(cells[begins[inside]]), spans=None)


STRAIGHT = 1e-6  # with a smaller bend between two stations in radians, the path is straight


class Stations(NamedTuple):
    """Survey stations: depths along a well with a known direction."""

    depths: Floats  # depths along the well from 0, shape (n,)
    directions: Floats  # unit vectors along x, y and z, shape (n, 3)


def positions_along_well(collar: Floats, stations: Stations, depths: Floats) -> Floats:
    """Return the positions, shape (n, 3), at given depths along a well, by minimum curvature.

    Between two stations, the path is an arc of length L and bend β, with end tangents t₁ and t₂. At
    length f L, the offset is L / (β sin β) · ([cos (1 − f)β − cos β] t₁ + [1 − cos fβ] t₂).
    """
    starts = [collar]
    for k in range(1, len(stations.depths)):
        start, end = stations.depths[k - 1 : k + 1]
        starts.append(starts[-1] + _gone(stations, k - 1, np.array([end - start]))[0])
    which = np.maximum(np.searchsorted(stations.depths, depths, side="right") - 1, 0)
    places = np.empty((len(depths), 3))
    for k in np.unique(which):
        after_k = which == k
        places[after_k] = starts[k] + _gone(stations, k, depths[after_k] - stations.depths[k])
    return places


def _gone(stations: Stations, k: int, along: Floats) -> Floats:
    """Return the offsets of the path from station k at given lengths after this station."""
    first = stations.directions[k]
    if k + 1 == len(stations.depths):
        return along[:, None] * first
    second, length = stations.directions[k + 1], stations.depths[k + 1] - stations.depths[k]
    bend = bend_between(first, second)
    if bend < STRAIGHT:
        return along[:, None] * first
    share = along / length
    by_first = np.cos((1 - share) * bend) - np.cos(bend)
    by_second = 1 - np.cos(share * bend)
    sums = by_first[:, None] * first + by_second[:, None] * second
    return length / (bend * np.sin(bend)) * sums


def bend_between(first: Floats, second: Floats) -> float:
    """Return the angle between two directions in radians; small angles are accurate, too."""
    return 2 * float(np.arcsin(min(float(np.linalg.norm(second - first)) / 2, 1.0)))
