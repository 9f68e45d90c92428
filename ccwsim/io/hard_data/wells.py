"""Wells in two or three tables: collars, intervals and, where they deviate, surveys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile
from ccwsim.io.formats.classes import Classes
from ccwsim.io.formats.pictures import Picture
from ccwsim.io.hard_data.columns import (
    COLLARS,
    INTERVALS,
    SURVEYS,
    Asked,
    asked_columns,
    columns_of,
    interval_columns,
    survey_columns,
    value_column,
    well_columns,
)
from ccwsim.io.hard_data.depths import along_wells, heights_below
from ccwsim.io.hard_data.paths import Stations, bend_between, positions
from ccwsim.io.hard_data.placing import (
    FaciesNames,
    HardDataImport,
    place_points,
    resolve_points,
)
from ccwsim.io.hard_data.points import (
    ImportedPoints,
    PointsPreview,
    facies_column,
    known_points,
    names_of_wells,
    place_numbers,
    preview_of,
)
from ccwsim.io.limits import limits
from ccwsim.io.opening import PathOrFile, open_file
from ccwsim.model.arrays import check_int
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage

STEPS_A_CELL = 16
"""Points of a deviated well along the shortest side of a cell."""
MAX_BEND = np.radians(179.0)
"""Beyond it directions are opposite, and the plane of the arc between them is unclear."""


TABLES = {"collars": COLLARS, "intervals": INTERVALS, "surveys": SURVEYS}
"""What the columns of each table may be, by the arguments that name them."""
WELL_COLUMNS = tuple(dict.fromkeys(name for roles in TABLES.values() for name in roles))


def import_wells(
    collars: PathOrFile,
    intervals: PathOrFile,
    grid: Grid | Sequence[int],
    training_image: TrainingImage | None = None,
    *,
    surveys: PathOrFile | None = None,
    facies: str | None = None,
    facies_names: FaciesNames | None = None,
    threshold: float | None = None,
    classes: Classes = None,
    on_collision: str = "error",
    on_outside: str = "error",
    on_unknown: str = "error",
    **columns: str | None,
) -> HardDataImport:
    """Return the hard data of wells and a report of what happened on the way.

    Parameters
    ----------
    collars : path or binary file
        A table with one row a well: its name, x, y, z (the elevation of the collar) and, if known,
        its length (`length`, `total depth`, `EOH`).
    intervals : path or binary file
        A table with the name of the well, `from` and `to` or one `depth`, and the facies. Depths
        are along the well, from the collar on.
    grid : Grid or triple of int
        The grid of the volume.
    training_image, facies_names, threshold, classes
        As in `place_points`.
    surveys : path or binary file, optional
        A table of stations of deviated wells: name, `depth` along the well, `azimuth` (degrees from
        north, clockwise), and `inclination` (degrees from straight down) or `dip` (degrees from
        horizontal, negative below it; dips of which none is negative are refused). Between
        stations a well is an arc, by the method of minimum curvature [1]_; before the first and
        after the last it keeps its direction. Wells without stations are vertical.
    facies : str, optional
        The column of facies, where its name does not tell.
    on_collision, on_outside, on_unknown
        As in `resolve_points`.
    **columns : str, optional
        The other columns, where their names do not tell: of the collars `x`, `y`, `z`,
        `collar_well` (their names) and `collar_length`; of the intervals `well`, `depth_from` and
        `depth_to`, or `depth`; of the surveys `survey_well`, `survey_depth`, `survey_azimuth`, and
        `survey_inclination` or `survey_dip`. An empty text says that there is none.

    Returns
    -------
    HardDataImport
        A vertical well has a datum in every cell whose centre is in an interval; a deviated one in
        every cell that it goes through, with the facies at the middle of its way there.

    Raises
    ------
    CCWSIMError
        For tables that cannot be read or contradict each other; the message names their rows.

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
    own = Grid.of(grid)
    points = read_well_points(
        collars, intervals, own, surveys=surveys, facies=facies, **_known(columns)
    )
    placed = place_points(
        points, own, training_image, facies_names=facies_names, threshold=threshold, classes=classes
    )
    return resolve_points(
        placed, on_collision=on_collision, on_outside=on_outside, on_unknown=on_unknown
    )


