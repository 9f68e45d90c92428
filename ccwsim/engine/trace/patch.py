"""One patch of a realization: choice, cut and paste, and the reasons to reject other locations."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.stages.conditioning import (
    PlacedData,
    Weights,
    add_missed,
    make_misses,
    ruled_out,
)
from ccwsim.engine.stages.path import Box, inside_overlap

ONE_KIND = {
    "missed": Weights(1, 0, 0, 0, False),
    "held": Weights(0, 1, 0, 0, False),
    "ahead": Weights(0, 0, 1, 0, False),
}
"""Weights with which `add_missed` counts data of only one kind."""


class SeenDatum(NamedTuple):
    """A datum in the template or the co-template, in path coordinates.

    `inside` is true if the datum is in the template; `held` is true if the overlap honours the
    datum.
    """

    row: int
    column: int
    facies: int
    inside: bool
    held: bool
    layer: int = 0


@dataclass(frozen=True, eq=False)
class DataTerms:
    """The cost of data for each location.

    Attributes
    ----------
    seen : tuple of SeenDatum
    missed, held, ahead : ndarray of int64, shape ([nz_places,] ny_places, nx_places)
        Number of data that a patch from each location would not honour: in the template; in the
        template, but honoured by the overlap; in the co-template.
    ruled_out : ndarray of bool, of the same shape
        True for locations that are not searched, because the overlap is not among the best share.
    slack : int
        Largest difference in score between a candidate and the best location.
    weights : Weights
        Costs of a datum that is not honoured, in wrong cells of overlap.
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

    def without_layer(self) -> DataTerms:
        """Return the terms for a map, without the axis of layers."""
        kinds = {name: getattr(self, name)[0] for name in (*ONE_KIND, "ruled_out")}
        return replace(self, **kinds)


def data_terms(
    phases: NDArray[np.uint8],
    grid: NDArray[np.uint8],
    data: PlacedData,
    box: Box,
    times: int,
    weights: Weights,
    slack: int,
    totals: NDArray[np.signedinteger],
) -> DataTerms:
    """Return the costs of data at each location; `grid` is the grid before the patch."""
    misses = make_misses(data.columns.size, phases.shape[3:], totals.shape)  # type: ignore[arg-type]
    certain = np.ones(256)  # data beyond the end of the image cost nothing
    counts = {kind: np.zeros(totals.shape, np.int64) for kind in ONE_KIND}
    for kind, weight in ONE_KIND.items():
        add_missed(phases, grid, data, box, times, certain, weight, 1.0, misses, counts[kind])
    out = totals >= ruled_out(totals) // 2
    seen, reach = seen_data(data, grid, box, times), times * box.nx
    return DataTerms(seen, **counts, ruled_out=out, slack=slack, weights=weights, reach=reach)


def seen_data(
    data: PlacedData, grid: NDArray[np.uint8], box: Box, times: int
) -> tuple[SeenDatum, ...]:
    """Return the data in the template and the co-template, sorted by layer and row."""
    seen = []
    shape = data.facies.shape
    for z in range(box.z0, min(box.z0 + times * box.nz, shape[0])):
        for y in range(box.y0, min(box.y0 + times * box.ny, shape[1])):
            row = z * shape[1] + y
            for x in data.columns[data.first[row] : data.first[row + 1]].tolist():
                if not box.x0 <= x < box.x0 + times * box.nx:
                    continue
                inside = z < box.z0 + box.nz and y < box.y0 + box.ny and x < box.x0 + box.nx
                facies, required = int(data.facies[z, y, x]), data.required[z, y, x]
                held = inside and grid[z, y, x] == facies == required
                seen.append(SeenDatum(y, x, facies, inside, bool(held), z))
    return tuple(seen)


