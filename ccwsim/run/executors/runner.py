"""What `simulate` asks of the place where realizations are simulated."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

from ccwsim.engine.realization import Realization
from ccwsim.model.study import Study
from ccwsim.system.workers import Progress

Take = Callable[[int, Realization], None]
"""Called as take(k, realization), in any order; k counts from 0 within the run."""


class Work(NamedTuple):
    """Realizations `first` to `first` + n − 1 of a study.

    Attributes
    ----------
    study : Study
    first, n : int
    keep_sources : bool
        As `simulate` has it.
    """

    study: Study
    first: int
    n: int
    keep_sources: bool


class Runner(Protocol):
    """Simulates the realizations of a study somewhere."""

    def prepare(self, work: Work, progress: Progress | None) -> None:
        """Do what comes before the first realization, such as to compile."""
        ...

    def run(
        self,
        work: Work,
        take: Take,
        progress: Progress | None,
        cancel: Callable[[], bool] | None,
    ) -> list[int]:
        """Hand each realization to `take`; return which were finished, ascending, from 0.

        Fewer than all are finished only where `cancel` returned True.
        """
        ...
