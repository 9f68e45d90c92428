"""The memory that is available: of the container, if it has less than the machine."""

from __future__ import annotations

import ctypes
import os
from contextlib import suppress
from pathlib import Path

ROOT = Path("/")
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
"""Numbers of options in <malloc.h> of glibc."""
OWN_PIECE = 1 << 20
"""Bytes from which a piece of memory goes back to the system at once when it is free."""
UNLIMITED = 1 << 60
"""Version 1 of control groups reports about this many bytes where there is no limit."""
VERSION_1 = "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"
VERSION_2 = "memory.max", "memory.current", "inactive_file"
"""Files of control groups with limit and usage, and the field of memory that can be dropped."""


def free_memory(root: Path = ROOT) -> int | None:
    """Return the bytes available without swapping, None if the system does not tell.

    That is the least of what the machine and the control groups of this process leave.
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

    By default glibc spreads pieces over eight arenas a core and keeps larger and larger ones. So
    there are `n_arenas`, without pieces of more than `OWN_PIECE`. Call it before threads begin.
    """
    with suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        library.mallopt(M_ARENA_MAX, n_arenas)
        library.mallopt(M_MMAP_THRESHOLD, OWN_PIECE)
        library.mallopt(M_TRIM_THRESHOLD, 8 * OWN_PIECE)


def _of_groups(root: Path) -> list[int | None]:
    """Return what the control groups of this process leave it, in both versions of them."""
    found: list[int | None] = []
    for line in lines_of(root / "proc/self/cgroup"):
        _, kinds, path = [*line.split(":", 2), "", ""][:3]
        if kinds == "":
            found += _along(root / "sys/fs/cgroup", path, VERSION_2)
        elif "memory" in kinds.split(","):
            found += _along(root / "sys/fs/cgroup/memory", path, VERSION_1)
    return found


def _along(top: Path, path: str, names: tuple[str, str, str]) -> list[int | None]:
    """Return what each group from the process's own up to the top leaves.

    Inside of a container the path may be that of the host, and the top is the container's own.
    """
    parts = [part for part in path.split("/") if part not in ("", "..")]
    return [_left(top.joinpath(*parts[:n]), *names) for n in range(len(parts), -1, -1)]


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
    for line in lines_of(path):
        words = line.replace(":", " ").split()
        if len(words) > 1 and words[0] == name and words[1].isdigit():
            return int(words[1]) * unit
    return None


def _number(path: Path) -> int | None:
    text = "".join(lines_of(path)).strip()
    return int(text) if text.isdigit() else None


def lines_of(path: Path) -> list[str]:
    """Return the lines of a file of the system, none if it cannot be read."""
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
