"""A description of the machine, to be reported with measured times."""

import os
import platform
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from ccwsim.system.memory import free_memory, lines_of


@dataclass(frozen=True)
class Machine:
    """The machine on which times were measured; `free_bytes` is None if unknown."""

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


def n_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def this_machine() -> Machine:
    """Return a description of this machine, with the memory that is available now."""
    lines = lines_of(Path("/proc/cpuinfo"))
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    name = next(named, "") or platform.processor() or platform.machine() or "unknown processor"
    return Machine(
        processor=name,
        n_cores=n_cores(),
        system=platform.system(),
        python=platform.python_version(),
        numpy=version("numpy"),
        numba=version("numba"),
        free_bytes=free_memory(),
    )
