"""Files that are replaced whole or not at all."""

from __future__ import annotations

import os
import secrets
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from ccwsim.model.errors import CCWSIMError

try:
    import fcntl
except ImportError:  # not on Windows, where an open file cannot be deleted anyway
    fcntl: Any = None

MIN_AGE = 60.0
"""Seconds before a file that nobody writes is one that a run left when it was killed."""


@contextmanager
def unwritable(path: str | os.PathLike[str]) -> Iterator[None]:
    """Say errors of the system as a CCWSIMError that names the file."""
    try:
        yield
    except CCWSIMError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise CCWSIMError(f"{os.fspath(path)} cannot be written: {reason}") from error


def check_replaceable(path: str | os.PathLike[str]) -> Path:
    """Return the file that a path leads to, through links, or say that it must stay as it is."""
    with unwritable(path):
        target = Path(os.path.realpath(path))
        if target.exists() and not target.is_file():
            raise OSError("it is no file; give another one")
        if target.exists() and not target.stat().st_mode & 0o222:
            raise OSError("it is read-only; make it writable or give another one")
    return target


class WholeFile:
    """A temporary file beside its target, in whose place it comes as a whole.

    It gets the mode of the target. What earlier runs of the same target left when they were killed
    is deleted.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._target = check_replaceable(path)
        delete_left_over(self._target)
        name = f"{_start_of(self._target)}{secrets.token_hex(6)}.tmp"
        self._beside = self._target.with_name(name)
        self.file: BinaryIO = self._beside.open("xb+")
        try:
            if fcntl:
                fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if self._target.exists():
                os.chmod(self._beside, stat.S_IMODE(self._target.stat().st_mode))
        except OSError:  # a file system without locks or modes: the file is as good
            pass

    def commit(self) -> Path:
        """Put the file in place of its target, and return its path."""
        self.file.flush()
        os.fsync(self.file.fileno())
        self.file.close()
        self._beside.replace(self._target)
        return self._target

    def drop(self) -> None:
        """Delete the temporary file, if it still exists."""
        with suppress(OSError, ValueError):
            self.file.close()
        with suppress(OSError, ValueError):
            self._beside.unlink(missing_ok=True)


def delete_left_over(target: Path) -> None:
    """Delete old temporary files of a target that no process writes any more."""
    if fcntl is None:
        return
    with suppress(OSError):
        for path in target.parent.iterdir():
            name = path.name
            if not (name.startswith(_start_of(target)) and name.endswith(".tmp")):
                continue
            with suppress(OSError), path.open("rb") as file:
                if time.time() - path.stat().st_mtime > MIN_AGE:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # an error if it is written
                    path.unlink()


def _start_of(target: Path) -> str:
    return f".{target.name[:100]}."
