"""A sweep on a thread, whose settings can be looked at as they come."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field

from ccwsim.experiments.sweep import Row, Sweep, sweep
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.jobs.job import Job
from ccwsim.ui.jobs.limits import Demand, demand_of

CELLS_KEPT = 64_000_000
"""Cells of realizations that a sweep keeps, one byte each."""
MAX_KEPT = 4


@dataclass
class SweepRun:
    """A sweep that is going on, or has come to an end.

    Attributes
    ----------
    training_image, grid, hard_data, seed, settings, n_realizations
        What is simulated.
    facies : int
        Place of the facies whose connection is judged.
    colours : list of str
        Of the facies, "#rrggbb".
    rows : list of Row
        The settings that are finished.
    job : Job or None
    n_drawn : int
        How many of them the page shows.
    tiles : list of bytes
        A small picture of each.
    """

    training_image: TrainingImage
    grid: Grid
    hard_data: HardData
    seed: int
    settings: tuple[Parameters, ...]
    n_realizations: int
    facies: int
    colours: list[str]
    rows: list[Row] = field(default_factory=list)
    job: Job[Sweep] | None = None
    n_drawn: int = 0
    tiles: list[bytes] = field(default_factory=list)

    def start(self) -> SweepRun:
        """Begin, on a thread; refused where the server does not have what it demands."""
        n = len(self.settings)
        self.job = Job(self._work, demand=self.demand(), n=n, unit="settings")
        return self

    @property
    def going(self) -> bool:
        """Whether it has begun and not come to an end."""
        return self.job is not None and not self.job.finished

    def demand(self) -> Demand:
        """Return what it asks of the server: one setting at a time, and what is kept of each."""
        largest = 0
        for p in self.settings:
            with suppress(CCWSIMError):  # one that does not fit is told about among the results
                study = Study(self.training_image, self.grid, p, self.hard_data, self.seed)
                needed = demand_of(study, self.n_realizations, n_workers=1).n_bytes
                largest = max(largest, needed)
        cells = self.grid.ny * self.grid.nx * len(self.settings)
        kept = max(CELLS_KEPT, cells)  # one realization at least
        return Demand(cells * self.n_realizations, self.hard_data.n, largest + kept)

    def _work(self, job: Job[Sweep]) -> Sweep:
        room = CELLS_KEPT // (self.grid.ny * self.grid.nx * len(self.settings))
        return sweep(
            self.training_image, self.grid, self.settings, self.hard_data,
            n_realizations=self.n_realizations, seed=self.seed, progress=job.report,
            cancel=job.is_cancelled,
            found=self.rows.append, n_kept=min(max(room, 1), MAX_KEPT), facies=self.facies,
        )  # fmt: skip

    @property
    def found(self) -> Sweep:
        """What is known so far."""
        if self.job is not None and self.job.result is not None:
            return self.job.result
        return Sweep(tuple(self.rows), (), len(self.settings), self.training_image.shape)
