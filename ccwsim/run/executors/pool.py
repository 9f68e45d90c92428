"""Batches for a pool of processes, or any other executor of `concurrent.futures`."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import BrokenExecutor, Executor, Future

from ccwsim.model.errors import CCWSIMError
from ccwsim.run.executors.batches import without_program
from ccwsim.run.executors.flags import FileFlag
from ccwsim.run.executors.runner import Work
from ccwsim.run.executors.serialization import name_of, packed
from ccwsim.run.executors.worker import BatchRequest, Reply, simulate_batch


class Pool:
    """Sends batches to an executor, which stays open.

    An order names its study alone; a worker that does not know it says so, and the batch is sent
    again with the study.

    Parameters
    ----------
    executor : concurrent.futures.Executor
    n_workers : int
        How many batches it works on at once, where it does not tell.
    """

    def __init__(self, executor: Executor, n_workers: int) -> None:
        self._executor = executor
        self._n_workers = getattr(executor, "_max_workers", None) or n_workers

    def open(self, work: Work) -> None:
        """Pack the study."""
        self._content = packed(work.study)
        self._name = name_of(work.study)
        self._keep_sources = work.keep_sources
        self._flag = FileFlag()

    def n_workers(self) -> int:
        """Say how many batches can be worked on at once."""
        return self._n_workers

    def send(self, numbers: tuple[int, ...], whole: bool) -> Future[Reply]:
        """Submit a batch."""
        order = BatchRequest(self._name, numbers, self._keep_sources, self._flag)
        try:
            return self._executor.submit(simulate_batch, order, self._content if whole else None)
        except BrokenExecutor:
            raise
        except RuntimeError as error:
            raise CCWSIMError(f"the executor takes no work: {error}; give an open one") from error

    def fetch(self, future: Future[Reply]) -> Reply:
        """Return the answer."""
        return future.result()

    def shares(self, numbers: Iterable[int]) -> dict[int, float]:
        """Return what workers of this machine told last of some realizations."""
        return self._flag.shares(numbers)

    def lost(self, error: BaseException) -> bool:
        """Say what ended a batch; a broken pool cannot be used any more."""
        if isinstance(error, BrokenExecutor):
            raise CCWSIMError(
                "a worker process ended before its work was done, perhaps for lack of memory; "
                "use fewer workers or a smaller grid, and a new executor"
            ) from error
        if isinstance(error, ImportError):
            raise without_program(error) from error
        return False

    def stop(self) -> None:
        """Raise the flag."""
        self._flag.set()
