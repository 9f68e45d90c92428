"""Long work on threads, in the order of the server's queue, with progress and cancel."""

from __future__ import annotations

import time
import traceback
from collections import Counter
from collections.abc import Callable
from functools import cache
from threading import Event, Lock, Thread, Timer
from typing import Any, Generic, TypeVar

from ccwsim.jobs.limits import Demand, admit, limits_of_environment
from ccwsim.jobs.workers import share_cores, stoppable
from ccwsim.model.errors import Cancelled

Result = TypeVar("Result")
LEAST_SHARE = 0.02
"""Share of the work from which the time left can be estimated."""
PATIENCE = 0.3
"""Seconds to wait for the first results of quick work before progress is shown instead."""
POLL_SECONDS = 0.25
"""Seconds between two looks at a job that is waited for."""
MAX_CELLS_AT_ONCE = 4_000_000
"""Cells of a realization that is simulated while a page is drawn: some tenths of a second."""
MAX_COUNTED_SECONDS = 10.0
"""Seconds after which an active job does not count against the slots while others wait."""
NOTHING = Demand(0)
_admission = Lock()
"""One job at a time is admitted, so that two cannot be promised the same memory."""


class Job(Generic[Result]):
    """A piece of work that runs on its own thread as soon as the queue of the server lets it.

    It is called as work(job): it calls `job.report` with its progress, asks `job.is_cancelled`,
    and may call `job.publish_partial`. It returns the `result`; what it raises is `error`. `about`
    is for the caller's own use; progress counts `n` pieces, called `unit`. A CCWSIMError is raised,
    and nothing begins, if the server does not have what the job demands.

    Examples
    --------
    >>> job = Job(lambda job: 6 * 7)
    >>> job.wait(5.0), job.result
    (True, 42)
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
        self.active_since = 0.0  # by the clock of the queue
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
        except RuntimeError as error:  # the system gives no more threads
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
        """Keep only result and error, and leave the queue."""
        self.error, self._work = error, None
        while error is not None:
            # a session keeps its last error: the frames' arrays would stay in memory with it
            traceback.clear_frames(error.__traceback__)
            error = error.__context__ if isinstance(error.__context__, Exception) else None
        if self._abandoned:
            self.result = self.partial = None
            self.error = Cancelled("stopped, as the page was closed")
        self._finished.set()
        self._first.set()
        self._queue.leave(self)

    def still_to_take(self) -> float:
        """Return how many bytes of memory it has asked for and not taken yet."""
        if self.is_cancelled() or self.finished:
            return 0.0
        return self._n_bytes * (1 - min(self.fraction, 1.0))

    def report(self, fraction: float, n_done: int) -> None:
        """Store the share of the work and the number of pieces done; the work calls this."""
        if self._first_report is None:
            self._first_report = time.monotonic(), fraction
        self.fraction, self.n_done = fraction, n_done

    def publish_partial(self, partial: Result) -> None:
        """Show what is ready before the rest; the work calls this."""
        self.partial = partial
        self._first.set()

    def sleep(self, seconds: float) -> None:
        """Wait; raise `Cancelled` if it is asked to stop meanwhile. The work calls this."""
        if self._cancelled.wait(seconds):
            raise Cancelled("stopped before it began")

    def cancel(self) -> None:
        """Ask the work to stop; a job that waits ends at once."""
        self._cancelled.set()
        if self._queue.withdraw(self):
            self._end(Cancelled("stopped before it began"))

    def abandon(self) -> None:
        """Stop the work and keep no result: nobody is there to look at it."""
        self._abandoned = True
        self.cancel()

    def is_cancelled(self) -> bool:
        """Return whether it was asked to stop."""
        return self._cancelled.is_set()

    @property
    def position(self) -> int:
        """Its position among the jobs that wait, 0 if it does not wait."""
        return self._queue.position(self)

    @property
    def finished(self) -> bool:
        """Whether it has ended, with a result or an error."""
        return self._finished.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` and return whether it has finished."""
        return self._finished.wait(seconds)

    def wait_first(self, seconds: float) -> bool:
        """Wait at most `seconds` for a partial result or the end; return whether it is there."""
        return self._first.wait(seconds)

    @property
    def seconds(self) -> float:
        """Time since it began; 0 while it waits."""
        return 0.0 if self._began is None else time.monotonic() - self._began

    @property
    def seconds_left(self) -> float | None:
        """Estimate of the time left since the kernels are compiled, None if too little is done."""
        start, share = self._first_report or (0.0, 1.0)
        if self.fraction - share < LEAST_SHARE:
            return None
        return (time.monotonic() - start) * (1 - self.fraction) / (self.fraction - share)


class Queue:
    """Lets jobs begin: of the session with the fewest active jobs, the longest since its turn.

    At most `n_slots` short jobs are active at once. A job that has been active for
    `MAX_COUNTED_SECONDS` continues, and its slot is free for others; all share the cores.
    `current_session` returns the name of the session that this thread draws, empty for none.
    """

    def __init__(self, n_slots: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.current_session: Callable[[], str] = lambda: ""
        self._n_slots, self._clock = n_slots, clock
        self._waiting: list[Job] = []
        self._active: list[Job] = []
        self._turns: dict[str, int] = {}  # when each session had its latest, while it has jobs
        self._n_begun = 0
        self._timer: Timer | None = None
        self._lock = Lock()

    def enter(self, job: Job) -> None:
        """Take a position at the end; if a slot is free it begins at once."""
        with self._lock:
            self._waiting.append(job)
        self.look()

    def leave(self, job: Job) -> None:
        """Leave the queue at the end of a job."""
        with self._lock:
            if job in self._active:
                self._active.remove(job)
            self._forget(job.session)
        self.look()

    def withdraw(self, job: Job) -> bool:
        """Give up waiting; return whether the job waited, and so will never begin."""
        with self._lock:
            if job not in self._waiting:
                return False
            self._waiting.remove(job)
            self._forget(job.session)
        self.look()
        return True

    def look(self) -> None:
        """Begin the jobs that may begin by now."""
        with self._lock:
            now, begun = self._clock(), []
            while self._waiting and self._n_counted(now) < self._n_slots:
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
        """Return how many jobs must begin up to and with this one, 0 if it does not wait."""
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
        """Return the jobs of a session, active and waiting."""
        with self._lock:
            return [job for job in (*self._active, *self._waiting) if job.session == session]

    @property
    def n_active(self) -> int:
        """How many jobs are active."""
        return len(self._active)

    @property
    def n_waiting(self) -> int:
        """How many jobs wait."""
        return len(self._waiting)

    @property
    def still_to_take(self) -> float:
        """Bytes of memory that all jobs have asked for and not taken yet."""
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

        return min(waiting, key=rank)  # the first of equals

    def _n_counted(self, now: float) -> int:
        return sum(now - job.active_since < MAX_COUNTED_SECONDS for job in self._active)

    def _look_again(self, now: float) -> None:
        """Look when the next active job has become a long one, if any job waits for that."""
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
    """Return the one queue of this process, whose runs share its cores from now on."""
    share_cores()
    return Queue(limits_of_environment().n_slots)


def result_in_turn(work: Callable[..., Result], demand: Demand) -> Result:
    """Return work(progress=…, cancel=…) that a page needs: at once, or as a job if it is large."""
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