def read_wells(
    collars: PathOrFile,
    intervals: PathOrFile,
    grid: Grid | Sequence[int],
    training_image: TrainingImage | None = None,
    *,
    surveys: PathOrFile | None = None,
    facies: str | None = None,
    facies_names: FaciesNames | None = None,
    threshold: float | None = None,
    classes: Classes = None,
    on_collision: str = "error",
    on_outside: str = "error",
    on_unknown: str = "error",
    **columns: str | None,
) -> HardData:
    """Return the hard data of wells; `import_wells` also says what happened on the way.

    Parameters
    ----------
    collars, intervals, grid, training_image, surveys, facies
        As in `import_wells`.
    facies_names, threshold, classes, on_collision, on_outside, on_unknown, **columns
        As in `import_wells`.

    Raises
    ------
    CCWSIMError
        For tables that cannot be read or contradict each other; the message names their rows.

    Examples
    --------
    >>> from io import BytesIO
    >>> collars = BytesIO(b"well,x,y,z\\nA,10.5,2.5,8\\n")
    >>> read_wells(collars, BytesIO(b"well,depth,facies\\nA,1.2,1\\n"), (8, 8, 16)).triples
    ((6, 2, 10, 1),)
    """
    imported = import_wells(
        collars,
        intervals,
        grid,
        training_image,
        surveys=surveys,
        facies=facies,
        facies_names=facies_names,
        threshold=threshold,
        classes=classes,
        on_collision=on_collision,
        on_outside=on_outside,
        on_unknown=on_unknown,
        **columns,
    )
    return imported.hard_data


def read_well_points(
    collars: PathOrFile,
    intervals: PathOrFile,
    grid: Grid | Sequence[int],
    *,
    surveys: PathOrFile | None = None,
    facies: str | None = None,
    **columns: str | None,
) -> ImportedPoints:
    """Return the data of wells as points: one for each cell of an interval, or each depth.

    Parameters
    ----------
    collars, intervals, grid, surveys, facies, **columns
        As in `import_wells`.

    Raises
    ------
    CCWSIMError
        For tables that cannot be read or contradict each other; the message names their rows.

    Examples
    --------
    >>> from io import BytesIO
    >>> collars, log = BytesIO(b"a,b,c,d\\nA,10.5,2.5,8\\n"), BytesIO(b"a,b,c\\nA,1.2,1\\n")
    >>> named = {"collar_well": "a", "x": "b", "y": "c", "z": "d", "well": "a", "depth": "b"}
    >>> points = read_well_points(collars, log, (8, 8, 16), **named)
    >>> points.places.tolist(), points.wells
    ([[10.5, 2.5, 6.8]], {2: 'A'})
    """
    own, asked = Grid.of(grid), _known(columns)
    if own.nz is None:
        raise CCWSIMError(f"wells need a grid with layers, but {own} is a map; give nz")
    paths = _collars(_table(collars), asked)
    if surveys is not None:
        _add_stations(_table(surveys), paths, asked)
    elif lost := next((name for name in SURVEYS if asked.get(name)), None):
        raise CCWSIMError(
            f"{lost} = {shown(asked[lost])} is of a table of surveys; give surveys, or leave it out"
        )
    return _points(_table(intervals), paths, own, facies, asked)


def _known(columns: Asked) -> Asked:
    """Return arguments that name columns; another one is a mistake in the call."""
    unknown = [name for name in columns if name not in WELL_COLUMNS]
    if unknown:
        raise TypeError(f"unexpected keyword argument {unknown[0]!r} for wells")
    return columns


