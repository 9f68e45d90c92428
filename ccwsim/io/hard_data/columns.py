"""Which columns of a table of hard data hold places, heights and facies, by their names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from ccwsim.io.data_file import DataFile
from ccwsim.model.errors import CCWSIMError, shown


def _words(text: str) -> tuple[str, ...]:
    return tuple(text.split())


_X = _words(
    "x xcoord xcoordinate coordx xkoordinate xkoord xm xutm utmx utme easting utmeasting eastings "
    "east eastm utmeast ostwert rechtswert ost rechts rw este est lon long longitude laengengrad "
    "lngengrad xworld surfacex xwgs84 e"
)
_Y = _words(
    "y ycoord ycoordinate coordy ykoordinate ykoord ym yutm utmy utmn northing utmnorthing "
    "northings north northm utmnorth nordwert hochwert nord hoch hw norte lat latitude breitengrad "
    "yworld surfacey ywgs84 n"
)
_Z = _words(
    "z zcoord zcoordinate zm elevation elev altitude alt height depth dept md tvd tvdss "
    "measureddepth tiefe teufe hoehe hhe top base bottom from to kb k iz slice"
)
_ROW = ("row", "rows", "i", "iy", "rowindex")
_COLUMN = ("col", "cols", "column", "columns", "j", "ix", "colindex", "columnindex")
_CODE = _words(
    "facies faciescode faciesname fazies lithofacies lithology lithologie litho lith rock rocktype "
    "gestein code codes class klasse category soil boden geology unit"
)
_VALUE = (*_CODE, "value", "wert", "var", "variable", "v")
_NAMES = _words(
    "well wellname wellid wells hole holeid bore borehole bohrung bohrungsname sonde uwi id fid "
    "objectid pointid name no nr number index station point punkt sample date datum remark remarks "
    "comment comments bemerkung surface"
)
"""Names of wells, numbers of rows, remarks: never taken for facies unasked."""
_LAYER = ("layer", "layers", "k", "iz", "kz", "slice", "layerindex")
_COLLAR = _words(
    "z zcoord zcoordinate coordz zkoordinate zm elevation elev altitude alt height hoehe "
    "collar zcollar collarz collarelevation kb"
)
_DEPTH = _words("depth dept md tvd measureddepth tiefe teufe")
_WELL = _words(
    "bhid holeid hole boreholeid borehole bore well wellname wellid uwi bohrung bohrungsname sonde "
    "dhid name id"
)
_LENGTH = _words("length totaldepth td eoh maxdepth enddepth endofhole laenge endteufe depth")
_AZIMUTH = _words("azimuth azi azim bearing brg az richtung azimut")
_INCLINATION = _words("inclination incl inc deviation dev zenith neigung")
_DIP = _words("dip plunge fallen")
_FROM = _words("from depthfrom fromdepth mdfrom frommd top depthtop topdepth von tiefevon")
_TO = _words("to depthto todepth mdto tomd bottom base depthbase basedepth bis tiefebis")


def is_points(names: list[str]) -> bool:
    """Return whether columns of these names say where something is.

    Examples
    --------
    >>> is_points(["X [m]", "Y [m]", "facies"]), is_points(["facies", "porosity"])
    (True, False)
    """
    pairs = (_X, _Y), (_ROW, _COLUMN)
    return any(_first(names, first) and _first(names, second) for first, second in pairs)


class Roles(NamedTuple):
    """Which columns of a table are what, and what was taken for granted."""

    x: str  # or the column of a cell
    y: str  # or the row of a cell
    world: bool
    facies: str
    notes: list[str]


def table_roles(
    file: DataFile, x: str | None, y: str | None, facies: str | None, coordinates: str | None
) -> Roles:
    """Return which columns of a table hold places and facies: as asked for, or by their names.

    Examples
    --------
    >>> file = DataFile("table", "a.csv", {}, is_table=True, columns=("Ost", "Nord", "z", "Rock"))
    >>> table_roles(file, None, None, None, None)
    Roles(x='Ost', y='Nord', world=True, facies='Rock', notes=[])
    """
    first, second, world, notes = place_columns(file, x, y, coordinates)
    rest = [name for name in file.names if name not in (first, second)]
    return Roles(first, second, world, value_column(file, rest, facies), notes)


def place_columns(
    file: DataFile, x: str | None = None, y: str | None = None, coordinates: str | None = None
) -> tuple[str, str, bool, list[str]]:
    """Return the columns of x and y, or of col and row; whether they are of the world; notes.

    Examples
    --------
    >>> columns = ("Easting [m]", "Northing [m]", "facies")
    >>> place_columns(DataFile("table", "a.csv", {}, is_table=True, columns=columns))
    ('Easting [m]', 'Northing [m]', True, [])
    """
    names, cells = list(file.names), coordinates == "cells"
    asked = [None if name is None else file.column(name) for name in (x, y)]
    if asked[0] is not None and asked[0] == asked[1]:
        raise CCWSIMError(f"{file.name}: x and y are both {shown(asked[0])}; name two columns")
    free = [name for name in names if name not in asked]
    column, row = asked[0] or _first(free, _COLUMN), asked[1] or _first(free, _ROW)
    first, second = asked[0] or _first(free, _X, 4), asked[1] or _first(free, _Y, 4)
    if coordinates is None and column and row:
        cells = _plain(column) in _COLUMN and _plain(row) in _ROW and not (first and second)
        cells |= column == first and row == second and _plain(column) in _COLUMN
    if first and second and not cells:
        return first, second, True, []
    if row and column and coordinates != "world":
        letters = {_plain(row), _plain(column)} == {"i", "j"} and asked == [None, None]
        note = [f"{row} was taken as the row and {column} as the column."] if letters else []
        return column, row, False, note
    numeric = [name for name in free if name in file.variables]
    if len(names) < 3 or len(numeric) < asked.count(None):
        there = ", ".join(names)
        raise CCWSIMError(
            f"{file.name} needs columns x, y, facies or row, col, facies; it has {there}"
        )
    places = [name for name in numeric if _plain(name) not in (*_Z, *_NAMES, *_CODE)]
    guess = iter(places if len(places) >= asked.count(None) else numeric)
    if cells:  # as they are read aloud: row, then column
        row, column = (name or next(guess) for name in (asked[1], asked[0]))
        return column, row, False, [_untold(row, column, "row and col")]
    first, second = (name or next(guess) for name in asked)
    return first, second, True, [_untold(first, second, "x and y")]


def _untold(one: str, two: str, said: str) -> str:
    return f"No column is called so: {one} and {two} were taken as {said}."


class HeightRoles(NamedTuple):
    """Which columns of a table hold heights: all empty for a map."""

    z: str = ""  # the elevation of points or of the collars of wells, or the layer of a cell
    depths: tuple[str, ...] = ()  # below it: of points, or from and to of intervals


def height_roles(file: DataFile, z: str | None, taken: Sequence[str], world: bool) -> HeightRoles:
    """Return which columns hold the heights of data of a volume; an error names what is missing.

    Examples
    --------
    >>> file = DataFile("table", "a.csv", {}, is_table=True, columns=("Z", "from", "to"))
    >>> height_roles(file, None, [], True)
    HeightRoles(z='Z', depths=('from', 'to'))
    """
    own = None if z is None else file.column(z)
    if own in taken:
        raise CCWSIMError(
            f"{file.name}: z = {shown(z)} is a column of something else; name another"
        )
    free = [name for name in file.names if name not in (*taken, own)]
    if not world:
        layer = own or _first(free, _LAYER)
        if layer is None:
            raise CCWSIMError(
                f"{file.name} has no column of layers, which a volume needs; it has "
                f"{', '.join(file.names)}: name it (z=)"
            )
        return HeightRoles(layer)
    start, end, depth = (_first(free, words) for words in (_FROM, _TO, _DEPTH))
    collar = own or _first(free, _COLLAR)
    if collar is None:
        depths = " and ".join(name for name in (start, end, depth) if name)
        said = f"depths ({depths}) but no z of the collars" if depths else "no column of heights"
        raise CCWSIMError(
            f"{file.name} has {said}, which a volume needs; it has {', '.join(file.names)}: add "
            "a column z, or name it (z=)"
        )
    if bool(start) != bool(end) and not depth:
        raise CCWSIMError(
            f"{file.name} has the depth {start or end} of intervals, but not that of their other "
            f"end; add a column {'to' if start else 'from'}"
        )
    if start and end:
        return HeightRoles(collar, (start, end))
    return HeightRoles(collar, (depth,) if depth else ())


def well_columns(file: DataFile) -> tuple[str, str, str]:
    """Return the columns of a table of collars: well, z, and length or an empty text.

    Examples
    --------
    >>> columns = ("HoleID", "East", "North", "Elev", "EOH")
    >>> well_columns(DataFile("table", "a.csv", {}, is_table=True, columns=columns))
    ('HoleID', 'Elev', 'EOH')
    """
    well = needed_column(file, _WELL, "the names of the wells", "well")
    z = needed_column(file, _COLLAR, "the elevations of the collars", "z")
    return well, z, _first(list(file.names), _LENGTH) or ""


def interval_columns(file: DataFile) -> tuple[str, tuple[str, ...]]:
    """Return the columns of a table of intervals: well, and from and to, or the depth of points.

    Examples
    --------
    >>> columns = ("BHID", "From", "To", "Rock")
    >>> interval_columns(DataFile("table", "a.csv", {}, is_table=True, columns=columns))
    ('BHID', ('From', 'To'))
    """
    names = list(file.names)
    well = needed_column(file, _WELL, "the names of the wells", "well")
    start, end, depth = (_first(names, words) for words in (_FROM, _TO, _DEPTH))
    if start and end:
        return well, (start, end)
    if start or end:
        raise CCWSIMError(
            f"{file.name} has the depth {start or end} of intervals, but not that of their other "
            f"end; add a column {'to' if start else 'from'}"
        )
    return well, (depth or needed_column(file, _DEPTH, "depths", "from and to, or depth"),)


def survey_columns(file: DataFile) -> tuple[str, str, str, str, bool]:
    """Return the columns of a table of surveys: well, depth, azimuth, tilt; whether it is a dip.

    Examples
    --------
    >>> columns = ("BHID", "MD", "Azi", "Dip")
    >>> survey_columns(DataFile("table", "a.csv", {}, is_table=True, columns=columns))
    ('BHID', 'MD', 'Azi', 'Dip', True)
    """
    well = needed_column(file, _WELL, "the names of the wells", "well")
    depth = needed_column(file, (*_DEPTH, "at"), "depths", "depth")
    azimuth = needed_column(file, _AZIMUTH, "directions", "azimuth")
    tilt = _first(list(file.names), _INCLINATION)
    if tilt:
        return well, depth, azimuth, tilt, False
    dip = needed_column(file, _DIP, "how wells are tilted", "inclination or dip")
    return well, depth, azimuth, dip, True


def needed_column(file: DataFile, words: tuple[str, ...], what: str, name: str) -> str:
    """Return the column that is called by one of some words; an error says what is missing."""
    found = _first(list(file.names), words)
    if found is None:
        raise CCWSIMError(
            f"{file.name} has no column of {what}; it has {', '.join(file.names)}: call it {name}"
        )
    return found


def value_column(file: DataFile, rest: list[str], variable: str | None) -> str:
    """Return the column of facies among those that are no places.

    Examples
    --------
    >>> file = DataFile("table", "a.csv", {}, is_table=True, columns=("x", "y", "id", "Code"))
    >>> value_column(file, ["id", "Code"], None)
    'Code'
    """
    if variable is not None:
        return file.column(variable)
    named = _first(rest, _CODE, 5) or _first(rest, _VALUE)
    if named:
        return named
    likely = [name for name in rest if _plain(name) not in (*_Z, *_NAMES)]
    if len(likely) == 2 and len(file.names) == 4 and _unnamed(file):
        return likely[1]  # x, y, z, value without telling names
    if len(likely) == 1:
        return likely[0]
    if not likely:
        others = f" (left are {', '.join(rest[:9])})" if rest else ""
        raise CCWSIMError(
            f"{file.name} has no column that looks like facies{others}; name it (facies=)"
        )
    there = ", ".join(map(repr, likely[:20]))
    raise CCWSIMError(f"{file.name} has {len(likely)} variables: {there}; pick one (facies=)")


def _unnamed(file: DataFile) -> bool:
    return all(re.match(r"(col|column|var)[ _]?\d", name.lower()) for name in file.names)


def height_column(rest: list[str], key: str) -> str | None:
    """Return the column of heights among those that are no places, if there is one.

    Examples
    --------
    >>> height_column(["Z", "facies"], "facies")
    'Z'
    """
    return next((name for name in rest if _plain(name) in _Z and name != key), None)


def _first(names: list[str], known: tuple[str, ...], prefix: int = 0) -> str | None:
    """The first name that is a known word; else one that begins with a word of so many letters."""
    found = next((name for word in known for name in names if _plain(name) == word), None)
    long = [word for word in known if prefix and len(word) >= prefix]
    return found or next((n for word in long for n in names if _plain(n).startswith(word)), None)


def _plain(name: str) -> str:
    """A column's name without units, case and marks: "X [m]" is x."""
    return re.sub(r"[^a-z0-9]", "", re.split(r"[\[(,]", name.lower())[0])
