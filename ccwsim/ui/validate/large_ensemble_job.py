"""A long run: thousands of realizations whose statistics are kept, not they themselves."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from ccwsim.metrics import RunningStatistics, RunningSummary
from ccwsim.model.bounds import MAX_LAG
from ccwsim.model.errors import Cancelled
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate
from ccwsim.system.workers import n_cores
from ccwsim.ui.jobs.job import Cancel, Job
from ccwsim.ui.jobs.limits import Demand, demand_of

CELLS_A_BATCH = 4_000_000
"""Cells that are kept at once, one byte each."""
POLL_SECONDS = 1.0
"""Seconds between two summaries."""
LOW, HIGH = 0.05, 0.95


@dataclass
class LargeEnsembleRun:
    """A run that is going on, or has come to an end.

    Attributes
    ----------
    training_image, grid, parameters, hard_data, seed, n
        What is simulated.
    facies : int
        Place of the facies whose curves are followed.
    summary : RunningSummary or None
        The latest one.
    numbers, errors : list
        Standard error of the E-type, averaged over cells, after so many realizations.
    n_wrong : int
        Hard data not honoured, over all realizations so far.
    nbytes : int
        Memory of the statistics, the same for any number of realizations.
    """

    training_image: TrainingImage
    grid: Grid
    parameters: Parameters
    hard_data: HardData
    seed: int
    n: int
    facies: int
    summary: RunningSummary | None = None
    numbers: list[int] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    n_wrong: int = 0
    nbytes: int = 0
    job: Job | None = None

    def start(self) -> LargeEnsembleRun:
        """Begin, on a thread; refused where the server does not have what it demands."""
        self.job = Job(self._work, demand=self.demand(), n=self.n)
        return self

    @property
    def going(self) -> bool:
        """Whether it has begun and not come to an end."""
        return self.job is not None and not self.job.finished

    def demand(self) -> Demand:
        """Return what it asks of the server: a batch of realizations, and the statistics."""
        study = Study(self.training_image, self.grid, self.parameters, self.hard_data, self.seed)
        return demand_of(study, self.n, n_kept=self._batch)

    @property
    def _batch(self) -> int:
        cells = self.grid.ny * self.grid.nx
        return min(max(CELLS_A_BATCH // cells, 1), 4 * n_cores())

    def _work(self, job: Job) -> None:
        cancel = job.is_cancelled
        sides = (*self.grid.shape, *self.training_image.shape)
        n_facies, lags = self.training_image.n_facies, min(MAX_LAG, min(sides) // 2)
        running = RunningStatistics(self.grid.shape, n_facies, [self.facies], max_lag=lags)
        self.nbytes = running.nbytes
        batch, looked = self._batch, 0.0
        while running.n < self.n and not cancel():
            self._add_batch(running, min(batch, self.n - running.n), cancel)
            job.report(running.n / self.n, running.n)
            done = running.n == self.n or (cancel() and self.summary is None)
            if running.n and (done or time.monotonic() - looked > POLL_SECONDS):
                self._look(running)
                looked = time.monotonic()

    def _add_batch(self, running: RunningStatistics, n: int, cancel: Cancel) -> None:
        try:
            ensemble = simulate(
                self.training_image, self.grid, self.parameters, self.hard_data,
                n_realizations=n, seed=self.seed, cancel=cancel, first_realization=running.n,
            )  # fmt: skip
        except Cancelled:
            return
        wrong = ensemble.n_mismatched
        for k, realization in enumerate(ensemble.indices):
            try:
                running.add(realization)
            except Cancelled:
                return
            self.n_wrong += int(wrong[k])

    def _look(self, running: RunningStatistics) -> None:
        self.summary = running.summary(LOW, HIGH)
        p = self.summary.etype.probability[self.facies]
        self.numbers.append(running.n)
        self.errors.append(float(100 * np.sqrt(p * (1 - p) / running.n).mean()))
