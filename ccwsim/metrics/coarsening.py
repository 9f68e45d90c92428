"""Maps and volumes at a lower resolution."""

from collections.abc import Sequence

import numpy as np

from ccwsim.engine.kernels import allocating_kernel
from ccwsim.metrics.stack import N_AXES, Codes, Images, as_image
from ccwsim.model import (
    UNKNOWN,
    Bytes,
    Floats,
    Integers,
    Ints,
    as_array,
    check_int,
    codes_with_nan,
    refused,
    shown,
)

TIE = 1e-9  # minimum difference between shares; smaller differences are rounding errors, thus ties


def coarsened(image: Images, factor: int | Sequence[int], codes: Codes | None = None) -> Integers:
    """Return an image at 1 / factor of its resolution, with the dominant facies in each cell.

    The share of each facies results from anti-aliased resizing. The indicator of each facies is
    mirrored at the edges and smoothed by a Gaussian of standard deviation (factor − 1) / 2 cells.
    The smoothed indicator is then interpolated linearly at the centres of ⌊ny / factor⌋ × ⌊nx /
    factor⌋ new cells. In a tie, the cell gets the smallest code. A factor is from 1 (a copy) to the
    side of the image; a volume may have three, along layers, rows and columns.

    Examples
    --------
    >>> coarsened(np.repeat(np.eye(2, dtype=int), 4, axis=0).repeat(4, axis=1), 4)
    array([[1, 0],
           [0, 1]])
    """
    stack = as_image(image, codes)
    if stack.is_volumes and np.ndim(as_array(factor, "coarsening factor")):
        if np.shape(factor) != (N_AXES,):
            raise refused("coarsening_factor", factor=shown(factor))
        factors = tuple(np.asarray(factor).tolist())
    else:
        one = check_int("coarsening factor", factor, 1, min(stack.shape))
        factors = (one if stack.is_volumes else 1, one, one)
    smaller = coarsened_volume(stack.volume(0), factors, stack.n_facies)
    table = codes_with_nan(stack.codes, bool((smaller == UNKNOWN).any()))
    return table[smaller.reshape(smaller.shape[-len(stack.shape) :])]


def coarsened_volume(volume: Bytes, factors: Sequence[int], n_facies: int) -> Bytes:
    """Return facies indices (nz, ny, nx) at a lower resolution along layers, rows and columns."""
    for factor, side in zip(factors, volume.shape, strict=True):
        check_int("coarsening factor", factor, 1, side)
    if max(factors) == 1:
        return volume.copy()
    (layers, layer_weights), (rows, row_weights), (columns, column_weights) = (
        _taps(n, factor) for n, factor in zip(volume.shape, factors, strict=True)
    )
    has_unknown = bool((volume == UNKNOWN).any())
    indices, n = (np.minimum(volume, n_facies), n_facies + 1) if has_unknown else (volume, n_facies)
    coarse = _largest_share(
        indices, n, layers, layer_weights, rows, row_weights, columns, column_weights
    )
    return np.where(coarse == n_facies, UNKNOWN, coarse).astype(np.uint8) if has_unknown else coarse


def _taps(n: int, factor: int) -> tuple[Ints, Floats]:
    """Return the cells that contribute to each coarse cell along one axis, and their weights."""
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
    sources = base[:, None] + np.arange(-radius, radius + 2)
    sources = np.abs((sources + n - 1) % max(2 * (n - 1), 1) - (n - 1))
    return sources, weights


@allocating_kernel
def _largest_share(
    indices, n_facies, layers, layer_weights, rows, row_weights, columns, column_weights
):
    nz, ny, nx = len(layers), len(rows), len(columns)
    best = np.full((nz, ny, nx), -1.0)
    winner = np.zeros((nz, ny, nx), np.uint8)
    line = np.empty(indices.shape[2])
    for facies in range(n_facies):
        for k in range(nz):
            for i in range(ny):
                line[:] = 0.0
                for s in range(layers.shape[1]):
                    if layer_weights[k, s] == 0.0:
                        continue
                    for t in range(rows.shape[1]):
                        weight = layer_weights[k, s] * row_weights[i, t]
                        values = indices[layers[k, s], rows[i, t]]
                        for j in range(len(values)):
                            line[j] += weight if values[j] == facies else 0.0
                for j in range(nx):
                    share = 0.0
                    for t in range(columns.shape[1]):
                        share += column_weights[j, t] * line[columns[j, t]]
                    if share > best[k, i, j] + TIE:
                        best[k, i, j] = share
                        winner[k, i, j] = facies
    return winner
