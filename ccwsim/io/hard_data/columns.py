"""Assign the columns of a table of hard data to coordinates, heights and facies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from ccwsim.io.data_file import DataFile, listed
from ccwsim.io.hard_data.column_names import (
    DEPTHS,
    HEIGHTS,
    LAYERS,
    WELL_OF_POINTS,
    WELL_TABLES,
    asked_columns,
    columns_of,
    counts_from_one,
    place_columns,
    value_column,
)
from ccwsim.model.errors import CCWSIMError, shown


@dataclass(frozen=True)
class PointColumns:
    """The columns of hard data in a file; columns that are not given are guessed by name."""

    x: str | None = None
    y: str | None = None
    """Columns of the coordinates. With `coordinates="cells"`, x is the column and y the row."""
    facies: str | None = None
    """Name of the column, variable or array that contains facies as numbers or names. By default,
    columns of heights or well names are never used as facies."""
    well: str | None = None
    """Name of the column of well names, only for a volume; "" for no column."""
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
        known = isinstance(self.coordinates, str) and self.coordinates in ("world", "cells")
        if self.coordinates is not None and not known:
            raise CCWSIMError(f'coordinates = {shown(self.coordinates)} must be "world" or "cells"')

    def named(self, *, volume: bool = True) -> dict[str, str | None]:
        """Return the given columns by role; leave out columns for volumes if `volume` is false."""
        roles = ("x", "y", "facies", *(("well", "z", *DEPTHS) if volume else ()))
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
    """Assign columns of a table to coordinates, facies and, for a volume, heights and wells.

    Examples
    --------
    >>> file = DataFile("table", "a.csv", {}, is_table=True, columns=("Ost", "Nord", "z", "Rock"))
    >>> assign_columns(file, PointColumns(), volume=True).columns
    {'x': 'Ost', 'y': 'Nord', 'z': 'z', 'facies': 'Rock'}
    >>> assign_columns(file, PointColumns(well="Rock"), volume=False).problems
    ("well = 'Rock' applies only to volumes; give a grid with nz, or leave the column out",)
    """
    columns, named = dict[str, str](), dict[str, str]()
    notes, problems = list[str](), list[str]()
    world = asked.coordinates != "cells"
    try:
        role = next((role for role in ("z", *DEPTHS, "well") if getattr(asked, role)), None)
        if role and not volume:
            column = shown(getattr(asked, role))
            raise CCWSIMError(
                f"{role} = {column} applies only to volumes; give a grid with nz, or leave the "
                "column out"
            )
        named = asked_columns(file, asked.named(volume=volume))
        taken = [column for role, column in named.items() if role not in ("x", "y")]
        places = place_columns(file, asked.x, asked.y, asked.coordinates, taken)
        columns["x"], columns["y"], world, notes = places
    except CCWSIMError as error:
        problems.append(str(error))
    unclear = bool(notes or problems)
    if volume:
        try:
            roles = {**(HEIGHTS if world else LAYERS), **WELL_OF_POINTS}
            taken = [*columns.values(), *([named["facies"]] if "facies" in named else [])]
            columns |= columns_of(file, roles, vars(asked), taken)
            _check_heights(file, columns, asked, world)
        except CCWSIMError as error:
            problems.append(str(error))
    _assign_facies(file, columns, asked.facies, problems)
    cells = [] if world else [columns[role] for role in ("x", "y", "z") if role in columns]
    from_one = bool(cells) and counts_from_one(*cells)
    return Assignment(columns, tuple(notes), tuple(problems), world, unclear, from_one)


def assign_well_columns(file: DataFile, table: str, asked: WellColumns) -> Assignment:
    """Assign the columns of a table of wells to roles.

    Examples
    --------
    >>> columns = ("BHID", "From", "To", "Rock")
    >>> file = DataFile("table", "a.csv", {}, is_table=True, columns=columns)
    >>> assign_well_columns(file, "intervals", WellColumns()).columns
    {'well': 'BHID', 'depth_from': 'From', 'depth_to': 'To', 'facies': 'Rock'}
    """
    roles, columns, problems = WELL_TABLES[table], dict[str, str](), list[str]()
    facies = {"facies": asked.facies} if table == "intervals" else {}
    try:
        value = asked_columns(file, facies)
        columns = columns_of(file, roles, vars(asked), [*value.values()])
        asked_columns(file, {**facies, **{role: getattr(asked, role) for role in roles}})
        _check_well_columns(file, table, columns)
    except CCWSIMError as error:
        problems.append(str(error))
    if table == "intervals":
        _assign_facies(file, columns, asked.facies, problems)
    return Assignment(columns, problems=tuple(problems))


def _assign_facies(
    file: DataFile, columns: dict[str, str], asked: str | None, problems: list[str]
) -> None:
    """Add the column of facies; if no column fits, append the error's text to `problems`."""
    try:
        rest = [name for name in file.names if name not in columns.values()]
        columns["facies"] = value_column(file, rest, asked)
    except CCWSIMError as error:
        if str(error) not in problems:
            problems.append(str(error))


def _check_heights(
    file: DataFile, columns: Mapping[str, str], asked: PointColumns, world: bool
) -> None:
    """Raise an error if a table of data in a volume has no column of heights."""
    if not world and (role := next((role for role in DEPTHS if getattr(asked, role)), None)):
        raise CCWSIMError(
            f"{file.name}: {role} = {shown(getattr(asked, role))} is a depth below z, but cells "
            "have layers; leave the column out"
        )
    there = ", ".join(file.names)
    if "z" in columns:
        _check_depths(file, columns)
        return
    if not world:
        raise CCWSIMError(
            f"{file.name} has no column of layers, which a volume needs; set z= to one of {there}"
        )
    depths = " and ".join(columns[role] for role in DEPTHS if role in columns)
    said = f"depths ({depths}) but no z of the collars" if depths else "no column of heights"
    raise CCWSIMError(
        f"{file.name} has {said}, which a volume needs; add a column z, or set z= to one of {there}"
    )


def _check_depths(file: DataFile, columns: Mapping[str, str]) -> None:
    """Raise an error if intervals have only one of the depths "from" and "to"."""
    ends = [role for role in ("depth_from", "depth_to") if role in columns]
    if len(ends) == 1:
        other = "depth_to" if ends == ["depth_from"] else "depth_from"
        raise CCWSIMError(
            f"{file.name} has only the depth {columns[ends[0]]} at one end of intervals; add a "
            f"column '{DEPTHS[other].call}', or set {other}= to a column of the file"
        )


def _check_well_columns(file: DataFile, table: str, columns: Mapping[str, str]) -> None:
    """Raise an error if a required column is missing in a table of wells."""
    roles = WELL_TABLES[table]
    needed = [role for role, kind in roles.items() if not kind.optional]
    if table == "surveys" and "survey_inclination" not in columns:
        needed.append("survey_dip")
    if table == "intervals" and not {"depth_from", "depth_to"} & columns.keys():
        needed.append("depth")
    for role in needed:
        if role not in columns:
            raise CCWSIMError(
                f"{file.name} has no column of {roles[role].what}; it has {listed(file.names)}; "
                f"rename a column to '{roles[role].call}', or set {role}= to a column of the file"
            )
