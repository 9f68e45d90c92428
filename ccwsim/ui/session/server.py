"""Clean-up after closed tabs: jobs of closed sessions end, and their memory is freed."""

import gc
import logging
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from threading import Lock, Thread

import streamlit as st
from streamlit import config
from streamlit.runtime import Runtime, app_session
from streamlit.runtime.scriptrunner import get_script_run_ctx
from streamlit.runtime.scriptrunner_utils import script_run_context

from ccwsim.experiments.warm_up import compile_in_background
from ccwsim.io.isolated import forget_results
from ccwsim.jobs.job import Queue, server_queue
from ccwsim.jobs.limits import limits_of_environment
from ccwsim.run.executors.processes import use_processes
from ccwsim.system.machine import n_cores
from ccwsim.system.memory import give_back_memory, settle_memory

LOOK_SECONDS = 2.0  # seconds between two checks for closed sessions
GRACE = 20.0  # seconds for which a tab may be disconnected, for example while the network changes
EARLY = 10.0
"""Seconds before the end of Streamlit's time to live at which a closed session is dropped."""


def current_session() -> str:
    """Watch the session of the current thread, and return its name; "" without a session."""
    context = get_script_run_ctx(suppress_warning=True)
    session = context.session_id if context is not None else ""
    session_monitor().note(session)
    return session


def is_open(session: str) -> bool:
    """Return whether a browser shows a session; always True without a server."""
    return not session or not Runtime.exists() or Runtime.instance().is_active_session(session)


def forget(session: str) -> None:
    """Make Streamlit free a closed session now; otherwise it waits until another session closes."""
    if not Runtime.exists():
        return
    runtime = Runtime.instance()

    def close() -> None:
        if runtime.is_active_session(session):
            return
        info = runtime._session_mgr.get_session_info(session)
        runtime.close_session(session)
        if info is not None:  # the event loop refers to the last session until the next one starts
            info.session.session_state.clear()
            info.session.session_state._new_widget_state.widget_metadata.clear()
            info.session._fragment_storage.clear()

    # close_session is not thread-safe; Streamlit's event loop and sessions have no public access
    with suppress(Exception):  # a server that is ending frees the session too
        runtime._get_async_objs().eventloop.call_soon_threadsafe(close)


def is_news(record: logging.LogRecord) -> bool:
    """Return False for two lines of Streamlit's log that report no problem.

    A part of a page that follows a job has a timer in the browser, which ticks until the browser
    hears that the page is drawn without this part. Streamlit ignores a later tick, and logs a line.
    Jobs use the shared cache on their own threads, for which Streamlit logs a line too.
    """
    return not str(record.msg).startswith(NO_NEWS)


NO_NEWS = "The fragment with id %s does not exist anymore", "Thread '%s': missing ScriptRunContext!"
"""Beginnings of the messages that `is_news` leaves out."""


@cache
def settle_server() -> None:
    """Prepare a server for sessions: set up log, queue and memory, and compile kernels."""
    for module in (app_session, script_run_context):
        logging.getLogger(module.__name__).addFilter(is_news)
    server_queue().current_session = current_session
    if limits_of_environment().processes:
        use_processes()
    if Runtime.exists():
        settle_memory(max(2, n_cores()))
        gc.collect()
        gc.freeze()  # collecting imported objects would pause every session
        compile_in_background()


class SessionMonitor:
    """Watches sessions; after a tab is closed, jobs end, and later the memory is freed."""

    def __init__(
        self,
        queue: Queue,
        is_open: Callable[[str], bool] = is_open,
        forget: Callable[[str], None] = forget,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._queue, self._is_open, self._forget, self._clock = queue, is_open, forget, clock
        self._sessions: set[str] = set()
        self._closed_since: dict[str, float] = {}
        self._lock = Lock()
        self._thread: Thread | None = None
        self._freed = False

    def note(self, session: str) -> None:
        """Start to watch a session; the watching thread ends after the last session."""
        with self._lock:
            if not session or session in self._sessions:
                return
            self._sessions.add(session)
            if self._thread is None:
                self._thread = Thread(target=self._keep_looking, daemon=True)
                self._thread.start()

    def look(self) -> None:
        """End the jobs of sessions closed `GRACE` seconds ago; drop sessions closed long ago."""
        now, to_live = self._clock(), config.get_option("server.disconnectedSessionTTL")
        # Streamlit cannot close a session later
        kept_seconds = max(to_live - EARLY, min(GRACE, to_live / 2))
        for session in list(self._sessions):
            if self._is_open(session):
                self._closed_since.pop(session, None)
                continue
            away = now - self._closed_since.setdefault(session, now)
            if away >= min(GRACE, kept_seconds):
                for job in self._queue.jobs_of(session):
                    job.abandon()
            if away >= kept_seconds:
                self._forget(session)
                self._freed = True
                with self._lock:
                    self._sessions.discard(session)
                    self._closed_since.pop(session, None)

    def give_back(self) -> None:
        """Give back the memory of dropped sessions and, after the last one, of shared caches."""
        freed, self._freed = self._freed, False
        if not freed:
            return
        if not self._sessions:
            st.cache_data.clear()
            st.cache_resource.clear()
            forget_results()
        gc.collect()
        give_back_memory()

    def _keep_looking(self) -> None:
        while True:
            time.sleep(LOOK_SECONDS)
            self.give_back()
            self.look()
            with self._lock:
                if not self._sessions and not self._freed:
                    self._thread = None
                    return


@cache
def session_monitor() -> SessionMonitor:
    """Return the only session monitor in this process."""
    return SessionMonitor(server_queue())
