"""Long work on a thread, with progress and cancel; it knows nothing of the page."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from threading import Event, Thread
from typing import Any, Generic, Self, TypeVar

Result = TypeVar("Result")
Progress = Callable[[float, int], None]
Cancel = Callable[[], bool]
SLOW_START = 0.8
"""Seconds without progress after which the kernels must be compiling."""


class Job(Generic[Result]):
    """A piece of work that runs on its own thread from the moment it is made.

    Parameters
    ----------
    work : callable
        Called as work(progress, cancel); what it returns is `result`, what it raises is `error`.
    about : object
        Whatever the caller wants to find on the job again.

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

    Examples
    --------
    >>> job = Job(lambda progress, cancel: 6 * 7)
    >>> job.wait(5.0), job.result
    (True, 42)
    """

    def __init__(self, work: Callable[[Progress, Cancel], Result], about: Any = None) -> None:
        self.about = about
        self.fraction = 0.0
        self.n_done = 0
        self.partial: Result | None = None
        self.result: Result | None = None
        self.error: Exception | None = None
        self.collected = False
        self._started = time.monotonic()
        self._cancelled = Event()
        self._finished = Event()
        self._first = Event()
        self._work = work
        Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        try:
            self.result = self._work(self._report, self._cancelled.is_set)
        except Exception as error:
            self.error = error
        finally:
            self._finished.set()
            self._first.set()

    def _report(self, fraction: float, n_done: int) -> None:
        self.fraction, self.n_done = fraction, n_done

    def give(self, partial: Result) -> None:
        """Show what is ready before the rest; the work itself calls this."""
        self.partial = partial
        self._first.set()

    def cancel(self) -> None:
        """Ask the work to stop; it does so when it next looks."""
        self._cancelled.set()

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
        """Time since the start."""
        return time.monotonic() - self._started

    @property
    def seconds_left(self) -> float | None:
        """Estimate of the time left, None where too little is done to tell."""
        if self.fraction < 0.02:
            return None
        return self.seconds * (1 - self.fraction) / self.fraction


def held_up(job: Job | None) -> str:
    """Say why a job does not get on, for a progress bar: it is being stopped, or kernels compile.

    Returns
    -------
    str
        Empty where it gets on.
    """
    if job is None or job.cancelled:
        return "Stopping …"
    if job.fraction == 0 and job.seconds > SLOW_START:
        return "Compiling the kernels for this machine: some seconds, on the first run only …"
    return ""


class BackgroundRun(ABC):
    """Something that works on a thread from `start` on, with its own results to look at."""

    job: Job | None

    def start(self) -> Self:
        """Begin, on a thread."""
        self.job = Job(self._work)
        return self

    @abstractmethod
    def _work(self, progress: Progress, cancel: Cancel) -> Any:
        """Do the work; what it returns is the result of the job."""

    @property
    def going(self) -> bool:
        """Whether it has begun and not come to an end."""
        return self.job is not None and not self.job.finished
