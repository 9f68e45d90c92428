"""Errors on a page: the log contains the cause of an error under the number in the message."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any, TypeVar

import streamlit as st
from streamlit.logger import get_logger
from streamlit.runtime import Runtime
from streamlit.runtime.scriptrunner import get_script_run_ctx

from ccwsim import CCWSIMError
from ccwsim.system.log import LOG, logged
from ccwsim.ui.widgets.text import page_text, plain

T = TypeVar("T")
PENDING_ERROR = "ccwsim_error"
"""Session key of a callback's error message, which is shown when the page is next drawn."""
get_logger(LOG.name)  # sets the format of Streamlit's log messages


def catch_callback_errors(act: Callable[..., Any]) -> Callable[..., None]:
    """Return a callback whose errors are shown on the page, instead of replacing the page."""

    @wraps(act)
    def acting(*args: Any, **kwargs: Any) -> None:
        try:
            with uninterrupted():
                act(*args, **kwargs)
        except Exception as error:
            if is_control_flow(error):
                raise
            st.session_state[PENDING_ERROR] = user_message(error, "done")

    acting.is_safe = True  # type: ignore[attr-defined]
    return acting


def tells_errors(act: Callable[[], T]) -> Callable[[], T]:
    """Return a function for another thread, whose errors are shown when the page is drawn again.

    Streamlit calls the content of a download on a thread without a session, and tells the user
    nothing of its errors.
    """
    context = get_script_run_ctx(suppress_warning=True)

    def acting() -> T:
        try:
            return act()
        except Exception as error:
            if context is not None and Runtime.exists():
                context.session_state[PENDING_ERROR] = user_message(error, "done")
                _draw_again(context.session_id)
            raise

    return acting


def _draw_again(session: str) -> None:
    """Draw the page of a session again; called from any thread."""
    runtime = Runtime.instance()
    app = runtime.get_app_session(session)
    if app is not None:
        loop = runtime._get_async_objs().eventloop  # sessions and event loop have no public access
        loop.call_soon_threadsafe(app.request_rerun, app._client_state)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Finish a callback before later changes of the user redraw the page.

    Otherwise Streamlit may stop the callback when it reads the session state. Streamlit does not
    repeat the callback, so the change would be lost.
    """
    context = get_script_run_ctx(suppress_warning=True)
    shared: dict[str, Any] = vars(context.session_state) if context else {"_yield_callback": None}
    interrupt, shared["_yield_callback"] = shared["_yield_callback"], lambda: None
    try:
        yield
    finally:
        shared["_yield_callback"] = interrupt


def problem_in(act: Callable[[], object]) -> str:
    """Return the reason why an action fails, or an empty text if the action succeeds."""
    try:
        act()
    except CCWSIMError as error:
        return str(error)
    return ""


def if_possible(read: Callable[[], T]) -> T | None:
    """Return the result of `read`, or None if `read` fails; another part of the page shows why."""
    try:
        return read()
    except CCWSIMError:
        return None


def user_message(error: Exception, what: str) -> str:
    """Return the message for an error; `what` is "drawn" or "done". Log unexpected errors."""
    if isinstance(error, CCWSIMError):
        return plain(str(error))
    number = logged(error)
    if isinstance(error, MemoryError):
        return page_text("Not enough memory")
    return page_text("Unexpected error", what=what, number=number)


def is_control_flow(error: Exception) -> bool:
    """Return whether Streamlit raised an exception only to stop or restart the page."""
    return type(error).__module__.startswith("streamlit.runtime.scriptrunner")
