"""Heights of hard data of a volume: elevations, or depths in vertical wells below their collars."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.limits import limits
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid

if TYPE_CHECKING:
    from ccwsim.io.hard_data.points import ImportedPoints

_FAR = 2.0**40
"""Layers: farther off a height can only be a mistake."""


class Heights(NamedTuple):
    """Where rows of a table are along z."""

    z: NDArray[np.float64]  # shape (n,): of intervals the middle
    spans: NDArray[np.float64] | None  # shape (n, 2): bottom and top of intervals


def heights_below(
    name: str,
    lines: NDArray[np.int64],
    z: NDArray[np.float64],
    depths: list[NDArray[np.float64]],
) -> Heights:
    """Return heights from those of points or collars and none, one or two depths below them.

    Examples
    --------
    >>> collar, top, base = np.array([100.0]), np.array([10.0]), np.array([14.0])
    >>> heights_below("a.csv", np.array([2]), collar, [top, base])
    Heights(z=array([88.]), spans=array([[86., 90.]]))
    """
    if len(depths) < 2:
        return Heights(z - depths[0] if depths else z, None)
    start, end = depths
    wrong = np.flatnonzero(start > end)
    if len(wrong):
        k = wrong[0]
        raise CCWSIMError(
            f"{name}, line {lines[k]}: the depth from {start[k]:g} is below the depth to "
            f"{end[k]:g}; exchange them"
        )
    return Heights(z - (start + end) / 2, np.stack([z - end, z - start], axis=1))


def along_wells(points: ImportedPoints, grid: Grid | None) -> ImportedPoints:
    """Return a datum for every cell whose centre is in an interval of depths, instead of intervals.

    Intervals that meet at a centre do not share the cell: it belongs to the upper one.
    """
    if points.spans is None:
        return points
    if grid is None or grid.nz is None:
        raise CCWSIMError(f"{points.name}: intervals of depth need a grid with nz; give one")
    bottom, top = ((points.spans - grid.origin[2]) / grid.cell_size[2] - 0.5).T
    far = np.flatnonzero(np.maximum(np.abs(bottom), np.abs(top)) > _FAR)
    if len(far):
        raise CCWSIMError(
            f"{points.name}, {points.named(far)}: the depths are absurdly far from the grid; "
            "correct them"
        )
    first = np.ceil(bottom).astype(np.int64)
    counts = np.ceil(top).astype(np.int64) - first
    n = int(counts.sum())
    if n > limits().points:
        raise CCWSIMError(
            f"{points.name}: its wells have {n} cells, more than {limits().points} hard data; "
            "take fewer, or larger cells along z"
        )
    which = np.repeat(np.arange(points.n), counts)
    layers = first[which] + np.arange(n) - (np.cumsum(counts) - counts)[which]
    places = points.places[which]
    places[:, 2] = grid.origin[2] + (layers + 0.5) * grid.cell_size[2]
    empty = int(np.count_nonzero(counts == 0))
    notes = (f"Intervals of depth that hold no centre of a cell, left out: {empty}.",)
    return replace(
        points,
        places=places,
        values=points.values[which],
        lines=points.lines[which],
        spans=None,
        notes=points.notes + (notes if empty else ()),
    )
