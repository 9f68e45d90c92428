"""Store compiled kernels on disk, in a folder named after the content of all kernels.

The code of a kernel includes the functions that the kernel calls. If the way of compiling or any
file with kernels changes, all kernels are therefore recompiled into a new folder.
"""

import atexit
import os
import re
import shutil
import sys
import tempfile
import time
from contextlib import suppress
from hashlib import blake2b
from pathlib import Path

import numba
from numba import config

PACKAGE = Path(__file__).parents[1]
FOLDER_VARIABLE = "_CCWSIM_KERNELS"
"""Environment variable that contains the folder of kernels, for compiling processes."""
DECORATED = re.compile(rb"^@\w*kernel$", re.MULTILINE)
USER_CACHES = {"darwin": "Library/Caches", "win32": "AppData/Local"}
"""Folder for caches in the home folder, by platform; ".cache" on other platforms."""
UNUSED_DAYS = 7  # number of days without use after which folders of other versions are removed


def _digest_of_sources(package: Path = PACKAGE) -> str:
    sums = blake2b(digest_size=8)
    for source in sorted(package.rglob("*.py")):
        text = source.read_bytes()
        has_kernel = DECORATED.search(text) or source.name in ("kernels.py", "numba_hooks.py")
        sums.update(text if has_kernel or source.parent.name in ("stages", "corrections") else b"")
    return sums.hexdigest()


SOURCE = _digest_of_sources()  # digest of all files that contain kernels
CHECKED = "-checked" if getattr(config, "BOUNDSCHECK", None) else ""
NAME = f"kernels-{SOURCE}-numba{numba.__version__}{CHECKED}"
"""Name of the folder that contains the compiled kernels.

Kernels that check the bounds of arrays (`NUMBA_BOUNDSCHECK=1`) have a folder of their own, because
Numba would load unchecked code otherwise."""


def _user_folder() -> Path | None:
    """Return the folder of compiled kernels of this user, or None without a home folder."""
    caches = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not caches.is_absolute():
        try:
            caches = Path.home() / USER_CACHES.get(sys.platform, ".cache")
        except RuntimeError:  # in some containers users have no home folder
            return None
    return caches / "ccwsim" / NAME


def _cache_folder() -> str:
    """Return the folder of compiled kernels in the user's cache folder.

    If this folder is not writable, for example in a read-only container, its kernels are copied to
    a temporary folder, because Numba needs a writable folder. Return "" if no temporary folder can
    be created.
    """
    if folder_of_parent := os.environ.get(FOLDER_VARIABLE):
        return folder_of_parent
    place = _user_folder()
    if place and _is_writable(place):
        return str(place)
    try:
        temporary = tempfile.mkdtemp(prefix="ccwsim-")
    except OSError:
        return ""
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    folder = Path(temporary) / NAME
    if place and os.path.isdir(place):
        for file in place.rglob("*.nb[ic]"):  # shutil.copytree would copy file modes
            copy = folder / file.relative_to(place)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, copy)
    return str(folder)


def _is_writable(place: Path) -> bool:
    """Return whether a folder is writable or can be created."""
    # unlike `Path.exists`, this function raises no error if a folder is not accessible
    existing = next(folder for folder in (place, *place.parents) if os.path.exists(folder))
    return os.access(existing, os.W_OK | os.X_OK)


FOLDER = _cache_folder()  # folder of compiled kernels; an empty string if no folder is writable


def note_use(folder: str) -> None:
    """Record the current time as the last use of a folder of kernels."""
    with suppress(OSError):
        os.utime(folder)


def remove_unused(folder: str, days: float = UNUSED_DAYS) -> None:
    """Remove the folders of other versions beside `folder` that were not used for `days` days.

    A process records the use of its folder when it starts and when it compiles. A process that runs
    longer than `days` days has its kernels in memory and recompiles missing kernels.
    """
    current = Path(folder)
    for other in current.parent.glob("kernels-*"):
        with suppress(OSError):
            if other.name != current.name and time.time() - other.stat().st_mtime > 86400 * days:
                shutil.rmtree(other, ignore_errors=True)


note_use(FOLDER)
