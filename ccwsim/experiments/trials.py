"""Trials: studies that are simulated to compare settings or to measure times, and their results."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Any, TypeVar

import numpy as np

from ccwsim import Cancelled, Ensemble, Parameters
from ccwsim.engine.prepared_image import fresh_images
from ccwsim.model import UNWATCHED, Floats, Ints, Study, Watch
from ccwsim.run.simulation import simulate_study

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Trial(Study):
    """A study to simulate; its inputs are checked to fit together when it is simulated."""

    checked: bool = field(default=False, kw_only=True)
    n_sampled: int = field(default=0, kw_only=True)
    """Number of hard data that are sampled for this trial, in place of `hard_data`."""

    @property
    def n_data(self) -> int:
        """Number of hard data."""
        return self.n_sampled or self.hard_data.n

    @fresh_images()
    def simulate(self, n_realizations: int, **options: Any) -> Ensemble:
        """Simulate with options of `simulate_study`; CPU times include all preparation."""
        return simulate_study(self, n_realizations, **options)


@dataclass(frozen=True, eq=False)
class TrialResult:
    """The CPU times of a trial, and its data that are not honoured."""

    trial: Trial
    cpu_seconds: Floats  # shape (n,): CPU seconds of each realization
    n_mismatched: Ints  # shape (n,): number of hard data not honoured

    @property
    def parameters(self) -> Parameters:
        """The parameters of the trial."""
        return self.trial.parameters

    @property
    def seconds(self) -> float:
        """Median CPU time; it hardly changes if other processes interrupt one realization."""
        return float(np.median(self.cpu_seconds))


def run_trials(
    trials: Sequence[Item],
    function: Callable[[Item, Watch], Result],
    seconds: Sequence[float],
    watch: Watch = UNWATCHED,
    n_pieces: int = 1,
) -> Iterator[Result]:
    """Yield the results of function(trial, watch of the trial) in the order of `trials`.

    `watch` gets the finished share of the expected `seconds` of all trials, and the number of
    finished pieces. Each trial has `n_pieces`; if this is more than one, pieces of an unfinished
    trial are counted. Raises `Cancelled` before a trial if `watch` asks to stop.

    Examples
    --------
    >>> shares = []
    >>> progress = lambda share, n_done: shares.append((share, n_done))
    >>> list(run_trials([2, 3], lambda k, watch: k * k, [1.0, 3.0], Watch(progress)))
    [4, 9]
    >>> shares
    [(0.25, 1), (1.0, 2)]
    """
    ends = list(accumulate(seconds, initial=0.0))
    for k, trial in enumerate(trials):
        if watch.cancel():
            raise Cancelled(f"stopped after {k} of {len(trials)} settings")
        low, high = ends[k] / ends[-1], ends[k + 1] / ends[-1]
        yield function(trial, watch.part(low, high, k * n_pieces, counts=n_pieces > 1))
        watch.progress(high, (k + 1) * n_pieces)
