"""Jobs: long work on threads, queued by the server, with progress and cancel."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from functools import cache
from math import inf
from threading import Event, Lock, Thread
from typing import Any, Generic, TypeVar

from ccwsim.jobs.limits import Demand, admit, limits_of_environment
from ccwsim.jobs.scheduler import PAGE_TURNS, Lease, Scheduler, Usage
from ccwsim.jobs.workers import share_cores, stoppable
from ccwsim.model import Cancelled

Result = TypeVar("Result")
MIN_FINISHED_SHARE = 0.02  # minimum finished share of the work for an estimate of the time left
# seconds that a page waits for first results before it shows the progress
FIRST_RESULT_SECONDS = 0.3
JOB_POLL_SECONDS = 0.25  # seconds between two checks of a job that a page waits for
MAX_CELLS_AT_ONCE = 4_000_000  # maximum cells of a run without a job, some tenths of a second
MAX_COUNTED_SECONDS = 10.0  # seconds after which an active job no longer occupies a slot
NO_DEMAND = Demand(0)
_admission = Lock()  # held so that two jobs are never promised the same memory


class Job(Lease, Generic[Result]):
    """Work that the queue of the server starts on a separate thread.

    The thread calls work(job), which reports progress to `job.report`, checks `job.is_cancelled`,
    and may call `job.publish_partial`. The caller may store anything in `about`. Progress counts
    `n` pieces, called `unit`. Raises `CCWSIMError` if the server lacks the resources of `demand`.
    """

    def __init__(
        self,
        work: Callable[[Job[Result]], Result],
        about: Any = None,
        demand: Demand = NO_DEMAND,
        *,
        n: int = 0,
        unit: str = "realizations",
    ) -> None:
        self.about, self.n, self.unit = about, n, unit
        self.fraction, self.n_done = 0.0, 0
        self.partial: Result | None = None
        self.result: Result | None = None
        self.error: Exception | None = None
        self._first_report: tuple[float, float] | None = None
        self._finished, self._first = Event(), Event()
        self._work: Callable[[Job[Result]], Result] | None = work
        self._n_bytes, self._abandoned = demand.n_bytes, False
        self._queue = queue = server_queue()
        session = queue.current_session()
        with _admission:
            super().__init__(queue.usage_of(session))
            if demand is not NO_DEMAND:
                admit(demand, queue.still_to_take)
            queue.request(self)

    def answer(self) -> None:
        """Start the work on a thread, unless the job was stopped while it waited."""
        if self.since == inf:
            self._end(Cancelled("stopped before it began"))
            return
        try:
            Thread(target=self._run, daemon=True).start()
        except RuntimeError as error:  # the system refuses another thread
            self._end(error)

    def _run(self) -> None:
        error = None
        try:
            assert self._work is not None
            with stoppable(self.is_cancelled):
                self.result = self._work(self)
        except Exception as raised:
            error = raised
        finally:
            self._end(error)

    def _end(self, error: Exception | None) -> None:
        """Keep only the result and the error, and leave the queue."""
        self.error, self._work = error, None
        while error is not None:
            # a session keeps its last error, whose traceback would keep large arrays in memory
            traceback.clear_frames(error.__traceback__)
            error = error.__context__ if isinstance(error.__context__, Exception) else None
        if self._abandoned:
            self.result = self.partial = None
            self.error = Cancelled("stopped, because the page was closed")
        self._finished.set()
        self._first.set()
        self._queue.release(self)

    def still_to_take(self) -> float:
        """Return the bytes of memory that the job was promised and has not allocated yet."""
        if self.is_cancelled() or self.finished:
            return 0.0
        return self._n_bytes * (1 - min(self.fraction, 1.0))

    def report(self, fraction: float, n_done: int) -> None:
        """Store the finished share and the number of finished pieces; called by the work."""
        if self._first_report is None:
            self._first_report = time.monotonic(), fraction
        self.fraction, self.n_done = fraction, n_done

    def publish_partial(self, partial: Result) -> None:
        """Publish a first part of the result; called by the work."""
        self.partial = partial
        self._first.set()

    def sleep(self, seconds: float) -> None:
        """Make the work wait; raise `Cancelled` if the job is asked to stop meanwhile."""
        if self.stop.wait(seconds):
            raise Cancelled("stopped before it began")

    def cancel(self) -> None:
        """Ask the work to stop; a waiting job ends at once."""
        self.stop.set()
        self._queue.look()

    def abandon(self) -> None:
        """Stop the work and drop its result, because its page was closed."""
        self._abandoned = True
        self.cancel()

    def is_cancelled(self) -> bool:
        """Return whether the job was asked to stop."""
        return self.stop.is_set()

    @property
    def position(self) -> int:
        """Position among the waiting jobs, 0 if this job does not wait."""
        return self._queue.position(self)

    @property
    def finished(self) -> bool:
        """Whether the job has ended, with a result or an error."""
        return self._finished.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` and return whether the job has finished."""
        return PAGE_TURNS.wait(self._finished, seconds)

    def wait_first(self, seconds: float) -> bool:
        """Return whether a partial or final result arrives within `seconds`."""
        return PAGE_TURNS.wait(self._first, seconds)

    @property
    def seconds(self) -> float:
        """Seconds since the job began; 0 while it waits."""
        return max(self._queue.clock() - self.since, 0.0)

    @property
    def seconds_left(self) -> float | None:
        """Estimated seconds left, excluding compilation; None if too little of the work is done."""
        start, share = self._first_report or (0.0, 1.0)
        if self.fraction - share < MIN_FINISHED_SHARE:
            return None
        return (time.monotonic() - start) * (1 - self.fraction) / (self.fraction - share)


