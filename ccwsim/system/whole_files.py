"""Files that are replaced completely or not at all."""

import os
import secrets
import shutil
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from ccwsim.model import CCWSIMError, format_bytes

try:
    import fcntl
except ImportError:  # Windows does not let open files be deleted anyway
    fcntl: Any = None

TRIAL_BYTES = 65536  # written to find out whether a folder is full
MIN_AGE = 60.0  # minimum age in seconds of a temporary file that a killed run may have left


@contextmanager
def unwritable(path: str | os.PathLike[str]) -> Iterator[None]:
    """Convert operating-system errors to a `CCWSIMError` that names the file."""
    try:
        yield
    except CCWSIMError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        name = "".join(c for c in str(os.fspath(path))[:500] if c.isprintable())
        raise CCWSIMError(f"{name} cannot be written: {reason}") from error


def check_replaceable(path: str | os.PathLike[str]) -> Path:
    """Follow links and return the file behind a path; raise if the file cannot be replaced."""
    with unwritable(path):
        target = Path(os.path.realpath(path))
        if target.exists() and not target.is_file():
            raise OSError("it is not a regular file; give another path")
        if target.exists() and not target.stat().st_mode & 0o222:
            raise OSError("it is read-only; make it writable or give another path")
    return target


def check_writable(path: str | os.PathLike[str], n_bytes: int = 0) -> None:
    """Raise an error if a file of `n_bytes` cannot be written; an existing file is kept."""
    with unwritable(path):
        folder = check_replaceable(path).parent
        if not folder.is_dir():
            raise OSError(f"there is no folder {folder}; create it first")
        if n_bytes > (free := shutil.disk_usage(folder).free):
            raise OSError(
                f"{format_bytes(n_bytes)} do not fit into {folder}, which has {format_bytes(free)} "
                "free; write less, another format, or to another folder"
            )
        trial = WholeFile(path)
        try:
            trial.file.write(bytes(TRIAL_BYTES))
            trial.file.flush()
            os.fsync(trial.file.fileno())
        finally:
            trial.drop()


class WholeFile:
    """A temporary file with the permissions of its target, which it replaces when complete."""

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
        except OSError:  # the file system has no locks or modes, which are not essential
            pass

    def commit(self) -> Path:
        """Replace the target by the temporary file, and return the path of the target."""
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
    """Delete old temporary files of a target, except files to which a process writes."""
    if fcntl is None:
        return
    with suppress(OSError):
        for path in target.parent.iterdir():
            name = path.name
            if not (name.startswith(_start_of(target)) and name.endswith(".tmp")):
                continue
            with suppress(OSError), path.open("rb") as file:
                if time.time() - path.stat().st_mtime > MIN_AGE:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # fails while a process writes
                    path.unlink()


def _start_of(target: Path) -> str:
    return f".{target.name[:100]}."
