"""Settings that are timed one after another in the background."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field

from ccwsim.experiments.timing import CELLS_AT_ONCE, Timing, TimingCase, time_cases
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage
from ccwsim.ui.jobs.admission import Demand, demand_of
from ccwsim.ui.jobs.job import Job
from ccwsim.ui.jobs.queue import server_queue


@dataclass
class TimingRun:
    """A run that is going on, or has come to an end.

    Attributes
    ----------
    training_image, cases, n_realizations, seed
        What is timed.
    timings : list of Timing
        What is finished, in the order of the cases.
    disturbed : bool
        Whether others were computing on this server at the same time.
    """

    training_image: TrainingImage
    cases: list[TimingCase]
    n_realizations: int
    seed: int
    timings: list[Timing] = field(default_factory=list)
    disturbed: bool = False
    job: Job | None = None

    def start(self) -> TimingRun:
        """Begin, on a thread; refused where the server does not have what it demands."""
        n = len(self.cases)
        self.job = Job(self._work, demand=self.demand(), n=n, unit="settings")
        return self

    @property
    def going(self) -> bool:
        """Whether it has begun and not come to an end."""
        return self.job is not None and not self.job.finished

    def demand(self) -> Demand:
        """Return what it asks of the server: one case at a time."""
        n_bytes = 0
        for case in self.cases:
            with suppress(CCWSIMError):  # one that does not fit ends the run when it is its turn
                study = Study(self.training_image, Grid(*case.grid_shape), case.parameters)
                at_once = max(CELLS_AT_ONCE // case.n_cells, 1)
                needed = demand_of(study, self.n_realizations, n_kept=at_once, n_workers=1)
                n_bytes = max(n_bytes, needed.n_bytes)
        n_cells = sum(case.n_cells for case in self.cases) * self.n_realizations
        return Demand(n_cells, max((case.n_data for case in self.cases), default=0), n_bytes)

    def _work(self, job: Job) -> None:
        def report(fraction: float, n_done: int) -> None:
            self.disturbed = self.disturbed or server_queue().n_active > 1
            job.report(fraction, n_done)

        cases, n = self.cases, self.n_realizations
        for timing in time_cases(
            self.training_image, cases, n, self.seed, report, job.is_cancelled
        ):
            self.timings.append(timing)
