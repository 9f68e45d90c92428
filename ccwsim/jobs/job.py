"""Long work on a thread, in its turn, with progress and cancel; it knows nothing of the page."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from threading import Event, Lock, Thread
from typing import Any, Generic, TypeVar

from ccwsim.engine.kernels import COMPILE_TIME, compilation, must_compile
from ccwsim.jobs.limits import Demand, admit
from ccwsim.jobs.queue import QueueEntry, current_session, server_queue, session_monitor
from ccwsim.jobs.workers import stoppable
from ccwsim.model.errors import Cancelled

Result = TypeVar("Result")
Progress = Callable[[float, int], None]
Cancel = Callable[[], bool]
SLOW_START = 0.8
"""Seconds without progress after which the kernels must be compiling."""
LEAST_SHARE = 0.02
"""Share of the work from which the time left can be estimated."""
PATIENCE = 0.3
"""Seconds to wait for the first results of quick work before progress is shown instead."""
POLL_SECONDS = 0.25
"""Seconds between two looks at a job that is waited for."""
MAX_CELLS_AT_ONCE = 4_000_000
"""Cells of a realization that is simulated while a page is drawn: some tenths of a second."""
NOTHING = Demand(0)
_admission = Lock()
"""One job at a time is admitted, so that two cannot be promised the same memory."""


class Job(Generic[Result]):
    """A piece of work that runs on its own thread as soon as the queue of the server lets it.

    It is called as work(job): it calls `job.report` with its progress, asks `job.is_cancelled`,
    and may `job.give` a part of the result. It returns the `result`; what it raises is `error`.
    `about` is what the caller wants to find on the job again; `n` pieces are called `unit`. Where
    the server does not have what the job demands, nothing is begun and a CCWSIMError is raised.

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
        self._began: float | None = None
        self._first_report: tuple[float, float] | None = None
        self._cancelled, self._finished, self._first = Event(), Event(), Event()
        self._work: Callable[[Job[Result]], Result] | None = work
        self._n_bytes, self._abandoned = demand.n_bytes, False
        session, self._queue = current_session(), server_queue()
        self._entry = QueueEntry(session, self._begin, self.abandon, self._still_to_take)
        with _admission:
            if demand is not NOTHING:
                admit(demand, self._queue.still_to_take)
            self._queue.enter(self._entry)
        session_monitor().note(session)

    def _begin(self) -> None:
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
        """Keep what came out and nothing else, and leave the queue."""
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
        self._queue.leave(self._entry)

    def _still_to_take(self) -> float:
        if self.is_cancelled() or self.finished:
            return 0.0
        return self._n_bytes * (1 - min(self.fraction, 1.0))

    def report(self, fraction: float, n_done: int) -> None:
        """Say which share of the work and how many pieces are done; the work calls this."""
        if self._first_report is None:
            self._first_report = time.monotonic(), fraction
        self.fraction, self.n_done = fraction, n_done

    def publish_partial(self, partial: Result) -> None:
        """Show what is ready before the rest; the work calls this."""
        self.partial = partial
        self._first.set()

    def sleep(self, seconds: float) -> None:
        """Wait, unless it is asked to stop meanwhile; the work calls this.

        Raises
        ------
        Cancelled
        """
        if self._cancelled.wait(seconds):
            raise Cancelled("stopped before it began")

    def cancel(self) -> None:
        """Ask the work to stop; it does so when it next looks, and at once where it waits."""
        self._cancelled.set()
        if self._queue.withdraw(self._entry):
            self._end(Cancelled("stopped before it began"))

    def abandon(self) -> None:
        """Stop the work and keep nothing of it: there is nobody to look at it."""
        self._abandoned = True
        self.cancel()

    def is_cancelled(self) -> bool:
        """Return whether it was asked to stop."""
        return self._cancelled.is_set()

    @property
    def position(self) -> int:
        """Its position among the jobs that wait, 0 where it does not wait."""
        return self._queue.position(self._entry)

    @property
    def finished(self) -> bool:
        """Whether it has come to an end, good or bad."""
        return self._finished.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` and return whether it has finished."""
        return self._finished.wait(seconds)

    def wait_first(self, seconds: float) -> bool:
        """Wait at most `seconds` for a part of the result or the end; say whether it is there."""
        return self._first.wait(seconds)

    @property
    def seconds(self) -> float:
        """Time since it began; 0 while it waits."""
        return 0.0 if self._began is None else time.monotonic() - self._began

    @property
    def seconds_left(self) -> float | None:
        """Estimate of the time left, None where too little is done to tell.

        It is made from the first report on, when the kernels are compiled.
        """
        start, share = self._first_report or (0.0, 1.0)
        if self.fraction - share < LEAST_SHARE:
            return None
        return (time.monotonic() - start) * (1 - self.fraction) / (self.fraction - share)


def result_in_turn(work: Callable[..., Result], demand: Demand) -> Result:
    """Return work(progress=…, cancel=…) that a page cannot be drawn without.

    Little work is done at once; much of it waits for its turn as a job.
    """
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


def progress_text(job: Job, label: str = "") -> str:
    """Say how far a job is; a `label` takes the place of the number of finished pieces."""
    if delay := delay_text(job):
        return f"{label} · {delay}" if label else delay
    text = label or f"{job.n_done:,} of {job.n:,} {job.unit}"
    left = job.seconds_left
    return text if left is None else f"{text} · {format_duration(max(left, 1.0))} left"


def delay_text(job: Job) -> str:
    """Say why a job does not get on: it stops, waits, or kernels compile; empty where it does."""
    if job.is_cancelled():
        return "Stopping …"
    if position := job.position:
        return f"Waiting: {ordinal(position)} in the queue"
    if job.fraction == 0 and job.seconds > SLOW_START:
        return compilation_text()
    return ""


def compilation_text() -> str:
    """Say that kernels compile and how many of them are done, where that is known."""
    done = compilation()
    count = f", {done[0]} of {done[1]} done" if done else ""
    return f"Compiling the kernels for this machine{count}: {COMPILE_TIME}, on the first run only …"


def compilation_to_come() -> str:
    """Say what an estimate of time leaves out on a machine's first run; else nothing."""
    return f" Before that the kernels compile, once: {COMPILE_TIME}." if must_compile() else ""


def format_duration(seconds: float) -> str:
    """Return a time that is only approximate, without more digits than it deserves.

    Examples
    --------
    >>> format_duration(4.7), format_duration(170.0), format_duration(9000.0)
    ('5 s', '3 min', '2.5 h')
    """
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def ordinal(number: int) -> str:
    """Return the word for a position in a row.

    Examples
    --------
    >>> [ordinal(n) for n in (1, 2, 3, 4, 11, 22)]
    ['1st', '2nd', '3rd', '4th', '11th', '22nd']
    """
    special = {1: "st", 2: "nd", 3: "rd"} if number % 100 not in (11, 12, 13) else {}
    return f"{number}{special.get(number % 10, 'th')}"
