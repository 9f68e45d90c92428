"""Errors of background work: a short reason for the user, and a log entry with the cause."""

import logging
import secrets

from ccwsim.model import CCWSIMError

LOG = logging.getLogger("ccwsim")


def reason(error: Exception) -> str:
    """Return the reason for an error in a few words; unexpected errors are logged."""
    if isinstance(error, CCWSIMError):
        return str(error)
    if isinstance(error, MemoryError):
        return "it does not fit into memory; ask for fewer realizations or a smaller grid"
    return f"an error, number {logged(error)} in the server's log; report it if it happens again"


def logged(error: BaseException) -> str:
    """Log an error with its traceback, at most once, and return the number of its log entry."""
    number = getattr(error, "number_in_log", "")
    if not number:
        number = secrets.token_hex(3)
        error.number_in_log = number  # type: ignore[attr-defined]
        LOG.error("trouble %s: %s", number, type(error).__name__, exc_info=error)
    return number
