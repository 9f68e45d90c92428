"""Ensembles that jobs share: equal studies are simulated once, and a few ensembles are kept."""

from collections.abc import Callable, Hashable
from threading import Event, Lock, Thread

from ccwsim.jobs.job import Job
from ccwsim.jobs.workers import POLL_SECONDS, stoppable
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import Cancelled
from ccwsim.system.lru_cache import LruCache

MAX_KEPT = 16  # maximum number of kept ensembles
MAX_KEPT_BYTES = 64 * 2**20  # maximum total size of kept ensembles; a larger ensemble is not kept


class SharedRun:
    """A simulation for one or more jobs, which get its progress; it stops when all have left."""

    def __init__(self, n: int) -> None:
        self.n, self.stopped = n, False
        self.partial: Ensemble | None = None
        self.result: Ensemble | None = None
        self.error: Exception | None = None
        self.finished = Event()
        self._jobs: list[Job[Ensemble]] = []

    def join(self, job: Job[Ensemble]) -> None:
        """Let a job take part."""
        self._jobs.append(job)
        if self.partial is not None:
            job.publish_partial(self.partial)

    def leave(self, job: Job[Ensemble]) -> None:
        """Let a job leave; the simulation is asked to stop if it was the last one."""
        self._jobs.remove(job)
        self.stopped = not self._jobs

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
        return self.stopped


class SharedRuns:
    """Simulates each study once, by a key of all that decides it; keeps the latest ensembles."""

    def __init__(self, max_kept: int = MAX_KEPT, max_bytes: int = MAX_KEPT_BYTES) -> None:
        self._kept = LruCache[Ensemble](max_kept, max_bytes, min_values=0)
        self._running: dict[Hashable, SharedRun] = {}
        self._lock = Lock()

    def kept(self, key: Hashable) -> Ensemble | None:
        """Return the ensemble with this key, if it is kept."""
        return self._kept.get(key)

    def ensemble_for(
        self, job: Job[Ensemble], key: Hashable, work: Callable[[SharedRun], Ensemble]
    ) -> Ensemble:
        """Return the ensemble with this key; `work` simulates it unless it is kept or simulated.

        A job that is cancelled leaves the simulation, which goes on for the other jobs, and
        `Cancelled` has the part that the job has seen. The last job waits for its end instead.
        """
        with self._lock:
            if (kept := self._kept.get(key)) is not None:
                return kept
            run = self._running.get(key)
            if run is None or run.stopped:
                run = SharedRun(job.n)
                run.join(job)
                Thread(target=self._simulate, args=(key, run, work), daemon=True).start()
                self._running[key] = run
            else:
                run.join(job)
        while not run.finished.wait(POLL_SECONDS):
            if job.is_cancelled():
                with self._lock:
                    run.leave(job)
                if not run.stopped:
                    n = 0 if run.partial is None else run.partial.n
                    raise Cancelled(f"stopped after {n} of {run.n} realizations", run.partial)
                run.finished.wait()
        if run.error is not None:
            raise run.error
        assert run.result is not None
        return run.result

    def _simulate(
        self, key: Hashable, run: SharedRun, work: Callable[[SharedRun], Ensemble]
    ) -> None:
        try:
            with stoppable(run.is_cancelled):
                run.result = work(run)
        except Exception as error:
            run.error = error
        with self._lock:
            if run.result is not None:
                self._kept.put(key, run.result)
            if self._running.get(key) is run:
                del self._running[key]
        run.finished.set()
