"""How one patch of a realization was chosen, cut and pasted, and why other locations were not."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.stages.box import LEFT, TOP, Box
from ccwsim.engine.stages.conditioning import (
    RULED_OUT,
    PlacedData,
    Weights,
    add_missed,
    make_misses,
)

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
    misses = make_misses(data.columns.size, phases.shape[3], totals.shape)
    certain = np.ones(256)  # what the image ends before costs nothing: only sure misses count
    counts = {}
    for kind, one in ONE_KIND.items():
        counts[kind] = np.zeros(totals.shape, np.int64)
        add_missed(phases, grid, data, box, reach, certain, one, 1.0, misses, counts[kind])
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


class Patch(NamedTuple):
    """Which patch of the path, in path coordinates.

    Attributes
    ----------
    number : int
        0 for the first one.
    tile, part : int
        Its tile, and which part of it where the tile is split.
    row, column : int
        Of the tile.
    parts : int
        Into how many parts, along each axis, the tile is split.
    split : int
        The same as an index of the splits that are legal.
    y0, x0, size : int
        First cell and side.
    shape : int
        Of its overlap: 0 none, 1 left, 2 top, 3 both.
    """

    number: int
    tile: int
    part: int
    row: int
    column: int
    parts: int
    split: int
    y0: int
    x0: int
    size: int
    shape: int


@dataclass(frozen=True, eq=False)
class TracedPatch:
    """How one patch was chosen, cut and pasted; everything in path coordinates.

    Attributes
    ----------
    patch : Patch
    before, after : ndarray of uint8, shape (ny, nx)
        The grid; UNKNOWN where nothing is simulated.
    blocks : ndarray of int64, shape (n_planes, size / 2^J, size / 2^J)
        Block sums of the overlap, 0 outside of it.
    scores : ndarray of int, shape (ny_places, nx_places)
        As the search has them: SSD − ΣB², in block sums.
    energy : int
        ΣB² of the overlap, in block sums; 0 where the similarity is the correlation.
    block_size : int
        2^J.
    places : ndarray of int64, shape (K, 2)
        The K best in blocks, the candidates first.
    n_candidates : int
        How many of them are near enough to the best to be drawn from.
    drawn : int
        Which of them was drawn.
    place : pair of int
        Where the patch was taken from in the end, in cells.
    cells : ndarray of uint8, shape (size, size)
        The patch.
    keep_mask : ndarray of bool, shape (size, size)
        Where the cut keeps the grid as it was.
    overlap : int
        OR in cells.
    correlation : bool
        Whether locations are compared by correlation.
    data : DataTerms or None
        What hard data cost; None where there are none ahead.
    totals : ndarray of int64 or None
        Scores with the costs of data and location, where there are such costs.
    """

    patch: Patch
    before: NDArray[np.uint8]
    after: NDArray[np.uint8]
    blocks: NDArray[np.int64]
    scores: NDArray[np.integer]
    energy: int
    block_size: int
    places: NDArray[np.int64]
    n_candidates: int
    drawn: int
    place: tuple[int, int]
    cells: NDArray[np.uint8]
    keep_mask: NDArray[np.bool_]
    overlap: int
    correlation: bool
    data: DataTerms | None
    totals: NDArray[np.int64] | None

    @property
    def candidates(self) -> NDArray[np.int64]:
        """Row and column, in blocks, of the locations that were drawn from."""
        return self.places[: self.n_candidates]

    @property
    def drawn_place(self) -> tuple[int, int]:
        """The drawn location in cells, before it is shifted to where it fits best."""
        row, column = self.places[self.drawn] * self.block_size
        return int(row), int(column)

    @cached_property
    def in_overlap(self) -> NDArray[np.bool_]:
        """Which cells of the patch lie in the overlap, shape (size, size)."""
        inside = np.zeros(self.cells.shape, bool)
        if self.patch.shape & LEFT:
            inside[:, : self.overlap] = True
        if self.patch.shape & TOP:
            inside[: self.overlap] = True
        return inside

    @property
    def old(self) -> NDArray[np.uint8]:
        """What the grid had where the patch is placed, shape (size, size)."""
        p = self.patch
        return self.before[p.y0 : p.y0 + p.size, p.x0 : p.x0 + p.size]

    @property
    def approximation(self) -> NDArray[np.float64]:
        """Haar coefficients cA_J of the overlap, NaN outside; shape of `blocks`."""
        n = self.blocks.shape[1]  # a part of a split tile need not be whole blocks
        inside = self.in_overlap[:: self.block_size, :: self.block_size][:n, :n]
        return np.where(inside, self.blocks / self.block_size, np.nan)

    @property
    def error(self) -> NDArray[np.bool_]:
        """Where patch and grid differ in the overlap: the error surface of the cut."""
        return self.in_overlap & (self.old != self.cells)

    @cached_property
    def ccw(self) -> NDArray[np.float64]:
        """The CCW score of each place in wavelet coefficients, shape (ny_places, nx_places).

        The sum of squared differences between overlap and image, best where small; or the
        cross-correlation, best where large.
        """
        sums = self.scores.astype(float)
        sums = -sums / 2 if self.correlation else sums + self.energy
        return sums / self.block_size**2

    def best_overlaps(self) -> NDArray[np.int64]:
        """Return the K places with the best overlaps, whatever the data say; in blocks."""
        order = np.argsort(self.scores, axis=None, kind="stable")[: len(self.places)]
        return np.stack(np.unravel_index(order, self.scores.shape), axis=1)


Fate = Literal["drawn", "candidate", "fraction", "slack", "data", "location", "tie"]


class PlaceFate(NamedTuple):
    """What became of one location.

    Attributes
    ----------
    row, column : int
        In blocks, in path coordinates.
    ccw : float
        Its CCW score.
    missed, held, ahead : int
        Data that its patch would miss: in the template, there but right in the overlap already,
        and in the co-template.
    fate : str
        "drawn"; "candidate", that was not drawn; out as the overlap is not among the share that is
        looked at ("fraction"), as it is too much worse than the best ("slack"), as others honour
        more "data", as it is too far from the patch's own ("location"), or at random among equals
        ("tie").
    """

    row: int
    column: int
    ccw: float
    missed: int
    held: int
    ahead: int
    fate: Fate


def fates(step: TracedPatch) -> list[PlaceFate]:
    """Return what became of the K places chosen and of the K with the best overlaps.

    The drawn one comes first, then the other candidates, then the rejected ones; each by score.
    """
    chosen = [tuple(place) for place in step.places.tolist()]
    found: dict[tuple[int, ...], Fate]
    found = {place: _of_chosen(step, k) for k, place in enumerate(chosen)}
    if step.totals is not None and step.patch.shape:  # without an overlap none fits best
        for row, column in step.best_overlaps().tolist():
            found.setdefault((row, column), _of_rejected(step, row, column))
    sign = -1 if step.correlation else 1
    places = [_place(step, row, column, fate) for (row, column), fate in found.items()]
    order = {"drawn": 0, "candidate": 1}
    return sorted(places, key=lambda p: (order.get(p.fate, 2), sign * p.ccw, p.row, p.column))


def _of_chosen(step: TracedPatch, k: int) -> Fate:
    if k == step.drawn:
        return "drawn"
    return "candidate" if k < step.n_candidates else "slack"


def _of_rejected(step: TracedPatch, row: int, column: int) -> Fate:
    assert step.totals is not None
    if step.data is not None and step.data.ruled_out[row, column]:
        return "fraction"
    if step.totals[row, column] <= step.totals[tuple(step.places.T)].max():
        return "tie"
    return "data" if step.data is not None else "location"


def _place(step: TracedPatch, row: int, column: int, fate: Fate) -> PlaceFate:
    d, at = step.data, (row, column)
    missed, held, ahead = (
        (0, 0, 0) if d is None else (int(d.missed[at]), int(d.held[at]), int(d.ahead[at]))
    )
    return PlaceFate(row, column, float(step.ccw[at]), missed, held, ahead, fate)
