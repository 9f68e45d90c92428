"""Identify the columns of a table of hard data by their names."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ccwsim.io.data_file import DataFile, listed
from ccwsim.model.errors import CCWSIMError, shown

_FILE = Path(__file__).parents[2] / "assets" / "column_names.toml"
WORDS = {
    kind: tuple(text.split()) for kind, text in tomllib.loads(_FILE.read_text("utf-8")).items()
}
"""For each kind of column, the words that identify a column of this kind."""


class Role(NamedTuple):
    """The role of a column: its kind, which is a key of `WORDS`, and its name in messages."""

    kind: str
    what: str
    call: str
    prefix: int = 0  # longer words may match the start of a name
    optional: bool = False


Asked = Mapping[str, Any]
"""The columns that a user names, by role; an empty text means that there is no such column."""
DEPTHS = {
    "depth_from": Role("from", "starts of intervals", "from", optional=True),
    "depth_to": Role("to", "ends of intervals", "to", optional=True),
    "depth": Role("depth", "depths", "from and to, or depth", optional=True),
}
_NAMES_OF_WELLS = Role("well", "the names of the wells", "well")
WELL_OF_POINTS = {"well": Role("hole", "the names of the wells", "well")}
HEIGHTS = {"z": Role("collar", "heights", "z"), **DEPTHS}
LAYERS = {"z": Role("layer", "layers", "layer")}
COLLARS = {
    "collar_well": _NAMES_OF_WELLS,
    "x": Role("x", "x of the collars", "x", 4),
    "y": Role("y", "y of the collars", "y", 4),
    "z": Role("collar", "the elevations of the collars", "z"),
    "collar_length": Role("length", "the lengths of the wells", "length", optional=True),
}
INTERVALS = {"well": _NAMES_OF_WELLS, **DEPTHS}
SURVEYS = {
    "survey_well": _NAMES_OF_WELLS,
    "survey_depth": Role("survey_depth", "depths", "depth"),
    "survey_azimuth": Role("azimuth", "directions", "azimuth"),
    "survey_inclination": Role("inclination", "the tilt of wells", "inclination", optional=True),
    "survey_dip": Role("dip", "the tilt of wells", "inclination or dip", optional=True),
}
WELL_TABLES = {"collars": COLLARS, "intervals": INTERVALS, "surveys": SURVEYS}
"""The roles of columns in each table of wells."""
ALTERNATIVE_ROLES = {"depth": ("depth_from", "depth_to"), "survey_dip": ("survey_inclination",)}
"""By role, the roles that are preferred by default if a table also has columns of these roles."""


def is_points(names: list[str]) -> bool:
    """Return whether some of these column names are names of coordinates.

    Examples
    --------
    >>> is_points(["X [m]", "Y [m]", "facies"]), is_points(["facies", "porosity"])
    (True, False)
    """
    pairs = ("x", "y"), ("row", "column")
    return any(_first(names, first) and _first(names, second) for first, second in pairs)


def place_columns(
    file: DataFile,
    x: str | None = None,
    y: str | None = None,
    coordinates: str | None = None,
    taken: Sequence[str] = (),
) -> tuple[str, str, bool, list[str]]:
    """Return two columns of coordinates, whether coordinates are in world units, and notes.

    Columns in `taken` already have another role, so they are not guessed as coordinates.

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
    free = [name for name in names if name not in (*asked, *taken)]
    column, row = asked[0] or _first(free, "column"), asked[1] or _first(free, "row")
    first, second = asked[0] or _first(free, "x", 4), asked[1] or _first(free, "y", 4)
    if coordinates is None and column and row:
        cells = _is(column, "column") and _is(row, "row") and not (first and second)
        cells |= column == first and row == second and _is(column, "column")
    if first and second and not cells:
        return first, second, True, []
    if row and column and coordinates != "world":
        letters = counts_from_one(row, column) and asked == [None, None]
        note = [f"{column} counts cells along x, and {row} along y."] if letters else []
        return column, row, False, note
    numeric = [name for name in free if name in file.variables]
    if len(names) < 3 or len(numeric) < asked.count(None):
        raise CCWSIMError(
            f"{file.name} needs columns x, y, facies or row, col, facies; it has {listed(names)}"
        )
    places = [name for name in numeric if not _is(name, *_NOT_PLACES)]
    if len(places) < asked.count(None):
        raise CCWSIMError(
            f"{file.name} has no columns of coordinates among {', '.join(names)}; name x and y"
        )
    guess = iter(places)
    if cells:  # the usual order is row, column
        row, column = (name or next(guess) for name in (asked[1], asked[0]))
        return column, row, False, [_untold(row, column, "row and col")]
    first, second = (name or next(guess) for name in asked)
    return first, second, True, [_untold(first, second, "x and y")]


def counts_from_one(*columns: str) -> bool:
    """Return whether all these columns of cell numbers have names that count from 1.

    Examples
    --------
    >>> counts_from_one("I", "J"), counts_from_one("row", "col")
    (True, False)
    """
    return all(_is(column, "from_one") for column in columns)


