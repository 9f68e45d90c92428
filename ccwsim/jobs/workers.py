"""Run numbered tasks on threads, with progress, and stop them when asked."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar, copy_context
from functools import partial
from threading import Event
from typing import Protocol

from ccwsim.jobs.scheduler import Cores, Lease, Usage
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.system.machine import n_cores

POLL_SECONDS = 0.05  # seconds between two checks of progress and cancel

Progress = Callable[[float, int], None]  # called with the finished share and the finished tasks
Cancel = Callable[[], bool]  # returns True if the work should stop


def progress_of_part(
    progress: Progress | None,
    low: float,
    high: float,
    n_before: int = 0,
    cancel: Cancel | None = None,
) -> Callable[..., None]:
    """Return a function report(share, n_done=0) for a part of the work, from `low` to `high`.

    `progress` is called with the finished share of the whole work, and with the number of finished
    tasks, which includes the `n_before` tasks of earlier parts. The function raises `Cancelled` if
    `cancel` returns True.
    """

    def report(share: float, n_done: int = 0) -> None:
        if cancel and cancel():
            raise Cancelled("stopped")
        if progress:
            progress((1 - share) * low + share * high, n_before + n_done)

    return report


_shared_cores: Cores | None = None


def share_cores() -> None:
    """Make all later runs of this process share the cores, with one active task per core."""
    global _shared_cores
    if _shared_cores is None:
        _shared_cores = Cores(n_cores())


_asked_to_stop: ContextVar[Cancel | None] = ContextVar("asked_to_stop", default=None)
_usage: ContextVar[Usage | None] = ContextVar("usage", default=None)
_needs_no_core: ContextVar[bool] = ContextVar("needs_no_core", default=False)


@contextmanager
def stoppable(asked_to_stop: Cancel) -> Iterator[None]:
    """Make `check_stop` end the work of this thread and of its tasks if `asked_to_stop()` is True.
    The core usage of this work is the sum over all of its runs.
    """
    token, usage = _asked_to_stop.set(asked_to_stop), _usage.set(Usage())
    try:
        yield
    finally:
        _asked_to_stop.reset(token)
        _usage.reset(usage)


@contextmanager
def without_cores() -> Iterator[None]:
    """Let quick tasks of a thread run without a core: it holds a lock that others wait for."""
    token = _needs_no_core.set(True)
    try:
        yield
    finally:
        _needs_no_core.reset(token)


def check_stop() -> None:
    """Raise `Cancelled` if the work of this thread was asked to stop; called by long loops."""
    asked = _asked_to_stop.get()
    if asked is not None and asked():
        raise Cancelled("stopped")


class StopFlag(Protocol):
    """A flag that is set if work should stop, such as a `threading.Event`."""

    def is_set(self) -> bool: ...


class Watch:
    """The progress, the stop flag and the core of a running task."""

    def __init__(self, stop: StopFlag) -> None:
        self.share = 0.0
        """Finished share of the task, from 0 to 1."""
        self.yield_core: Callable[[], None] | None = None
        """Yields the core if that is due; None if the task does not share cores with other runs."""
        self._stop = stop

    def report(self, share: float) -> None:
        """Store the finished share; raise `Cancelled` if the task was asked to stop."""
        self.share = share
        self.check()

    def check(self) -> None:
        """Raise `Cancelled` if the task was asked to stop; yield the core if that is due."""
        if self.yield_core is not None and not self._stop.is_set():
            self.yield_core()
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
    """Run task(number, watch) for numbers 0 … n − 1 and return the numbers that finished.

    Fewer than n tasks finish only if `cancel` returned True. The first error of a task stops the
    other tasks and is raised. `progress` and `cancel` are called in the thread of the caller. A
    given `pool` stays open.
    """
    stop = Event()
    cores, usage = None if _needs_no_core.get() else _shared_cores, _usage.get() or Usage()
    watches = [Watch(stop) for _ in range(n)]
    numbers, finished = iter(range(n)), []

    def work() -> None:
        """Run the next tasks, and keep a core between them as long as its slice lasts."""
        lease = Lease(usage, stop)
        with cores.held(lease) if cores else nullcontext():
            for number in numbers:
                watch = watches[number]
                watch.yield_core = partial(cores.yield_if_due, lease) if cores else None
                watch.check()
                task(number, watch)
                finished.append(number)

    n_threads = min(n, n_workers if pool is None else pool._max_workers)
    with nullcontext(pool) if pool else ThreadPoolExecutor(n_threads) as threads:
        futures: list[Future[None]] = []
        try:
            futures += [_submit(threads, work) for _ in range(n_threads)]
            pending = set(futures)
            while pending:
                ended, pending = wait(pending, POLL_SECONDS)
                for future in ended:
                    future.result()
                if progress:
                    progress(sum(watch.share for watch in watches) / n, len(finished))
                if pending and cancel and cancel():
                    break
        finally:
            stop.set()
            if cores:
                cores.look()
            for future in futures:
                future.cancel()
            wait(futures)
    return sorted(finished)


def _submit(pool: ThreadPoolExecutor, work: Callable[[], None]) -> Future[None]:
    try:
        return pool.submit(copy_context().run, work)
    except RuntimeError as error:
        raise CCWSIMError(f"the executor takes no work: {error}; give an open one") from error
