"""Statistics computed one after another on a thread, and cached for all sessions."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from threading import Condition
from typing import Any, Generic, TypeVar

from ccwsim.jobs.job import Job
from ccwsim.jobs.memo import Memo
from ccwsim.jobs.scheduler import PAGE_TURNS
from ccwsim.jobs.workers import check_stop
from ccwsim.model import Cancelled, CCWSIMError, Fraction
from ccwsim.system.log import reason

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

    def __init__(self, memo: Memo) -> None:
        self.memo = memo
        self.stopped = False
        self.job: Job | None = None  # computes the tasks; None if there are none
        self._pending: list[Task] = []
        self._current: Task | None = None
        self._share = 0.0
        self._changed = Condition()

    def ask(self, task: Task) -> None:
        """Append a task unless it waits already, its value is known, or the worker is stopped."""
        with self._changed:
            if self.stopped or self.memo.get(task.key) is not None:
                return
            if task not in self._pending and task != self._current:
                self._pending.append(task)
            if self.job is None or self.job.finished:  # a waiting task may have been dropped
                self.job = Job(self._run)

    def forget(self) -> None:
        """Drop the tasks that have not begun."""
        with self._changed:
            self._pending.clear()

    def stop(self) -> None:
        """Drop all tasks, including the current one; accept no tasks until `go_on`."""
        with self._changed:
            self.stopped = True
            self._pending.clear()
            if self.job is not None:
                self.job.cancel()

    def go_on(self) -> None:
        """Accept tasks again."""
        self.stopped = False

    def wait_for(self, task: Task[Value], seconds: float) -> Value | Failure | None:
        """Return the value of a task, or None if it is not known within `seconds`."""
        if self.memo.get(task.key) is None:
            with PAGE_TURNS.paused(), self._changed:
                self._changed.wait_for(lambda: self.memo.get(task.key) is not None, seconds)
        return self.memo.get(task.key)

    def share_of(self, task: Task) -> float | None:
        """Return the finished share of a task, or None if it has not begun."""
        return self._share if task == self._current else None

    def _run(self, job: Job) -> None:
        while True:
            with self._changed:
                if not self._pending or job.is_cancelled():
                    self._current, self.job = None, None
                    self._changed.notify_all()
                    return
                task = self._current = self._pending.pop(0)
                self._share = 0.0
            with suppress(Cancelled):
                self.memo.value(task.key, partial(self._computed, task))
            with self._changed:
                self._changed.notify_all()

    def _show(self, share: float) -> None:
        self._share = share
        check_stop()

    def _computed(self, task: Task) -> Any:
        try:
            return task.work(self._show)
        except Cancelled:
            raise
        except CCWSIMError as error:
            return Failure(str(error))
        except Exception as error:
            return Failure(f"this could not be computed: {reason(error)}")