_NOT_PLACES = ("z", "label", "code", "value", "depth", "from", "to", "length")
"""Kinds of columns that are never guessed as coordinates."""


def _untold(one: str, two: str, said: str) -> str:
    return f"No column name shows coordinates. {one} and {two} are read as {said}."


def columns_of(
    file: DataFile, roles: Mapping[str, Role], asked: Asked, taken: Sequence[str] = ()
) -> dict[str, str]:
    """Return the column of each role in a table, as given by the user or guessed by name.

    If a table has a column "depth" and also columns "from" and "to", the columns that the user
    names are returned (default: "from" and "to"). Inclinations are preferred to dips by default.

    Examples
    --------
    >>> columns = ("hole", "from", "to", "depth", "rock")
    >>> file = DataFile("table", "a.csv", {}, is_table=True, columns=columns)
    >>> columns_of(file, INTERVALS, {})
    {'well': 'hole', 'depth_from': 'from', 'depth_to': 'to'}
    >>> columns_of(file, INTERVALS, {"depth": "DEPTH", "well": ""})
    {'depth': 'depth'}
    """
    named = asked_columns(file, {role: asked.get(role) for role in roles})
    free = [name for name in file.names if name not in (*named.values(), *taken)]
    columns = {}
    for role, kind in roles.items():
        column = named.get(role)
        if column is None and asked.get(role) is None:
            column = _first(free, kind.kind, kind.prefix)
        if column is not None:
            columns[role] = column
            free = [name for name in free if name != column]
    for one, others in ALTERNATIVE_ROLES.items():
        rivals = [other for other in others if other in named]
        if one in named and rivals:
            raise CCWSIMError(
                f"{file.name}: {one} and {rivals[0]} are both named, but are alternatives; leave "
                "one out"
            )
        if one in named:
            columns = {role: column for role, column in columns.items() if role not in others}
        elif any(other in columns for other in others):
            columns.pop(one, None)
    return columns


def asked_columns(file: DataFile, asked: Asked) -> dict[str, str]:
    """Return the columns given by the user; raise an error if one is missing or given twice.

    Examples
    --------
    >>> file = DataFile("table", "a.csv", {}, is_table=True, columns=("East", "North"))
    >>> asked_columns(file, {"x": "east", "y": None, "z": ""})
    {'x': 'East'}
    """
    roles: dict[str, str] = {}  # role by column
    for role, name in asked.items():
        if name is None or (isinstance(name, str) and not name):
            continue
        column = file.column(name)
        first = roles.setdefault(column, role)
        if first != role:
            raise CCWSIMError(
                f"{file.name}: {first} and {role} are both {shown(column)}; name two columns"
            )
    return {role: column for column, role in roles.items()}


def value_column(file: DataFile, rest: list[str], variable: str | None) -> str:
    """Find the column of facies among `rest`, the columns that are not coordinates.

    Examples
    --------
    >>> file = DataFile("table", "a.csv", {}, is_table=True, columns=("x", "y", "id", "Code"))
    >>> value_column(file, ["id", "Code"], None)
    'Code'
    """
    if variable is not None:
        return file.column(variable)
    named = _first(rest, "code", 5) or _first(rest, "value")
    if named:
        return named
    likely = [name for name in rest if not _is(name, "z", "label")]
    if len(likely) == 2 and len(file.names) == 4 and _unnamed(file):
        return likely[1]  # four columns with generic names are x, y, z and the value
    if len(likely) == 1:
        return likely[0]
    if not likely:
        others = f" (among {', '.join(rest[:9])})" if rest else ""
        raise CCWSIMError(
            f"{file.name} has no column that looks like facies{others}; name the column (facies=)"
        )
    there = ", ".join(map(repr, likely[:20]))
    raise CCWSIMError(f"{file.name} has {len(likely)} variables: {there}; pick one (facies=)")


def _unnamed(file: DataFile) -> bool:
    return all(re.match(r"(col|column|var)[ _]?\d", name.lower()) for name in file.names)


def height_column(rest: list[str], key: str) -> str | None:
    """Find the column of heights among `rest`; return None if there is none.

    Examples
    --------
    >>> height_column(["Z", "facies"], "facies")
    'Z'
    """
    return next((name for name in rest if _is(name, "z") and name != key), None)


def _first(names: list[str], kind: str, prefix: int = 0) -> str | None:
    """Return the first name that equals a word, or starts with a word of ≥ `prefix` letters."""
    words = WORDS[kind]
    exact = next((name for word in words for name in names if _plain(name) == word), None)
    long = [word for word in words if prefix and len(word) >= prefix]
    return exact or next((n for word in long for n in names if _plain(n).startswith(word)), None)


def _is(name: str, *kinds: str) -> bool:
    return any(_plain(name) in WORDS[kind] for kind in kinds)


def _plain(name: str) -> str:
    """Return a column name in lower case, without units and punctuation: "X [m]" becomes x."""
    return re.sub(r"[^a-z0-9]", "", re.split(r"[\[(,]", name.lower())[0])
