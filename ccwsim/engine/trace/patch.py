"""One patch of a realization: choice, cut and paste, and the reasons to reject other locations."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from ccwsim.engine.stages.conditioning import (
    PlacedData,
    Weights,
    add_missed,
    make_misses,
    ruled_out,
)
from ccwsim.engine.stages.path import Box, inside_overlap
from ccwsim.engine.tiles import PatchInputs
from ccwsim.model import Array, Bytes, Floats, Integers, Ints, Mask, window_at

ONE_KIND = {
    "missed": Weights(1, 0, 0, 0, False),
    "held": Weights(0, 1, 0, 0, False),
    "ahead": Weights(0, 0, 1, 0, False),
}
"""Weights with which `add_missed` counts data of only one kind."""


class SeenDatum(NamedTuple):
    """A datum in the template or the co-template, in path coordinates."""

    row: int
    column: int
    facies: int
    inside: bool  # in the template
    held: bool  # the overlap honours the datum
    layer: int = 0


@dataclass(frozen=True, eq=False)
class DataTerms:
    """The cost of data for each location; arrays have the shape of the locations."""

    seen: tuple[SeenDatum, ...]
    missed: Ints  # number of data in the template that a patch would not honour
    held: Ints  # number of these data that the overlap honours
    ahead: Ints  # number of data in the co-template that a patch would not honour
    ruled_out: Mask  # the overlap is not among the best share
    slack: int  # largest difference in score between a candidate and the best location
    weights: Weights  # costs of a datum that is not honoured, in wrong cells of overlap
    reach: int  # side of the co-template in cells


def data_terms(
    inputs: PatchInputs,
    layer: int,
    grid: Bytes,
    box: Box,
    weights: Weights,
    totals: Integers,
    of_places: Callable[[Array], Array],
) -> DataTerms:
    """Return the costs of data at each location.

    `totals` begin with layer `layer` of locations; `of_places` converts an array of their shape to
    the shape of the result.
    """
    phases, data, search = inputs.oriented.pyramid.phases, inputs.data, inputs.search
    layers = layer, len(totals) + search.template[0] // search.block[0] - 1
    times = search.co_template
    misses = make_misses(data.columns.size, phases.shape[3:], totals.shape)  # type: ignore[arg-type]
    certain = np.ones(256)  # data beyond the end of the image cost nothing
    counts = {kind: np.zeros(totals.shape, np.int64) for kind in ONE_KIND}
    for kind, weight in ONE_KIND.items():
        add_missed(
            phases, layers, grid, data, box, times, certain, weight, 1.0, misses, counts[kind]
        )
    return DataTerms(
        seen=seen_data(data, grid, box, times),
        **{kind: of_places(count) for kind, count in counts.items()},
        ruled_out=of_places(totals >= ruled_out(totals) // 2),
        slack=int(weights.slack * search.slack_cost),
        weights=weights,
        reach=times * box.nx,
    )


def seen_data(data: PlacedData, grid: Bytes, box: Box, times: int) -> tuple[SeenDatum, ...]:
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
                seen.append(SeenDatum(y, x, facies, inside, held=bool(held), layer=z))
    return tuple(seen)


class Patch(NamedTuple):
    """A patch of the path, in path coordinates."""

    number: int  # along the path, from 0
    tile: int  # number of the tile
    part: int  # number of the patch in a split tile
    row: int  # position of the tile
    column: int
    parts: int  # number of parts of the tile along each axis
    split: int  # index of the split in `legal_splits`
    y0: int  # first row
    x0: int  # first column
    size: int  # side in cells
    shape: int  # sides of the overlap: 1 left, 2 top; add 4 for an overlap below
    z0: int = 0  # first layer
    layers: int = 1  # number of layers; 1 in a map


@dataclass(frozen=True, eq=False)
class TracedPatch:
    """Record of how one patch was chosen, cut and pasted, in path coordinates.

    Shapes are given for a map; arrays of a volume have an additional first axis, for layers.
    """

    patch: Patch
    box: Box  # position and overlap of the patch in the grid
    before: Bytes  # the grid before the patch; UNKNOWN in cells not simulated yet
    after: Bytes  # the grid after the patch
    blocks: Ints  # block sums, shape (n_planes, …); 0 outside the overlap
    scores: Integers  # SSD − ΣB² of each location, in block sums
    energy: int  # ΣB² of the overlap, in block sums; 0 for the correlation
    block: tuple[int, int, int]  # 2^J along z, y and x
    places: Ints  # shape (K, 2): the K best locations in blocks, the candidates first
    n_candidates: int  # number of locations whose score is close enough to the best score
    n_drawn: int  # number of locations chosen at random; the best after refinement is used
    drawn: int  # index of the used location in `places`
    place: tuple[int, ...]  # location of the patch after refinement, in cells
    cells: Bytes  # facies indices of the image at `place`
    keep_mask: Mask  # cells of the grid that stay old
    overlap: int  # width (OR) in cells
    correlation: bool  # whether locations are compared by correlation
    slack: int | None  # largest difference from the best score; None for no limit
    copies: Mask  # locations that only continue a neighbouring patch
    steered: bool  # whether the choice is steered towards target proportions
    data: DataTerms | None  # None if template and co-template contain no data
    totals: Ints | None  # scores plus costs of data and guides; None without costs
    illegal: Mask  # locations with unknown cells; shape () if there are none
    layer: int  # layer of the stack of copies in which the patch of a map was found
    source: str  # name of the copy from which the patch is; empty without copies

    @property
    def candidates(self) -> Ints:
        """(Layer,) row and column of each candidate, in blocks."""
        return self.places[: self.n_candidates]

    @property
    def drawn_place(self) -> tuple[int, ...]:
        """The used location in cells, before refinement."""
        return tuple((self.places[self.drawn] * self._block_along).tolist())

    @property
    def _block_along(self) -> Ints:
        """Number of cells in a block along each axis of the arrays."""
        return np.array(self.block[-self.cells.ndim :])

    @cached_property
    def in_overlap(self) -> Mask:
        """Mask, shape (size, size), of the cells of the patch that are in the overlap."""
        inside = np.ones((self.box.nz, self.box.ny, self.box.nx), bool)
        low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(self.box)
        inside[low_z:high_z, low_y:high_y, low_x:high_x] = False
        return inside if self.cells.ndim == 3 else inside[0]

    @property
    def old(self) -> Bytes:
        """The cells of the grid before the patch, shape (size, size)."""
        first = (self.box.z0, self.box.y0, self.box.x0)[-self.cells.ndim :]
        return self.before[window_at(first, self.cells.shape)]

    @property
    def approximation(self) -> Floats:
        """Haar coefficients cA_J of the overlap, NaN outside the overlap; shape of `blocks`."""
        steps = tuple(slice(None, None, n) for n in self._block_along)
        inside = self.in_overlap[steps]
        # a part of a split tile may end inside a block
        inside = inside[tuple(slice(n) for n in self.blocks.shape[1:])]
        return np.where(inside, self.blocks / np.sqrt(np.prod(self._block_along)), np.nan)

    @property
    def error(self) -> Mask:
        """The error surface of the cut: cells in the overlap that differ between patch and grid."""
        return self.in_overlap & (self.old != self.cells)

    @property
    def block_size(self) -> int:
        """Number of cells in a block along x, 2^J."""
        return self.block[2]

    @cached_property
    def ccw(self) -> Floats:
        """The CCW score of each location in wavelet coefficients, shape (ny_places, nx_places).

        The score is the sum of squared differences between overlap and image (best at the minimum)
        or the cross-correlation (best at the maximum); NaN at locations with unknown cells.
        """
        sums = self.scores.astype(float)
        sums = -sums / 2 if self.correlation else sums + self.energy
        return np.where(self.illegal, np.nan, sums / np.prod(self._block_along))


Fate = Literal["drawn", "candidate", "fraction", "slack", "copy", "data", "guide", "tie"]


class PlaceFate(NamedTuple):
    """One location, and whether it was chosen at random or why it was rejected.

    The reasons are: "fraction", the overlap is not among the best share; "slack", the score is too
    far from the best; "copy", the location only continues a neighbouring patch; "data", other
    locations honour more data; "guide", other locations fit the guides better; "tie", other equal
    locations were chosen at random.
    """

    row: int  # in blocks
    column: int
    ccw: float
    missed: int  # data not honoured, as in `DataTerms`
    held: int
    ahead: int
    fate: Fate  # "drawn", "candidate" or the reason for a rejection
    layer: int = 0


def fates(step: TracedPatch) -> list[PlaceFate]:
    """Return the fates of the K locations with the best totals and the K with the best scores.

    The order is: used location, other candidates, rejected locations, each sorted by score.
    """
    chosen = [tuple(place) for place in step.places.tolist()]
    n = step.n_candidates
    kinds: list[Fate] = ["candidate" if k < n else "slack" for k in range(len(chosen))]
    kinds[step.drawn] = "drawn"
    fate_of = dict(zip(chosen, kinds, strict=True))
    differ = step.totals is not None or step.copies.any()
    if differ and step.patch.shape:  # without an overlap all locations fit equally
        best = np.argsort(step.scores, axis=None, kind="stable")[: len(chosen)]
        for place in zip(*np.unravel_index(best, step.scores.shape), strict=True):
            place = tuple(map(int, place))
            fate_of.setdefault(place, _reason_of_rejection(step, place))
    sign = -1 if step.correlation else 1
    places = [_fate_at(step, place, fate) for place, fate in fate_of.items()]
    places = [place for place in places if not np.isnan(place.ccw)]  # without illegal locations
    order = {"drawn": 0, "candidate": 1}
    return sorted(
        places, key=lambda p: (order.get(p.fate, 2), sign * p.ccw, p.layer, p.row, p.column)
    )


def _reason_of_rejection(step: TracedPatch, place: tuple[int, ...]) -> Fate:
    if step.copies[place]:
        return "copy"
    if step.totals is None:
        return "tie"
    if step.data is not None and step.data.ruled_out[place]:
        return "fraction"
    if step.totals[place] <= step.totals[tuple(step.places.T)].max():
        return "tie"
    return "data" if step.data is not None else "guide"


def _fate_at(step: TracedPatch, place: tuple[int, ...], fate: Fate) -> PlaceFate:
    data, (layer, row, column) = step.data, (0, *place)[-3:]
    return PlaceFate(
        row=row,
        column=column,
        ccw=float(step.ccw[place]),
        missed=int(data.missed[place]) if data else 0,
        held=int(data.held[place]) if data else 0,
        ahead=int(data.ahead[place]) if data else 0,
        fate=fate,
        layer=layer,
    )
