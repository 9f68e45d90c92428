"""The limits of a server, set by environment variables, and the resources a run demands."""

import os
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from ccwsim.jobs.child import memory_of_children
from ccwsim.model import CCWSIMError, format_bytes, refused
from ccwsim.system.machine import n_cores
from ccwsim.system.memory import free_memory, used_memory

CELLS_VARIABLE = "CCWSIM_MAX_CELLS"
DATA_VARIABLE = "CCWSIM_MAX_DATA"
JOBS_VARIABLE = "CCWSIM_JOBS"
MEMORY_VARIABLE = "CCWSIM_MEMORY_MB"
HISTORY_VARIABLE = "CCWSIM_HISTORY_MB"
UPLOADS_VARIABLE = "CCWSIM_UPLOADS_MB"
PROCESSES_VARIABLE = "CCWSIM_PROCESSES"  # environment variables
DEFAULT_HISTORY = 256
DEFAULT_UPLOADS = 1024
RESERVE = 128 * 10**6  # bytes of memory reserved for the pages

UNASKED_SECONDS, UNASKED_CELLS, UNASKED_BYTES = 120.0, 500_000_000, 10**9
"""A study from a link or a project needs confirmation if its run takes more seconds, simulates more
cells, or takes more bytes of memory than this."""
UNASKED_SHARE = 0.5
"""Confirmation is also needed if the run takes more than this share of the free memory."""


@dataclass(frozen=True)
class Demand:
    """The resources that a run demands: cells of all realizations, hard data, bytes of memory."""

    n_cells: int
    n_data: int = 0
    n_bytes: int = 0


@dataclass(frozen=True)
class ServerLimits:
    """The limits of a server; by default only memory is limited."""

    cells: int | None  # maximum cells × realizations of a run; None means no limit
    data: int | None  # maximum number of hard data of a run; None means no limit
    n_slots: int  # maximum number of short jobs that are active at a time, over all sessions
    memory: int | None  # bytes for the program; None means all memory of the machine
    history: int  # maximum bytes of earlier runs kept by a session
    uploads: int  # maximum bytes of all uploaded files, also those kept for a reload
    processes: bool = False  # whether runs simulate in worker processes

    def check(self, demand: Demand) -> None:
        """Raise `CCWSIMError` if a run is larger than this server allows, and give advice."""
        if self.cells is not None and demand.n_cells > self.cells:
            raise CCWSIMError(
                f"{format_millions(demand.n_cells)} cells × realizations are more than the "
                f"{format_millions(self.cells)} that this server allows for one run: "
                "simulate fewer realizations or a smaller grid"
            )
        if self.data is not None and demand.n_data > self.data:
            raise refused("run_of_too_many_data", n=demand.n_data, most=self.data)

    def __str__(self) -> str:
        """Describe the largest allowed run; return an empty text if there are no limits."""
        parts = []
        if self.cells is not None:
            parts.append(f"{format_millions(self.cells)} cells × realizations")
        if self.data is not None:
            parts.append(f"{self.data:,} hard data")
        return f"This server allows up to {' and '.join(parts)} per run." if parts else ""


def limits_of_environment() -> ServerLimits:
    """Return the limits set by the environment variables of the server."""
    memory = _number(MEMORY_VARIABLE)
    return ServerLimits(
        cells=_number(CELLS_VARIABLE),
        data=_number(DATA_VARIABLE),
        n_slots=_number(JOBS_VARIABLE) or 2 * n_cores(),
        memory=None if memory is None else memory * 10**6,
        history=_number(HISTORY_VARIABLE, DEFAULT_HISTORY) * 10**6,
        uploads=_number(UPLOADS_VARIABLE, DEFAULT_UPLOADS) * 10**6,
        processes=bool(_number(PROCESSES_VARIABLE)),
    )


def _number(name: str, unset: Any = None) -> Any:
    """Return the integer of a variable, such as 200000000, 200_000_000 or 2e8; else `unset`."""
    text = os.environ.get(name, "").strip()
    if not text:
        return unset
    with suppress(ValueError, OverflowError):
        value = float(text)
        if value >= 0 and value == int(value):
            return int(value)
    raise CCWSIMError(f"the variable {name} = {text!r} must be a whole number; correct or unset it")


def format_millions(number: int) -> str:
    """Format an integer; large numbers in millions."""
    if number < 10**6:
        return f"{number:,}"
    millions = number / 1e6
    return f"{millions:,.1f}".removesuffix(".0") + " million"


def admit(demand: Demand, promised: float = 0.0) -> None:
    """Raise `CCWSIMError` if a run exceeds the limits or the free memory minus `promised` bytes."""
    limits = limits_of_environment()
    limits.check(demand)
    free = free_bytes(limits)
    if free is None or demand.n_bytes <= free - promised:
        return
    advice = "" if demand.n_bytes > free else " now, beside other runs; wait for these runs, or"
    raise CCWSIMError(
        f"this run needs about {format_bytes(demand.n_bytes)} of memory, but "
        f"{format_bytes(max(free - promised, 0))} are free{advice or ':'} simulate fewer "
        "realizations or a smaller grid, or use the command line with --output FILE.npy, which "
        "writes realizations to disk"
    )


def needs_consent(demand: Demand, seconds: float, promised: float = 0.0) -> bool:
    """Return whether a run needs confirmation; other runs were promised `promised` bytes."""
    free = free_bytes(limits_of_environment())
    n_bytes = UNASKED_BYTES
    if free is not None:
        n_bytes = min(n_bytes, UNASKED_SHARE * (free - promised))
    large = demand.n_cells > UNASKED_CELLS or demand.n_bytes > n_bytes
    return large or seconds > UNASKED_SECONDS


def free_bytes(limits: ServerLimits) -> int | None:
    """Return the bytes of memory available to runs, or None if unknown."""
    free = free_memory()
    if limits.memory is not None:
        unused = limits.memory - (used_memory() or 0) - memory_of_children()
        free = unused if free is None else min(unused, free)
    return None if free is None else max(free - RESERVE, 0)
