"""Run numbered tasks on threads, with progress, and stop them when asked."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar, copy_context
from functools import partial
from threading import Event

from ccwsim.jobs.scheduler import Cores, Lease, Usage
from ccwsim.model import UNWATCHED, Cancel, Cancelled, CCWSIMError, Watch as Watch
from ccwsim.system.machine import n_cores

WORKER_POLL_SECONDS = 0.05  # seconds between two checks of progress and cancel

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
    """Let quick tasks of a thread run without a core, while the thread holds a lock."""
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


def run_all(
    task: Callable[[int, Watch], None],
    n: int,
    n_workers: int,
    watch: Watch = UNWATCHED,
    pool: ThreadPoolExecutor | None = None,
) -> list[int]:
    """Run task(number, its watch) for numbers 0 … n − 1 and return the numbers that finished.

    Fewer than n tasks finish only if `watch` asks to stop. The first error of a task stops the
    other tasks and is raised. The functions of `watch` are called in the thread of the caller. A
    given `pool` stays open.
    """
    stop = Event()
    cores, usage = None if _needs_no_core.get() else _shared_cores, _usage.get() or Usage()
    shares, numbers, finished = [0.0] * n, iter(range(n)), []

    def set_share(number: int, share: float, n_done: int) -> None:
        shares[number] = share

    def work() -> None:
        """Run the next tasks, and keep a core between them as long as its slice lasts."""
        lease = Lease(usage, stop)

        def asked_to_stop() -> bool:
            if cores and not stop.is_set():
                cores.yield_if_due(lease)
            return stop.is_set()

        with cores.held(lease) if cores else nullcontext():
            for number in numbers:
                part = Watch(partial(set_share, number), asked_to_stop)
                part.check()
                task(number, part)
                finished.append(number)

    n_threads = min(n, n_workers if pool is None else pool._max_workers)
    with nullcontext(pool) if pool else ThreadPoolExecutor(n_threads) as threads:
        futures: list[Future[None]] = []
        try:
            futures += [_submit(threads, work) for _ in range(n_threads)]
            pending = set(futures)
            while pending:
                ended, pending = wait(pending, WORKER_POLL_SECONDS)
                for future in ended:
                    future.result()
                watch.progress(sum(shares) / n, len(finished))
                if pending and watch.cancel():
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
