"""Simulate the patches of a realization one by one, and go back to any of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.raster import Plan, empty_grid
from ccwsim.engine.tiles import make_workspace, simulate_patches
from ccwsim.engine.trace.patch import Patch
from ccwsim.model.study import Study

MAX_CHECKPOINTS = 24
"""A trace keeps at most so many states to start again from, each as large as the grid …"""
MAX_BYTES = 64_000_000
"""… and fewer of large grids."""
MIN_INTERVAL = 8
"""Patches between two of them, at least."""


class Checkpoint(NamedTuple):
    """All that a realization goes on from before a patch.

    Sources of cells are left as they are: a patch that is simulated again writes the same ones.
    """

    grid: NDArray[np.uint8]
    counts: NDArray[np.int64]
    rng: Any


class PatchStepper:
    """A realization on its way along the path."""

    def __init__(self, study: Study, plan: Plan, rng: np.random.Generator) -> None:
        self._plan, self.rng = plan, rng
        self.patches = _patches(plan)
        self.work = make_workspace(plan.oriented, plan.search, plan.data[0])
        self.simulated = empty_grid(study, plan.path, 0, len(self.patches), keep_sources=True)
        self._next = 0
        n_kept = min(max(MAX_BYTES // self.simulated.grid.size, 4), MAX_CHECKPOINTS)
        self._every = max(-(-len(self.patches) // n_kept), MIN_INTERVAL)
        self._checkpoints: dict[int, Checkpoint] = {}

    @property
    def n_done(self) -> int:
        """Up to which patch it is known."""
        return max([self._next, *self._checkpoints])

    def go_to(self, number: int) -> None:
        """Bring the grid to where it is before a patch."""
        if not self._next <= number < self._next + self._every:
            known = [k for k in self._checkpoints if k <= number]
            if known and (self._next > number or max(known) > self._next):
                self._restore(max(known))
        while self._next < number:
            self.step()

    def _restore(self, number: int) -> None:
        kept = self._checkpoints[number]
        self.simulated = self.simulated._replace(grid=kept.grid.copy(), counts=kept.counts.copy())
        self._next, self.rng.bit_generator.state = number, kept.rng

    def step(self) -> tuple[int, int]:
        """Simulate the next patch and return its location in the oriented image."""
        k, plan, simulated = self._next, self._plan, self.simulated
        if k % self._every == 0 and k not in self._checkpoints:
            state = self.rng.bit_generator.state
            self._checkpoints[k] = Checkpoint(simulated.grid.copy(), simulated.counts.copy(), state)
        fixed = plan.patches, plan.oriented, plan.data[0], plan.search
        simulate_patches(k, k + 1, *fixed, self.rng, self.work, simulated)
        self._next += 1
        return int(simulated.locations[k, 0]), int(simulated.locations[k, 1])


def _patches(plan: Plan) -> tuple[Patch, ...]:
    found = []
    for k, (y0, x0, size, sides, split, tile, part) in enumerate(plan.patches.tolist()):
        row, column = divmod(tile, plan.path.n_columns)
        parts = int(plan.oriented.splits[split])
        found.append(Patch(k, tile, part, row, column, parts, split, y0, x0, size, sides))
    return tuple(found)
