"""A long run that a page starts: its inputs, its job and its results."""

from __future__ import annotations

from typing import Any, Generic, Self, TypeVar

from ccwsim.jobs.job import NOTHING, Job
from ccwsim.jobs.limits import Demand
from ccwsim.model.errors import CCWSIMError

Result = TypeVar("Result")


class PageRun(Generic[Result]):
    """Work of a page on a thread; a dataclass derived from it holds inputs and partial results.

    `n_pieces` pieces of work, called `unit`, are counted in its progress.
    """

    unit = "realizations"
    job: Job[Result] | None = None

    @property
    def n_pieces(self) -> int:
        """How many pieces of work there are, 0 to count none."""
        return 0

    def work(self, job: Job[Result]) -> Result:
        """Do the work on the thread of its job."""
        raise NotImplementedError

    def demand(self) -> Demand:
        """Return what it asks of the server."""
        return NOTHING

    def start(self) -> Self:
        """Begin; an error if the server does not have what it demands."""
        self.job = Job(self.work, demand=self.demand(), n=self.n_pieces, unit=self.unit)
        return self

    @property
    def going(self) -> bool:
        """Whether it has begun and not ended."""
        return self.job is not None and not self.job.finished

    @property
    def error(self) -> Exception | None:
        """Why it ended early, None unless it did."""
        return self.job.error if self.job is not None else None

    @property
    def result(self) -> Result | None:
        """What it gave, None until its end."""
        return self.job.result if self.job is not None else None

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` and return whether it has ended."""
        return self.job is not None and self.job.wait(seconds)

    def stop(self) -> None:
        """Ask it to stop."""
        if self.job is not None:
            self.job.cancel()


def start_page_run(page_state: Any, name: str, run: PageRun) -> bool:
    """Start a run and make it the one called `name` of a page; return whether it has begun.

    If the server refuses it, the earlier run stays and the reason is the `message` of the page.
    """
    page_state.message = ""
    try:
        setattr(page_state, name, run.start())
    except CCWSIMError as error:
        page_state.message = str(error)
    return not page_state.message
