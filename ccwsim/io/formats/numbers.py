"""Numbers in text, a million in a fifth of a second, with the line of what is no number."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.limits import check_time, limits
from ccwsim.model.errors import CCWSIMError

CHUNK = 2**20
"""Bytes split into words at a time, so that memory stays small."""

MAX_WORD = 80
"""No number is longer."""

_SPACE = re.compile(rb"\s")


def is_number(word: str) -> bool:
    """Return whether a word is a number (or NaN).

    Examples
    --------
    >>> is_number(" 0.0000000e+000"), is_number("sand")
    (True, False)
    """
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def numbers_in(
    content: bytes, name: str, *, start: int = 0, first_line: int = 1
) -> NDArray[np.float64]:
    """Return all numbers of a text from byte `start` on.

    Parameters
    ----------
    content : bytes
        Numbers between white space.
    name : str
        What to call the file in messages.
    start, first_line : int
        Where the numbers begin, and the number of that line.

    Raises
    ------
    CCWSIMError
        For a word that is not a finite number or NaN, or too many of them; names its line.

    Examples
    --------
    >>> numbers_in(b"1 2.5\\n nan", "text")
    array([1. , 2.5, nan])
    """
    parts: list[NDArray[np.float64]] = []
    n, at, line = 0, start, first_line
    while at < len(content):
        cut = _SPACE.search(content, at + CHUNK)
        end = cut.start() if cut else len(content)
        chunk = content[at:end]
        parts.append(_parsed(chunk, name, line))
        n += len(parts[-1])
        if n > limits().cells:
            raise CCWSIMError(f"{name}: more than {limits().cells} values; cut a smaller piece")
        check_time(name)
        line += chunk.count(b"\n")
        at = end
    return np.concatenate(parts) if parts else np.empty(0)


def _parsed(chunk: bytes, name: str, line: int) -> NDArray[np.float64]:
    words = chunk.split()
    if not words:
        return np.empty(0)
    if b"_" not in chunk and len(max(words, key=len)) <= MAX_WORD:
        try:
            values = np.array(words, dtype=np.float64)
        except ValueError:
            pass
        else:
            if not np.isinf(values).any():
                return values
    raise CCWSIMError(_first_bad(chunk, name, line))


def _first_bad(chunk: bytes, name: str, line: int) -> str:
    for k, text in enumerate(chunk.split(b"\n")):
        for word in text.split():
            said = word[:MAX_WORD].decode("latin-1")
            if len(word) > MAX_WORD or not is_number(said) or np.isinf(float(said)):
                return f"{name}, line {line + k}: {said[:30]!r} is not a number; correct it"
    return f"{name}: a value after line {line} is not a number; correct it"
