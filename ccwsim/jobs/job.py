"""Jobs: long work on threads, queued by the server, with progress and cancel."""

from __future__ import annotations

import time
import traceback
from collections import Counter
from collections.abc import Callable
from functools import cache
from threading import Event, Lock, Thread, Timer
from typing import Any, Generic, TypeVar

from ccwsim.jobs.limits import Demand, admit, limits_of_environment
from ccwsim.jobs.turns import PAGE_TURNS
from ccwsim.jobs.workers import share_cores, stoppable
from ccwsim.model.errors import Cancelled

Result = TypeVar("Result")
LEAST_SHARE = 0.02  # minimum finished share of the work for an estimate of the time left
PATIENCE = 0.3  # seconds that a page waits for first results before it shows the progress
POLL_SECONDS = 0.25  # seconds between two checks of a job that a page waits for
MAX_CELLS_AT_ONCE = 4_000_000  # cells of a run without a job, which takes some tenths of a second
MAX_COUNTED_SECONDS = 10.0  # after these, an active job no longer occupies a slot of the queue
NOTHING = Demand(0)
_admission = Lock()  # held so that two jobs are never promised the same memory


class Job(Generic[Result]):
    """Work that the queue of the server starts on a separate thread.

    The thread calls work(job), which reports progress to `job.report`, checks `job.is_cancelled`,
    and may call `job.publish_partial`. The caller may store anything in `about`. Progress counts
    `n` pieces, called `unit`. If the server lacks what a job demands, `CCWSIMError` is raised.
    """

    def __init__(
        self,
        work: Callable[[Job[Result]], Result],
        about: Any = None,
        demand: Demand = NOTHING,
        *,
        n: int = 0,
        unit: str = "realizations",
    ) -> None:
        self.about, self.n, self.unit = about, n, unit
        self.fraction, self.n_done = 0.0, 0
        self.partial: Result | None = None
        self.result: Result | None = None
        self.error: Exception | None = None
        self.active_since = 0.0  # times of the queue's clock
        self._began: float | None = None
        self._first_report: tuple[float, float] | None = None
        self._cancelled, self._finished, self._first = Event(), Event(), Event()
        self._work: Callable[[Job[Result]], Result] | None = work
        self._n_bytes, self._abandoned = demand.n_bytes, False
        self._queue = server_queue()
        self.session = self._queue.current_session()
        with _admission:
            if demand is not NOTHING:
                admit(demand, self._queue.still_to_take)
            self._queue.enter(self)

    def begin(self) -> None:
        """Start the work on a thread; the queue calls this."""
        self._began = time.monotonic()
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
        self._queue.leave(self)

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
        if self._cancelled.wait(seconds):
            raise Cancelled("stopped before it began")

    def cancel(self) -> None:
        """Ask the work to stop; a waiting job ends at once."""
        self._cancelled.set()
        if self._queue.withdraw(self):
            self._end(Cancelled("stopped before it began"))

    def abandon(self) -> None:
        """Stop the work and drop its result, because its page was closed."""
        self._abandoned = True
        self.cancel()

    def is_cancelled(self) -> bool:
        """Return whether the job was asked to stop."""
        return self._cancelled.is_set()

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
        return 0.0 if self._began is None else time.monotonic() - self._began

    @property
    def seconds_left(self) -> float | None:
        """Estimated seconds left, excluding compilation; None if too little of the work is done."""
        start, share = self._first_report or (0.0, 1.0)
        if self.fraction - share < LEAST_SHARE:
            return None
        return (time.monotonic() - start) * (1 - self.fraction) / (self.fraction - share)