def preview_wells(
    path_or_file: PathOrFile,
    table: str,
    *,
    facies: str | None = None,
    n_rows: int = 6,
    **columns: str | None,
) -> PointsPreview:
    """Return what a table of wells holds and which columns are taken for what.

    Parameters
    ----------
    path_or_file : path or binary file
    table : "collars", "intervals" or "surveys"
        Which of the tables it is.
    facies, **columns
        As in `import_wells`; those of other tables are not looked at.
    n_rows : int
        How many rows to show, at least 1.

    Raises
    ------
    CCWSIMError
        For a file that is no table; columns that cannot be guessed are no error here.

    Examples
    --------
    >>> from io import BytesIO
    >>> found = preview_wells(BytesIO(b"BHID,From,To,Rock\\nA,1,3,1\\n"), "intervals")
    >>> found.guess
    {'well': 'BHID', 'depth_from': 'From', 'depth_to': 'To', 'facies': 'Rock'}
    >>> found = preview_wells(BytesIO(b"a,b,c,d\\nA,1,3,1\\n"), "collars", x="b")
    >>> found.guess, found.reasons[0].split(";")[0]
    ({'x': 'b'}, 'file has no column of the names of the wells')
    """
    if table not in TABLES:
        raise CCWSIMError(f"table = {shown(table)} must be one of {', '.join(TABLES)}")
    n_rows = check_int("n_rows", n_rows, 1)
    file, asked = _table(path_or_file), _known(columns)
    own = facies if table == "intervals" else ""
    guess: dict[str, str] = {}
    reasons: list[str] = []
    try:
        value = asked_columns(file, {"facies": own})
        guess = columns_of(file, TABLES[table], asked, [*value.values()])
        _check_columns(file, table, asked, own)
    except CCWSIMError as error:
        reasons.append(str(error))
    return preview_of(file, guess, reasons, own, n_rows)


def _check_columns(file: DataFile, table: str, asked: Asked, facies: str | None) -> None:
    """Say which column is missing of a table of wells."""
    if table == "intervals":
        interval_columns(file, asked, facies)
    else:
        (well_columns if table == "collars" else survey_columns)(file, asked)


class Well(NamedTuple):
    """A well: its collar, its length where it is known, and how it deviates."""

    line: int  # of the table of collars
    collar: NDArray[np.float64]  # x, y, z
    length: float
    stations: list[Stations]  # none where it is vertical


def _table(path_or_file: PathOrFile) -> DataFile:
    file = open_file(path_or_file)
    if isinstance(file, Picture) or not file.is_table or file.lines is None:
        raise CCWSIMError(f"{file.name} is no table; wells come as tables with named columns")
    return file


def _number(file: DataFile, column: str) -> NDArray[np.float64]:
    """A column of numbers, none missing."""
    assert file.lines is not None
    values = place_numbers(file, column, file.lines).astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise CCWSIMError(f"{file.name}, line {file.lines[bad[0]]}: {column} is missing; add it")
    return values


def _collars(file: DataFile, asked: Asked) -> dict[str, Well]:
    """Return the wells of a table of collars by their names."""
    columns = well_columns(file, asked)
    well, length = columns["collar_well"], columns.get("collar_length")
    places = np.column_stack([_number(file, columns[name]) for name in ("x", "y", "z")])
    lengths = np.full(len(places), np.inf)
    if length:
        lengths = place_numbers(file, length, np.array(_lines(file)))
        lengths = np.where(np.isnan(lengths), np.inf, lengths)  # not known of this well
    found: dict[str, Well] = {}
    rows = zip(_lines(file), names_of_wells(file, well), places, lengths, strict=True)
    for line, name, place, own in rows:
        if not name:
            raise CCWSIMError(f"{file.name}, line {line}: the name of the well is missing; add it")
        if name in found:
            raise CCWSIMError(
                f"{file.name}, lines {found[name].line} and {line}: the well {shown(name)} has two "
                "collars; leave one out"
            )
        found[name] = Well(line, place, float(own), [])
    return found


