"""Realizations on threads of this process."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

from ccwsim.engine.prepared_image import PreparedImage, keep, prepared_image
from ccwsim.engine.realization import (
    Realization,
    compile_kernels,
    is_compiled,
    simulate_realization,
)
from ccwsim.jobs.workers import run_all, without_cores
from ccwsim.model import Study, Watch

Take = Callable[[int, Realization], None]
"""Callback take(k, realization), called in any order; k counts from 0 within the run."""


class Work(NamedTuple):
    """Realizations `first` to `first` + n − 1 of a study."""

    study: Study
    first: int
    n: int
    keep_sources: bool


class ThreadRunner:
    """Runs realizations on threads or a given `pool`; kernels release the interpreter lock."""

    loads_kernels = True  # whether this process runs the kernels

    def __init__(
        self,
        work: Work,
        n_workers: int,
        pool: ThreadPoolExecutor | None = None,
        prepared: PreparedImage | None = None,
    ) -> None:
        self._work, self._n_workers, self._pool = work, n_workers, pool
        self._image = prepared or prepared_image(work.study)

    def prepare(self, watch: Watch) -> bool:
        """Prepare the image and compile the kernels; return False if the run was cancelled."""
        if is_compiled(self._image):
            return True
        with without_cores():  # other tasks with cores wait for the same lock and kernels
            compiled = run_all(
                lambda _, part: compile_kernels(self._image, part, self.loads_kernels),
                n=1,
                n_workers=1,
                watch=watch.part(0.0, 0.0, counts=False),
            )
        return bool(compiled)

    def run(self, take: Take, watch: Watch) -> list[int]:
        """Pass each realization to `take`; return the indices k of the finished realizations."""
        _, first, n, keep_sources = self._work

        def task(k: int, part: Watch) -> None:
            take(k, simulate_realization(self._image, first + k, keep_sources, part))

        try:
            return run_all(task, n, self._n_workers, watch, self._pool)
        finally:
            keep(self._image)
