"""Which session asks, and what becomes of its jobs and its memory when its tab is closed."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from threading import Event, Lock, Thread

import streamlit as st
from streamlit import config
from streamlit.runtime import Runtime
from streamlit.runtime.scriptrunner import get_script_run_ctx

from ccwsim.system.memory import give_back_memory
from ccwsim.ui.jobs.queue import Queue, server_queue

POLL_SECONDS = 2.0
"""Seconds between two looks at who is still there."""
GRACE = 20.0
"""Seconds that a tab may be away, as when a laptop changes networks, before its jobs end."""
EARLY = 10.0
"""A closed session is forgotten so many seconds before Streamlit stops to look for it."""


def current_session() -> str:
    """Return the name of the session that this thread draws, empty where it draws none.

    Examples
    --------
    >>> current_session()
    ''
    """
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
        if not runtime.is_active_session(session):
            runtime.close_session(session)

    # close_session is not thread-safe, and no public way leads to the event loop of the server
    with suppress(Exception):  # it may be ending at this moment, which serves as well
        runtime._get_async_objs().eventloop.call_soon_threadsafe(close)


@cache
def settle_memory() -> None:
    """Leave what a server has imported out of later searches for garbage; call before a session.

    These are nearly all of its objects, and a search for garbage stops every session meanwhile.
    """
    if Runtime.exists():
        gc.collect()
        gc.freeze()


class SessionMonitor:
    """Watches who is still there: jobs of a session that was left end; later it is forgotten.

    Parameters
    ----------
    queue : Queue
    is_open : callable
        Returns whether a browser shows a session.
    forget : callable
        Called with a session that nobody comes back to.
    clock : callable
        Returns the time in seconds.
    """

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
        now = self._clock()
        for session in list(self._sessions):
            if self._is_open(session):
                self._left.pop(session, None)
                continue
            away = now - self._left.setdefault(session, now)
            if away >= GRACE:
                for entry in self._queue.entries_of(session):
                    entry.drop()
            if away >= max(config.get_option("server.disconnectedSessionTTL") - EARLY, GRACE):
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
            self._woken.wait(POLL_SECONDS)
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
