"""Batches of realizations, which are sent to workers and collected a few at a time."""

from collections import deque
from collections.abc import Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from typing import Any

from ccwsim.jobs.workers import POLL_SECONDS, Cancel, Progress
from ccwsim.model.errors import CCWSIMError, refused
from ccwsim.run.executors import worker
from ccwsim.run.executors.threads import Take, Work

BATCH_SECONDS = 0.25
"""Intended duration of a batch in seconds, which is long compared with the transfer of a batch."""
BATCH_BYTES = 64_000_000
BATCHES_PER_WORKER = 2
"""Number of batches that each worker has at a time, so that no worker waits for its next batch."""
STOP_SECONDS = 0.7
"""Seconds that running batches have after a stop to return their finished realizations."""


class BatchBackend:
    """Sends batches to an executor of `concurrent.futures`, which stays open.

    A request contains only the key of its study. If the worker lacks the study, the batch is sent
    again with the study. `n_workers` applies only if the executor does not report its number of
    workers.
    """

    def __init__(self, executor: Any, n_workers: int) -> None:
        self._executor = executor
        self._n_workers = getattr(executor, "_max_workers", None) or n_workers

    def open(self, work: Work) -> None:
        """Prepare to send batches of the study of `work`."""
        self._content, self._key = worker.serialized(work.study), worker.study_key(work.study)
        self._keep_sources = work.keep_sources
        self._flag: Any = worker.FileFlag()

    def n_workers(self) -> int:
        """Number of batches that run at a time."""
        return self._n_workers

    def submit(self, numbers: tuple[int, ...], with_study: bool) -> Future[worker.Reply]:
        """Send a batch; if requested, send its study too."""
        request = self._request(numbers)
        content = self._content if with_study else None
        try:
            return self._executor.submit(worker.simulate_batch, request, content)
        except BrokenExecutor:
            raise
        except RuntimeError as error:
            raise CCWSIMError(f"the executor takes no work: {error}; use a new one") from error

    def shares(self, numbers: Iterable[int]) -> dict[int, float]:
        """Return which share of each realization is finished, as its worker last reported."""
        return self._flag.shares(numbers)

    def recovers(self, error: BaseException) -> bool:
        """Return whether to resend a failed batch; raise `CCWSIMError` if resending cannot help."""
        if isinstance(error, BrokenExecutor):
            raise refused("worker_ended") from error
        if isinstance(error, ImportError):
            raise refused("worker_cannot_import", error=error) from error
        return False

    def stop(self) -> None:
        """Ask the workers to stop."""
        self._flag.set()

    def _request(self, numbers: tuple[int, ...]) -> worker.BatchRequest:
        return worker.BatchRequest(self._key, numbers, self._keep_sources, self._flag)


class BatchRunner:
    """Runs the realizations of `work` in batches that a backend sends to its workers."""

    def __init__(self, backend: BatchBackend, work: Work) -> None:
        self._backend, self._work = backend, work
        self._finished: list[int] = []
        self._left = deque(range(work.first, work.first + work.n))
        self._with_study: deque[tuple[int, ...]] = deque()
        self._out: dict[Future[worker.Reply], tuple[int, ...]] = {}
        self._seconds = 0.0

    def prepare(self, progress: Progress | None, cancel: Cancel | None) -> bool:
        """Open the backend and return True."""
        if progress:
            progress(0.0, 0)
        self._backend.open(self._work)
        return True

    def run(self, take: Take, progress: Progress | None, cancel: Cancel | None) -> list[int]:
        """Run the realizations as `ThreadRunner.run` does; batches may run in any order."""
        n = self._work.n
        try:
            while len(self._finished) < n:
                self._send()
                self._receive(take)
                n_done = len(self._finished)
                if progress:
                    sent = [number for batch in self._out.values() for number in batch]
                    progress((n_done + sum(self._backend.shares(sent).values())) / n, n_done)
                if n_done < n and cancel and cancel():
                    break
        finally:
            self._stop(take)
        return sorted(self._finished)

    def _send(self) -> None:
        """Send batches until every worker has `BATCHES_PER_WORKER`."""
        at_once = BATCHES_PER_WORKER * self._backend.n_workers()
        while len(self._out) < at_once and (self._with_study or self._left):
            with_study = bool(self._with_study)
            batch = self._with_study.popleft() if with_study else self._next_batch(at_once)
            try:
                self._out[self._backend.submit(batch, with_study)] = batch
            except Exception as error:
                self._recover(batch, error)
                return

    def _receive(self, take: Take) -> None:
        """Wait a moment for replies, and collect the replies that arrived."""
        done, _ = wait(self._out, POLL_SECONDS, FIRST_COMPLETED)
        for future in done:
            batch = self._out.pop(future)
            error = CancelledError() if future.cancelled() else future.exception()
            if error is not None:
                self._recover(batch, error)
            elif not future.result().known:
                self._with_study.append(batch)
            else:
                self._keep(take, batch, future.result())

    def _stop(self, take: Take) -> None:
        """Cancel waiting batches, stop running batches, and collect replies that come in time."""
        self._backend.stop()
        done, _ = wait([future for future in self._out if not future.cancel()], STOP_SECONDS)
        for future in done:
            if future.exception() is None:
                self._keep(take, self._out[future], future.result())

    def _recover(self, batch: tuple[int, ...], error: BaseException) -> None:
        if not self._backend.recovers(error):
            raise error
        self._left.extendleft(reversed(batch))

    def _next_batch(self, at_once: int) -> tuple[int, ...]:
        cells = self._work.study.grid.n_cells
        fit = min(BATCH_SECONDS / self._seconds if self._seconds else 1, BATCH_BYTES / cells)
        share = -(-len(self._left) // at_once)
        size = max(min(int(fit), share), 1)
        return tuple(self._left.popleft() for _ in range(min(size, len(self._left))))

    def _keep(self, take: Take, batch: tuple[int, ...], reply: worker.Reply) -> None:
        for number, realization in zip(batch, reply.realizations, strict=False):
            self._finished.append(number - self._work.first)
            take(self._finished[-1], realization)
        self._left.extendleft(reversed(batch[len(reply.realizations) :]))
        if reply.realizations:
            self._seconds = reply.seconds
