"""Shapes that the training image does not have: where a seam shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SIDE = 6
"""Cells of the windows that are looked at: seen at a glance, and few enough to be all known."""


def window_names(indices: NDArray[np.integer]) -> NDArray[np.uint64]:
    """Return one number a window of SIDE × SIDE cells, equal for equal windows.

    Two windows that differ have the same number about once in 10¹⁹.

    Examples
    --------
    >>> names = window_names(np.tile([0, 1], (8, 4)))
    >>> names.shape, len(np.unique(names))
    ((3, 3), 2)
    """
    ny, nx = (n - SIDE + 1 for n in indices.shape)
    weights = np.random.default_rng(SIDE).integers(2**63, size=(SIDE, SIDE), dtype=np.uint64)
    cells = indices.astype(np.uint64) + np.uint64(1)
    names = np.zeros((max(ny, 0), max(nx, 0)), np.uint64)
    for row in range(SIDE):
        for column in range(SIDE):
            names += weights[row, column] * cells[row : row + ny, column : column + nx]
    return names


def new_shapes(
    indices: NDArray[np.integer], known: NDArray[np.uint64]
) -> tuple[NDArray[np.bool_], float]:
    """Return where a map has windows that are not known, and the share of them.

    Parameters
    ----------
    indices : ndarray, shape (ny, nx)
    known : ndarray
        The names of the windows of the training image.

    Returns
    -------
    ndarray of bool, shape (ny, nx)
        The four cells in the middle of each window that is not known.
    float

    Examples
    --------
    >>> stripes = np.tile([0, 0, 1, 1], (12, 6))
    >>> shifted = np.vstack([stripes[:6], 1 - stripes[6:]])
    >>> where, share = new_shapes(shifted, window_names(stripes))
    >>> where.any(axis=1).nonzero()[0].tolist(), round(share, 2)
    ([3, 4, 5, 6, 7, 8], 0.71)
    """
    new = ~np.isin(window_names(indices), known)
    where = np.zeros(indices.shape, bool)
    middle = SIDE // 2 - 1
    for down in (middle, middle + 1):
        for along in (middle, middle + 1):
            where[down : down + new.shape[0], along : along + new.shape[1]] |= new
    return where, float(new.mean()) if new.size else 0.0
