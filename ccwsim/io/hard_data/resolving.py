"""Hard data from placed points, with the troubles settled as asked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.hard_data.collisions import COLLISION_CHOICES, settled
from ccwsim.io.hard_data.placing import PlacedPoints
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.hard_data import HardData


@dataclass(frozen=True, eq=False)
class HardDataImport:
    """Hard data and what happened on the way.

    Attributes
    ----------
    hard_data : HardData
        What is to be honoured.
    n_read : int
        Points with a value in the file.
    n_missing, n_off_centre, n_outside, n_unknown, n_collisions, n_repeated : int
        Rows without a value; points moved to the centre of their cell; points outside the grid and
        of unknown facies; cells with more than one facies; points that say a cell's facies again.
    n_dropped : int
        Points that were left out because they are outside, unknown or lost a collision.
    notes : tuple of str
        All of it in sentences, for the screen.
    """

    hard_data: HardData
    n_read: int
    n_missing: int
    n_off_centre: int
    n_outside: int
    n_unknown: int
    n_collisions: int
    n_repeated: int
    n_dropped: int
    notes: tuple[str, ...]


def resolve_points(
    placed: PlacedPoints,
    *,
    on_collision: str = "error",
    on_outside: str = "error",
    on_unknown: str = "error",
) -> HardDataImport:
    """Return hard data, with the troubles settled in the ways asked for.

    Parameters
    ----------
    placed : PlacedPoints
        From `place_points`.
    on_collision : "error", "drop", "majority" or "nearest"
        What to do with a cell of several facies: drop all its points, or keep the facies of most
        of them, or that of the point nearest to the centre. Ties go to the nearest point, then to
        the first in the file.
    on_outside, on_unknown : "error" or "drop"
        What to do with points outside the grid, and of a facies the training image does not have.

    Raises
    ------
    CCWSIMError
        Where there are such points and the choice is "error": the message names their lines.

    Examples
    --------
    >>> from io import BytesIO
    >>> from ccwsim import Grid
    >>> from ccwsim.io import place_points, read_points
    >>> points = read_points(BytesIO(b"x,y,facies\\n5.2,0.5,1\\n5.9,0.4,0\\n"))
    >>> report = resolve_points(place_points(points, Grid(4, 8)), on_collision="nearest")
    >>> report.hard_data.facies.tolist(), report.n_dropped
    ([1], 1)
    """
    _check_choice("on_collision", on_collision, COLLISION_CHOICES)
    _check_choice("on_outside", on_outside, ("error", "drop"))
    _check_choice("on_unknown", on_unknown, ("error", "drop"))
    points = placed.points
    if len(placed.outside) and on_outside == "error":
        raise CCWSIMError(
            f"{points.name}, {points.named(placed.outside)}: {len(placed.outside)} of {points.n} "
            "data lie outside the grid; drop them, or correct the grid or the coordinates"
        )
    if len(placed.unknown) and on_unknown == "error":
        codes = ", ".join(map(str, np.unique(placed.facies[placed.unknown])[:10]))
        raise CCWSIMError(
            f"{points.name}, {points.named(placed.unknown)}: the training image has no facies "
            f"{codes}; recode or drop these data"
        )
    if placed.collisions and on_collision == "error":
        raise CCWSIMError(_said_collision(placed))
    keep = np.ones(points.n, bool)
    keep[placed.outside] = keep[placed.unknown] = False
    ties = 0
    for members in placed.collisions:
        code, tied = settled(placed.facies[members], placed.offsets[members], on_collision)
        keep[members] &= placed.facies[members] == code if code is not None else False
        ties += tied
    return _report(placed, keep, ties)


def _check_choice(name: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise CCWSIMError(f"{name} = {shown(value)} must be one of {', '.join(allowed)}")


def _said_collision(placed: PlacedPoints) -> str:
    points, members = placed.points, placed.collisions[0]
    row, column = placed.cells[members[0]]
    said = ", ".join(
        f"{points.counted} {points.lines[k]} says {placed.facies[k]}" for k in members[:6]
    )
    more = len(placed.collisions) - 1
    tail = f", and {more} more such cells" if more else ""
    return (
        f"{points.name}: two facies in the cell at row {row}, column {column} ({said}){tail}; "
        "drop them, or keep the majority or the nearest"
    )


def _report(placed: PlacedPoints, keep: NDArray[np.bool_], ties: int) -> HardDataImport:
    points = placed.points
    hard_data = HardData(placed.cells[keep], placed.facies[keep])
    n_clashing = sum(len(members) for members in placed.collisions)
    n_lost = int(np.count_nonzero(~keep)) - len(placed.outside) - len(placed.unknown)
    n_repeated = int(np.count_nonzero(keep)) - hard_data.n
    sentences = (
        (points.n_missing, f"Rows without a value, left out: {points.n_missing}."),
        (
            len(placed.outside),
            f"{len(placed.outside)} of {points.n} data lie outside the grid and were left out "
            f"({points.named(placed.outside)}).",
        ),
        (
            len(placed.unknown),
            f"{len(placed.unknown)} of {points.n} data have a facies that the training image does "
            f"not have and were left out ({points.named(placed.unknown)}).",
        ),
        (
            n_clashing,
            f"Cells with data of more than one facies: {len(placed.collisions)}; {n_lost} of the "
            f"{n_clashing} data there were left out.",
        ),
        (ties, f"Cells of these where only the order in the file decided: {ties}."),
        (n_repeated, f"Data that repeat the facies of their cell: {n_repeated}."),
        (
            placed.n_off_centre,
            f"{placed.n_off_centre} of {points.n} data were not at the centre of their cell and "
            "count for the whole cell.",
        ),
    )
    notes = points.notes + tuple(text for count, text in sentences if count)
    return HardDataImport(
        hard_data, points.n, points.n_missing, placed.n_off_centre,
        len(placed.outside), len(placed.unknown), len(placed.collisions),
        n_repeated, int(np.count_nonzero(~keep)), notes,
    )  # fmt: skip
