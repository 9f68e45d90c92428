"""Two facies in one cell: which points, and which of them to keep."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

COLLISION_CHOICES = ("error", "drop", "majority", "nearest")


def colliding(
    cells: NDArray[np.int64], facies: NDArray[np.int64], among: NDArray[np.int64]
) -> tuple[NDArray[np.int64], ...]:
    """Return, for each cell with more than one facies, the points in it.

    Parameters
    ----------
    cells : ndarray, shape (n, 2)
        Row and column of each point.
    facies : ndarray, shape (n,)
        Its facies.
    among : ndarray
        The points to look at.

    Returns
    -------
    tuple of ndarray
        Places in `cells`, in the order of the file; cells by row, then column.

    Examples
    --------
    >>> cells = np.array([[0, 1], [2, 2], [0, 1]])
    >>> [c.tolist() for c in colliding(cells, np.array([1, 1, 0]), np.arange(3))]
    [[0, 2]]
    """
    if not len(among):
        return ()
    order = among[np.lexsort((among, cells[among, 1], cells[among, 0]))]
    new_cell = np.any(np.diff(cells[order], axis=0) != 0, axis=1)
    starts = np.concatenate([[0], np.flatnonzero(new_cell) + 1, [len(order)]])
    low = np.minimum.reduceat(facies[order], starts[:-1])
    high = np.maximum.reduceat(facies[order], starts[:-1])
    return tuple(order[starts[k] : starts[k + 1]] for k in np.flatnonzero(low != high))


def settled(
    facies: NDArray[np.int64], offsets: NDArray[np.float64], choice: str
) -> tuple[int | None, bool]:
    """Return the facies to keep in a cell and whether only the order in the file decided.

    Parameters
    ----------
    facies, offsets : ndarray, shape (k,)
        Facies of the points in the cell and their distances from its centre, in file order.
    choice : "drop", "majority" or "nearest"
        As in `resolve_points`.

    Returns
    -------
    code : int or None
        None where all are dropped.
    tied : bool

    Examples
    --------
    >>> settled(np.array([0, 1, 1]), np.array([0.0, 0.2, 0.3]), "majority")
    (1, False)
    """
    if choice == "drop":
        return None, False
    running = np.ones(len(facies), bool)
    if choice == "majority":
        codes, counts = np.unique(facies, return_counts=True)
        running = np.isin(facies, codes[counts == counts.max()])
    nearest = offsets[running].min()
    running &= offsets <= nearest + 1e-9
    left = facies[running]
    return int(left[0]), bool((left != left[0]).any())