def _add_stations(file: DataFile, wells: dict[str, Well], asked: Asked) -> None:
    """Give wells the directions of a table of surveys."""
    well, depth, azimuth, tilt, is_dip = survey_columns(file, asked)
    depths, bearings, tilts = (_number(file, name) for name in (depth, azimuth, tilt))
    lines = _lines(file)
    if is_dip and tilts.max(initial=0) > 0 and tilts.min() >= 0:
        raise CCWSIMError(
            f"{file.name}: {tilt} is {tilts.min():g} to {tilts.max():g}, above the horizon: "
            "give dips of wells that go down below 0, or call the column inclination if 0 is "
            "straight down"
        )
    least, most = (-90, 90) if is_dip else (0, 180)
    for what, values, low, high in ((azimuth, bearings, -180, 360), (tilt, tilts, least, most)):
        bad = np.flatnonzero((values < low) | (values > high))
        if len(bad):
            raise CCWSIMError(
                f"{file.name}, line {lines[bad[0]]}: {what} {values[bad[0]]:g} is not from {low} "
                f"to {high} degrees; correct it"
            )
    radians, bearing = np.radians(tilts - least), np.radians(bearings)  # both from straight down
    flat = np.sin(radians)
    ways = np.column_stack([flat * np.sin(bearing), flat * np.cos(bearing), -np.cos(radians)])
    names = np.array(names_of_wells(file, well))
    for name in dict.fromkeys(names.tolist()):
        own = np.flatnonzero(names == name)
        if name not in wells:
            raise CCWSIMError(
                f"{file.name}, line {lines[own[0]]}: there is no collar of the well {shown(name)}; "
                "add it to the collars"
            )
        own = own[np.argsort(depths[own], kind="stable")]
        twice = np.flatnonzero(np.diff(depths[own]) == 0)
        if depths[own[0]] < 0 or len(twice):
            k, said = (own[twice[0] + 1], "twice") if len(twice) else (own[0], "above the collar")
            raise CCWSIMError(
                f"{file.name}, line {lines[k]}: a station of {shown(name)} at depth {depths[k]:g} "
                f"is {said}; correct it"
            )
        for k, after in pairwise(own):
            if bend_between(ways[k], ways[after]) > MAX_BEND:
                raise CCWSIMError(
                    f"{file.name}, lines {lines[k]} and {lines[after]}: {shown(name)} turns back "
                    f"on itself between these stations; correct {azimuth} or {tilt} of one"
                )
        start = depths[own][:1] > 0
        stations = Stations(
            np.concatenate([np.zeros(int(start.sum())), depths[own]]),
            np.concatenate([ways[own][:1][start], ways[own]]),
        )
        wells[name].stations.append(stations)


def _lines(file: DataFile) -> list[int]:
    assert file.lines is not None
    return file.lines.tolist()


def _points(
    file: DataFile, wells: dict[str, Well], grid: Grid, facies: str | None, asked: Asked
) -> ImportedPoints:
    """Return the points of all wells: one for each cell of an interval, or each depth."""
    well, depths = interval_columns(file, asked, facies)
    rest = [name for name in file.names if name not in (well, *depths)]
    variable = value_column(file, rest, facies)
    columns = [_number(file, name) for name in depths]
    start, end, lines = columns[0], columns[-1], np.array(_lines(file))
    below = heights_below(file.name, lines, np.zeros(len(lines)), columns)
    names = names_of_wells(file, well)
    _check(file, names, start, end, wells)
    values, words = facies_column(file, variable)
    if words:
        file = replace(file, missing=())  # a place in the names is no value
    collars = np.array([wells[name].collar for name in names]).reshape(-1, 3)
    places = collars + np.outer(below.z, [0, 0, 1])
    spans = None if below.spans is None else below.spans + collars[:, 2:]
    points = known_points(file, variable, places, values, lines, True, "line", [], spans)
    points = replace(points, words=words, wells=dict(zip(lines.tolist(), names, strict=True)))
    known = np.isin(lines, points.lines)
    names, start, end = np.array(names)[known], start[known], end[known]
    bent = np.array([bool(wells[name].stations) for name in names.tolist()], bool)
    parts = [along_wells(_part(points, ~bent), grid)]
    for k in np.flatnonzero(bent).tolist():
        own = _part(points, [k]), wells[names[k]], start[k], end[k], grid
        parts.append(_along_path(*own))
    n_empty = sum(not part.n for part in parts[1:])
    notes = parts[0].notes
    if n_empty:
        notes += (f"Intervals that hold no middle of a well's way through a cell: {n_empty}.",)
    notes += _notes_on_paths(points, names, end, wells)
    return replace(
        parts[0],
        places=np.concatenate([part.places for part in parts]),
        values=np.concatenate([part.values for part in parts]),
        lines=np.concatenate([part.lines for part in parts]),
        notes=notes,
    )


