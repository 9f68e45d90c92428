"""How a worker learns that its work is not wanted any more, and tells how far it is."""

from __future__ import annotations

import os
import shutil
import socket
import tempfile
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

POLL_SECONDS = 0.2
"""Seconds between two looks of a worker at its flag."""


class Flag(Protocol):
    """Something that a worker can look at, and leave word at."""

    def is_set(self) -> bool:
        """Say whether the work is to stop."""
        ...

    def tell(self, number: int, share: float) -> None:
        """Leave word how much of a realization is done, 0 … 1."""
        ...


class PolledFlag:
    """A flag that is looked at now and then only, as a look has its price.

    Examples
    --------
    >>> from threading import Event
    >>> PolledFlag(Event()).is_set()
    False
    """

    def __init__(self, flag: Flag, every: float = POLL_SECONDS) -> None:
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


@dataclass(frozen=True)
class FileFlag:
    """A folder of this machine that is there as long as the work is wanted.

    A worker on another machine never sees it go, and finishes its batch.

    Examples
    --------
    >>> flag = FileFlag()
    >>> before = flag.is_set()
    >>> flag.set()
    >>> before, flag.is_set()
    (False, True)
    """

    path: str = field(default_factory=lambda: tempfile.mkdtemp(prefix="ccwsim-"))
    host: str = field(default_factory=socket.gethostname)

    def set(self) -> None:
        """Ask all workers to stop."""
        shutil.rmtree(self.path, ignore_errors=True)

    def is_set(self) -> bool:
        """Say whether the work is to stop."""
        return self.host == socket.gethostname() and not os.path.exists(self.path)

    def tell(self, number: int, share: float) -> None:
        """Leave word in the folder, where it is there, how much of a realization is done, 0 … 1."""
        with suppress(FileNotFoundError):
            (Path(self.path) / str(number)).write_text(str(share))

    def shares(self, numbers: Iterable[int]) -> dict[int, float]:
        """Return what was told last of some realizations."""
        told = {}
        for number in numbers:
            with suppress(FileNotFoundError, ValueError):  # not told yet, or being written
                told[number] = float((Path(self.path) / str(number)).read_text())
        return told


@dataclass(frozen=True)
class ClusterFlag:
    """An event that the scheduler of a Dask cluster keeps."""

    name: str

    def is_set(self) -> bool:
        """Say whether the work is to stop."""
        from distributed import Event

        return bool(Event(self.name).is_set())

    def tell(self, number: int, share: float) -> None:
        """Send word to whoever listens how much of a realization is done, 0 … 1."""
        from distributed import get_worker

        get_worker().log_event(self.name, (number, share))
