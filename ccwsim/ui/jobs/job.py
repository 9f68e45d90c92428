"""Long work on a thread, in its turn, with progress and cancel; it knows nothing of the page."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable
from threading import Event, Lock, Thread
from typing import Any, Generic, TypeVar

from ccwsim.model.errors import Cancelled
from ccwsim.system.workers import stoppable
from ccwsim.ui.jobs.admission import Demand, admit
from ccwsim.ui.jobs.queue import QueueEntry, server_queue
from ccwsim.ui.jobs.sessions import current_session, session_monitor

Result = TypeVar("Result")
Progress = Callable[[float, int], None]
Cancel = Callable[[], bool]
SLOW_START = 0.8
"""Seconds without progress after which the kernels must be compiling."""
NOTHING = Demand(0)
_door = Lock()
"""One job at a time is let in, so that two cannot be promised the same memory."""


class Job(Generic[Result]):
    """A piece of work that runs on its own thread as soon as the queue of the server lets it.

    Parameters
    ----------
    work : callable
        Called as work(progress, cancel); what it returns is `result`, what it raises is `error`.
    about : object
        Whatever the caller wants to find on the job again.
    demand : Demand
        What it asks of the server.

    Attributes
    ----------
    fraction : float
        Share of the work that is done, 0 to 1.
    n_done : int
        How many pieces are finished.
    partial : object
        What is ready before the rest, None until then; `give` sets it.
    result, error
        What came out; None until then.

    Raises
    ------
    CCWSIMError
        Where the server has not got what it demands; nothing is begun then.

    Examples
    --------
    >>> job = Job(lambda progress, cancel: 6 * 7)
    >>> job.wait(5.0), job.result
    (True, 42)
    """

    def __init__(
        self,
        work: Callable[[Progress, Cancel], Result],
        about: Any = None,
        demand: Demand = NOTHING,
    ) -> None:
        self.about = about
        self.fraction = 0.0
        self.n_done = 0
        self.partial: Result | None = None
        self.result: Result | None = None
        self.error: Exception | None = None
        self.collected = False
        self._began: float | None = None
        self._cancelled = Event()
        self._finished = Event()
        self._first = Event()
        self._work: Callable[[Progress, Cancel], Result] | None = work
        self._n_bytes, self._dropped = demand.n_bytes, False
        session, self._queue = current_session(), server_queue()
        self._place = QueueEntry(session, self._begin, self.drop, self._still_to_take)
        with _door:
            if demand is not NOTHING:
                admit(demand, self._queue.still_to_take)
            self._queue.enter(self._place)
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
            with stoppable(self._cancelled.is_set):
                self.result = self._work(self._report, self._cancelled.is_set)
        except Exception as raised:
            error = raised
        finally:
            self._end(error)

    def _end(self, error: Exception | None) -> None:
        """Keep what came out and nothing else, and give the place back."""
        self.error, self._work = error, None
        while error is not None:  # what was in the work of a frame would stay with its error
            traceback.clear_frames(error.__traceback__)
            error = error.__context__ if isinstance(error.__context__, Exception) else None
        if self._dropped:
            self.result = self.partial = None
            self.error = Cancelled("stopped, as the page was closed")
        self._finished.set()
        self._first.set()
        self._queue.leave(self._place)

    def _still_to_take(self) -> float:
        if self.cancelled or self.finished:
            return 0.0
        return self._n_bytes * (1 - min(self.fraction, 1.0))

    def _report(self, fraction: float, n_done: int) -> None:
        self.fraction, self.n_done = fraction, n_done

    def give(self, partial: Result) -> None:
        """Show what is ready before the rest; the work itself calls this."""
        self.partial = partial
        self._first.set()

    def cancel(self) -> None:
        """Ask the work to stop; it does so when it next looks, and at once where it waits."""
        self._cancelled.set()
        if self._queue.withdraw(self._place):
            self._end(Cancelled("stopped before it began"))

    def drop(self) -> None:
        """Stop the work and keep nothing of it: there is nobody to look at it."""
        self._dropped = True
        self.cancel()

    @property
    def position(self) -> int:
        """Its place among the jobs that wait, 0 where it does not wait."""
        return self._queue.position(self._place)

    @property
    def cancelled(self) -> bool:
        """Whether it was asked to stop."""
        return self._cancelled.is_set()

    @property
    def finished(self) -> bool:
        """Whether it has come to an end, good or bad."""
        return self._finished.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` and return whether it has finished."""
        return self._finished.wait(seconds)

    def wait_first(self, seconds: float) -> bool:
        """Wait at most `seconds` for a part of the result, or the end; return whether it is there.

        Examples
        --------
        >>> Job(lambda progress, cancel: "all").wait_first(5.0)
        True
        """
        return self._first.wait(seconds)

    @property
    def seconds(self) -> float:
        """Time since it began; 0 while it waits."""
        return 0.0 if self._began is None else time.monotonic() - self._began

    @property
    def seconds_left(self) -> float | None:
        """Estimate of the time left, None where too little is done to tell."""
        if self.fraction < 0.02:
            return None
        return self.seconds * (1 - self.fraction) / self.fraction


def held_up(job: Job | None) -> str:
    """Say why a job does not get on, for a progress bar: it waits, it stops, or kernels compile.

    Returns
    -------
    str
        Empty where it gets on.
    """
    if job is None or job.cancelled:
        return "Stopping …"
    if position := job.position:
        return f"Waiting: {ordinal(position)} in the queue"
    if job.fraction == 0 and job.seconds > SLOW_START:
        return "Compiling the kernels for this machine: some seconds, on the first run only …"
    return ""


def ordinal(number: int) -> str:
    """Return the word for a place in a row.

    Examples
    --------
    >>> [ordinal(n) for n in (1, 2, 3, 4, 11, 22)]
    ['1st', '2nd', '3rd', '4th', '11th', '22nd']
    """
    special = {1: "st", 2: "nd", 3: "rd"} if number % 100 not in (11, 12, 13) else {}
    return f"{number}{special.get(number % 10, 'th')}"
