"""The queue of a server: sessions take turns, and what a closed one had is free again."""

from __future__ import annotations

import gc
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from threading import Event, Lock, Thread, Timer

import streamlit as st
from streamlit import config
from streamlit.runtime import Runtime
from streamlit.runtime.scriptrunner import get_script_run_ctx

from ccwsim.jobs.limits import limits_of_environment
from ccwsim.jobs.workers import n_cores, share_cores
from ccwsim.system.memory import give_back_memory, settle_memory

MAX_COUNTED_SECONDS = 10.0
"""Seconds after which an active job does not count against the slots where others wait."""
LOOK_SECONDS = 2.0
"""Seconds between two looks at who is still there."""
GRACE = 20.0
"""Seconds that a tab may be away, as when a laptop changes networks, before its jobs end."""
EARLY = 10.0
"""A closed session is forgotten so many seconds before Streamlit stops to look for it."""


class QueueEntry:
    """An entry in the queue: whose it is, and what is called when it is its turn or unwanted.

    `still_to_take` returns how many bytes of memory it has asked for and not taken yet.
    """

    def __init__(
        self,
        session: str,
        begin: Callable[[], None],
        abandon: Callable[[], None] = lambda: None,
        still_to_take: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self.session = session
        self.begin, self.abandon, self.still_to_take = begin, abandon, still_to_take
        self.since = 0.0


class Queue:
    """Lets jobs begin: the session with the fewest active ones first, then the one whose turn is
    longest ago, then who came first.

    At most `n_slots` short jobs are active at once. One that has been active for
    `MAX_COUNTED_SECONDS` goes on and its slot is for others; the cores are shared all the same.

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


def current_session() -> str:
    """Return the name of the session that this thread draws, empty where it draws none."""
    context = get_script_run_ctx(suppress_warning=True)
    return context.session_id if context is not None else ""


def is_open(session: str) -> bool:
    """Return whether a browser shows a session; without a server nobody can have left."""
    return not session or not Runtime.exists() or Runtime.instance().is_active_session(session)


def forget(session: str) -> None:
    """Let Streamlit give back the memory of a closed session.

    It keeps a session for some time for a browser that comes back, but then drops it only when
    another one is closed, which may be hours later.
    """
    if not Runtime.exists():
        return
    runtime = Runtime.instance()

    def close() -> None:
        if runtime.is_active_session(session):
            return
        kept = runtime._session_mgr.get_session_info(session)
        runtime.close_session(session)
        if kept is not None:  # the loop of the server names the last session until another comes
            kept.session.session_state.clear()
            kept.session.session_state._new_widget_state.widget_metadata.clear()
            kept.session._fragment_storage.clear()

    # close_session is not thread-safe, and no public way leads to the server's loop and sessions
    with suppress(Exception):  # it may be ending at this moment, which serves as well
        runtime._get_async_objs().eventloop.call_soon_threadsafe(close)


@cache
def settle_server() -> None:
    """Make a server's memory easy to search and to give back; call before a session.

    What it has imported is left out of later searches for garbage: these are nearly all of its
    objects, and a search stops every session meanwhile.
    """
    if Runtime.exists():
        settle_memory(max(2, n_cores()))
        gc.collect()
        gc.freeze()


class SessionMonitor:
    """Watches who is still there: jobs of a session that was left end; later it is forgotten."""

    def __init__(
        self,
        queue: Queue,
        is_open: Callable[[str], bool] = is_open,
        forget: Callable[[str], None] = forget,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._queue, self._is_open, self._forget, self._clock = queue, is_open, forget, clock
        self._sessions: set[str] = set()
        self._left: dict[str, float] = {}
        self._lock = Lock()
        self._thread: Thread | None = None
        self._freed = False
        self._woken = Event()

    def note(self, session: str) -> None:
        """Look after a session from now on, on a thread that ends with the last of them."""
        with self._lock:
            if not session or session in self._sessions:
                return
            self._sessions.add(session)
            if self._thread is None:
                self._thread = Thread(target=self._keep_looking, daemon=True)
                self._thread.start()

    def look(self) -> None:
        """End the jobs of sessions that were left `GRACE` seconds ago; forget older ones."""
        now, to_live = self._clock(), config.get_option("server.disconnectedSessionTTL")
        kept = max(to_live - EARLY, min(GRACE, to_live / 2))  # later Streamlit keeps but loses it
        for session in list(self._sessions):
            if self._is_open(session):
                self._left.pop(session, None)
                continue
            away = now - self._left.setdefault(session, now)
            if away >= min(GRACE, kept):
                for entry in self._queue.entries_of(session):
                    entry.abandon()
            if away >= kept:
                self._forget(session)
                self._freed = True
                with self._lock:
                    self._sessions.discard(session)
                    self._left.pop(session, None)

    def give_back(self) -> None:
        """Give the memory of sessions that were forgotten before the last look to the system.

        With the last of them goes what was kept for all, which came from their images and data.
        """
        freed, self._freed = self._freed, False
        if not freed:
            return
        if not self._sessions:
            st.cache_data.clear()
            st.cache_resource.clear()
        gc.collect()
        give_back_memory()

    def _keep_looking(self) -> None:
        while True:
            self._woken.wait(LOOK_SECONDS)
            self.give_back()
            self.look()
            with self._lock:
                if not self._sessions and not self._freed:
                    self._thread = None
                    return


@cache
def session_monitor() -> SessionMonitor:
    """Return the one monitor of this process."""
    return SessionMonitor(server_queue())
