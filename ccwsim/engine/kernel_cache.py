"""Where compiled kernels are kept between runs: in a folder named after the content of all kernels.

A kernel that calls another one has that one compiled into it, so that any change of a file with
kernels, or of how they are compiled, makes all of them anew.
"""

from __future__ import annotations

import atexit
import os
import re
import shutil
import tempfile
import time
from contextlib import suppress
from hashlib import blake2b
from pathlib import Path

import numba

PACKAGE = Path(__file__).parents[1]
FOLDER_VARIABLE = "_CCWSIM_KERNELS"
"""Environment variable by which a process that compiles for another one knows where to."""
DECORATED = re.compile(rb"^@\w*kernel$", re.MULTILINE)
UNUSED_DAYS = 7
"""Folders of other versions are removed if they were not used for so long."""


def _digest_of_sources(package: Path = PACKAGE) -> str:
    sums = blake2b(digest_size=8)
    for source in sorted(package.rglob("*.py")):
        text = source.read_bytes()
        has_kernel = DECORATED.search(text) or source.name in ("kernels.py", "numba_hooks.py")
        sums.update(text if has_kernel or source.parent.name in ("stages", "corrections") else b"")
    return sums.hexdigest()


SOURCE = _digest_of_sources()
"""A short name of the content of all files with kernels."""
NAME = f"kernels-{SOURCE}-numba{numba.__version__}"
"""The name of the folder."""


def _cache_folder() -> str:
    """Return where compiled kernels are kept: beside the package, or where the user may write.

    If nothing can be written, as in a container whose files are read-only, kernels that were
    compiled beforehand are copied to a temporary folder, which Numba wants to write to. Empty if
    that is impossible too.
    """
    if given := os.environ.get(FOLDER_VARIABLE):
        return given
    places = [PACKAGE / "__pycache__" / NAME]
    with suppress(RuntimeError):  # a user without a home, as in some containers
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        places.append(home / "ccwsim" / NAME)
    for place in places:
        if _is_writable(place):
            return str(place)
    warm = [place for place in places if place.is_dir()]
    try:
        temporary = tempfile.mkdtemp(prefix="ccwsim-")
    except OSError:
        return ""
    atexit.register(shutil.rmtree, temporary, ignore_errors=True)
    folder = Path(temporary) / NAME
    for file in warm[0].rglob("*.nb[ic]") if warm else ():  # not shutil.copytree: it copies modes
        copy = folder / file.relative_to(warm[0])
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
    return str(folder)


def _is_writable(place: Path) -> bool:
    """Return whether a folder can be written to, or made."""
    there = next(folder for folder in (place, *place.parents) if folder.exists())
    return os.access(there, os.W_OK | os.X_OK)


FOLDER = _cache_folder()
"""Where compiled kernels are kept; empty if nothing can be written."""


def note_use(folder: str) -> None:
    """Let a folder of kernels be known as used now."""
    with suppress(OSError):
        os.utime(folder)


def remove_unused(folder: str, days: float = UNUSED_DAYS) -> None:
    """Remove the folders of other versions beside a folder, unless used in the last days.

    A process notes the use of its folder when it starts and when it compiles. One that has run
    longer has its kernels in memory, and compiles others anew.
    """
    own = Path(folder)
    for other in own.parent.glob("kernels-*"):
        with suppress(OSError):
            if other.name != own.name and time.time() - other.stat().st_mtime > 86400 * days:
                shutil.rmtree(other, ignore_errors=True)


note_use(FOLDER)
