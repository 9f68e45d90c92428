"""A run that shows a few realizations at once, and the rest as they come."""

from __future__ import annotations

import time
from collections.abc import Callable

from ccwsim.model.choices import Choices
from ccwsim.model.ensemble import Ensemble, joined
from ccwsim.model.errors import Cancelled
from ccwsim.system.workers import n_cores
from ccwsim.ui.jobs.admission import Demand
from ccwsim.ui.jobs.job import NOTHING, Cancel, Job, Progress

AT_ONCE = 0.3
"""Seconds that the first part may take."""
NEXT_PART = 1.0
"""Seconds of the second part; each later one takes twice as long, as drawing costs time too."""
FEWEST = 2
NEARLY_ALL = 0.7
"""A part that is so large a share of what is left takes all of it."""


class LiveRun(Job[Ensemble]):
    """A simulation in parts: `partial` is what is finished so far, `result` what one run gives.

    Parameters
    ----------
    some : callable
        Called as some(first, n, progress, cancel) → Ensemble of realizations first … first+n−1.
    choices : Choices
        The study.
    n_first : int
        Realizations of the first part.
    wanted : int
        Which realization was large before; it is again as soon as it is there.
    demand : Demand
        What it asks of the server.
    """

    def __init__(
        self,
        some: Callable[[int, int, Progress, Cancel], Ensemble],
        choices: Choices,
        n_first: int,
        wanted: int = 0,
        demand: Demand = NOTHING,
    ) -> None:
        self._some = some
        self._n, self._n_first = choices.n_realizations, n_first
        self._wanted, self._put = wanted, wanted
        super().__init__(self._in_parts, choices, demand)

    def place_of(self, shown: int, n: int) -> int:
        """Return which of n is large: the wanted one, unless the user chose another since."""
        if shown == self._put:
            self._put = min(self._wanted, n - 1)
            return self._put
        return min(shown, n - 1)

    def _in_parts(self, progress: Progress, cancel: Cancel) -> Ensemble:
        n, size, budget = self._n, min(self._n_first, self._n), NEXT_PART
        start = time.monotonic()
        whole = self._with_part(None, size, progress, cancel)
        while whole.n < n:
            self.give(whole)
            each = (time.monotonic() - start) / whole.n
            size = part_size(n - whole.n, budget / each)
            whole = self._with_part(whole, size, progress, cancel)
            budget *= 2
        return whole

    def _with_part(
        self, before: Ensemble | None, size: int, progress: Progress, cancel: Cancel
    ) -> Ensemble:
        done = before.n if before else 0

        def report(fraction: float, n_done: int) -> None:
            progress((done + fraction * size) / self._n, done + n_done)

        parts = [before] if before else []
        try:
            return joined([*parts, self._some(done, size, report, cancel)])
        except Cancelled as stopped:
            parts += [stopped.ensemble] if stopped.ensemble else []
            ended = joined(parts) if parts else None
            said = f"stopped after {ended.n if ended else 0} of {self._n} realizations"
            raise Cancelled(said, ended) from None


def first_part(choices: Choices, latest: Ensemble | None) -> int:
    """Return how many realizations are likely to be finished at once, by the pace of the latest."""
    if latest is None or latest.revised or latest.wall_seconds <= 0:
        return FEWEST
    cells = choices.grid.ny * choices.grid.nx
    each = latest.wall_seconds / latest.n * cells / (latest.grid.ny * latest.grid.nx)
    return part_size(choices.n_realizations, AT_ONCE / each)


def part_size(left: int, fits: float) -> int:
    """Return how many of the realizations that are left make the next part.

    Parameters
    ----------
    left : int
    fits : float
        How many the time would do for.

    Examples
    --------
    >>> part_size(100, 0.2), part_size(100, 31.0), part_size(12, 10.0)
    (2, 30, 12)
    """
    cores = n_cores()
    size = max(int(fits) // cores * cores, cores, FEWEST)
    return left if fits >= NEARLY_ALL * left else min(size, left)
