"""What one session may ask of a server: the environment says so, and pages state it."""

from __future__ import annotations

import os
from dataclasses import dataclass

from ccwsim.model.errors import CCWSIMError
from ccwsim.system.workers import n_cores

MAX_CELLS = "CCWSIM_MAX_CELLS"
MAX_DATA = "CCWSIM_MAX_DATA"
JOBS = "CCWSIM_JOBS"
MEMORY = "CCWSIM_MEMORY_MB"
HISTORY = "CCWSIM_HISTORY_MB"
USUAL_HISTORY = 256


@dataclass(frozen=True)
class Limits:
    """The limits of a server; a laptop has none but its memory.

    Attributes
    ----------
    cells : int or None
        Most cells × realizations of one run, None for any number.
    data : int or None
        Most hard data of one run, None for any number.
    n_places : int
        How many short jobs of all sessions are active at once.
    memory : int or None
        Bytes that the program may use, None for what the machine or its container has.
    history : int
        Bytes of earlier runs that each session keeps.
    """

    cells: int | None
    data: int | None
    n_places: int
    memory: int | None
    history: int

    def check(self, n_cells: int, n_data: int = 0) -> None:
        """Refuse a run that is larger than this server allows.

        Parameters
        ----------
        n_cells : int
            Cells of all its realizations together.
        n_data : int

        Raises
        ------
        CCWSIMError
            With the number, the limit, and what to do.
        """
        if self.cells is not None and n_cells > self.cells:
            raise CCWSIMError(
                f"{said(n_cells)} cells × realizations are more than the {said(self.cells)} that "
                "this server allows for one run: ask for fewer realizations or a smaller grid"
            )
        if self.data is not None and n_data > self.data:
            raise CCWSIMError(
                f"{n_data:,} hard data are more than the {self.data:,} that this server allows "
                "for one run: use fewer"
            )

    def __str__(self) -> str:
        """Say what a session may ask for; empty where it is anything."""
        parts = []
        if self.cells is not None:
            parts.append(f"{said(self.cells)} cells × realizations")
        if self.data is not None:
            parts.append(f"{self.data:,} hard data")
        return f"This server takes up to {' and '.join(parts)} a run." if parts else ""


def limits_of_environment() -> Limits:
    """Return the limits that the environment variables of the server set.

    Raises
    ------
    CCWSIMError
        For a variable that is no number.

    Examples
    --------
    >>> limits_of_environment().n_places >= 1
    True
    """
    memory, history = _number(MEMORY), _number(HISTORY)
    return Limits(
        _number(MAX_CELLS),
        _number(MAX_DATA),
        _number(JOBS) or 2 * n_cores(),
        None if memory is None else memory * 10**6,
        (USUAL_HISTORY if history is None else history) * 10**6,
    )


def _number(name: str) -> int | None:
    """Return the whole number of a variable, such as 200000000, 200_000_000 or 2e8."""
    text = os.environ.get(name, "").strip()
    if not text:
        return None
    try:
        value = float(text)
        if value >= 0 and value == int(value):
            return int(value)
    except (ValueError, OverflowError):
        pass
    raise CCWSIMError(f"{name} = {text!r} of the server must be a whole number, or left out")


def said(number: int) -> str:
    """Say a number, in millions where it is that large.

    Examples
    --------
    >>> said(786_432), said(1_200_000_000), said(2_500_000)
    ('786,432', '1,200 million', '2.5 million')
    """
    if number < 10**6:
        return f"{number:,}"
    millions = number / 1e6
    return f"{millions:,.1f}".removesuffix(".0") + " million"
