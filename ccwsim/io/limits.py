"""Limits of files, checked before memory is allocated.

Scripts have wide limits, and uploads to a public server have narrow limits. The context
manager `limited` sets the limits of all readers that are called inside it.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, replace
from math import inf, prod
from typing import Any

from ccwsim.model import CCWSIMError, refused, shown

MIB = 2**20


@dataclass(frozen=True)
class FileLimits:
    """Limits of one file. The defaults are for scripts and exceed the sizes of real files."""

    bytes: int = 16 * 1024 * MIB  # size of the file
    unpacked: int = 64 * 1024 * MIB  # total size of all parts of a file, unpacked in memory
    cells: int = 4_000_000_000  # number of values of all variables, or pixels of a picture
    whole: int = 4_000_000_000  # like `cells`, for a file that is read only in part
    points: int = 10_000_000  # number of hard data; each is checked during simulation and drawn
    lines: int = 200_000_000  # number of lines of a text table; each becomes an object
    line_bytes: int = 1024 * MIB  # bytes of one line, which becomes one object
    fields: int = 100_000_000  # number of fields of a table that are read one by one
    variables: int = 1000  # number of variables or columns, of which a user chooses one in a list
    members: int = 2000  # number of files in a zip; Python creates an object for each file
    # for a file that another process reads (`ccwsim.io.isolated`)
    memory: int = 64 * 1024 * MIB  # bytes of memory that reading takes
    seconds: float = inf  # processor time of reading


SCRIPT_LIMITS = FileLimits()

UPLOAD_LIMITS = FileLimits(
    bytes=64 * MIB,
    unpacked=128 * MIB,
    cells=4_000_000,
    whole=70_000_000,
    points=100_000,
    lines=500_000,
    line_bytes=MIB,
    fields=500_000,
    memory=1024 * MIB,
    seconds=10.0,
)
"""Limits of uploads; they allow the paper's largest image, which has 2000 × 2000 cells."""

_limits: ContextVar[FileLimits] = ContextVar("limits", default=SCRIPT_LIMITS)


def limits() -> FileLimits:
    """Return the current limits; by default, the limits of scripts."""
    return _limits.get()


@contextmanager
def limited(to: FileLimits) -> Iterator[None]:
    """Apply all limits except `memory` and `seconds` to readers called inside the block.

    Examples
    --------
    >>> with limited(UPLOAD_LIMITS):
    ...     limits().cells
    4000000
    """
    token = _limits.set(to)
    try:
        yield
    finally:
        _limits.reset(token)


class TooManyCells(CCWSIMError):
    """A file with more cells than the limit: message, largest array's shape, number of values."""

    def __str__(self) -> str:
        return self.args[0]

    def grid(self) -> tuple[tuple[int, ...], float]:
        """Return the largest shape, and all values / its values; raise if no part can be read."""
        _, shape, n = self.args
        shape = shape[-3:] if shape[-3:-2] != (1,) else shape[-2:]
        if len(shape) < 2 or n > limits().whole:
            raise self
        return shape, n / prod(shape)


def check_cells(name: str, shape: tuple[float, ...]) -> int:
    """Return the number of values of an array; raise an error if it is impossible or too large."""
    return check_arrays(name, [shape])


def check_arrays(name: str, shapes: Sequence[tuple[float, ...]]) -> int:
    """Return the number of values of arrays; raise an error for impossible or too large arrays."""
    for shape in shapes:
        if min(shape, default=0) < 1 or any(side % 1 != 0 for side in shape):
            raise refused("impossible_grid", name=name, shape=_sides(shape))
    counts = [prod(shape) if len(shape) <= 32 else inf for shape in shapes]
    n, most = sum(counts), limits().cells
    if n > most:
        largest, several = shapes[counts.index(max(counts))], len(shapes) > 1
        of_all = f"{n} values in {len(shapes)} arrays" if several else f"{_sides(largest)} values"
        remedy = "cut a smaller piece, or read it in a script"
        raise TooManyCells(f"{name}: {of_all} are more than {most}; {remedy}", largest, n)
    return int(n)


def _sides(shape: tuple[float, ...]) -> str:
    return " × ".join(map(shown, shape[:6])) + (" × …" if len(shape) > 6 else "")


def check_table(name: str, n_rows: int, n_columns: int) -> None:
    """Raise an error if a table has too many columns or values, or no rows."""
    check(name, variables=n_columns)
    if not n_rows:
        raise CCWSIMError(f"{name} has no rows; give at least one datum")
    check_cells(name, (n_rows * n_columns,))


def check(name: str, **counts: int) -> None:
    """Raise an error if a file has more of something than the limit of the same name allows."""
    for key, n in counts.items():
        most = getattr(limits(), key)
        if n > most:
            written = _megabytes if key in ("bytes", "unpacked") else str
            raise refused(f"limit_of_{key}", name=name, n=written(n), most=written(most))


def _megabytes(n_bytes: int) -> str:
    return f"{n_bytes / MIB:.3g}" if n_bytes < 1000 * MIB else f"{n_bytes // MIB}"


VARIABLES = {
    "bytes": "CCWSIM_MAX_UPLOAD_BYTES",
    "unpacked": "CCWSIM_MAX_UPLOAD_UNPACKED_BYTES",
    "cells": "CCWSIM_MAX_UPLOAD_CELLS",
    "whole": "CCWSIM_MAX_UPLOAD_WHOLE_CELLS",
    "points": "CCWSIM_MAX_UPLOAD_POINTS",
    "lines": "CCWSIM_MAX_UPLOAD_LINES",
    "memory": "CCWSIM_MAX_UPLOAD_MEMORY",
    "seconds": "CCWSIM_MAX_UPLOAD_SECONDS",
}
"""Environment variables that set the limits of uploads on a server."""


def upload_limits(environment: Mapping[str, str] | None = None) -> FileLimits:
    """Return the limits of uploads, as set by the environment variables of the server.

    Raises `CCWSIMError` for a variable that is not a number above 0.

    Examples
    --------
    >>> upload_limits({"CCWSIM_MAX_UPLOAD_CELLS": "1000000"}).cells
    1000000
    """
    settings = os.environ if environment is None else environment
    changed: dict[str, Any] = {}
    for name, variable in VARIABLES.items():
        if text := settings.get(variable, "").strip():
            kind = type(getattr(UPLOAD_LIMITS, name))
            with suppress(ValueError, OverflowError):
                changed[name] = kind(float(text))  # accept 4e6 for integers, too
            if not changed.get(name, 0) > 0:
                message = f"{variable} = {shown(text)} must be a number above 0; correct it"
                raise CCWSIMError(message)
    return replace(UPLOAD_LIMITS, **changed)
