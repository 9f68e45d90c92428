"""How a worker learns that its work is not wanted any more."""

from __future__ import annotations

import os
import socket
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Protocol

LOOK_EVERY = 0.2
"""Seconds between two looks of a worker at its flag."""


class Flag(Protocol):
    """Something that a worker can look at."""

    def is_set(self) -> bool:
        """Say whether the work is to stop."""
        ...


class Seldom:
    """A flag that is looked at now and then only, as a look has its price.

    Examples
    --------
    >>> from threading import Event
    >>> Seldom(Event()).is_set()
    False
    """

    def __init__(self, flag: Flag, every: float = LOOK_EVERY) -> None:
        self._flag = flag
        self._every = every
        self._next = 0.0
        self._seen = False

    def is_set(self) -> bool:
        """Say what the last look showed."""
        if not self._seen and time.monotonic() >= self._next:
            self._seen = self._flag.is_set()
            self._next = time.monotonic() + self._every
        return self._seen


def _marker() -> str:
    handle, path = tempfile.mkstemp(prefix="ccwsim-")
    os.close(handle)
    return path


@dataclass(frozen=True)
class FileFlag:
    """A file of this machine that is there as long as the work is wanted.

    A worker on another machine never sees it raised, and finishes its batch.

    Examples
    --------
    >>> flag = FileFlag()
    >>> before = flag.is_set()
    >>> flag.set()
    >>> before, flag.is_set()
    (False, True)
    """

    path: str = field(default_factory=_marker)
    host: str = field(default_factory=socket.gethostname)

    def set(self) -> None:
        """Ask all workers to stop."""
        with suppress(FileNotFoundError):
            os.unlink(self.path)

    def is_set(self) -> bool:
        """Say whether the work is to stop."""
        return self.host == socket.gethostname() and not os.path.exists(self.path)


@dataclass(frozen=True)
class ClusterFlag:
    """An event that the scheduler of a Dask cluster keeps."""

    name: str

    def is_set(self) -> bool:
        """Say whether the work is to stop."""
        from distributed import Event

        return bool(Event(self.name).is_set())