class Queue:
    """Starts the job whose session has the fewest active jobs and, in a tie, the earliest start.

    At most `n_slots` short jobs are active at a time; a job that has been active for
    `MAX_COUNTED_SECONDS` frees its slot. `current_session` returns the name of the session whose
    page this thread shows, or "".
    """

    def __init__(self, n_slots: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.current_session: Callable[[], str] = lambda: ""
        self._n_slots, self._clock = n_slots, clock
        self._waiting: list[Job] = []
        self._active: list[Job] = []
        self._turns: dict[str, int] = {}  # number of the latest turn of each session that has jobs
        self._n_begun = 0
        self._timer: Timer | None = None
        self._lock = Lock()

    def enter(self, job: Job) -> None:
        """Append a job to the queue; it begins at once if a slot is free."""
        with self._lock:
            self._waiting.append(job)
        self.look()

    def leave(self, job: Job) -> None:
        """Remove a job that has ended from the queue."""
        with self._lock:
            if job in self._active:
                self._active.remove(job)
            self._forget(job.session)
        self.look()

    def withdraw(self, job: Job) -> bool:
        """Remove a waiting job; return False if it has begun already."""
        with self._lock:
            if job not in self._waiting:
                return False
            self._waiting.remove(job)
            self._forget(job.session)
        self.look()
        return True

    def look(self) -> None:
        """Start the waiting jobs for which slots are free now."""
        with self._lock:
            now, begun = self._clock(), []
            while self._waiting and self._n_slots > sum(
                now - job.active_since < MAX_COUNTED_SECONDS for job in self._active
            ):
                job = self._next(self._waiting, self._busy(), self._turns)
                self._waiting.remove(job)
                self._active.append(job)
                self._n_begun += 1
                self._turns[job.session] = self._n_begun
                job.active_since = now
                begun.append(job)
            self._look_again(now)
        for job in begun:
            job.begin()

    def position(self, job: Job) -> int:
        """Return the position of a waiting job, from 1; 0 if it does not wait."""
        with self._lock:
            if job not in self._waiting:
                return 0
            ahead, waiting = 1, list(self._waiting)
            busy, turns = self._busy(), dict(self._turns)
            while (following := self._next(waiting, busy, turns)) is not job:
                waiting.remove(following)
                busy[following.session] += 1
                turns[following.session] = self._n_begun + ahead
                ahead += 1
            return ahead

    def jobs_of(self, session: str) -> list[Job]:
        """Return the active and waiting jobs of a session."""
        with self._lock:
            return [job for job in (*self._active, *self._waiting) if job.session == session]

    @property
    def n_active(self) -> int:
        """Number of active jobs."""
        return len(self._active)

    @property
    def n_of_others(self) -> int:
        """Number of active and waiting jobs of sessions other than that of this thread."""
        session = self.current_session()
        with self._lock:
            return sum(job.session != session for job in (*self._active, *self._waiting))

    @property
    def still_to_take(self) -> float:
        """Bytes of memory that all jobs were promised and have not allocated yet."""
        with self._lock:
            jobs = [*self._active, *self._waiting]
        return sum(job.still_to_take() for job in jobs)

    def _busy(self) -> Counter[str]:
        return Counter(job.session for job in self._active)

    def _forget(self, session: str) -> None:
        if all(job.session != session for job in (*self._active, *self._waiting)):
            self._turns.pop(session, None)

    @staticmethod
    def _next(waiting: list[Job], busy: Counter[str], turns: dict[str, int]) -> Job:
        def rank(job: Job) -> tuple[int, int]:
            return busy[job.session], turns.get(job.session, 0)

        return min(waiting, key=rank)  # the first session in case of a tie

    def _look_again(self, now: float) -> None:
        """If jobs wait, check the queue again as soon as the next active job frees its slot."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._waiting:
            times = (job.active_since for job in self._active)
            first = min(since for since in times if now - since < MAX_COUNTED_SECONDS)
            self._timer = Timer(max(first + MAX_COUNTED_SECONDS - now, 0.01), self.look)
            self._timer.daemon = True
            self._timer.start()


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
    while not job.wait(POLL_SECONDS):
        pass
    if job.error is not None:
        raise job.error
    assert job.result is not None
    return job.result