class Patch(NamedTuple):
    """A patch of the path, in path coordinates.

    Attributes
    ----------
    number : int
        Number of the patch along the path, from 0.
    tile, part : int
        Number of the tile, and number of the patch in a split tile.
    row, column : int
        Position of the tile.
    parts : int
        Number of parts, along each axis, into which the tile is split.
    split : int
        Index of the split of the tile in `legal_splits`.
    y0, x0, size : int
        First row, first column and side in cells.
    shape : int
        Sides of the overlap: 0 none, 1 left, 2 top, 3 left and top; add 4 for an overlap below.
    z0, layers : int
        First layer, and number of layers; 0 and 1 in a map.
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
    z0: int = 0
    layers: int = 1


@dataclass(frozen=True, eq=False)
class TracedPatch:
    """Record of how one patch was chosen, cut and pasted, in path coordinates.

    Shapes are given for a map; arrays of a volume have an additional first axis, for layers.

    Attributes
    ----------
    patch : Patch
    box : Box
        Position and overlap of the patch in the grid.
    before, after : ndarray of uint8, shape (ny, nx)
        The grid before and after the patch; UNKNOWN in cells that are not simulated yet.
    blocks : ndarray of int64, shape (n_planes, size / 2^J, size / 2^J)
        Block sums of the overlap; 0 outside the overlap.
    scores : ndarray of int, shape (ny_places, nx_places)
        Scores of the search: SSD − ΣB², in block sums.
    energy : int
        ΣB² of the overlap, in block sums; 0 if the similarity is the correlation.
    block : triple of int
        2^J along z, y and x.
    places : ndarray of int64, shape (K, 2)
        The K best locations in blocks, the candidates first.
    n_candidates : int
        Number of candidates, which are the locations whose score is close enough to the best score.
    n_drawn : int
        Number of locations chosen at random, of which the best after refinement is used.
    drawn : int
        Index of the used location in `places`.
    place : pair or triple of int
        Location of the patch after refinement, in cells.
    cells : ndarray of uint8, shape (size, size)
        Facies indices of the image at `place`.
    keep_mask : ndarray of bool, shape (size, size)
        Cells of the grid that stay old.
    overlap : int
        Width of the overlap (OR) in cells.
    correlation : bool
        Whether locations are compared by correlation.
    slack : int or None
        Largest difference in score between a candidate and the best location; None for no limit.
    copies : ndarray of bool, shape of `scores`
        True for locations that are excluded because they only continue a neighbouring patch.
    steered : bool
        Whether the choice among candidates is steered towards target proportions.
    data : DataTerms or None
        Costs of hard data; None if template and co-template contain no data.
    totals : ndarray of int64 or None
        Scores plus the costs of data and location; None if there are no costs.
    """

    patch: Patch
    box: Box
    before: NDArray[np.uint8]
    after: NDArray[np.uint8]
    blocks: NDArray[np.int64]
    scores: NDArray[np.integer]
    energy: int
    block: tuple[int, int, int]
    places: NDArray[np.int64]
    n_candidates: int
    n_drawn: int
    drawn: int
    place: tuple[int, ...]
    cells: NDArray[np.uint8]
    keep_mask: NDArray[np.bool_]
    overlap: int
    correlation: bool
    slack: int | None
    copies: NDArray[np.bool_]
    steered: bool
    data: DataTerms | None
    totals: NDArray[np.int64] | None

    @property
    def candidates(self) -> NDArray[np.int64]:
        """(Layer,) row and column of each candidate, in blocks."""
        return self.places[: self.n_candidates]

    @property
    def drawn_place(self) -> tuple[int, ...]:
        """The used location in cells, before refinement."""
        return tuple((self.places[self.drawn] * self._block_along).tolist())

    @property
    def _block_along(self) -> NDArray[np.int64]:
        """Number of cells in a block along each axis of the arrays."""
        return np.array(self.block[-self.cells.ndim :])

    @cached_property
    def in_overlap(self) -> NDArray[np.bool_]:
        """Mask, shape (size, size), of the cells of the patch that are in the overlap."""
        inside = np.ones((self.box.nz, self.box.ny, self.box.nx), bool)
        low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(self.box)
        inside[low_z:high_z, low_y:high_y, low_x:high_x] = False
        return inside if self.cells.ndim == 3 else inside[0]

    @property
    def old(self) -> NDArray[np.uint8]:
        """The cells of the grid before the patch, shape (size, size)."""
        first = (self.box.z0, self.box.y0, self.box.x0)[-self.cells.ndim :]
        ends = zip(first, self.cells.shape, strict=True)
        return self.before[tuple(slice(start, start + n) for start, n in ends)]

    @property
    def approximation(self) -> NDArray[np.float64]:
        """Haar coefficients cA_J of the overlap, NaN outside the overlap; shape of `blocks`."""
        steps = tuple(slice(None, None, n) for n in self._block_along)
        inside = self.in_overlap[steps]
        # a part of a split tile may end inside a block
        inside = inside[tuple(slice(n) for n in self.blocks.shape[1:])]
        return np.where(inside, self.blocks / np.sqrt(np.prod(self._block_along)), np.nan)

    @property
    def error(self) -> NDArray[np.bool_]:
        """The error surface of the cut: cells in the overlap that differ between patch and grid."""
        return self.in_overlap & (self.old != self.cells)

    @property
    def block_size(self) -> int:
        """Number of cells in a block along x, 2^J."""
        return self.block[2]

    @cached_property
    def ccw(self) -> NDArray[np.float64]:
        """The CCW score of each location in wavelet coefficients, shape (ny_places, nx_places).

        The score is the sum of squared differences between overlap and image (best at the minimum)
        or the cross-correlation (best at the maximum).
        """
        sums = self.scores.astype(float)
        sums = -sums / 2 if self.correlation else sums + self.energy
        return sums / np.prod(self._block_along)

    def best_overlaps(self) -> NDArray[np.int64]:
        """Return the K locations, in blocks, with the best scores, without costs of data."""
        order = np.argsort(self.scores, axis=None, kind="stable")[: len(self.places)]
        return np.stack(np.unravel_index(order, self.scores.shape), axis=1)


Fate = Literal["drawn", "candidate", "fraction", "slack", "copy", "data", "location", "tie"]


class PlaceFate(NamedTuple):
    """One location, and whether it was chosen at random or why it was rejected.

    Attributes
    ----------
    row, column : int
        Position in blocks, in path coordinates.
    ccw : float
        CCW score of the location.
    missed, held, ahead : int
        Number of data that the patch would not honour: in the template; in the template, but
        honoured by the overlap; in the co-template.
    fate : str
        "drawn" for the used location, "candidate" for other candidates, or the reason for a
        rejection. "fraction": the overlap is not among the best share; "slack": the score is too
        far from the best score; "copy": the location only continues a neighbouring patch; "data":
        other locations honour more data; "location": the location is too far from the relative
        position of the patch; "tie": other equal locations were chosen at random.
    """

    row: int
    column: int
    ccw: float
    missed: int
    held: int
    ahead: int
    fate: Fate
    layer: int = 0


def fates(step: TracedPatch) -> list[PlaceFate]:
    """Return the fates of the K locations with the best totals and the K with the best scores.

    The order is: used location, other candidates, rejected locations, each sorted by score.
    """
    chosen = [tuple(place) for place in step.places.tolist()]
    fate_of: dict[tuple[int, ...], Fate]
    fate_of = {place: _of_chosen(step, k) for k, place in enumerate(chosen)}
    differ = step.totals is not None or step.copies.any()
    if differ and step.patch.shape:  # without an overlap all locations fit equally
        for place in map(tuple, step.best_overlaps().tolist()):
            fate_of.setdefault(place, _of_rejected(step, place))
    sign = -1 if step.correlation else 1
    places = [_place(step, place, fate) for place, fate in fate_of.items()]
    order = {"drawn": 0, "candidate": 1}
    return sorted(
        places, key=lambda p: (order.get(p.fate, 2), sign * p.ccw, p.layer, p.row, p.column)
    )


def _of_chosen(step: TracedPatch, k: int) -> Fate:
    if k == step.drawn:
        return "drawn"
    return "candidate" if k < step.n_candidates else "slack"


def _of_rejected(step: TracedPatch, place: tuple[int, ...]) -> Fate:
    if step.copies[place]:
        return "copy"
    if step.totals is None:
        return "tie"
    if step.data is not None and step.data.ruled_out[place]:
        return "fraction"
    if step.totals[place] <= step.totals[tuple(step.places.T)].max():
        return "tie"
    return "data" if step.data is not None else "location"


def _place(step: TracedPatch, place: tuple[int, ...], fate: Fate) -> PlaceFate:
    d = step.data
    counted = () if d is None else (d.missed, d.held, d.ahead)
    missed, held, ahead = (int(count[place]) for count in counted) if counted else (0, 0, 0)
    layer, row, column = (0, *place)[-3:]
    return PlaceFate(row, column, float(step.ccw[place]), missed, held, ahead, fate, layer)
