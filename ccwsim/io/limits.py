"""How much a file may hold: checked before memory is taken for it."""

from __future__ import annotations

from math import prod

from ccwsim.errors import CCWSIMError

MAX_BYTES = 512 * 2**20
"""Largest file, and largest unpacked content of a packed one, in bytes."""

MAX_CELLS = 50_000_000
"""Most values that a file may hold, over all its variables."""

MAX_POINTS = 1_000_000
"""Most hard data that a file may hold."""

MAX_VARIABLES = 1000
"""Most variables or arrays that a file may hold."""


def check_cells(name: str, shape: tuple[int, ...]) -> int:
    """Return how many values `shape` has, or say that they are none or too many.

    Raises
    ------
    CCWSIMError
        For sizes below 1 or more than `MAX_CELLS` values.

    Examples
    --------
    >>> check_cells("ti.npy", (20, 30))
    600
    """
    said = " × ".join(map(str, shape))
    if min(shape, default=0) < 1:
        raise CCWSIMError(f"{name}: a grid of {said} cells is empty; every size must be 1 or more")
    if prod(shape) > MAX_CELLS:
        raise CCWSIMError(f"{name}: {said} values are more than {MAX_CELLS}; cut a smaller piece")
    return prod(shape)


def check_bytes(name: str, n_bytes: int) -> None:
    """Say so where a file or its unpacked content is too large.

    Raises
    ------
    CCWSIMError
        For more than `MAX_BYTES`.

    Examples
    --------
    >>> check_bytes("ti.npy", 128)
    """
    if n_bytes > MAX_BYTES:
        raise CCWSIMError(
            f"{name}: {n_bytes / 2**20:.0f} MB are more than {MAX_BYTES // 2**20} MB; "
            "cut a smaller piece"
        )
