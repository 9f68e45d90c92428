"""How one patch of a realization was chosen, cut and pasted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.stages.box import LEFT, TOP
from ccwsim.engine.trace.data import DataTerms


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
