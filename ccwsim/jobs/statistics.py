"""Statistics computed one after another on a thread, and cached for all sessions."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Condition
from typing import Any, Generic, TypeVar

from ccwsim.jobs.job import Job
from ccwsim.jobs.scheduler import PAGE_TURNS
from ccwsim.model.errors import Cancelled, CCWSIMError
from ccwsim.model.watch import Fraction as Fraction
from ccwsim.model.watch import Watch
from ccwsim.system.log import reason
from ccwsim.system.lru_cache import LruCache

Value = TypeVar("Value")


@dataclass(frozen=True)
class Task(Generic[Value]):
    """A value to compute; tasks with equal inputs have equal keys."""

    key: tuple
    work: Callable[[Fraction], Value] = field(compare=False, repr=False)  # called as work(progress)


@dataclass(frozen=True)
class Failure:
    """The reason why the value of a task could not be computed."""

    reason: str


class StatisticsWorker:
    """Computes tasks in order on a thread, which ends after the last task."""

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
        """Append a task unless it waits already, its value is known, or the worker is stopped."""
        with self._changed:
            if self.stopped or self.cache.get(task.key) is not None:
                return
            if task not in self._pending and task != self._current:
                self._pending.append(task)
            if self._job is None or self._job.finished:  # a waiting task may have been dropped
                self._since = time.monotonic()
                self._job = Job(self._run)

    def forget(self) -> None:
        """Drop the tasks that have not begun."""
        with self._changed:
            self._pending.clear()

    def stop(self) -> None:
        """Drop all tasks, including the current one; accept no tasks until `go_on`."""
        with self._changed:
            self.stopped = True
            self._pending.clear()
            if self._job is not None:
                self._job.cancel()

    def go_on(self) -> None:
        """Accept tasks again."""
        self.stopped = False

    def wait_for(self, task: Task[Value], seconds: float) -> Value | Failure | None:
        """Return the value of a task, or None if it is not known within `seconds`."""
        if self.cache.get(task.key) is None:
            with PAGE_TURNS.paused(), self._changed:
                self._changed.wait_for(lambda: self.cache.get(task.key) is not None, seconds)
        return self.cache.get(task.key)

    def share_of(self, task: Task) -> float | None:
        """Return the finished share of a task, or None if it has not begun."""
        return self._share if task == self._current else None

    @property
    def seconds(self) -> float:
        """Seconds since the worker began its current job."""
        return time.monotonic() - self._since if self._job is not None else 0.0

    @property
    def position(self) -> int:
        """Position of the worker in the queue of the server, 0 if it does not wait."""
        job = self._job
        return job.position if job is not None else 0

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

    def _show(self, share: float) -> None:
        self._share = share

    def _computed(self, task: Task, job: Job) -> Any:
        watch = Watch.of_share(self._show, job.is_cancelled)
        try:
            return task.work(watch.tell)
        except Cancelled:
            return None
        except CCWSIMError as error:
            return Failure(str(error))
        except Exception as error:
            return Failure(f"this could not be computed: {reason(error)}")