def _notes_on_paths(
    points: ImportedPoints,
    names: NDArray[np.str_],
    end: NDArray[np.float64],
    wells: dict[str, Well],
) -> tuple[str, ...]:
    """Say which wells have no data, and where paths were taken for granted."""
    logged = set(names.tolist())
    surveyed = any(well.stations for well in wells.values())
    empty = [name for name in wells if name not in logged]
    straight = [name for name in wells if name in logged and not wells[name].stations and surveyed]
    notes = [
        f"{what}: {len(which)} ({', '.join(which[:6])}{' …' if len(which) > 6 else ''})."
        for what, which in (
            ("Wells without intervals", empty),
            ("Wells without stations, taken as vertical", straight),
        )
        if which
    ]
    surveys = [wells[name].stations for name in names.tolist()]
    last = np.array([own[0].depths[-1] if own else np.inf for own in surveys])
    below = np.flatnonzero(end > last)
    if len(below):
        notes.append(f"Below its last station a well keeps its direction ({points.named(below)}).")
    return tuple(notes)


def _check(
    file: DataFile,
    names: list[str],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    wells: dict[str, Well],
) -> None:
    """Say which intervals cannot be: one sentence with their rows."""
    lines = _lines(file)
    for k, name in enumerate(names):
        where = f"{file.name}, line {lines[k]}"
        if name not in wells:
            raise CCWSIMError(
                f"{where}: there is no collar of the well {shown(name)}; add it to the collars"
            )
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
                f"overlap from {start[b]:g} on; correct one of them"
            )


def _part(points: ImportedPoints, which: NDArray[np.bool_] | list[int]) -> ImportedPoints:
    spans = None if points.spans is None else points.spans[which]
    own = points.places[which], points.values[which], points.lines[which]
    places, values, lines = own
    return replace(points, places=places, values=values, lines=lines, spans=spans)


def _along_path(
    point: ImportedPoints, well: Well, start: float, end: float, grid: Grid
) -> ImportedPoints:
    """Return an interval of a deviated well as a point in each cell that it has there.

    The middle of the way through the cell decides: it is in one interval alone.
    """
    (stations,) = well.stations
    if point.spans is None:
        places = positions(well.collar, stations, np.array([start]))
        return replace(point, places=places, spans=None)
    step = min(grid.cell_size) / STEPS_A_CELL
    reach = sum(grid.cell_size)  # a cell that the interval begins or ends in is followed to its end
    first, last = max(start - reach, 0.0), min(end + reach, well.length)
    first, n = int(first / step), int(last / step) - int(first / step) + 1
    if n > STEPS_A_CELL * limits().points:
        raise CCWSIMError(
            f"{point.name}, {point.named(np.array([0]))}: the interval is {(end - start):g} long, "
            f"and cells {min(grid.cell_size):g}; correct its depths"
        )
    depths = step * np.arange(first, first + n, dtype=np.float64)  # the same of each interval
    path = positions(well.collar, stations, depths)
    cells = grid.cells_of(*path.T)
    changes = np.flatnonzero((np.diff(cells, axis=0) != 0).any(axis=1)) + 1
    begins, ends = np.r_[0, changes], np.r_[changes, n] - 1
    edges = np.r_[depths[0], (depths[changes - 1] + depths[changes]) / 2, depths[-1]]
    middle = (edges[:-1] + edges[1:]) / 2
    own = (middle > start) & (middle <= end) & (ends > begins)  # a single point may be of an edge
    count = int(own.sum())
    return replace(
        point,
        places=grid.centers_of(cells[begins[own]]),
        values=np.repeat(point.values, count),
        lines=np.repeat(point.lines, count),
        spans=None,
    )
