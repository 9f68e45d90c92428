"""Hard data before they are placed in cells: coordinates, values and line numbers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile, first_of
from ccwsim.io.limits import limits
from ccwsim.model.arrays import frozen
from ccwsim.model.classes import are_codes
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid

FAR = 2.0**40
"""Maximum distance of data from the grid, in cells; a larger distance is an error."""


@dataclass(frozen=True, eq=False)
class ImportedPoints:
    """Hard data of a file before they are placed in cells."""

    places: NDArray[np.float64]
    """Coordinates, shape (n, 2) or (n, 3): x, y (and z) in world units if `world` is true,
    otherwise (layer,) row (from the south) and column."""
    values: NDArray[np.float64]
    """Facies codes or values of a continuous variable, shape (n,); only `known` removes NaN."""
    lines: NDArray[np.int64]
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
    spans: NDArray[np.float64] | None = None
    """Heights z of bottom and top of each interval in a vertical well, shape (n, 2); `places`
    contains the middle of each interval."""
    wells: Mapping[int, str] = field(default_factory=dict)
    """Well names by line number, only for a volume; empty if the file has no well names."""
    problems: tuple[RowProblem, ...] = ()
    """Rows of tables of wells that need a decision, with those that are decided."""

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

    def named(self, which: NDArray[np.integer]) -> str:
        """Return the line numbers of some data as a phrase: "lines 3, 7 and 12".

        Examples
        --------
        >>> none = np.empty(0)
        >>> points = ImportedPoints(none, none, np.array([2, 3]), True, "line", "a", "b")
        >>> points.named(np.array([0, 1]))
        'lines 2 and 3'
        """
        return _named_lines(self.counted, self.lines[which])

    def refuse(self, bad: NDArray[np.bool_], said: str) -> None:
        """Raise an error with the lines of bad data, if there are any."""
        if bad.any():
            raise CCWSIMError(f"{self.name}, {self.named(np.flatnonzero(bad))}: {said}")

    def taken(self, which: NDArray | list[int]) -> ImportedPoints:
        """Return the data selected by a mask or by indices."""
        return replace(
            self,
            places=frozen(self.places[which]),
            values=frozen(self.values[which]),
            lines=frozen(self.lines[which]),
            spans=None if self.spans is None else frozen(self.spans[which]),
        )

    def known(self) -> ImportedPoints:
        """Return the data with a value and coordinates, if they are not too many.

        A note names the rows without coordinates.
        """
        check_few(self.name, self.n, "rows")
        known, placed = ~np.isnan(self.values), np.isfinite(self.places).all(axis=1)
        notes = self.notes
        if lost := self.lines[known & ~placed].tolist():
            said = f"{len(lost)} ({self.counted} {first_of(lost)})"
            notes += (f"Rows without coordinates, left out: {said}.",)
        n_missing = self.n - int(np.count_nonzero(known & placed))
        points = replace(self.taken(known & placed), n_missing=n_missing, notes=notes)
        points.refuse(np.isinf(points.values), "the value is not finite; correct it")
        return points


def _named_lines(counted: str, lines: NDArray[np.integer]) -> str:
    different = np.unique(lines)  # many cells of a well have one line number
    numbers = [str(line) for line in different[:6]]
    if len(numbers) < 2:
        return f"{counted} {''.join(numbers)}"
    last = f"{len(different) - 6} more" if len(different) > 6 else numbers.pop()
    return f"{counted}s {', '.join(numbers)} and {last}"


class RowProblem(NamedTuple):
    """Rows of a table of wells that need a decision."""

    option: str  # the field of `Conversion` that decides
    where: str  # file and line numbers
    said: str  # what is wrong
    remedy: str


class RowProblems(NamedTuple):
    """Collects problems with rows of tables of wells."""

    file: DataFile  # the present table
    decisions: Mapping[str, str]  # decisions of the user by option
    found: list[RowProblem]  # problems of all tables

    def add(self, option: str, rows: Sequence[int | np.integer], said: str, remedy: str) -> None:
        """Note a problem with some rows, by their indices."""
        assert self.file.lines is not None
        lines = _named_lines(self.file.counted, self.file.lines[np.array(rows)])
        self.found.append(RowProblem(option, f"{self.file.name}, {lines}", said, remedy))

    def usable(
        self, bad: NDArray[np.bool_], said: str | Callable[[int], str], remedy: str
    ) -> NDArray[np.bool_]:
        """Note bad rows one by one, and return a mask of the others.

        `said` is the problem, or a function that returns it for the index of a row.
        """
        for k in np.flatnonzero(bad).tolist():
            self.add("on_bad_row", [k], said if isinstance(said, str) else said(k), remedy)
        return ~bad

    def with_name(self, names: Sequence[str]) -> NDArray[np.bool_]:
        """Return a mask of the rows with the name of a well, and note the others."""
        lost = np.array([not name for name in names], bool)
        return self.usable(lost, "the name of the well is missing", "add it")

    def with_collar(self, names: Sequence[str], collars: Collection[str]) -> NDArray[np.bool_]:
        """Return a mask of the rows whose well has a collar, and note the others."""
        there = self.with_name(names)
        rows_of_lost: dict[str, list[int]] = {}
        for k in np.flatnonzero(there).tolist():
            if names[k] not in collars:
                rows_of_lost.setdefault(names[k], []).append(k)
        for name, rows in rows_of_lost.items():
            said = f"there is no collar of the well {shown(name)}"
            self.add("on_no_collar", rows, said, "add it to the collars")
            there[rows] = False
        return there


def check_few(name: str, n: int, what: str) -> None:
    """Raise an error if a file has too many rows or cells for hard data."""
    if n > limits().points:
        raise CCWSIMError(
            f"{name}: {n} {what} are more than the limit of {limits().points} hard data; a grid "
            "without gaps cannot be hard data"
        )


def heights_below(
    name: str, lines: NDArray[np.int64], z: NDArray[np.float64], depths: list[NDArray[np.float64]]
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Return heights and spans of data, from z and at most two columns of depths below z.

    Two depths define an interval. The height of an interval is the height of its middle; spans,
    shape (n, 2), contain the heights of bottom and top.

    Examples
    --------
    >>> collar, top, base = np.array([100.0]), np.array([10.0]), np.array([14.0])
    >>> heights_below("a.csv", np.array([2]), collar, [top, base])
    (array([88.]), array([[86., 90.]]))
    """
    if len(depths) < 2:
        return z - depths[0] if depths else z, None
    start, end = depths
    wrong = np.flatnonzero(start > end)
    if len(wrong):
        k = wrong[0]
        raise CCWSIMError(
            f"{name}, line {lines[k]}: the upper depth {start[k]:g} is below the lower depth "
            f"{end[k]:g}; exchange them"
        )
    return z - (start + end) / 2, np.stack([z - end, z - start], axis=1)


