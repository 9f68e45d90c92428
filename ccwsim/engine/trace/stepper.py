"""Lay the patches of a realization one by one, and go back to any of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.raster import Plan
from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.tiles import make_workspace, patch_geometry, simulate_patch
from ccwsim.engine.trace.patch import Patch
from ccwsim.model.study import Study

N_CHECKPOINTS = 24
"""A trace keeps at most so many states to start again from, each as large as the grid …"""
BYTES_KEPT = 64_000_000
"""… and fewer of large grids."""
LEAST_BETWEEN = 8


class Checkpoint(NamedTuple):
    """All that a realization goes on from before a patch.

    Sources of cells are left as they are: what is laid again writes the same ones again.
    """

    grid: NDArray[np.uint8]
    counts: NDArray[np.int64]
    rng: dict[str, Any]


class PatchStepper:
    """A realization on its way along the path.

    Attributes
    ----------
    patches : tuple of Patch
        In the order of the path.
    grid : ndarray of uint8, shape (ny, nx)
        As far as it is simulated, in the path frame.
    sources : ndarray of int32, shape (ny, nx)
        Flat index in the turned image of each cell.
    room : Room
        What the latest patch left.
    rng : numpy.random.Generator
        As the next patch finds it.
    """

    def __init__(self, study: Study, plan: Plan, rng: np.random.Generator) -> None:
        self._plan, self._proportions, self.rng = plan, study.training_image.proportions, rng
        self.patches = _patches(plan)
        self.room = make_workspace(plan.oriented, plan.search)
        full = plan.path.full
        self.grid = np.full(full, UNKNOWN, np.uint8)
        self.sources = np.zeros(full, np.int32)
        self._counts = np.zeros(study.training_image.n_facies, np.int64)
        self._next = 0
        n_kept = min(max(BYTES_KEPT // (full[0] * full[1]), 4), N_CHECKPOINTS)
        self._every = max(-(-len(self.patches) // n_kept), LEAST_BETWEEN)
        self._checkpoints: dict[int, Checkpoint] = {}

    @property
    def n_done(self) -> int:
        """Up to which patch it is known so far."""
        return max([self._next, *self._checkpoints])

    def go_to(self, number: int) -> None:
        """Bring the grid to where it is before a patch."""
        if not self._next <= number < self._next + self._every:
            known = [k for k in self._checkpoints if k <= number]
            if known and (self._next > number or max(known) > self._next):
                self._restore(max(known))
        while self._next < number:
            self.lay_next()

    def _restore(self, number: int) -> None:
        kept = self._checkpoints[number]
        self.grid, self._counts, self._next = kept.grid.copy(), kept.counts.copy(), number
        self.rng.bit_generator.state = kept.rng

    def lay_next(self) -> tuple[int, int]:
        """Simulate the next patch and return its place in the turned image."""
        if self._next % self._every == 0 and self._next not in self._checkpoints:
            self._checkpoints[self._next] = Checkpoint(
                self.grid.copy(), self._counts.copy(),
                self.rng.bit_generator.state,  # type: ignore[arg-type]
            )  # fmt: skip
        p, plan = self.patches[self._next], self._plan
        ty, tx = simulate_patch(
            p.y0, p.x0, p.size, p.shape, plan.oriented.energies[p.split, p.shape],
            plan.oriented.pyramid, plan.data[0], self._proportions, plan.search,
            self.rng, self.room, self._counts, self.grid, self.sources,
        )  # fmt: skip
        self._next += 1
        return int(ty), int(tx)


def _patches(plan: Plan) -> tuple[Patch, ...]:
    found: list[Patch] = []
    n_columns = plan.path.n_columns
    for tile, split in enumerate(plan.split_of.tolist()):
        parts = int(plan.oriented.splits[split])
        for part in range(parts * parts):
            lie = map(int, patch_geometry(tile, part, parts, n_columns, plan.search))
            row, column = divmod(tile, n_columns)
            found.append(Patch(len(found), tile, part, row, column, parts, split, *lie))
    return tuple(found)
