"""Run trials, such as the settings of a sweep, one after another with progress and cancel."""

from collections.abc import Callable, Iterator, Sequence
from itertools import accumulate
from typing import TypeVar

from ccwsim.jobs.workers import Cancel, Progress, progress_of_part
from ccwsim.model.errors import Cancelled

Trial = TypeVar("Trial")
Result = TypeVar("Result")


def run_trials(
    trials: Sequence[Trial],
    run: Callable[[Trial, Callable[..., None]], Result],
    seconds: Sequence[float],
    progress: Progress | None = None,
    cancel: Cancel | None = None,
    n_pieces: int = 1,
) -> Iterator[Result]:
    """Yield the results of run(trial, report) in the order of `trials`.

    `run` reports the finished share of its trial as report(share) or, if a trial counts as more
    than one piece of work, as report(share, n_done). `progress` is called with the finished share
    of the expected `seconds` of all trials, and the number of finished pieces, `n_pieces` for each
    trial. Raises `Cancelled` before a trial if `cancel` returns True.

    Examples
    --------
    >>> shares = []
    >>> progress = lambda share, n_done: shares.append((share, n_done))
    >>> list(run_trials([2, 3], lambda k, report: k * k, [1.0, 3.0], progress))
    [4, 9]
    >>> shares
    [(0.25, 1), (1.0, 2)]
    """
    ends = list(accumulate(seconds, initial=0.0))
    for k, trial in enumerate(trials):
        if cancel and cancel():
            raise Cancelled(f"stopped after {k} of {len(trials)} settings")
        report = progress_of_part(
            progress, ends[k] / ends[-1], ends[k + 1] / ends[-1], k * n_pieces
        )
        yield run(trial, report)
        report(1.0, n_pieces)
