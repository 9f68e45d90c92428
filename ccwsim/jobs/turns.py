"""Turns, by which the threads of many sessions draw their pages a few at a time.

Python runs one thread at a time. If thirty threads draw pages at once, the thread that sends the
pages to the browsers gets a thirtieth of the time, and the server does not answer for seconds.
"""

import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock, local

MAX_AT_ONCE = 2  # pages drawn at a time: while one waits for the disk, the other continues
MAX_COUNTED_SECONDS = 2.0  # after these, a page that is still being drawn lets another begin


class Turns:
    """Lets `n` threads work at a time in the order in which they come, each for some seconds."""

    def __init__(
        self,
        n: int,
        seconds: float = MAX_COUNTED_SECONDS,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._n, self._seconds, self._clock = n, seconds, clock
        self._waiting: deque[Event] = deque()
        self._began: dict[Event, float] = {}
        self._lock = Lock()
        self._mine = local()

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Wait for a turn of this thread, and end it at the end."""
        self._take(self._waiting.append)
        try:
            yield
        finally:
            self._end()

    @contextmanager
    def paused(self) -> Iterator[None]:
        """End the turn of this thread, if it has one, while it waits; then it comes next."""
        if getattr(self._mine, "turn", None) is None:
            yield
            return
        self._end()
        try:
            yield
        finally:
            self._take(self._waiting.appendleft)

    def wait(self, event: Event, seconds: float) -> bool:
        """Wait for an event for at most `seconds`, without a turn; return whether it is set."""
        if not event.is_set():
            with self.paused():
                event.wait(seconds)
        return event.is_set()

    def _take(self, enter: Callable[[Event], None]) -> None:
        turn = Event()
        with self._lock:
            enter(turn)
            self._begin_next()
        while not turn.wait(self._seconds):
            with self._lock:
                self._begin_next()
        self._mine.turn = turn

    def _end(self) -> None:
        with self._lock:
            del self._began[self._mine.turn]
            self._begin_next()
        self._mine.turn = None

    def _begin_next(self) -> None:
        now = self._clock()
        while self._waiting and self._n > sum(
            now - began < self._seconds for began in self._began.values()
        ):
            turn = self._waiting.popleft()
            self._began[turn] = now
            turn.set()


PAGE_TURNS = Turns(MAX_AT_ONCE)  # the turns of the threads of this process that draw pages
