"""Statistics computed one after another on a thread, and kept for all who ask again."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, is_dataclass
from threading import Condition, Lock
from typing import Any, Generic, TypeVar

import numpy as np

from ccwsim.jobs.job import Job, delay_text
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.ui.widgets.errors import reason

Value = TypeVar("Value")
Fraction = Callable[[float], None]
MAX_KEPT = 96
MAX_LARGE = 24
"""More than a page shows: so many values are kept however large they are."""
MAX_BYTES = 256 * 10**6


@dataclass(frozen=True)
class Task(Generic[Value]):
    """Something to be computed from a study; its key is equal for equal contents and settings."""

    key: tuple
    work: Callable[[Fraction], Value] = field(compare=False, repr=False)  # takes its progress


@dataclass(frozen=True)
class Failure:
    """Why a task could not be computed."""

    reason: str


class LruCache:
    """The latest values, by the key of their task; the one least lately used goes first."""

    def __init__(self, max_values: int = MAX_KEPT) -> None:
        self._max_values = max_values
        self._values: OrderedDict[tuple, Any] = OrderedDict()
        self._lock = Lock()

    def get(self, key: tuple) -> Any:
        """Return a value, or None."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
            return self._values.get(key)

    def put(self, key: tuple, value: Any) -> None:
        """Keep a value."""
        with self._lock:
            self._values[key] = value
            self._values.move_to_end(key)
            while len(self._values) > self._max_values or self._too_large():
                self._values.popitem(last=False)

    def _too_large(self) -> bool:
        return len(self._values) > MAX_LARGE and n_bytes(self._values) > MAX_BYTES


def n_bytes(value: Any) -> int:
    """Return the memory of the arrays and pictures in a value.

    Examples
    --------
    >>> import numpy as np
    >>> n_bytes({"a": np.zeros(10), "b": [b"picture", 3]})
    87
    """
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, str | bytes):
        return len(value)
    if isinstance(value, dict):
        return sum(n_bytes(each) for each in list(value.values()))
    if isinstance(value, list | tuple):
        return sum(n_bytes(each) for each in value)
    return n_bytes(vars(value)) if is_dataclass(value) and hasattr(value, "__dict__") else 0


class StatisticsWorker:
    """Computes what is asked for, in order, on one thread that ends when there is no more."""

    def __init__(self, cache: LruCache) -> None:
        self.cache = cache
        self.stopped = False
        self._pending: list[Task] = []
        self._current: Task | None = None
        self._share = 0.0
        self._since = 0.0
        self._job: Job | None = None
        self._changed = Condition()

    def ask(self, task: Task) -> None:
        """Put a task at the end of the queue, unless it is there, known, or all is stopped."""
        with self._changed:
            if self.stopped or self.cache.get(task.key) is not None:
                return
            if task not in self._pending and task != self._current:
                self._pending.append(task)
            if self._job is None or self._job.finished:  # one that waited may be dropped
                self._since = time.monotonic()
                self._job = Job(self._run)

    def forget(self) -> None:
        """Drop what was not begun yet."""
        with self._changed:
            self._pending.clear()

    def stop(self) -> None:
        """Drop everything, also what is at work, until `go_on`."""
        with self._changed:
            self.stopped = True
            self._pending.clear()
            if self._job is not None:
                self._job.cancel()

    def go_on(self) -> None:
        """Take questions again."""
        self.stopped = False

    def wait_for(self, task: Task[Value], seconds: float) -> Value | Failure | None:
        """Return a value as soon as it is there, None where it is not within `seconds`."""
        with self._changed:
            self._changed.wait_for(lambda: self.cache.get(task.key) is not None, seconds)
        return self.cache.get(task.key)

    def share_of(self, task: Task) -> float | None:
        """Return how much of it is done, None where it was not begun."""
        return self._share if task == self._current else None

    @property
    def seconds(self) -> float:
        """How long it has been at work."""
        return time.monotonic() - self._since if self._job is not None else 0.0

    @property
    def waiting(self) -> str:
        """Say which place it has in the queue of the server; empty where it does not wait."""
        job = self._job
        return delay_text(job) if job is not None and job.position else ""

    def _run(self, job: Job) -> None:
        while True:
            with self._changed:
                if not self._pending or job.is_cancelled():
                    self._current, self._job = None, None
                    self._changed.notify_all()
                    return
                self._current, self._share = self._pending.pop(0), 0.0
            value = self._computed(self._current, job)
            with self._changed:
                if value is not None:
                    self.cache.put(self._current.key, value)
                self._changed.notify_all()

    def _computed(self, task: Task, job: Job) -> Any:
        def progress(share: float) -> None:
            self._share = share
            if job.is_cancelled():
                raise Cancelled("stopped")

        try:
            return task.work(progress)
        except Cancelled:
            return None
        except CCWSIMError as error:
            return Failure(str(error))
        except MemoryError:
            return Failure("this does not fit into memory; ask for fewer realizations")
        except Exception as error:
            return Failure(f"this could not be computed: {reason(error)}")
