"""Run numbered tasks on threads, with progress, and stop them when asked."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar, copy_context
from threading import Event
from typing import Protocol

from ccwsim.jobs.cores import CoreLease, Cores, Usage
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.system.machine import n_cores

POLL_SECONDS = 0.05
"""Seconds between two checks of progress and cancel."""

Progress = Callable[[float, int], None]
"""Called as progress(fraction, n_done): share of all work, and how many tasks are finished."""
Cancel = Callable[[], bool]
"""Returns whether the work is to stop."""

_shared_cores: Cores | None = None


def share_cores() -> None:
    """Let all runs of this process share its cores from now on: one task a core computes."""
    global _shared_cores
    if _shared_cores is None:
        _shared_cores = Cores(n_cores())


_asked_to_stop: ContextVar[Cancel | None] = ContextVar("asked_to_stop", default=None)
_usage: ContextVar[Usage | None] = ContextVar("usage", default=None)


@contextmanager
def stoppable(asked_to_stop: Cancel) -> Iterator[None]:
    """Let `check_stop` end the work of this thread, and of tasks that it runs, when asked.

    All runs of the work share one `Usage` of the cores.
    """
    token, usage = _asked_to_stop.set(asked_to_stop), _usage.set(Usage())
    try:
        yield
    finally:
        _asked_to_stop.reset(token)
        _usage.reset(usage)


def check_stop() -> None:
    """Raise `Cancelled` if the work of this thread was asked to stop; long loops call it."""
    asked = _asked_to_stop.get()
    if asked is not None and asked():
        raise Cancelled("stopped")


class StopFlag(Protocol):
    """Tells whether work is to stop, such as a `threading.Event`."""

    def is_set(self) -> bool: ...


class Watch:
    """Progress and stop of a running task, and its right to compute."""

    def __init__(self, stop: StopFlag) -> None:
        self.share = 0.0
        """Share of the task that is done, 0 … 1."""
        self.lease: CoreLease | None = None
        """Set if the task shares the cores with other runs."""
        self._stop = stop

    def report(self, share: float) -> None:
        """Store the share that is done; raise `Cancelled` if the task was asked to stop."""
        self.share = share
        self.check()

    def check(self) -> None:
        """Raise `Cancelled` in a task that was asked to stop; let others compute meanwhile."""
        if self.lease is not None and not self._stop.is_set():
            self.lease.yield_if_due()
        if self._stop.is_set():
            raise Cancelled("the simulation was stopped")


def run_all(
    task: Callable[[int, Watch], None],
    n: int,
    n_workers: int,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
    pool: ThreadPoolExecutor | None = None,
) -> list[int]:
    """Run task(number, watch) for 0 … n − 1 and return the numbers that were finished.

    Fewer than n are finished only if `cancel` returned True. The first error of a task stops
    the others and is raised. `progress` and `cancel` are called in the caller's own thread.
    A `pool` that is given stays open.
    """
    stop = Event()
    cores, usage = _shared_cores, _usage.get() or Usage()

    def run(number: int, watch: Watch) -> None:
        """Run a task when it has a core; one that was stopped before does not begin."""
        if cores is None:
            task(number, watch)
            return
        with cores.lease(usage, stop) as watch.lease:
            watch.check()
            task(number, watch)

    watches = [Watch(stop) for _ in range(n)]
    with nullcontext(pool) if pool else ThreadPoolExecutor(min(n, n_workers)) as threads:
        futures: list[Future[None]] = []
        try:
            futures += [_submit(threads, run, k, watches[k]) for k in range(n)]
            pending = set(futures)
            while pending:
                finished, pending = wait(pending, POLL_SECONDS)
                for future in finished:
                    future.result()
                if progress:
                    progress(sum(w.share for w in watches) / n, n - len(pending))
                if pending and cancel and cancel():
                    break
        finally:
            stop.set()
            if cores:
                cores.let_stopped_go()
            for future in futures:
                future.cancel()
            wait(futures)
    return [k for k, f in enumerate(futures) if not f.cancelled() and f.exception() is None]


def _submit(
    pool: ThreadPoolExecutor, run: Callable[[int, Watch], None], number: int, watch: Watch
) -> Future[None]:
    try:
        return pool.submit(copy_context().run, run, number, watch)
    except RuntimeError as error:
        raise CCWSIMError(f"the executor takes no work: {error}; give an open one") from error
