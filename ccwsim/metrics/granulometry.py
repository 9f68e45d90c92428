"""How thick the bodies of a facies are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics.stack import as_image
from ccwsim.model.arrays import check_int

THICK_SHARE = 0.95
"""A facies is as thick as the squares that keep so much of it."""


@dataclass(frozen=True, eq=False)
class Granulometry:
    """What remains of a facies when all that is thinner than a size is taken away.

    Attributes
    ----------
    sizes : ndarray of int, shape (n_sizes,)
        1, 2, … cells.
    kept : ndarray, shape (n_sizes,)
        Share of the facies' cells that lie in a square of that size inside the facies.
    """

    sizes: NDArray[np.int64]
    kept: NDArray[np.float64]

    def thickness(self, share: float = THICK_SHARE) -> int:
        """Return the largest size that keeps at least `share` of the facies; 0 if it is absent."""
        return int(np.count_nonzero(self.kept >= share))


def granulometry(
    image: NDArray[np.integer], facies: int, max_size: int = 64, down_to: float = 0.0
) -> Granulometry:
    """Open a facies with squares of growing size (Matheron 1975), until nothing is left.

    Squares lie inside the image, so that a body cut by its edge counts as thin as it looks.

    Parameters
    ----------
    image : ndarray, shape (ny, nx)
        Facies codes or indices.
    facies : int
        Which value of the image.
    max_size : int
        Largest square.
    down_to : float
        Stop after the first size that keeps a smaller share.

    Raises
    ------
    CCWSIMError
        For a largest square below one cell.

    Examples
    --------
    >>> river = np.zeros((9, 9), int)
    >>> river[3:6] = 1
    >>> granulometry(river, 1).thickness()
    3
    """
    max_size = check_int("max_size", max_size, 1, 2**31)
    inside = as_image(image) == check_int("facies", facies, 0, 2**31)
    total = int(inside.sum())
    kept: list[float] = []
    for size in range(1, min(max_size, *inside.shape) + 1):
        whole = _square_sums(inside, size) == size * size
        if not whole.any():
            break
        reached = _square_sums(np.pad(whole, size - 1), size) > 0
        kept.append(np.count_nonzero(reached) / total)
        if kept[-1] < down_to:
            break
    return Granulometry(np.arange(1, len(kept) + 1), np.array(kept))


def _square_sums(mask: NDArray[np.bool_], size: int) -> NDArray[np.int64]:
    """Return the sum of each size × size square of a mask, at its south-west cell."""
    table = np.pad(np.cumsum(np.cumsum(mask, axis=0), axis=1), ((1, 0), (1, 0)))
    return table[size:, size:] - table[:-size, size:] - table[size:, :-size] + table[:-size, :-size]