def along_wells(points: ImportedPoints, grid: Grid | None) -> ImportedPoints:
    """Replace each depth interval by a datum in every cell whose centre is in the interval.

    A centre on the border of two intervals belongs to the upper interval.
    """
    if points.spans is None:
        return points
    if grid is None or grid.nz is None:
        raise CCWSIMError(f"{points.name}: depth intervals need a grid with nz; give such a grid")
    bottom, top = ((points.spans - grid.origin[2]) / grid.cell_size[2] - 0.5).T
    far = ~(np.maximum(np.abs(bottom), np.abs(top)) <= FAR)  # also NaN
    points.refuse(far, "the depths are too far from the grid; correct them")
    first = np.ceil(bottom).astype(np.int64)
    counts = np.ceil(top).astype(np.int64) - first
    n = int(counts.sum())
    if n > limits().points:
        raise CCWSIMError(
            f"{points.name}: its wells have {n} cells, more than {limits().points} hard data; use "
            "fewer wells, or larger cells along z"
        )
    which = np.repeat(np.arange(points.n), counts)
    layers = first[which] + np.arange(n) - (np.cumsum(counts) - counts)[which]
    places = points.places[which]
    places[:, 2] = grid.origin[2] + (layers + 0.5) * grid.cell_size[2]
    empty, notes = int(np.count_nonzero(counts == 0)), points.notes
    if empty:
        notes += (f"Depth intervals left out because they contain no cell centre: {empty}.",)
    return replace(points.taken(which), places=places, spans=None, notes=notes)
