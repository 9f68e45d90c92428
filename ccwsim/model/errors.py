"""Errors with messages that name the value and the remedy."""

import sys
import warnings
from functools import cache
from reprlib import Repr
from typing import Any

from ccwsim.model.assets import read_toml


class CCWSIMError(ValueError):
    """Invalid input; the message names the value and the remedy."""


@cache
def _messages() -> dict[str, str]:
    return read_toml("model/errors.toml")


def refused(key: str, /, **values: object) -> CCWSIMError:
    """Return the error with a message of `errors.toml`, which contains the longer messages."""
    return CCWSIMError(_messages()[key].format(**values))


class Cancelled(CCWSIMError):
    """The user stopped a simulation; `ensemble` contains finished realizations, if any."""

    def __init__(self, message: str, ensemble: Any = None) -> None:
        super().__init__(message)
        self.ensemble = ensemble  # an `Ensemble`, whose import here would be circular


def warn(message: str) -> None:
    """Warn at the line of the user's code that led here."""
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("ccwsim."):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, stacklevel=level)


_SHORT = Repr()
_SHORT.maxstring = _SHORT.maxother = 80
_SHORT.maxtuple = _SHORT.maxlist = 10


def shown(value: object) -> str:
    """Return the `repr` of a value for a message, shortened and on one line."""
    if isinstance(value, (bytes, bytearray)):
        value = bytes(value[:60])
    try:
        return " ".join(_SHORT.repr(value).split())
    except Exception:  # such as an integer with more digits than Python prints
        return f"a value of type {type(value).__name__}"
