"""Time slices, with which the runs of a process share the cores fairly.

Without slices, a quick run waits for realizations of other runs, which may take minutes. Twelve
realizations of 512 × 512 with 400 hard data take 0.46 s on two idle cores. While six
runs of 3000 × 3000 compute, the twelve take 0.57 to 0.81 s with slices, but 2.8 to 3.8 s without.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock

SLICE_SECONDS = 0.05  # seconds that a task may compute while other tasks wait
CREDIT_SECONDS = 1.0  # head start of a new user in core seconds, so that quick work starts at once


class Usage:
    """Core seconds used by the runs of a user; the user with the least usage gets the next core."""

    def __init__(self) -> None:
        self.seconds = float("-inf")
        self.n_tasks = self.n_running = 0  # number of tasks, and of tasks that compute


class Cores:
    """Lets `n` tasks compute at a time; the user with the least usage gets the next free core.

    At the end of its slice, a task yields its core to a waiting task of a user with less usage.
    """

    def __init__(self, n: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self._n_free = n
        self._waiting: list[CoreLease] = []
        self._running: list[CoreLease] = []
        self._present: set[Usage] = set()
        self._lock = Lock()

    @contextmanager
    def lease(self, usage: Usage, stop: Event) -> Iterator[CoreLease]:
        """Wait until a core is free or the run is stopped; release the core at the end."""
        lease = CoreLease(self, usage, stop)
        self.request(lease)
        lease.answered.wait()
        try:
            yield lease
        finally:
            if lease.has_core:
                self.release(lease)

    def let_stopped_go(self) -> None:
        """Wake waiting tasks whose run was stopped."""
        with self._lock:
            for lease in [lease for lease in self._waiting if lease.stop.is_set()]:
                self._waiting.remove(lease)
                self._leave(lease.usage)
                lease.answered.set()

    def request(self, lease: CoreLease) -> None:
        """Add a task to the waiting tasks; it gets a core at once if one is free."""
        with self._lock:
            if lease.stop.is_set():
                lease.answered.set()
            else:
                self._enter(lease.usage)
                self._waiting.append(lease)
                self._assign()

    def release(self, lease: CoreLease) -> None:
        """Take a core back and assign it to the next task."""
        with self._lock:
            self._revoke(lease)
            self._leave(lease.usage)
            self._assign()

    def yield_core(self, lease: CoreLease) -> bool:
        """Yield a core to a task with less usage; return whether such a task was waiting."""
        with self._lock:
            if lease.stop.is_set():
                return False
            self._revoke(lease)
            used = lease.usage.seconds
            if all(other.usage.seconds >= used for other in self._waiting):
                self._grant(lease)
                return False
            self._waiting.append(lease)
            self._assign()
            return True

    @property
    def contended(self) -> bool:
        """Whether any task waits for a core."""
        return bool(self._waiting)

    def _enter(self, usage: Usage) -> None:
        """Count a user as present, with a head start of at most `CREDIT_SECONDS`."""
        for lease in self._running:
            self._charge(lease)
        usage.n_tasks += 1
        self._present.add(usage)
        others = [other.seconds for other in self._present if other is not usage]
        usage.seconds = max(usage.seconds, min(others) - CREDIT_SECONDS if others else 0.0)

    def _leave(self, usage: Usage) -> None:
        usage.n_tasks -= 1
        if not usage.n_tasks:
            self._present.discard(usage)

    def _charge(self, lease: CoreLease) -> None:
        now = self.clock()
        lease.usage.seconds += now - lease.charged_until
        lease.charged_until = now

    def _revoke(self, lease: CoreLease) -> None:
        self._charge(lease)
        self._running.remove(lease)
        lease.has_core = False
        lease.usage.n_running -= 1
        self._n_free += 1

    def _grant(self, lease: CoreLease) -> None:
        self._n_free -= 1
        lease.usage.n_running += 1
        self._running.append(lease)
        lease.has_core = True
        lease.since = lease.charged_until = self.clock()
        lease.answered.set()

    def _assign(self) -> None:
        def rank(lease: CoreLease) -> float:
            return lease.usage.seconds + lease.usage.n_running * SLICE_SECONDS

        while self._n_free and self._waiting:
            lease = min(self._waiting, key=rank)  # the first task in case of a tie
            self._waiting.remove(lease)
            self._grant(lease)


class CoreLease:
    """The right of one task to compute; `has_core` is False while it waits."""

    def __init__(self, cores: Cores, usage: Usage, stop: Event) -> None:
        self.usage, self.stop = usage, stop
        self._cores = cores
        self.has_core = False
        self.since = self.charged_until = 0.0
        self.answered = Event()
        """An event that is set when the task has a core or its run is stopped."""

    def yield_if_due(self) -> None:
        """Yield the core if the slice is over and a task with less usage waits."""
        cores = self._cores
        if not cores.contended or not self.has_core or cores.clock() - self.since < SLICE_SECONDS:
            return
        self.answered.clear()
        if cores.yield_core(self):
            self.answered.wait()
