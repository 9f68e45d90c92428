"""What hard data cost each location when a patch was chosen, counted by the search's own stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.stages.box import Box
from ccwsim.engine.stages.conditioning import RULED_OUT, PlacedData, Weights, add_missed

ONE_KIND = {
    "missed": Weights(1, 0, 0, 0, False),
    "held": Weights(0, 1, 0, 0, False),
    "ahead": Weights(0, 0, 1, 0, False),
}
"""Weights under which `add_missed` counts the missed data of one kind."""


class SeenDatum(NamedTuple):
    """A datum in the template or the co-template, in path coordinates.

    `inside` says whether it lies in the template, `held` whether the overlap has it right already.
    """

    row: int
    column: int
    facies: int
    inside: bool
    held: bool


@dataclass(frozen=True, eq=False)
class DataTerms:
    """What data cost each location.

    Attributes
    ----------
    seen : tuple of SeenDatum
    missed, held, ahead : ndarray of int64, shape (ny_places, nx_places)
        How many data the patch of each location would miss: in the template, in the template where
        the cut can still keep them, and in the co-template.
    ruled_out : ndarray of bool, shape (ny_places, nx_places)
        Locations whose overlap is not among the best share that is looked at.
    slack : int
        How much worse than the best a candidate may be, in scores.
    weights : Weights
        Of a missed datum, in wrong cells of overlap.
    reach : int
        Side of the co-template in cells.
    """

    seen: tuple[SeenDatum, ...]
    missed: NDArray[np.int64]
    held: NDArray[np.int64]
    ahead: NDArray[np.int64]
    ruled_out: NDArray[np.bool_]
    slack: int
    weights: Weights
    reach: int


def data_terms(
    phases: NDArray[np.uint8],
    grid: NDArray[np.uint8],
    data: PlacedData,
    box: Box,
    reach: int,
    weights: Weights,
    slack: int,
    totals: NDArray[np.int64],
) -> DataTerms:
    """Return what the data around a patch cost each place; `grid` is as it was before the patch."""
    certain = np.ones(256)  # what the image ends before costs nothing: only sure misses count
    counts = {}
    for kind, one in ONE_KIND.items():
        counts[kind] = np.zeros(totals.shape, np.int64)
        add_missed(phases, grid, data, box, reach, certain, one, 1.0, counts[kind])
    ruled_out = totals >= RULED_OUT // 2
    seen = seen_data(data, grid, box, reach)
    return DataTerms(seen, **counts, ruled_out=ruled_out, slack=slack, weights=weights, reach=reach)


def seen_data(
    data: PlacedData, grid: NDArray[np.uint8], box: Box, reach: int
) -> tuple[SeenDatum, ...]:
    """Return the data of template and co-template, by row."""
    y0, x0, size = box.y0, box.x0, box.size
    found = []
    for y in range(y0, min(y0 + reach, len(data.first) - 1)):
        for x in data.columns[data.first[y] : data.first[y + 1]].tolist():
            if x0 <= x < x0 + reach:
                facies, inside = int(data.facies[y, x]), y < y0 + size and x < x0 + size
                held = inside and grid[y, x] == facies == data.required[y, x]
                found.append(SeenDatum(y, x, facies, inside, bool(held)))
    return tuple(found)
