"""Rows of tables of wells: problems with them, missing depths, and intervals that overlap."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile, named_lines
from ccwsim.model.errors import shown


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
        lines = named_lines(self.file.counted, self.file.lines[np.array(rows)])
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


class Intervals(NamedTuple):
    """Rows of a table of intervals that can be used, sorted by well and depth."""

    rows: NDArray[np.int64]  # indices of rows
    start: NDArray[np.float64]
    end: NDArray[np.float64]  # upper and lower depths along the well


def usable_intervals(
    names: Sequence[str],
    depths: Sequence[NDArray[np.float64]],
    lengths: Mapping[str, float],
    found: RowProblems,
) -> Intervals:
    """Return the intervals that can be used; every problem is added to `found`.

    `names` and `depths` (upper and lower, NaN if missing) belong to the rows; `lengths` are those
    of the wells, infinite if unknown. The user's decisions are in `found` too.
    """
    start, end = depths[0].copy(), depths[1].copy()
    keep = found.with_collar(names, lengths)
    keep &= found.usable(keep & np.isnan(start) & np.isnan(end), "the depth is missing", "add it")
    wells = {name: k for k, name in enumerate(lengths)}
    ids = np.array([wells.get(name, -1) for name in names], np.int64)
    bottoms = np.array([*lengths.values(), np.nan])[ids]

    def sorted_rows() -> NDArray[np.int64]:
        begins = ~np.isnan(start)
        order = np.lexsort((begins, np.where(begins, start, end), ids))
        return order[keep[order]]

    order = sorted_rows()
    _complete(order, ids, start, end, bottoms, keep, found)
    ordered = found.usable(
        keep & (start > end),
        lambda k: f"the upper depth {start[k]:g} is below the lower depth {end[k]:g}",
        "exchange them",
    )
    below_collar = found.usable(
        keep & (start < 0), lambda k: f"the depth {start[k]:g} is above the collar", "correct it"
    )
    in_well = found.usable(
        keep & (end > bottoms),
        lambda k: f"the depth {end[k]:g} is below the end of {shown(names[k])} at {bottoms[k]:g}",
        "correct one of them",
    )
    keep &= ordered & below_collar & in_well
    order = sorted_rows()
    _resolve_overlaps(order, names, start, end, keep, found)
    order = order[keep[order]]
    return Intervals(order, start[order], end[order])


def _complete(
    order: NDArray[np.int64],
    ids: NDArray[np.int64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    bottoms: NDArray[np.float64],
    keep: NDArray[np.bool_],
    found: RowProblems,
) -> None:
    """Replace a missing depth by that of the row above or below, the collar, or the well's end."""
    wells = ids[order]
    first, last = np.diff(wells, prepend=-1) != 0, np.diff(wells, append=-1) != 0
    above = np.where(first, 0.0, np.roll(end[order], 1))
    below = np.where(last, bottoms[order], np.roll(start[order], -1))
    for values, others, which in ((start, above, "upper"), (end, below, "lower")):
        lacking = np.isnan(values[order])
        filled = lacking & np.isfinite(others)
        for k in order[filled]:
            found.add("on_one_depth", [k], f"the {which} depth is missing", "add it")
        values[order[filled]] = others[filled]
        if found.decisions["on_one_depth"] == "drop":
            keep[order[filled]] = False
        lost = np.zeros(len(keep), bool)
        lost[order[lacking & ~filled]] = True
        said = f"the {which} depth is missing, and no other row has it"
        keep &= found.usable(lost, said, "add it")


def _resolve_overlaps(
    order: NDArray[np.int64],
    names: Sequence[str],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    keep: NDArray[np.bool_],
    found: RowProblems,
) -> None:
    """Shorten or leave out intervals that overlap; without a decision, the upper is kept."""
    decided = found.decisions["on_overlap"]
    upper = order[0] if len(order) else -1
    for k in order.tolist():
        if names[upper] != names[k]:
            upper = k
        if upper != k and start[k] < end[upper]:
            said = f"two intervals of {shown(names[k])} overlap below the depth {start[k]:g}"
            found.add("on_overlap", [upper, k], said, "correct one of them")
            if decided == "drop":
                keep[[upper, k]] = False
            elif decided == "lower":
                end[upper], upper = start[k], k
            else:
                start[k] = end[upper]
                end[k] = max(end[k], start[k])
        if end[k] > end[upper]:
            upper = k
