"""The cores of a process that many serve at once: runs take turns on them, in slices of time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock

SLICE = 0.05
"""Seconds that a task may compute while others wait; it looks up that often anyway."""


class Cores:
    """Gives so many tasks leave to compute at a time, the run with the fewest at work first.

    Every run has its own `Lane`. A task that has used up its slice gives its core to one of another
    run that waits, and waits itself: a realization of minutes holds nobody up.

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
        self._lock = Lock()

    def lane(self) -> Lane:
        """Return a lane for one run."""
        return Lane(self)

    def ask(self, turn: Turn) -> None:
        """Let a task wait for a core; it may get one at once."""
        with self._lock:
            if not turn.lane.closed:
                self._waiting.append(turn)
                self._hand_out()
            else:
                turn.called.set()

    def give_back(self, turn: Turn) -> None:
        """Take a core back and hand it to the next."""
        with self._lock:
            self._take(turn)
            self._hand_out()

    def swap(self, turn: Turn) -> bool:
        """Give the core of a task to one of another run, and return whether one waited."""
        with self._lock:
            if turn.lane.closed or all(other.lane is turn.lane for other in self._waiting):
                return False
            self._take(turn)
            self._waiting.append(turn)
            self._hand_out(after=turn.lane)
            return True

    def close(self, lane: Lane) -> None:
        """Let no task of a lane wait any longer."""
        with self._lock:
            lane.closed = True
            for turn in [t for t in self._waiting if t.lane is lane]:
                self._waiting.remove(turn)
                turn.called.set()

    @property
    def contended(self) -> bool:
        """Whether a task waits."""
        return bool(self._waiting)

    def _take(self, turn: Turn) -> None:
        turn.has_core = False
        turn.lane.n_busy -= 1
        self._free += 1

    def _hand_out(self, after: Lane | None = None) -> None:
        def rank(turn: Turn) -> tuple[int, bool]:
            return turn.lane.n_busy, turn.lane is after

        while self._free and self._waiting:
            turn = min(self._waiting, key=rank)  # the first of those alike
            self._waiting.remove(turn)
            self._free -= 1
            turn.lane.n_busy += 1
            turn.has_core, turn.since = True, self.clock()
            turn.called.set()


class Lane:
    """The tasks of one run.

    Attributes
    ----------
    n_busy : int
        How many of them compute now.
    closed : bool
        Whether none is to wait any longer, as the run is stopped.
    """

    def __init__(self, cores: Cores) -> None:
        self._cores = cores
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
    since : float
        When it got its core.
    called : Event
        Set when it need not wait any longer.
    """

    def __init__(self, lane: Lane, cores: Cores) -> None:
        self.lane = lane
        self._cores = cores
        self.has_core = False
        self.since = 0.0
        self.called = Event()

    def look_up(self) -> None:
        """Let a task of another run have the core, where one waits and the slice is over."""
        cores = self._cores
        if not cores.contended or not self.has_core or cores.clock() - self.since < SLICE:
            return
        self.called.clear()
        if cores.swap(self):
            self.called.wait()
