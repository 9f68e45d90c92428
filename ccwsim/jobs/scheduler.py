"""Fair distribution of a few slots among pages, jobs of the queue, and tasks on cores.

Cores are shared in time slices. Otherwise, a quick run would wait for realizations of other runs,
which may take minutes. Twelve realizations of 512 × 512 with 400 hard data take 0.46 s on two idle
cores. While six runs of 3000 × 3000 compute, the twelve take 0.57 to 0.81 s with slices, but
2.8 to 3.8 s without.

Pages are drawn a few at a time, because Python runs one thread at a time. If thirty threads draw
pages at once, the thread that sends the pages to the browsers gets a thirtieth of the time, and the
server does not answer for seconds.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf
from threading import Event, Lock, Timer, local
from typing import Generic, TypeVar

MAX_PAGES = 2  # pages drawn at a time: while one waits for the disk, the other continues
PAGE_SECONDS = 2.0  # seconds after which a page that is still being drawn frees its slot
SLICE_SECONDS = 0.05  # seconds that a task may compute while other tasks wait
HEAD_START_SECONDS = 1.0  # core seconds that a new user gets before others, to start at once
HEAD_START_SHARE = 0.2  # maximum share of core time for head starts, averaged over time


class Usage:
    """The slots that a user has had; users are sessions, runs, or all pages together."""

    def __init__(self, name: str = "") -> None:
        self.name = name
        self.seconds = 0.0  # core seconds, except those of the head start
        self.head_start = HEAD_START_SECONDS  # core seconds that are left of the head start
        self.latest = 0  # number of the latest slot, counted over all users; 0 if there was none


class Lease:
    """The right of a task to one slot of a scheduler, for which the task waits first."""

    def __init__(self, usage: Usage, stop: Event | None = None) -> None:
        self.usage = usage
        self.stop = Event() if stop is None else stop  # a set event ends the waiting
        self.answered = Event()
        self.since = inf  # time at which the lease got its slot; infinite while it waits

    def answer(self) -> None:
        """Let the task go on, because it has a slot or is stopped; called by the scheduler."""
        self.answered.set()


AnyLease = TypeVar("AnyLease", bound=Lease)


class Scheduler(Generic[AnyLease]):
    """Gives `n` slots to leases: the user with the fewest slots is next.

    In a tie, it is the user whose latest slot is the oldest, then the user who came first. A lease
    that has had its slot for `seconds` keeps it, but no longer counts.
    """

    def __init__(
        self, n: int, seconds: float = inf, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.clock = clock
        self._n, self._seconds = n, seconds
        self._waiting: list[AnyLease] = []
        self._active: list[AnyLease] = []
        self._n_begun = 0
        self._timer: Timer | None = None
        self._lock = Lock()

    def request(self, lease: AnyLease, first: bool = False) -> None:
        """Let a lease wait for a slot, before the other leases of its user if it is `first`.

        If the lease already has a slot, it gives up this slot at the same time.
        """
        with self._change():
            self._drop(lease)
            if not first:
                self._admit(lease.usage)
            lease.since = inf
            self._waiting.insert(0 if first else len(self._waiting), lease)

    def release(self, lease: AnyLease) -> None:
        """Take back the slot of a lease, or end its waiting."""
        with self._change():
            self._drop(lease)

    def look(self) -> None:
        """Answer the waiting leases that were stopped, or for which slots have become free."""
        with self._change():
            pass

    def obtain(self, lease: AnyLease, first: bool = False) -> None:
        """Request a slot and wait until the lease has it or is stopped."""
        lease.answered.clear()
        self.request(lease, first)
        lease.answered.wait()

    @contextmanager
    def held(self, lease: AnyLease) -> Iterator[None]:
        """Obtain a slot, and release it at the end."""
        try:
            self.obtain(lease)
            yield
        finally:
            self.release(lease)

    def position(self, lease: AnyLease) -> int:
        """Return the position of a waiting lease, from 1; 0 if it does not wait."""
        with self._lock:
            return self._order().index(lease) + 1 if lease in self._waiting else 0

    @property
    def n_active(self) -> int:
        """Number of leases that have a slot."""
        return len(self._active)

    @contextmanager
    def _change(self) -> Iterator[None]:
        """Hold the lock during a change, then give the free slots away."""
        with self._lock:
            self._charge()
            yield
            answered = [lease for lease in self._waiting if lease.stop.is_set()]
            for lease in answered:
                self._waiting.remove(lease)
            answered += self._give_slots()
        for lease in answered:
            lease.answer()

    def _drop(self, lease: AnyLease) -> None:
        for leases in (self._active, self._waiting):
            if lease in leases:
                leases.remove(lease)

    def _give_slots(self) -> list[AnyLease]:
        """Give free slots to waiting leases, and return these; set a timer for the next slot."""
        now, leases = self.clock(), []
        ends = [lease.since + self._seconds for lease in self._active]
        ends = [end for end in ends if end > now]
        while self._waiting and len(ends) < self._n:
            lease = self._order()[0]
            self._waiting.remove(lease)
            self._active.append(lease)
            self._n_begun += 1
            lease.usage.latest, lease.since = self._n_begun, now
            ends.append(now + self._seconds)
            leases.append(lease)
        if self._waiting and self._timer is None and min(ends) < inf:
            self._timer = Timer(max(min(ends) - now, 0.01), self._look_again)
            self._timer.daemon = True
            self._timer.start()
        return leases

    def _look_again(self) -> None:
        self._timer = None
        self.look()

    def _order(self) -> list[AnyLease]:
        """Return the waiting leases in the order in which they will get slots."""
        n_active = Counter(lease.usage for lease in self._active)
        by_user: dict[Usage, list[AnyLease]] = {}
        for lease in self._waiting:
            by_user.setdefault(lease.usage, []).append(lease)
        ranks = {
            lease: (self._had(usage) + n_active[usage] + k, k, usage.latest)
            for usage, leases in by_user.items()
            for k, lease in enumerate(leases)
        }
        return sorted(ranks, key=ranks.__getitem__)

    def _had(self, usage: Usage) -> float:
        """Return the number of slots that a user has had, apart from those that it has now."""
        return 0.0

    def _charge(self) -> None:
        """Account for the time since the latest change."""

    def _admit(self, usage: Usage) -> None:
        """Account for a further request of a user."""


class Cores(Scheduler[Lease]):
    """Slots on cores: at the end of its slice, a task yields to a user with less core time.

    A new user starts after the waiting users: `_floor` follows their minimum core time and never
    falls, so that users who come and go cannot keep others from an equal share. The core time
    of new users, up to `HEAD_START_SECONDS` each, is first and does not count in these shares. All
    head starts together take at most `HEAD_START_SECONDS` per core, which are restored by the share
    `HEAD_START_SHARE` of the time of all cores; without them, a new user has an equal share.
    """

    def __init__(self, n: int, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(n, clock=clock)
        self._charged_until = clock()
        self._floor = 0.0
        self._head_starts = n * HEAD_START_SECONDS  # core seconds that may be given now

    def yield_if_due(self, lease: Lease) -> None:
        """Yield the core of a lease if its slice is over, unless its user is next."""
        if self._waiting and self.clock() - lease.since >= SLICE_SECONDS:
            self.obtain(lease, first=True)

    def _had(self, usage: Usage) -> float:
        new = min(usage.head_start, self._head_starts) > 0
        return -inf if new else usage.seconds / SLICE_SECONDS

    def _charge(self) -> None:
        now = self.clock()
        elapsed, self._charged_until = now - self._charged_until, now
        refilled = self._head_starts + HEAD_START_SHARE * self._n * elapsed
        self._head_starts = min(refilled, self._n * HEAD_START_SECONDS)
        for lease in self._active:
            usage, free_seconds = lease.usage, 0.0
            if any(other.usage is not usage for other in self._waiting):
                free_seconds = min(elapsed, usage.head_start) if self._head_starts > 0 else 0.0
            self._head_starts -= free_seconds
            usage.head_start = max(usage.head_start - elapsed, 0.0)
            usage.seconds += elapsed - free_seconds
        waiting = [lease.usage.seconds for lease in self._waiting]
        level = min(waiting) if waiting else max((a.usage.seconds for a in self._active), default=0)
        self._floor = max(self._floor, level)

    def _admit(self, usage: Usage) -> None:
        if all(lease.usage is not usage for lease in self._waiting):
            after = 0.0 if usage.latest else SLICE_SECONDS  # so that many short runs are not ahead
            usage.seconds = max(usage.seconds, self._floor + after)


class Turns(Scheduler[Lease]):
    """Slots of threads that draw pages, in the order in which they come."""

    def __init__(
        self, n: int, seconds: float = PAGE_SECONDS, clock: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(n, seconds, clock)
        self._all_pages = Usage()
        self._mine = local()

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Wait for a turn of this thread, and end it at the end."""
        lease = Lease(self._all_pages)
        with self.held(lease):
            self._mine.lease = lease
            try:
                yield
            finally:
                self._mine.lease = None

    @contextmanager
    def paused(self) -> Iterator[None]:
        """End the turn of this thread, if it has one, during a wait; the thread is then next."""
        lease, self._mine.lease = getattr(self._mine, "lease", None), None
        if lease is None:
            yield
            return
        self.release(lease)
        try:
            yield
        finally:
            self.obtain(lease, first=True)
            self._mine.lease = lease

    def wait(self, event: Event, seconds: float) -> bool:
        """Wait for an event for at most `seconds`, without a turn; return whether it is set."""
        if not event.is_set():
            with self.paused():
                event.wait(seconds)
        return event.is_set()


PAGE_TURNS = Turns(MAX_PAGES)  # the turns of the threads of this process that draw pages
