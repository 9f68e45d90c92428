"""Realizations on threads of this process."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.realization import compile_kernels, is_compiled, simulate_realization
from ccwsim.run.executors.runner import Take, Work
from ccwsim.system.workers import Progress, Watch, run_all


class Threads:
    """Runs realizations on threads: kernels let go of the interpreter lock.

    Parameters
    ----------
    n_workers : int
        How many threads.
    pool : ThreadPoolExecutor, optional
        The caller's own, which stays open; `n_workers` is not used then.
    """

    def __init__(self, n_workers: int, pool: ThreadPoolExecutor | None = None) -> None:
        self._n_workers = n_workers
        self._pool = pool

    def prepare(self, work: Work, progress: Progress | None) -> None:
        """Prepare the image and compile."""
        self._image = image = PreparedImage(work.study)
        if is_compiled(work.study, image):
            return
        waiting = (lambda *_: progress(0.0, 0)) if progress else None
        run_all(lambda _, watch: compile_kernels(work.study, image, watch), 1, 1, waiting)

    def run(
        self,
        work: Work,
        take: Take,
        progress: Progress | None,
        cancel: Callable[[], bool] | None,
    ) -> list[int]:
        """Simulate one realization a task."""

        def task(k: int, watch: Watch) -> None:
            number, image = work.first + k, self._image
            take(k, simulate_realization(work.study, number, image, work.keep_sources, watch))

        return run_all(task, work.n, self._n_workers, progress, cancel, self._pool)
