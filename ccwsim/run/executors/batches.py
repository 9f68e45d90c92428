"""Realizations in batches: sent out a few at a time, taken in as they come back."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable
from queue import Empty, SimpleQueue
from typing import Any, Protocol

from ccwsim.model.errors import CCWSIMError
from ccwsim.run.executors.runner import Take, Work
from ccwsim.run.executors.worker import Reply
from ccwsim.system.workers import POLL_SECONDS, Progress

BATCH_SECONDS = 0.25
"""What a batch should take: long beside its way there and back, short beside a second."""
BATCH_BYTES = 64_000_000
AHEAD = 2
"""Batches under way for each worker, so that none waits for the next."""
PATIENCE = 0.7
"""Seconds that running batches get to hand over what they have, once they were asked to stop."""


class BatchBackend(Protocol):
    """Takes batches to workers and back."""

    def open(self, work: Work) -> None:
        """Get ready to send batches of a study."""
        ...

    def n_workers(self) -> int:
        """Say how many batches can be worked on at once."""
        ...

    def send(self, numbers: tuple[int, ...], whole: bool) -> Any:
        """Send a batch, with the `whole` study or with its name; return its future."""
        ...

    def fetch(self, future: Any) -> Reply:
        """Return what a future, which is done, has to give; called on any thread."""
        ...

    def shares(self, numbers: Iterable[int]) -> dict[int, float]:
        """Say how much of these realizations was done when workers last told, 0 … 1."""
        ...

    def lost(self, error: BaseException) -> bool:
        """Say whether a batch that ended in an error is to be sent again; raise what is worse."""
        ...

    def stop(self) -> None:
        """Tell the workers that nothing more is wanted."""
        ...


class Batches:
    """Runs realizations in batches that a courier takes to its workers."""

    def __init__(self, courier: BatchBackend) -> None:
        self._courier = courier

    def prepare(self, work: Work, progress: Progress | None) -> None:
        """Let the courier get ready."""
        if progress:
            progress(0.0, 0)
        self._courier.open(work)

    def run(
        self,
        work: Work,
        take: Take,
        progress: Progress | None,
        cancel: Callable[[], bool] | None,
    ) -> list[int]:
        """Send batches and take in what comes back, in any order."""
        tour = _Dispatch(self._courier, work, take)
        try:
            while len(tour.finished) < work.n:
                tour.send_out()
                tour.take_in(POLL_SECONDS)
                n_done = len(tour.finished)
                if progress:
                    progress((n_done + tour.under_way()) / work.n, n_done)
                if n_done < work.n and cancel and cancel():
                    break
        finally:
            tour.end()
        return sorted(tour.finished)


class _Dispatch:
    """The batches of one run: which are still to be sent, and which are under way."""

    def __init__(self, courier: BatchBackend, work: Work, take: Take) -> None:
        self.finished: list[int] = []
        self._courier, self._work, self._take = courier, work, take
        self._left = deque(range(work.n))
        self._seconds = 0.0
        self._whole: deque[tuple[int, ...]] = deque()  # to be sent with the study
        self._out: dict[int, tuple[Any, tuple[int, ...]]] = {}
        self._back: SimpleQueue[tuple[int, Reply | BaseException]] = SimpleQueue()
        self._n_sent = 0

    def send_out(self) -> None:
        """Send batches until every worker has enough."""
        at_once = AHEAD * self._courier.n_workers()
        while len(self._out) < at_once and (self._whole or self._left):
            whole = bool(self._whole)
            batch = self._whole.popleft() if whole else self._next_batch(at_once)
            numbers = tuple(self._work.first + k for k in batch)
            try:
                future = self._courier.send(numbers, whole)
            except Exception as error:
                if not self._courier.lost(error):
                    raise
                self._left.extendleft(reversed(batch))
                return
            token = self._n_sent = self._n_sent + 1
            self._out[token] = future, batch
            # The answer is fetched where it arrives, so that this thread can look at `cancel`.
            future.add_done_callback(lambda f, token=token: self._fetch(f, token))

    def take_in(self, seconds: float) -> None:
        """Wait for answers, at most so long, and take in all that are there."""
        try:
            answers = [self._back.get(timeout=seconds)]
            while not self._back.empty():
                answers.append(self._back.get())
        except Empty:
            return
        for token, answer in answers:
            _, batch = self._out.pop(token)
            if isinstance(answer, BaseException):
                if not self._courier.lost(answer):
                    raise answer
                self._left.extendleft(reversed(batch))
            elif not answer.known:
                self._whole.append(batch)
            else:
                self._keep(batch, answer)

    def under_way(self) -> float:
        """Say how many realizations what is done of unfinished ones makes."""
        sent = [self._work.first + k for _, batch in self._out.values() for k in batch]
        return sum(self._courier.shares(sent).values())

    def end(self) -> None:
        """Drop what waits, stop what runs, and take in what it gives at once."""
        self._courier.stop()
        for future, _ in self._out.values():
            future.cancel()
        until = time.monotonic() + PATIENCE
        while self._out and time.monotonic() < until:
            try:
                token, answer = self._back.get(timeout=max(until - time.monotonic(), 0.001))
            except Empty:
                break
            _, batch = self._out.pop(token)
            if isinstance(answer, Reply):
                self._keep(batch, answer)

    def _fetch(self, future: Any, token: int) -> None:
        try:
            answer = self._courier.fetch(future)
        except BaseException as error:  # some mean by it that a batch was cancelled
            answer = error
        self._back.put((token, answer))

    def _next_batch(self, at_once: int) -> tuple[int, ...]:
        cells = self._work.study.grid.ny * self._work.study.grid.nx
        fit = min(BATCH_SECONDS / self._seconds if self._seconds else 1, BATCH_BYTES / cells)
        share = -(-len(self._left) // at_once)
        size = max(min(int(fit), share), 1)
        return tuple(self._left.popleft() for _ in range(min(size, len(self._left))))

    def _keep(self, batch: tuple[int, ...], reply: Reply) -> None:
        for k, realization in zip(batch, reply.realizations, strict=False):
            self._take(k, realization)
            self.finished.append(k)
        self._left.extendleft(reversed(batch[len(reply.realizations) :]))
        if reply.realizations:
            self._seconds = reply.seconds


def without_program(error: ImportError) -> CCWSIMError:
    """Say that the workers lack something."""
    return CCWSIMError(
        f"a worker cannot import what it needs ({error}); install ccwsim and its requirements "
        "where the workers run"
    )
