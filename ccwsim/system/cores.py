"""The cores of a process that many serve at once: runs take turns on them, in slices of time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock

SLICE = 0.05
"""Seconds that a task may compute while others wait; it looks up that often anyway."""
CREDIT = 1.0
"""Seconds that who comes new is ahead of who computes already: quick work is done at once."""


class Usage:
    """What somebody has used of the cores, in seconds, against the others that compute."""

    def __init__(self) -> None:
        self.used = float("-inf")
        self.n_present = 0


class Cores:
    """Gives so many tasks leave to compute at a time: whose account has used least is next.

    Every run has its own `Lane`. A task that has used up its slice gives its core to one of another
    run that waits and has used less, and waits itself: a realization of minutes holds nobody up.

    Parameters
    ----------
    n : int
        How many tasks compute at once.
    clock : callable
        Returns the time in seconds.

    Examples
    --------
    >>> lane = Cores(2).lane()
    >>> with lane.turn() as turn:
    ...     turn.has_core
    True
    """

    def __init__(self, n: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self._free = n
        self._waiting: list[CoreLease] = []
        self._running: list[CoreLease] = []
        self._present: set[Usage] = set()
        self._lock = Lock()

    def slot(self, account: Usage | None = None) -> RunSlot:
        """Return a lane for one run; several of one account count as one."""
        return RunSlot(self, account or Usage())

    def ask(self, lease: CoreLease) -> None:
        """Let a task wait for a core; it may get one at once."""
        with self._lock:
            if not lease.slot.closed:
                self._come(lease.slot.account)
                self._waiting.append(lease)
                self._hand_out()
            else:
                lease.called.set()

    def give_back(self, lease: CoreLease) -> None:
        """Take a core back and hand it to the next."""
        with self._lock:
            self._take(lease)
            self._go(lease.slot.account)
            self._hand_out()

    def swap(self, lease: CoreLease) -> bool:
        """Give the core of a task to one that has used less, and return whether one waited."""
        with self._lock:
            if lease.slot.closed:
                return False
            self._take(lease)
            own = lease.slot.account.used
            if all(other.slot.account.used >= own for other in self._waiting):
                self._give(lease)
                return False
            self._waiting.append(lease)
            self._hand_out()
            return True

    def close(self, slot: RunSlot) -> None:
        """Let no task of a lane wait any longer."""
        with self._lock:
            slot.closed = True
            for lease in [t for t in self._waiting if t.slot is slot]:
                self._waiting.remove(lease)
                self._go(slot.account)
                lease.called.set()

    @property
    def contended(self) -> bool:
        """Whether a task waits."""
        return bool(self._waiting)

    def _come(self, account: Usage) -> None:
        """Count an account among those present: never further ahead of them than the credit."""
        for lease in self._running:
            self._count(lease)
        account.n_present += 1
        self._present.add(account)
        others = [other.used for other in self._present if other is not account]
        account.used = max(account.used, min(others) - CREDIT if others else 0.0)

    def _go(self, account: Usage) -> None:
        account.n_present -= 1
        if not account.n_present:
            self._present.discard(account)

    def _count(self, lease: CoreLease) -> None:
        now = self.clock()
        lease.slot.account.used += now - lease.counted
        lease.counted = now

    def _take(self, lease: CoreLease) -> None:
        self._count(lease)
        self._running.remove(lease)
        lease.has_core = False
        lease.slot.n_busy -= 1
        self._free += 1

    def _give(self, lease: CoreLease) -> None:
        self._free -= 1
        lease.slot.n_busy += 1
        self._running.append(lease)
        lease.has_core = True
        lease.since = lease.counted = self.clock()
        lease.called.set()

    def _hand_out(self) -> None:
        def rank(lease: CoreLease) -> float:
            return lease.slot.account.used + lease.slot.n_busy * SLICE

        while self._free and self._waiting:
            lease = min(self._waiting, key=rank)  # the first of those alike
            self._waiting.remove(lease)
            self._give(lease)


class RunSlot:
    """The tasks of one run.

    Attributes
    ----------
    account : Account
        Of whom they are.
    n_busy : int
        How many of them compute now.
    closed : bool
        Whether none is to wait any longer, as the run is stopped.
    """

    def __init__(self, cores: Cores, account: Usage) -> None:
        self._cores = cores
        self.account = account
        self.n_busy = 0
        self.closed = False

    @contextmanager
    def lease(self) -> Iterator[CoreLease]:
        """Wait for a core, and give it back at the end."""
        lease = CoreLease(self, self._cores)
        self._cores.ask(lease)
        lease.called.wait()
        try:
            yield lease
        finally:
            if lease.has_core:
                self._cores.give_back(lease)

    def close(self) -> None:
        """Let no task wait any longer: the run is stopped."""
        self._cores.close(self)


class CoreLease:
    """The leave of one task to compute.

    Attributes
    ----------
    has_core : bool
        False while it waits, and where its lane was closed meanwhile.
    since, counted : float
        When it got its core, and until when that was put to its account.
    called : Event
        Set when it need not wait any longer.
    """

    def __init__(self, slot: RunSlot, cores: Cores) -> None:
        self.slot = slot
        self._cores = cores
        self.has_core = False
        self.since = self.counted = 0.0
        self.called = Event()

    def look_up(self) -> None:
        """Let another task have the core, where one waits that has less and the slice is over."""
        cores = self._cores
        if not cores.contended or not self.has_core or cores.clock() - self.since < SLICE:
            return
        self.called.clear()
        if cores.swap(self):
            self.called.wait()
