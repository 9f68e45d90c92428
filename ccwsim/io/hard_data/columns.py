"""Assign the columns of a table of hard data to roles, as the user asks or by their names."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from ccwsim.io.data_file import DataFile, listed
from ccwsim.io.formats.text_tables import PETREL
from ccwsim.model import CCWSIMError, Floats, refused, shown


def _asset(name: str) -> dict[str, Any]:
    return tomllib.loads((Path(__file__).parents[2] / "assets" / name).read_text("utf-8"))


WORDS = {kind: tuple(text.split()) for kind, text in _asset("column_names.toml").items()}
"""For each kind of column, the words that identify a column of this kind."""


class Role(NamedTuple):
    """The role of a column: its kind, which is a key of `WORDS`, and its name in messages."""

    kind: str
    what: str
    call: str
    prefix: int = 0  # longer words may match the start of a name
    optional: bool = False


Asked = Mapping[str, Any]  # columns that a user names, by role; an empty text: no such column
_ROLES = {
    table: {role: Role(**about) for role, about in roles.items()}
    for table, roles in _asset("column_roles.toml").items()
}
DEPTH_ROLES, LAYER_ROLES, SURVEY_ROLES = _ROLES["depths"], _ROLES["layers"], _ROLES["surveys"]
HEIGHT_ROLES, INTERVAL_ROLES = (
    {**_ROLES["heights"], **DEPTH_ROLES},
    {**_ROLES["intervals"], **DEPTH_ROLES},
)
WELL_TABLES = {"collars": _ROLES["collars"], "intervals": INTERVAL_ROLES, "surveys": SURVEY_ROLES}
"""The roles of columns in each table of wells."""
ALTERNATIVE_ROLES = {"depth": ("depth_from", "depth_to"), "survey_dip": ("survey_inclination",)}
"""By role, the roles that are preferred by default if a table also has columns of these roles."""


@dataclass(frozen=True)
class PointColumns:
    """The columns of hard data in a file; columns that are not given are guessed by name."""

    x: str | None = None
    y: str | None = None
    """Columns of the coordinates. With `coordinates="cells"`, x is the column and y the row."""
    facies: str | None = None
    """Name of the column, variable or array that contains facies as numbers or names. By default,
    columns of heights or well names are never used as facies."""
    variable: str = ""
    """Name of a continuous variable: a column with this name is preferred to others."""
    well: str | None = None
    """Name of the column of well names; "" for no column."""
    z: str | None = None
    """Name of the column of elevations, only for a volume. If the table has depths, the
    column contains elevations of collars of vertical wells. With `coordinates="cells"`, the column
    contains layers."""
    depth_from: str | None = None
    depth_to: str | None = None
    depth: str | None = None
    """Depths below z, only in volumes: columns "from" and "to", or one column; "" for no column."""
    coordinates: Literal["world", "cells"] | None = None
    """Whether two columns with unclear names are x and y ("world"), or row and col ("cells")."""
    up: bool | None = None
    slice_index: int | None = None
    """Options for files with a grid, as in `read_training_image`."""
    z_up: bool | None = None
    """Whether the first layer of a file with a grid is the bottom of the volume (default: yes)."""

    def __post_init__(self) -> None:
        is_valid = isinstance(self.coordinates, str) and self.coordinates in ("world", "cells")
        if self.coordinates is not None and not is_valid:
            raise CCWSIMError(f'coordinates = {shown(self.coordinates)} must be "world" or "cells"')

    def named(self) -> dict[str, str | None]:
        """Return the given columns by role."""
        roles = ("x", "y", "facies", "well", "z", *DEPTH_ROLES)
        return {role: getattr(self, role) for role in roles}


GUESSED = PointColumns()


@dataclass(frozen=True)
class WellColumns:
    """Columns of tables of wells; columns that are not given are guessed; "" means no column."""

    collar_well: str | None = None
    x: str | None = None
    y: str | None = None
    z: str | None = None
    collar_length: str | None = None
    """Columns of collars: names of the wells, coordinates, elevations, and (optional) lengths."""
    well: str | None = None
    depth_from: str | None = None
    depth_to: str | None = None
    depth: str | None = None
    facies: str | None = None
    """Columns of intervals: well names, depths "from" and "to" (or one depth), and facies."""
    survey_well: str | None = None
    survey_depth: str | None = None
    survey_azimuth: str | None = None
    survey_inclination: str | None = None
    survey_dip: str | None = None
    """Columns of surveys: well names, depths along wells, azimuths, and inclinations or dips."""


GUESSED_WELLS = WellColumns()


@dataclass(frozen=True)
class Assignment:
    """The columns of a table by role, given or guessed, with assumptions and open questions."""

    columns: dict[str, str]  # columns by role, for roles that have a column
    notes: tuple[str, ...] = ()  # assumptions about columns, one sentence each
    problems: tuple[str, ...] = ()  # open questions, one sentence each
    world: bool = True  # whether points have world coordinates instead of rows and columns
    unclear: bool = False  # whether the columns of coordinates have unclear names
    from_one: bool = False  # whether the names of the columns of cells say that cells count from 1

    def complete(self) -> Assignment:
        """Return the assignment; raise an error if a question is open."""
        if self.problems:
            raise CCWSIMError(self.problems[0])
        return self

    def of(self, *roles: str) -> list[str]:
        """Return the columns of the given roles, without missing columns."""
        return [self.columns[role] for role in roles if role in self.columns]


NOTHING_ASSIGNED = Assignment({})


def assign_columns(file: DataFile, asked: PointColumns, *, volume: bool) -> Assignment:
    """Assign columns of a table to coordinates, facies and, for a volume, heights and wells."""
    columns, named = dict[str, str](), dict[str, str]()
    notes, problems = list[str](), list[str]()
    world = asked.coordinates != "cells"
    with _collected(problems):
        if not volume:
            reason = "applies only to volumes; give a grid with nz, or leave the column out"
            _refuse(asked, ("z", *DEPTH_ROLES), reason)
        named = asked_columns(file, asked.named())
        taken = [column for role, column in named.items() if role not in ("x", "y")]
        places = place_columns(file, named.get("x"), named.get("y"), asked.coordinates, taken)
        columns["x"], columns["y"], world, notes = places
    unclear = bool(notes or problems)
    with _collected(problems):
        heights = {} if not volume else HEIGHT_ROLES if world else LAYER_ROLES
        roles = {**heights, **_ROLES["points"]}
        taken = [*columns.values(), *([named["facies"]] if "facies" in named else [])]
        columns |= columns_by_role(file, roles, vars(asked), taken)
        if not world:
            _refuse(asked, DEPTH_ROLES, "is a depth below z, but cells have layers; leave it out")
        ends = {"depth_from", "depth_to"}
        _check_complete(file, roles, columns, ends if ends & columns.keys() else ())
        if "depth" in columns and asked.depth is None and _has_heights_of_data(file, columns):
            unused = columns.pop("depth")
            notes.append(f"{unused} is not used, because {columns['z']} is the height of each row.")
    with _collected(problems):
        columns["facies"] = value_column(file, columns.values(), asked.facies, asked.variable)
    cell_columns = [] if world else [columns[role] for role in ("x", "y", "z") if role in columns]
    return Assignment(
        columns,
        notes=tuple(notes),
        problems=tuple(problems),
        world=world,
        unclear=unclear,
        from_one=bool(cell_columns) and counts_from_one(cell_columns),
    )


def _has_heights_of_data(file: DataFile, columns: Mapping[str, str]) -> bool:
    """Whether z is the height of each row: it varies in a well, or in a place without a name."""
    keys = [columns["well"]] if "well" in columns else [columns["x"], columns["y"]]
    wells = zip(*(file.words.get(key, file.variables.get(key, ())) for key in keys), strict=True)
    heights, of_well = file.variables.get(columns["z"], np.empty(0)), dict[Any, float]()
    named = [(w, z) for w, z in zip(wells, heights.tolist(), strict=False) if w != ("",) and z == z]
    return file.kind == PETREL or any(of_well.setdefault(well, z) != z for well, z in named)


def assign_well_columns(file: DataFile, table: str, asked: WellColumns) -> Assignment:
    """Assign the columns of a table of wells to roles."""
    roles, columns, problems = WELL_TABLES[table], dict[str, str](), list[str]()
    has_facies = table == "intervals"
    if has_facies and file.kind == PETREL:  # each depth is the top of an interval
        roles = {**roles, "depth_from": DEPTH_ROLES["depth"]}
    with _collected(problems):
        facies = {"facies": asked.facies} if has_facies else {}
        named = asked_columns(file, {**facies, **{role: getattr(asked, role) for role in roles}})
        taken = [named["facies"]] if "facies" in named else []
        columns = columns_by_role(file, roles, vars(asked), taken)
        needs_tilt = table == "surveys" and "survey_inclination" not in columns
        needs_depth = has_facies and not {"depth_from", "depth_to"} & columns.keys()
        needed = ["survey_dip"] if needs_tilt else ["depth"] if needs_depth else []
        _check_complete(file, roles, columns, needed)
    if has_facies:
        with _collected(problems):
            columns["facies"] = value_column(file, columns.values(), asked.facies)
    return Assignment(columns, problems=tuple(problems))


@contextmanager
def _collected(problems: list[str]) -> Iterator[None]:
    """Add the message of an error to `problems`, so that all open questions are known at once."""
    try:
        yield
    except CCWSIMError as error:
        if str(error) not in problems:
            problems.append(str(error))


def _refuse(asked: PointColumns, roles: Iterable[str], reason: str) -> None:
    """Raise an error if the user names a column of one of these roles."""
    if role := next((role for role in roles if getattr(asked, role)), None):
        raise CCWSIMError(f"{role} = {shown(getattr(asked, role))} {reason}")


def _check_complete(
    file: DataFile, roles: Mapping[str, Role], columns: Mapping[str, str], needed: Iterable[str]
) -> None:
    """Raise an error if no column has a role that is not optional, or is needed in this table."""
    for role, kind in roles.items():
        if role not in columns and (not kind.optional or role in needed):
            raise CCWSIMError(
                f"{file.name} has no column of {kind.what}; it has {listed(file.names)}; "
                f"rename a column to '{kind.call}', or set {role}= to a column of the file"
            )


def is_points(names: list[str]) -> bool:
    """Return whether some of these column names are names of coordinates."""
    pairs = ("x", "y"), ("row", "column")
    return any(_first(names, first) and _first(names, second) for first, second in pairs)


def place_columns(
    file: DataFile,
    x: str | None = None,
    y: str | None = None,
    coordinates: str | None = None,
    taken: Sequence[str] = (),
) -> tuple[str, str, bool, list[str]]:
    """Return two columns of coordinates, whether they are in world units, and notes."""
    names, counts_cells, asked = list(file.names), coordinates == "cells", [x, y]
    free = [name for name in names if name not in (*asked, *taken)]
    column, row = x or _first(free, "column"), y or _first(free, "row")
    first, second = x or _first(free, "x", 4), y or _first(free, "y", 4)
    if coordinates is None and column and row:
        counts_cells = (
            is_kind(column, ["column"]) and is_kind(row, ["row"]) and not (first and second)
        )
        counts_cells |= column == first and row == second and is_kind(column, ["column"])
    if first and second and not counts_cells:
        return first, second, True, []
    if row and column and coordinates != "world":
        letters = counts_from_one((row, column)) and asked == [None, None]
        note = [f"{column} counts cells along x, and {row} along y."] if letters else []
        return column, row, False, note
    places = [name for name in free if name in file.variables and not is_kind(name, _NOT_PLACES)]
    if len(names) < 3 or len(places) < asked.count(None):
        raise refused("columns_needed", name=file.name, names=listed(names))
    guess = iter(places)
    if counts_cells:  # the usual order is row, column
        row, column = y or next(guess), x or next(guess)
        return column, row, False, [_untold(row, column, "row and col")]
    first, second = x or next(guess), y or next(guess)
    return first, second, True, [_untold(first, second, "x and y")]


def counts_from_one(columns: Iterable[str]) -> bool:
    """Return whether the names of all these columns say that cells are counted from 1."""
    return all(is_kind(column, ["from_one"]) for column in columns)


_NOT_PLACES = ("z", "label", "code", "value", "depth", "from", "to", "length")
"""Kinds of columns that are never guessed as coordinates."""


def _untold(first: str, second: str, axes: str) -> str:
    return f"No column name shows coordinates. {first} and {second} are read as {axes}."


def columns_by_role(
    file: DataFile, roles: Mapping[str, Role], asked: Asked, taken: Sequence[str] = ()
) -> dict[str, str]:
    """Return the column of each role in a table, as given by the user or guessed by name."""
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
    for single, alternatives in ALTERNATIVE_ROLES.items():
        rivals = [other for other in alternatives if other in named]
        if single in named and rivals:
            raise refused("alternative_columns", name=file.name, one=single, other=rivals[0])
        if single in named:
            columns = {role: column for role, column in columns.items() if role not in alternatives}
        elif any(other in columns for other in alternatives):
            columns.pop(single, None)
    return columns


def asked_columns(file: DataFile, asked: Asked) -> dict[str, str]:
    """Return the columns given by the user; raise an error if one is missing or given twice."""
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


def value_column(
    file: DataFile, taken: Collection[str], column: str | None, variable: str = ""
) -> str:
    """Find the column of facies, or of a variable, among columns that are not coordinates."""
    if column is not None:
        return file.column(column)
    free = [name for name in file.names if name not in taken]
    of_variable = [name for name in free if variable and _plain(name) == _plain(variable)]
    if of_variable:
        return of_variable[0]
    surface = next((name for name in free if file.kind == PETREL and name == "Surface"), None)
    named = _first(free, "code", 5) or _first(free, "value") or surface
    if named:
        return named
    likely = [name for name in free if not is_kind(name, ("z", "label"))]
    unnamed = all(re.match(r"(col|column|var)[ _]?\d", name.lower()) for name in file.names)
    if len(likely) == 2 and len(file.names) == 4 and unnamed:
        return likely[1]  # four columns with generic names are x, y, z and the value
    if len(likely) == 1:
        return likely[0]
    if not likely:
        hint = f" (among {', '.join(free[:9])})" if free else ""
        raise refused("no_facies_column", name=file.name, others=hint)
    problem = f"{file.name} has {len(likely)} variables: {listed(likely)}"
    raise CCWSIMError(f"{problem}; pick one (facies=)")


def height_column(names: list[str], key: str) -> str | None:
    """Return the column of heights among `names`, except `key`; return None if there is none."""
    return next((name for name in names if is_kind(name, ["z", "layer"]) and name != key), None)


def upward(column: str, heights: Floats) -> Floats:
    """Return elevations; depths, by the name of their column, are negative."""
    return -heights if is_kind(column, ["depth"]) and not (heights < 0).any() else heights


def _first(names: list[str], kind: str, prefix: int = 0) -> str | None:
    """Return the first name that equals a word, or starts with a word of ≥ `prefix` letters."""
    words = WORDS[kind]
    exact = next((name for word in words for name in names if _plain(name) == word), None)
    long = [word for word in words if prefix and len(word) >= prefix]
    return exact or next((n for word in long for n in names if _plain(n).startswith(word)), None)


def is_kind(name: str, kinds: Iterable[str]) -> bool:
    """Return whether a column name is a word of one of these kinds."""
    return any(_plain(name) in WORDS[kind] for kind in kinds)


def _plain(name: str) -> str:
    """Return a column name in lower case, without units and punctuation: "X [m]" becomes x."""
    return re.sub(r"[^a-z0-9]", "", re.split(r"[\[(,]", name.lower())[0])