class Queue(Scheduler[Job[Any]]):
    """The jobs of all sessions, of which `n_slots` short ones are active at a time.

    A job that has been active for `MAX_COUNTED_SECONDS` frees its slot. `current_session` returns
    the name of the session whose page this thread shows, or "".
    """

    def __init__(self, n_slots: int, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(n_slots, MAX_COUNTED_SECONDS, clock)
        self.current_session: Callable[[], str] = lambda: ""

    def jobs(self) -> list[Job[Any]]:
        """Return the active and waiting jobs of all sessions."""
        with self._lock:
            return [*self._active, *self._waiting]

    def jobs_of(self, session: str) -> list[Job[Any]]:
        """Return the active and waiting jobs of a session."""
        return [job for job in self.jobs() if job.usage.name == session]

    def usage_of(self, session: str) -> Usage:
        """Return the usage that the jobs of a session share; a session without jobs is new."""
        return next((job.usage for job in self.jobs_of(session)), Usage(session))

    @property
    def n_of_others(self) -> int:
        """Number of active and waiting jobs of sessions other than that of this thread."""
        return len(self.jobs()) - len(self.jobs_of(self.current_session()))

    @property
    def still_to_take(self) -> float:
        """Bytes of memory that all jobs were promised and have not allocated yet."""
        return sum(job.still_to_take() for job in self.jobs())


@cache
def server_queue() -> Queue:
    """Return the only queue of this process; from then on, all runs share the cores."""
    share_cores()
    return Queue(limits_of_environment().n_slots)


def result_in_turn(work: Callable[..., Result], demand: Demand) -> Result:
    """Return the result of work(progress=…, cancel=…); large work runs as a job."""
    admit(demand, server_queue().still_to_take)
    if demand.n_cells <= MAX_CELLS_AT_ONCE:
        return work(progress=None, cancel=None)
    job = Job(lambda job: work(progress=job.report, cancel=job.is_cancelled), demand=demand)
    while not job.wait(JOB_POLL_SECONDS):
        pass
    if job.error is not None:
        raise job.error
    assert job.result is not None
    return job.result
