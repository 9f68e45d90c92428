"""What runs as a job: runs that pages follow, and work that a page cannot be drawn without."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Self, TypeVar

from ccwsim.ui.jobs.admission import Demand, admit
from ccwsim.ui.jobs.job import NOTHING, Cancel, Job, Progress
from ccwsim.ui.jobs.queue import server_queue

Result = TypeVar("Result")
POLL_SECONDS = 0.5
SMALL = 4_000_000
"""Cells of a realization that is simulated while a page is drawn: some tenths of a second."""


class BackgroundRun(ABC):
    """Something that works on a thread from `start` on, with its own results to look at."""

    job: Job | None

    def start(self) -> Self:
        """Begin, on a thread.

        Raises
        ------
        CCWSIMError
            Where the server has not got what it demands.
        """
        self.job = Job(self._work, demand=self.demand())
        return self

    def demand(self) -> Demand:
        """Return what it asks of the server."""
        return NOTHING

    @abstractmethod
    def _work(self, progress: Progress, cancel: Cancel) -> Any:
        """Do the work; what it returns is the result of the job."""

    @property
    def going(self) -> bool:
        """Whether it has begun and not come to an end."""
        return self.job is not None and not self.job.finished


def done_in_turn(work: Callable[[Progress, Cancel], Result], demand: Demand) -> Result:
    """Do work that a page cannot do without and return what it gives; much of it takes its turn.

    Raises
    ------
    CCWSIMError
        Where the server has not got what it demands.

    Examples
    --------
    >>> done_in_turn(lambda progress, cancel: 6 * 7, Demand(n_cells=1))
    42
    """
    admit(demand, server_queue().still_to_take)
    if demand.n_cells <= SMALL:
        return work(lambda fraction, n_done: None, lambda: False)
    job = Job(work, demand=demand)
    while not job.wait(POLL_SECONDS):
        pass
    if job.error is not None:
        raise job.error
    assert job.result is not None
    return job.result
