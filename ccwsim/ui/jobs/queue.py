"""The queue of a server: so many jobs are active at once, and sessions take turns."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from functools import cache
from threading import Lock, Timer

from ccwsim.system.workers import share_cores
from ccwsim.ui.jobs.limits import limits_of_environment

MAX_COUNTED_SECONDS = 10.0
"""Seconds after which an active job does not count against the slots where others wait."""


class QueueEntry:
    """An entry in the queue.

    Parameters
    ----------
    session : str
        Whose it is.
    begin : callable
        Called once, when it is its turn.
    drop : callable
        Called where nobody wants it any more, as its session is over.
    still_to_take : callable
        Returns how many bytes of memory it has asked for and not taken yet.
    """

    def __init__(
        self,
        session: str,
        begin: Callable[[], None],
        drop: Callable[[], None] = lambda: None,
        still_to_take: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self.session = session
        self.begin, self.drop, self.still_to_take = begin, drop, still_to_take
        self.since = 0.0


class Queue:
    """Lets jobs begin: the session with the fewest active ones first, then the one whose turn is
    longest ago, then who came first.

    Parameters
    ----------
    n_slots : int
        How many short jobs are active at once. One that has been active for `MAX_COUNTED_SECONDS`
        goes on and its slot is for others; the cores are shared all the same.
    clock : callable
        Returns the time in seconds.

    Examples
    --------
    >>> queue = Queue(1)
    >>> first, second = (QueueEntry("a session", lambda: None) for _ in range(2))
    >>> queue.enter(first), queue.enter(second)
    (None, None)
    >>> queue.position(first), queue.position(second)
    (0, 1)
    """

    def __init__(self, n_slots: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._n_slots, self._clock = n_slots, clock
        self._waiting: list[QueueEntry] = []
        self._active: list[QueueEntry] = []
        self._turns: dict[str, int] = {}  # when each session had its latest, while it has entries
        self._n_begun = 0
        self._timer: Timer | None = None
        self._lock = Lock()

    def enter(self, entry: QueueEntry) -> None:
        """Take a position at the end; where there is room it begins at once."""
        with self._lock:
            self._waiting.append(entry)
        self.look()

    def leave(self, entry: QueueEntry) -> None:
        """Leave the queue at the end of a job."""
        with self._lock:
            if entry in self._active:
                self._active.remove(entry)
            self._forget(entry.session)
        self.look()

    def withdraw(self, entry: QueueEntry) -> bool:
        """Give up waiting; return whether the entry waited, and so will never begin."""
        with self._lock:
            if entry not in self._waiting:
                return False
            self._waiting.remove(entry)
            self._forget(entry.session)
        self.look()
        return True

    def look(self) -> None:
        """Let those begin who may by now."""
        with self._lock:
            now, begun = self._clock(), []
            while self._waiting and self._n_counted(now) < self._n_slots:
                entry = self._next(self._waiting, self._busy(), self._turns)
                self._waiting.remove(entry)
                self._active.append(entry)
                self._n_begun += 1
                self._turns[entry.session] = self._n_begun
                entry.since = now
                begun.append(entry)
            self._look_again(now)
        for entry in begun:
            entry.begin()

    def position(self, entry: QueueEntry) -> int:
        """Return how many jobs must begin before and with this one, 0 where it does not wait."""
        with self._lock:
            if entry not in self._waiting:
                return 0
            ahead, waiting = 1, list(self._waiting)
            busy, turns = self._busy(), dict(self._turns)
            while (following := self._next(waiting, busy, turns)) is not entry:
                waiting.remove(following)
                busy[following.session] += 1
                turns[following.session] = self._n_begun + ahead
                ahead += 1
            return ahead

    def entries_of(self, session: str) -> list[QueueEntry]:
        """Return the entries of a session, active and waiting."""
        with self._lock:
            return [p for p in (*self._active, *self._waiting) if p.session == session]

    @property
    def n_active(self) -> int:
        """How many jobs are active."""
        return len(self._active)

    @property
    def n_waiting(self) -> int:
        """How many jobs wait."""
        return len(self._waiting)

    @property
    def still_to_take(self) -> float:
        """Bytes of memory that all jobs have asked for and not taken yet."""
        with self._lock:
            entries = [*self._active, *self._waiting]
        return sum(entry.still_to_take() for entry in entries)

    def _busy(self) -> Counter[str]:
        return Counter(entry.session for entry in self._active)

    def _forget(self, session: str) -> None:
        if all(entry.session != session for entry in (*self._active, *self._waiting)):
            self._turns.pop(session, None)

    @staticmethod
    def _next(waiting: list[QueueEntry], busy: Counter[str], turns: dict[str, int]) -> QueueEntry:
        def rank(entry: QueueEntry) -> tuple[int, int]:
            return busy[entry.session], turns.get(entry.session, 0)

        return min(waiting, key=rank)  # the first of those alike

    def _n_counted(self, now: float) -> int:
        return sum(now - entry.since < MAX_COUNTED_SECONDS for entry in self._active)

    def _look_again(self, now: float) -> None:
        """Look when the next active job has become a long one, if anybody waits for that."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._waiting:
            first = min(p.since for p in self._active if now - p.since < MAX_COUNTED_SECONDS)
            self._timer = Timer(max(first + MAX_COUNTED_SECONDS - now, 0.01), self.look)
            self._timer.daemon = True
            self._timer.start()


@cache
def server_queue() -> Queue:
    """Return the one queue of this process, whose runs take turns on its cores from now on."""
    share_cores()
    return Queue(limits_of_environment().n_slots)
