"""A long run that a page starts, with inputs, job and results."""

from typing import Any, Generic, Self, TypeVar

from ccwsim.jobs.job import NOTHING, Job
from ccwsim.jobs.limits import Demand
from ccwsim.model.errors import CCWSIMError

Result = TypeVar("Result")


class PageRun(Generic[Result]):
    """Work on a thread; subclasses are dataclasses of inputs, partial results and `n_pieces`."""

    unit = "realizations"
    job: Job[Result] | None = None

    @property
    def n_pieces(self) -> int:
        """Total number of pieces of work, or 0 if pieces are not counted."""
        return 0

    def work(self, job: Job[Result]) -> Result:
        """Do the work and return the result; this is called on the job's thread."""
        raise NotImplementedError

    def demand(self) -> Demand:
        """Return the resources that the run demands from the server."""
        return NOTHING

    def start(self) -> Self:
        """Start the run; raise `CCWSIMError` if the server lacks the demanded resources."""
        self.job = Job(self.work, demand=self.demand(), n=self.n_pieces, unit=self.unit)
        return self

    @property
    def going(self) -> bool:
        """Whether the run has begun and not ended."""
        return self.job is not None and not self.job.finished

    @property
    def error(self) -> Exception | None:
        """The error with which the run ended, if any."""
        return self.job.error if self.job is not None else None

    @property
    def result(self) -> Result | None:
        """The result of the run; None until the run has ended."""
        return self.job.result if self.job is not None else None

    def wait(self, seconds: float) -> bool:
        """Wait at most `seconds` and return whether the run has ended."""
        return self.job is not None and self.job.wait(seconds)

    def stop(self) -> None:
        """Ask the run to stop."""
        if self.job is not None:
            self.job.cancel()


def start_page_run(page_state: Any, name: str, run: PageRun) -> bool:
    """Start a run as attribute `name`, or keep the earlier run and store why as `message`."""
    page_state.message = ""
    try:
        setattr(page_state, name, run.start())
    except CCWSIMError as error:
        page_state.message = str(error)
    return not page_state.message
