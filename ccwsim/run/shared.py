"""Ensembles that jobs share: equal studies are simulated once, and a few ensembles are kept."""

from collections.abc import Callable, Hashable
from concurrent.futures import Future, wait
from threading import Thread

from ccwsim import Cancelled, Ensemble
from ccwsim.jobs.job import Job
from ccwsim.jobs.memo import Memo
from ccwsim.jobs.workers import WORKER_POLL_SECONDS, stoppable

MAX_SHARED = 16  # maximum number of kept ensembles
MAX_SHARED_BYTES = 64 * 2**20  # maximum total size of kept ensembles; a larger ensemble is not kept


class SharedRun(Future[Ensemble]):
    """A simulation for one or more jobs, which get its progress; it stops when all have left."""

    def __init__(self, n: int) -> None:
        super().__init__()
        self.n = n
        self.partial: Ensemble | None = None
        self._jobs: list[Job[Ensemble]] = []

    def join(self, job: Job[Ensemble]) -> None:
        """Let a job take part."""
        self._jobs.append(job)
        if self.partial is not None:
            job.publish_partial(self.partial)

    def leave(self, job: Job[Ensemble]) -> None:
        """Let a job leave; the last job to leave asks the simulation to stop."""
        self._jobs.remove(job)

    def report(self, fraction: float, n_done: int) -> None:
        """Report the progress to all jobs; called by the work."""
        for job in list(self._jobs):
            job.report(fraction, n_done)

    def publish_partial(self, partial: Ensemble) -> None:
        """Publish a first part of the ensemble to all jobs; called by the work."""
        self.partial = partial
        for job in list(self._jobs):
            job.publish_partial(partial)

    def is_cancelled(self) -> bool:
        """Return whether all jobs have left."""
        return not self._jobs


class SharedRuns(Memo[Ensemble]):
    """Simulates each study, identified by a key, only once; keeps the latest ensembles."""

    def ensemble_for(
        self, job: Job[Ensemble], key: Hashable, work: Callable[[SharedRun], Ensemble]
    ) -> Ensemble:
        """Return the ensemble with this key; `work` simulates it unless it is kept or simulated.

        A cancelled job leaves the simulation, which continues for the other jobs; the error
        `Cancelled` contains the partial ensemble. The last job waits for the end of the simulation.
        """

        def simulate() -> Ensemble:
            with stoppable(run.is_cancelled):
                return work(run)

        with self._lock:
            run = self.claim(key, new := SharedRun(job.n))
            run.join(job)
        if run is new:
            Thread(target=self.compute, args=(key, run, simulate), daemon=True).start()
        while not wait([run], WORKER_POLL_SECONDS).done:
            if job.is_cancelled():
                with self._lock:
                    run.leave(job)
                    if run.is_cancelled():
                        self.give_up(key, run)
                        break
                n = 0 if run.partial is None else run.partial.n
                raise Cancelled(f"stopped after {n} of {run.n} realizations", run.partial)
        return run.result()
