"""Rows of tables of wells: problems with them, missing depths, and intervals that overlap."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ccwsim.io.data_file import DataFile, named_lines
from ccwsim.model import Floats, Ints, Mask, shown


class RowProblem(NamedTuple):
    """Rows of a table of wells that need a decision."""

    option: str  # the field of `Conversion` that decides
    where: str  # file and line numbers
    message: str  # the problem, without the remedy
    remedy: str


class RowProblems(NamedTuple):
    """Collects problems with rows of tables of wells."""

    file: DataFile  # the present table
    decisions: Mapping[str, str]  # decisions of the user by option
    noted: list[RowProblem]  # problems of all tables

    def add(self, option: str, rows: Sequence[int | np.integer], message: str, remedy: str) -> None:
        """Note a problem with some rows, by their indices."""
        assert self.file.lines is not None
        lines = named_lines(self.file.counted, self.file.lines[np.array(rows)])
        self.noted.append(RowProblem(option, f"{self.file.name}, {lines}", message, remedy))

    def usable(self, bad: Mask, message: str | Callable[[int], str], remedy: str) -> Mask:
        """Note bad rows with a message (text, or a function of the index); return usable rows."""
        for k in np.flatnonzero(bad).tolist():
            self.add("on_bad_row", [k], message if isinstance(message, str) else message(k), remedy)
        return ~bad

    def with_name(self, names: Sequence[str]) -> Mask:
        """Return a mask of the rows with the name of a well, and note the others."""
        lost = np.array([not name for name in names], bool)
        return self.usable(lost, "the name of the well is missing", "add it")

    def with_collar(self, names: Sequence[str], collars: Collection[str]) -> Mask:
        """Return a mask of the rows whose well has a collar, and note the others."""
        has_collar = self.with_name(names)
        rows_of_lost: dict[str, list[int]] = {}
        for k in np.flatnonzero(has_collar).tolist():
            if names[k] not in collars:
                rows_of_lost.setdefault(names[k], []).append(k)
        for name, rows in rows_of_lost.items():
            message = f"there is no collar of the well {shown(name)}"
            self.add("on_no_collar", rows, message, "add it to the collars")
            has_collar[rows] = False
        return has_collar


class Intervals:
    """Intervals of wells by row, with upper and lower depths, NaN if missing."""

    def __init__(
        self,
        names: Sequence[str],
        depths: Sequence[Floats],
        lengths: Mapping[str, float],
        problems: RowProblems,
    ) -> None:
        self.start, self.end = depths[0].copy(), depths[1].copy()
        self._names, self._problems = names, problems
        self._keep = problems.with_collar(names, lengths)
        wells = {name: k for k, name in enumerate(lengths)}
        self._wells = np.array([wells.get(name, -1) for name in names], np.int64)
        self._bottoms = np.array([*lengths.values(), np.nan])[self._wells]

    def usable_rows(self) -> Ints:
        """Return usable rows, sorted by well and depth; complete depths and resolve overlaps."""
        empty = self._keep & np.isnan(self.start) & np.isnan(self.end)
        self._keep &= self._problems.usable(empty, "the depth is missing", "add it")
        self._complete()
        self._check()
        return self._without_overlaps()

    def _sorted(self) -> Ints:
        begins = ~np.isnan(self.start)
        depths = np.where(begins, self.start, self.end)
        order = np.lexsort((begins, depths, self._wells))
        return order[self._keep[order]]

    def _complete(self) -> None:
        """Replace a missing depth by that of the row above or below, the collar, or the end."""
        order = self._sorted()
        wells = self._wells[order]
        first, last = np.diff(wells, prepend=-1) != 0, np.diff(wells, append=-1) != 0
        above = np.where(first, 0.0, np.roll(self.end[order], 1))
        below = np.where(last, self._bottoms[order], np.roll(self.start[order], -1))
        for values, neighbours, which in ((self.start, above, "upper"), (self.end, below, "lower")):
            lacking = np.isnan(values[order])
            filled = lacking & np.isfinite(neighbours)
            for k in order[filled]:
                self._problems.add("on_one_depth", [k], f"the {which} depth is missing", "add it")
            values[order[filled]] = neighbours[filled]
            if self._problems.decisions["on_one_depth"] == "drop":
                self._keep[order[filled]] = False
            lost = np.zeros(len(self._keep), bool)
            lost[order[lacking & ~filled]] = True
            message = f"the {which} depth is missing, and no other row has it"
            self._keep &= self._problems.usable(lost, message, "add it")

    def _check(self) -> None:
        """Leave out rows whose depths are exchanged or outside the well."""
        start, end, bottoms, names = self.start, self.end, self._bottoms, self._names

        def exchanged(k: int) -> str:
            return f"the upper depth {start[k]:g} is below the lower depth {end[k]:g}"

        def above(k: int) -> str:
            return f"the depth {start[k]:g} is above the collar"

        def below(k: int) -> str:
            return f"the depth {end[k]:g} is below the end of {shown(names[k])} at {bottoms[k]:g}"

        checks = (
            (start > end, exchanged, "exchange them"),
            (start < 0, above, "correct it"),
            (end > bottoms, below, "correct one of them"),
        )
        good = [
            self._problems.usable(self._keep & bad, message, fix) for bad, message, fix in checks
        ]
        self._keep &= np.all(good, axis=0)

    def _without_overlaps(self) -> Ints:
        """Shorten or leave out intervals that overlap; without a decision, the upper is kept."""
        start, end, names = self.start, self.end, self._names
        decided, order = self._problems.decisions["on_overlap"], self._sorted()
        upper = order[0] if len(order) else -1
        for k in order.tolist():
            if names[upper] != names[k]:
                upper = k
            if upper != k and start[k] < end[upper]:
                message = f"two intervals of {shown(names[k])} overlap below the depth {start[k]:g}"
                self._problems.add("on_overlap", [upper, k], message, "correct one of them")
                if decided == "drop":
                    self._keep[[upper, k]] = False
                elif decided == "lower":
                    end[upper], upper = start[k], k
                else:
                    start[k] = end[upper]
                    end[k] = max(end[k], start[k])
            if end[k] > end[upper]:
                upper = k
        return order[self._keep[order]]
