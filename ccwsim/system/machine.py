"""The machine that measures: times mean little without it."""

from __future__ import annotations

import os
import platform
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np

from ccwsim.system.workers import n_cores


@dataclass(frozen=True)
class Machine:
    """What times were measured on.

    Attributes
    ----------
    processor : str
        Its name where the system tells it, else its architecture.
    n_cores : int
        Cores that this process may use.
    system, python, numpy, numba : str
        The operating system, and versions.
    free_bytes : int or None
        Memory that is available now, None where the system does not tell.
    """

    processor: str
    n_cores: int
    system: str
    python: str
    numpy: str
    numba: str
    free_bytes: int | None

    def __str__(self) -> str:
        cores = "1 core" if self.n_cores == 1 else f"{self.n_cores} cores"
        return (
            f"{self.processor}, {cores}, {self.system}, Python {self.python}, "
            f"NumPy {self.numpy}, numba {self.numba}"
        )


def this_machine() -> Machine:
    """Return the machine that this runs on.

    Examples
    --------
    >>> this_machine().n_cores >= 1
    True
    """
    return Machine(
        _processor(), n_cores(), platform.system(), platform.python_version(),
        np.__version__, numba.__version__, _free_bytes(),
    )  # fmt: skip


def _processor() -> str:
    named = _line("/proc/cpuinfo", "model name")
    return named or platform.processor() or platform.machine() or "unknown processor"


def _free_bytes() -> int | None:
    """Return the memory that can be had without swapping, as Linux estimates it."""
    said = _line("/proc/meminfo", "MemAvailable").removesuffix(" kB")
    if said.isdigit():
        return 1024 * int(said)
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def _line(path: str, name: str) -> str:
    try:
        lines = Path(path).read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    found = (line.partition(":")[2].strip() for line in lines if line.startswith(name))
    return next(found, "")
