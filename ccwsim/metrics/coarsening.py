"""Images at a coarser resolution, for pattern statistics on a pyramid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.metrics.stack import as_indices
from ccwsim.model.arrays import check_int

TIE = 1e-9
"""Shares closer than this are equal, so that rounding does not decide."""


def coarsened(indices: NDArray[np.integer], factor: int, n_facies: int) -> NDArray[np.uint8]:
    """Return an image at 1 / factor of its resolution: the facies with the most weight.

    The indicator of each facies is smoothed by a Gaussian of standard deviation (factor − 1) / 2
    cells, mirrored at the edges, and read at the centres of ⌊ny / factor⌋ × ⌊nx / factor⌋ new
    cells by linear interpolation (the usual anti-aliased resizing). The largest share wins, a tie
    goes to the smaller index.

    Parameters
    ----------
    indices : ndarray, shape (ny, nx)
        Facies indices.
    factor : int
        1 returns a copy.
    n_facies : int

    Raises
    ------
    CCWSIMError
        For a factor below 1 or larger than the image.

    Examples
    --------
    >>> coarsened(np.repeat(np.eye(2, dtype=int), 4, axis=0).repeat(4, axis=1), 4, 2)
    array([[1, 0],
           [0, 1]], dtype=uint8)
    """
    image = as_indices(indices, n_facies)[0]
    factor = check_int("coarsening factor", factor, 1, min(image.shape))
    if factor == 1:
        return image.copy()
    rows, row_weights = _taps(image.shape[0], factor)
    columns, column_weights = _taps(image.shape[1], factor)
    return _largest_share(image, n_facies, rows, row_weights, columns, column_weights)


def _taps(n: int, factor: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return which cells, and with which weights, make each coarse cell along one axis."""
    n_coarse = n // factor
    ratio = n / n_coarse
    centers = (np.arange(n_coarse) + 0.5) * ratio - 0.5
    sigma = (ratio - 1) / 2
    radius = int(4 * sigma + 0.5)
    reach = np.arange(-radius, radius + 1)
    bell = np.exp(-0.5 * (reach / sigma) ** 2) if sigma else np.ones(1)
    bell /= bell.sum()
    base = np.floor(centers).astype(np.int64)
    part = (centers - base)[:, None]
    weights = np.zeros((n_coarse, 2 * radius + 2))
    weights[:, :-1] += (1 - part) * bell
    weights[:, 1:] += part * bell
    cells = base[:, None] + np.arange(-radius, radius + 2)
    period = max(2 * (n - 1), 1)
    cells = np.abs((cells + n - 1) % period - (n - 1))
    return cells, weights


@kernel
def _largest_share(image, n_facies, rows, row_weights, columns, column_weights):
    ny, nx = len(rows), len(columns)
    best = np.full((ny, nx), -1.0)
    winner = np.zeros((ny, nx), np.uint8)
    line = np.empty(image.shape[1])
    for facies in range(n_facies):
        for i in range(ny):
            line[:] = 0.0
            for t in range(rows.shape[1]):
                weight, row = row_weights[i, t], rows[i, t]
                for j in range(image.shape[1]):
                    line[j] += weight if image[row, j] == facies else 0.0
            for j in range(nx):
                share = 0.0
                for t in range(columns.shape[1]):
                    share += column_weights[j, t] * line[columns[j, t]]
                if share > best[i, j] + TIE:
                    best[i, j] = share
                    winner[i, j] = facies
    return winner
