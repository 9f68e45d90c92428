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


class Account:
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
        self._waiting: list[Turn] = []
        self._running: list[Turn] = []
        self._present: set[Account] = set()
        self._lock = Lock()

    def lane(self, account: Account | None = None) -> Lane:
        """Return a lane for one run; several of one account count as one."""
        return Lane(self, account or Account())

    def ask(self, turn: Turn) -> None:
        """Let a task wait for a core; it may get one at once."""
        with self._lock:
            if not turn.lane.closed:
                self._come(turn.lane.account)
                self._waiting.append(turn)
                self._hand_out()
            else:
                turn.called.set()

    def give_back(self, turn: Turn) -> None:
        """Take a core back and hand it to the next."""
        with self._lock:
            self._take(turn)
            self._go(turn.lane.account)
            self._hand_out()

    def swap(self, turn: Turn) -> bool:
        """Give the core of a task to one that has used less, and return whether one waited."""
        with self._lock:
            if turn.lane.closed:
                return False
            self._take(turn)
            own = turn.lane.account.used
            if all(other.lane.account.used >= own for other in self._waiting):
                self._give(turn)
                return False
            self._waiting.append(turn)
            self._hand_out()
            return True

    def close(self, lane: Lane) -> None:
        """Let no task of a lane wait any longer."""
        with self._lock:
            lane.closed = True
            for turn in [t for t in self._waiting if t.lane is lane]:
                self._waiting.remove(turn)
                self._go(lane.account)
                turn.called.set()

    @property
    def contended(self) -> bool:
        """Whether a task waits."""
        return bool(self._waiting)

    def _come(self, account: Account) -> None:
        """Count an account among those present: never further ahead of them than the credit."""
        for turn in self._running:
            self._count(turn)
        account.n_present += 1
        self._present.add(account)
        others = [other.used for other in self._present if other is not account]
        account.used = max(account.used, min(others) - CREDIT if others else 0.0)

    def _go(self, account: Account) -> None:
        account.n_present -= 1
        if not account.n_present:
            self._present.discard(account)

    def _count(self, turn: Turn) -> None:
        now = self.clock()
        turn.lane.account.used += now - turn.counted
        turn.counted = now

    def _take(self, turn: Turn) -> None:
        self._count(turn)
        self._running.remove(turn)
        turn.has_core = False
        turn.lane.n_busy -= 1
        self._free += 1

    def _give(self, turn: Turn) -> None:
        self._free -= 1
        turn.lane.n_busy += 1
        self._running.append(turn)
        turn.has_core = True
        turn.since = turn.counted = self.clock()
        turn.called.set()

    def _hand_out(self) -> None:
        def rank(turn: Turn) -> float:
            return turn.lane.account.used + turn.lane.n_busy * SLICE

        while self._free and self._waiting:
            turn = min(self._waiting, key=rank)  # the first of those alike
            self._waiting.remove(turn)
            self._give(turn)


class Lane:
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

    def __init__(self, cores: Cores, account: Account) -> None:
        self._cores = cores
        self.account = account
        self.n_busy = 0
        self.closed = False

    @contextmanager
    def turn(self) -> Iterator[Turn]:
        """Wait for a core, and give it back at the end."""
        turn = Turn(self, self._cores)
        self._cores.ask(turn)
        turn.called.wait()
        try:
            yield turn
        finally:
            if turn.has_core:
                self._cores.give_back(turn)

    def close(self) -> None:
        """Let no task wait any longer: the run is stopped."""
        self._cores.close(self)


class Turn:
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

    def __init__(self, lane: Lane, cores: Cores) -> None:
        self.lane = lane
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
