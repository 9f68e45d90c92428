"""Realizations on threads of this process."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.realization import (
    Realization,
    compile_kernels,
    is_compiled,
    simulate_realization,
)
from ccwsim.jobs.workers import Progress, Watch, run_all
from ccwsim.model.study import Study

Take = Callable[[int, Realization], None]
"""Called as take(k, realization), in any order; k counts from 0 within the run."""
Cancel = Callable[[], bool]


class Work(NamedTuple):
    """Realizations `first` to `first` + n − 1 of a study."""

    study: Study
    first: int
    n: int
    keep_sources: bool


class ThreadRunner:
    """Runs realizations on threads: kernels release the interpreter lock.

    A given `pool` stays open, and its number of threads applies.
    """

    def __init__(self, n_workers: int, pool: ThreadPoolExecutor | None = None) -> None:
        self._n_workers = n_workers
        self._pool = pool

    def prepare(self, work: Work, progress: Progress | None, cancel: Cancel | None) -> bool:
        """Prepare the image and compile; return False if `cancel` returned True meanwhile."""
        self._image = image = PreparedImage(work.study)
        if is_compiled(work.study, image):
            return True
        waiting = (lambda *_: progress(0.0, 0)) if progress else None
        return bool(
            run_all(
                lambda _, watch: compile_kernels(work.study, image, watch), 1, 1, waiting, cancel
            )
        )

    def run(
        self, work: Work, take: Take, progress: Progress | None, cancel: Cancel | None
    ) -> list[int]:
        """Pass each realization to `take`; return the finished ones, ascending, from 0.

        All are finished unless `cancel` returned True.
        """

        def task(k: int, watch: Watch) -> None:
            number, image = work.first + k, self._image
            take(k, simulate_realization(work.study, number, image, work.keep_sources, watch))

        return run_all(task, work.n, self._n_workers, progress, cancel, self._pool)
