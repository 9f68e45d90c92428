"""All experiments of the paper in their order: progress, cancel, and failures that stop nothing."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.paper.conditional import CONDITIONAL
from ccwsim.paper.dense_data import DENSE_DATA
from ccwsim.paper.experiment import Experiment, Outcome, Run
from ccwsim.paper.extent import FULL, Extent
from ccwsim.paper.grid_size import GRID_SIZE
from ccwsim.paper.inputs import Inputs
from ccwsim.paper.limits import LIMITS
from ccwsim.paper.sampled_data import SAMPLED_DATA
from ccwsim.paper.statistics import STATISTICS
from ccwsim.paper.stone_wall import STONE_WALL
from ccwsim.paper.three_facies import THREE_FACIES
from ccwsim.paper.times_with_data import TIMES_WITH_DATA
from ccwsim.paper.unconditional import UNCONDITIONAL
from ccwsim.paper.variability import VARIABILITY

EXPERIMENTS = (
    UNCONDITIONAL,
    CONDITIONAL,
    STATISTICS,
    SAMPLED_DATA,
    TIMES_WITH_DATA,
    VARIABILITY,
    GRID_SIZE,
    THREE_FACIES,
    DENSE_DATA,
    STONE_WALL,
    LIMITS,
)
"""In the order of the paper, as far as it is known."""


@dataclass(frozen=True, eq=False)
class Finished:
    """An experiment that came to an end: its outcome, or why there is none.

    Attributes
    ----------
    experiment : Experiment
    outcome : Outcome or None
    problem : str
        Empty where there is an outcome.
    seconds : float
        How long it took.
    """

    experiment: Experiment
    outcome: Outcome | None
    problem: str
    seconds: float


@dataclass(frozen=True, eq=False)
class Reproduction:
    """What a run of the experiments gave.

    Attributes
    ----------
    inputs, extent, seed
        What it was run on and how.
    finished : tuple of Finished
        In the order of the experiments.
    stopped : bool
        Whether the user stopped it before the end.
    seconds : float
    """

    inputs: Inputs
    extent: Extent
    seed: int
    finished: tuple[Finished, ...]
    stopped: bool
    seconds: float

    @property
    def words(self) -> Counter[str]:
        """How often each word of a verdict was given."""
        outcomes = [f.outcome for f in self.finished if f.outcome is not None]
        return Counter(j.word for outcome in outcomes for j in outcome.judgements)


def reproduce(
    inputs: Inputs | None = None,
    extent: Extent = FULL,
    seed: int = 0,
    progress: Callable[[float, int], None] | None = None,
    cancel: Callable[[], bool] | None = None,
    experiments: Sequence[Experiment] = EXPERIMENTS,
    on_finished: Callable[[Finished], None] | None = None,
) -> Reproduction:
    """Run the experiments of the paper.

    Parameters
    ----------
    inputs : Inputs, optional
        The bundled images where left out.
    extent : Extent
    seed : int
    progress : callable, optional
        Called as progress(fraction, n_done); n_done counts experiments.
    cancel : callable, optional
        Asked often; returns True to stop. What was finished before stays.
    experiments : sequence of Experiment
    on_finished : callable, optional
        Called with each experiment that came to an end.

    Examples
    --------
    >>> reproduce(experiments=()).stopped
    False
    """
    start, finished, stopped = time.perf_counter(), [], False
    cancelled = cancel or (lambda: False)
    ends = list(accumulate((e.weight for e in experiments), initial=0.0))
    for k, experiment in enumerate(experiments):

        def share(done: float, k: int = k) -> None:
            if progress:
                progress((ends[k] + done * experiments[k].weight) / ends[-1], k)

        run = Run(inputs or Inputs(), extent, seed, share, cancelled)
        try:
            if cancelled():
                raise Cancelled("stopped")
            finished.append(_tried(experiment, run))
        except Cancelled:
            stopped = True
            break
        if on_finished:
            on_finished(finished[-1])
        if progress:
            progress(ends[k + 1] / ends[-1], k + 1)
    seconds = time.perf_counter() - start
    return Reproduction(inputs or Inputs(), extent, seed, tuple(finished), stopped, seconds)


def with_largest_grid(extent: Extent, side: int | None) -> Extent:
    """Return an extent whose times go up to a grid of `side` × `side` cells.

    Raises
    ------
    CCWSIMError
        For a side that is too small or too large.

    Examples
    --------
    >>> with_largest_grid(FULL, 5000).timed_sides
    (1000, 2000, 3000, 4000, 5000)
    """
    if side is None:
        return extent
    if not 64 <= side <= 10_000:
        raise CCWSIMError(f"the largest grid's side {side} must be from 64 to 10000 cells")
    return replace(extent, timed_sides=tuple(round(side * k / 5) for k in range(1, 6)))


def _tried(experiment: Experiment, run: Run) -> Finished:
    """Run one experiment; whatever goes wrong in it is told, and the others go on."""
    start = time.perf_counter()
    outcome, problem = None, ""
    try:
        outcome = experiment.run(run)
    except Cancelled:
        raise
    except CCWSIMError as error:
        problem = str(error)
    except MemoryError:
        problem = "it does not fit into memory"
    except Exception as error:
        problem = f"{type(error).__name__}: {error}"
    return Finished(experiment, outcome, problem, time.perf_counter() - start)
