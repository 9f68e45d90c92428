"""The memory that is available: of the container, if it has less than the machine."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

ROOT = Path("/")
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
"""Numbers of options in <malloc.h> of glibc."""
OWN_PIECE = 1 << 20
"""Bytes from which a piece of memory goes back to the system at once when it is free."""
UNLIMITED = 1 << 60
"""Version 1 of control groups reports about this many bytes where there is no limit."""


def free_memory(root: Path = ROOT) -> int | None:
    """Return the bytes available without swapping, None if the system does not tell.

    That is the least of what the machine and the control groups of this process leave. `root` has
    the folders /proc and /sys.
    """
    found = [_field(root / "proc/meminfo", "MemAvailable"), *_of_groups(root)]
    known = [free for free in found if free is not None]
    return max(min(known), 0) if known else _of_pages()


def used_memory(root: Path = ROOT, process: int | None = None) -> int | None:
    """Return the bytes that a process, this one by default, holds; None where nobody tells."""
    return _field(root / f"proc/{process or 'self'}/status", "VmRSS")


def give_back_memory() -> None:
    """Give free memory of this process back to the system, if its C library can."""
    # glibc keeps what threads freed in an arena of each thread, and gives it back only when asked:
    # without this call a server holds the memory of its largest run for as long as it lives.
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def settle_memory(n_arenas: int) -> None:
    """Let memory that threads free go back to the system, if the C library can.

    By default glibc takes pieces from eight arenas for each core: what sessions free is then spread
    over all of them, a little in each page. And it takes larger and larger pieces from there, maps
    of 32 MB at last, whose place it keeps. So there are `n_arenas`, and none has pieces of more
    than `OWN_PIECE`. To be called before many threads have begun.
    """
    with suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        library.mallopt(M_ARENA_MAX, n_arenas)
        library.mallopt(M_MMAP_THRESHOLD, OWN_PIECE)
        library.mallopt(M_TRIM_THRESHOLD, 8 * OWN_PIECE)


def _of_groups(root: Path) -> list[int | None]:
    """Return what the control groups of this process leave it, in both versions of them."""
    found: list[int | None] = []
    for line in _lines(root / "proc/self/cgroup"):
        _, kinds, path = [*line.split(":", 2), "", ""][:3]
        if kinds == "":
            found += _along(root / "sys/fs/cgroup", path, _of_version_2)
        elif "memory" in kinds.split(","):
            found += _along(root / "sys/fs/cgroup/memory", path, _of_version_1)
    return found


def _along(top: Path, path: str, free: Callable[[Path], int | None]) -> list[int | None]:
    """Return what each group from the process's own up to the top leaves.

    Inside of a container the path may be that of the host, and the top is the container's own.
    """
    parts = [part for part in path.split("/") if part not in ("", "..")]
    return [free(top.joinpath(*parts[:n])) for n in range(len(parts), -1, -1)]


def _of_version_2(group: Path) -> int | None:
    return _left(group, "memory.max", "memory.current", "inactive_file")


def _of_version_1(group: Path) -> int | None:
    limit, usage = "memory.limit_in_bytes", "memory.usage_in_bytes"
    return _left(group, limit, usage, "total_inactive_file")


def _left(group: Path, limit: str, usage: str, reclaimable: str) -> int | None:
    """Return what is left of a limit; files that were read can be dropped, and do not count."""
    maximum, used = _number(group / limit), _number(group / usage)
    if maximum is None or used is None or maximum >= UNLIMITED:
        return None
    return maximum - used + (_field(group / "memory.stat", reclaimable, unit=1) or 0)


def _of_pages() -> int | None:
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def _field(path: Path, name: str, unit: int = 1024) -> int | None:
    """Return the number behind a name, as "MemAvailable: 123 kB" has it."""
    for line in _lines(path):
        words = line.replace(":", " ").split()
        if len(words) > 1 and words[0] == name and words[1].isdigit():
            return int(words[1]) * unit
    return None


def _number(path: Path) -> int | None:
    text = "".join(_lines(path)).strip()
    return int(text) if text.isdigit() else None


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return []


def format_bytes(number: float) -> str:
    """Say an amount of memory.

    Examples
    --------
    >>> format_bytes(12.3e9), format_bytes(45e6)
    ('12.3 GB', '45 MB')
    """
    return f"{number / 1e9:.1f} GB" if number >= 1e9 else f"{number / 1e6:.0f} MB"
