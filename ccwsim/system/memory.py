"""The available memory of the machine, or of the container if the container has less."""

import ctypes
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

ROOT = Path("/")
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8
"""Codes of three options of `mallopt`, from <malloc.h> of glibc."""
OWN_PIECE = 1 << 20
"""Minimum size in bytes of allocations that return to the system as soon as they are freed."""
UNLIMITED = 1 << 60
"""In control groups of version 1, a limit of at least this many bytes means "no limit"."""
VERSION_1 = "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"
VERSION_2 = "memory.max", "memory.current", "inactive_file"
"""For each version of control groups: the file with the limit, the file with the usage, and the
name of the entry for reclaimable memory."""


def free_memory(root: Path = ROOT) -> int | None:
    """Return the bytes available to machine and control groups, or None if unknown."""
    limits = [_field(root / "proc/meminfo", "MemAvailable"), *_free_in_groups(root)]
    known_limits = [free for free in limits if free is not None]
    return max(min(known_limits), 0) if known_limits else _free_pages()


def used_memory(root: Path = ROOT, process: int | None = None) -> int | None:
    """Return the bytes of memory that a process uses, by default this process; None if unknown."""
    return _field(root / f"proc/{process or 'self'}/status", "VmRSS")


def proportional_memory(process: int, root: Path = ROOT) -> int:
    """Return the bytes of memory of a process, with a share of shared pages; 0 if unknown.

    A page that n processes share counts as 1 / n of a page.
    """
    return _field(root / f"proc/{process}/smaps_rollup", "Pss") or 0


def address_space() -> int | None:
    """Return the bytes of address space of this process; None if unknown."""
    return _field(ROOT / "proc/self/status", "VmSize")


def give_back_memory() -> None:
    """Give freed memory of this process back to the system, if the C library can."""
    # glibc keeps freed memory in the arenas of threads and returns it only on request. Without this
    # call, a server would hold the memory of its largest run until the server ends.
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def settle_memory(n_arenas: int) -> None:
    """Configure the C library, before threads start, to return the memory that they free."""
    with suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        library.mallopt(M_ARENA_MAX, n_arenas)
        library.mallopt(M_MMAP_THRESHOLD, OWN_PIECE)
        library.mallopt(M_TRIM_THRESHOLD, 8 * OWN_PIECE)


def _free_in_groups(root: Path) -> Iterator[int | None]:
    """Yield the bytes available in the control groups (versions 1 and 2) of this process."""
    for line in lines_of(root / "proc/self/cgroup"):
        _, kinds, path = [*line.split(":", 2), "", ""][:3]
        if kinds == "":
            yield from _along(root / "sys/fs/cgroup", path, VERSION_2)
        elif "memory" in kinds.split(","):
            yield from _along(root / "sys/fs/cgroup/memory", path, VERSION_1)


def _along(top: Path, path: str, names: tuple[str, str, str]) -> list[int | None]:
    """Return the bytes available in each group up to the top, in a container its own group."""
    parts = [part for part in path.split("/") if part not in ("", "..")]
    groups = (top.joinpath(*parts[:n]) for n in range(len(parts), -1, -1))
    return [_unused(group, names) for group in groups]


def _unused(group: Path, names: tuple[str, str, str]) -> int | None:
    """Return the unused bytes below the limit of a group. Cached files count as unused."""
    limit, usage, reclaimable = names
    maximum, used = _number(group / limit), _number(group / usage)
    if maximum is None or used is None or maximum >= UNLIMITED:
        return None
    return maximum - used + (_field(group / "memory.stat", reclaimable, unit=1) or 0)


def _free_pages() -> int | None:
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def _field(path: Path, name: str, unit: int = 1024) -> int | None:
    """Return the number after a name in a file with lines such as "MemAvailable: 123 kB"."""
    for line in lines_of(path):
        words = line.replace(":", " ").split()
        if len(words) > 1 and words[0] == name and words[1].isdigit():
            return int(words[1]) * unit
    return None


def _number(path: Path) -> int | None:
    text = "".join(lines_of(path)).strip()
    return int(text) if text.isdigit() else None


def lines_of(path: Path) -> list[str]:
    """Return the lines of a system file, or no lines if it cannot be read."""
    try:
        return path.read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return []
