"""Whether a run may start: within the limits of the server, and within the memory that is left."""

from __future__ import annotations

from dataclasses import dataclass

from ccwsim.model.errors import CCWSIMError
from ccwsim.model.study import Study
from ccwsim.run.footprint import footprint
from ccwsim.system.memory import free_memory, used_memory
from ccwsim.ui.jobs.limits import Limits, limits_of_environment

RESERVE = 128 * 10**6
"""Bytes that are left for the pages themselves."""
MAPS_BYTES = 16
"""Bytes a cell of the grid for the maps of a page, and for each facies: shares and counts."""
FACIES_BYTES = 12


@dataclass(frozen=True)
class Demand:
    """What a run asks of the server.

    Attributes
    ----------
    n_cells : int
        Cells of all its realizations together.
    n_data : int
    n_bytes : int
        Memory of the run, its results and what the page works out from them.
    """

    n_cells: int
    n_data: int = 0
    n_bytes: int = 0


def demand_of(
    study: Study, n: int, n_kept: int | None = None, n_workers: int | None = None, copies: int = 1
) -> Demand:
    """Return what a run of a study asks for.

    Parameters
    ----------
    study : Study
    n : int
        Realizations.
    n_kept : int, optional
        How many of them are in memory at a time; all where not given.
    n_workers : int, optional
        Threads.
    copies : int
        How many copies of the realizations there are for a moment.

    Examples
    --------
    >>> import numpy as np
    >>> from ccwsim import Grid, TrainingImage
    >>> demand_of(Study(TrainingImage(np.eye(40)), Grid(50, 60)), 10).n_cells
    30000
    """
    cells, image = study.grid.ny * study.grid.nx, study.training_image
    kept = n if n_kept is None else min(n, n_kept)
    in_codes = 0 if image.codes[-1] == image.n_facies - 1 else image.codes.itemsize
    return Demand(
        cells * n,
        study.hard_data.n,
        footprint(study, kept, n_workers)
        + cells * kept * (copies - 1 + in_codes)
        + cells * (MAPS_BYTES + FACIES_BYTES * image.n_facies),
    )


def check_limits(demand: Demand) -> None:
    """Refuse what is larger than the server allows.

    Raises
    ------
    CCWSIMError
        As `Limits.check`.
    """
    limits_of_environment().check(demand.n_cells, demand.n_data)


def admit(demand: Demand, promised: float = 0.0) -> None:
    """Refuse a run that is larger than the server allows, or than its memory.

    Parameters
    ----------
    demand : Demand
    promised : float
        Bytes that other runs have still to take.

    Raises
    ------
    CCWSIMError
        With the reason, and what to do.

    Examples
    --------
    >>> admit(Demand(n_cells=1000, n_bytes=1000))
    """
    limits = limits_of_environment()
    limits.check(demand.n_cells, demand.n_data)
    free = free_bytes(limits)
    if free is None or demand.n_bytes <= free - promised:
        return
    others = "" if demand.n_bytes > free else " now, beside other runs; wait for them or"
    raise CCWSIMError(
        f"this run needs about {said_bytes(demand.n_bytes)} of memory, and "
        f"{said_bytes(max(free - promised, 0))} are free{others or ':'} ask for fewer "
        "realizations or a smaller grid, or use the command line with --out, which keeps "
        "realizations on disk"
    )


def free_bytes(limits: Limits) -> int | None:
    """Return the memory that runs may still take, None where the system does not tell."""
    free = free_memory()
    if limits.memory is not None:
        own = limits.memory - (used_memory() or 0)
        free = own if free is None else min(own, free)
    return None if free is None else max(free - RESERVE, 0)


def said_bytes(number: float) -> str:
    """Say an amount of memory.

    Examples
    --------
    >>> said_bytes(12.3e9), said_bytes(45e6)
    ('12.3 GB', '45 MB')
    """
    return f"{number / 1e9:.1f} GB" if number >= 1e9 else f"{number / 1e6:.0f} MB"
