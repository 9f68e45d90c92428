"""Correct the values of a realization at hard data by kriging of residuals (not in the paper).

Patches are chosen so that their values are close to data. What remains, as normal scores of the
image, is interpolated by simple kriging; then data are set. The covariance is that of the image at
each lag, without a model: all cells are on one lattice, and a windowed image has a covariance that
is positive definite and as smooth at short lags as the image.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ccwsim.jobs.workers import check_stop
from ccwsim.model import Array, Floats, Int32s, Ints, Shape, Study

MAX_TOGETHER = 2000
"""Maximum number of data that are kriged together; of more, each cell uses the nearest ones."""
N_NEAREST = 32
NUGGET = 0.01  # variance of residuals that neighbouring cells do not share
LARGEST_RESIDUAL = 4.0  # largest residual, in standard deviations, that is interpolated
MAX_SCORES = 2000  # maximum number of values with a normal score, between which scores are linear
CELLS_A_PART = 10_000


class Residuals(NamedTuple):
    """The inputs that correct all realizations of a study."""

    values: Floats  # values of the image, sorted
    scores: Floats  # normal score of each of `values`
    cells: Ints  # shape (n, 2): cells of the data
    measured: Floats  # shape (n,): values of the data
    wide: Shape  # shape of a grid in which covariances do not wrap around
    spectrum: Floats  # transform of the covariance in this grid
    factor: Floats  # Cholesky factor of the covariances of all data; empty with `nearest`
    nearest: Int32s  # shape (n_cells, N_NEAREST): nearest data of each cell, or empty
    weights: Floats  # shape of `nearest`


def residuals_of(study: Study) -> Residuals:
    """Return the inputs that correct realizations at the hard data of a study."""
    from scipy.fft import next_fast_len
    from scipy.linalg import cho_factor
    from scipy.special import ndtri

    image, data, shape = study.training_image, study.hard_data, study.grid.shape
    values, counts = np.unique(image.sorted_values, return_counts=True)
    kept = np.unique(np.linspace(0, len(values) - 1, MAX_SCORES).astype(int))
    scores = ndtri((np.cumsum(counts) - counts / 2) / counts.sum())
    of_image = np.nan_to_num(np.interp(image.values[image.variable], values, scores))
    window = np.outer(*(np.hanning(n + 2)[1:-1] for n in image.shape))
    sides = [max(2 * m, n + min(n, m)) for n, m in zip(shape, image.shape, strict=True)]
    wide = tuple(next_fast_len(n, real=True) or n for n in sides)
    spectrum = np.abs(np.fft.rfft2(of_image * window, wide)) ** 2
    table = np.fft.irfft2(spectrum, wide)
    variance = table[0, 0] or 1.0
    nugget = NUGGET * variance
    factor, nearest = np.empty((0, 0)), np.empty((0, 0), np.int32)
    weights = factor
    check_stop()
    if data.n > MAX_TOGETHER:
        parts = [*_weights_of_nearest(table, nugget, data.cells, shape)]
        nearest, weights = (np.concatenate(each) for each in zip(*parts, strict=True))
    else:
        lags = data.cells[:, None] - data.cells
        covariances = table[tuple(np.moveaxis(lags, -1, 0))] + nugget * np.eye(data.n)
        factor = cho_factor(covariances / variance, lower=True, overwrite_a=True)[0]
    return Residuals(
        values=values[kept],
        scores=scores[kept],
        cells=data.cells,
        measured=data.values[image.variable],
        wide=wide,
        spectrum=spectrum / variance,
        factor=factor,
        nearest=nearest,
        weights=weights,
    )


def correct(values: Floats, residuals: Residuals) -> None:
    """Correct a realization, shape (ny, nx), in place; data get exactly their values."""
    at, measured = tuple(residuals.cells.T), residuals.measured
    off = _scores_of(residuals, measured) - _scores_of(residuals, values[at])
    if off.any():
        scores, ends = _scores_of(residuals, values), (residuals.scores, residuals.values)
        shifts = _interpolated(
            residuals, np.clip(off, -LARGEST_RESIDUAL, LARGEST_RESIDUAL), values.shape
        )
        values += np.interp(scores + shifts, *ends) - np.interp(scores, *ends)
        np.clip(values, residuals.values[0], residuals.values[-1], out=values)
    values[at] = measured


def _scores_of(residuals: Residuals, values: Floats) -> Floats:
    """Return normal scores; beyond the image they continue with its mean slope."""
    v, z = residuals.values, residuals.scores
    slope = (z[-1] - z[0]) / max(v[-1] - v[0], 1e-300)
    return np.interp(values, v, z) + slope * (values - np.clip(values, v[0], v[-1]))


def _interpolated(residuals: Residuals, off: Floats, shape: Shape) -> Floats:
    """Return the kriged residual of each cell."""
    from scipy.linalg import cho_solve

    if residuals.weights.size:
        return np.einsum("ck,ck->c", residuals.weights, off[residuals.nearest]).reshape(shape)
    grid = np.zeros(residuals.wide)
    grid[tuple(residuals.cells.T)] = cho_solve((residuals.factor, True), off)
    spread = np.fft.irfft2(np.fft.rfft2(grid) * residuals.spectrum, residuals.wide)
    return spread[: shape[0], : shape[1]]


def _weights_of_nearest(
    table: Floats, nugget: float, cells: Ints, shape: Shape
) -> Iterator[tuple[Array, Floats]]:
    """Yield the nearest data, and their weights, of pieces of the grid."""
    from scipy.spatial import KDTree

    tree, every = KDTree(cells), np.argwhere(np.ones(shape))
    for start in range(0, len(every), CELLS_A_PART):
        check_stop()
        places = every[start : start + CELLS_A_PART]
        _, nearest = tree.query(places, N_NEAREST)
        y, x = np.moveaxis(cells[nearest], -1, 0)
        apart = table[y[:, :, None] - y[:, None], x[:, :, None] - x[:, None]]
        away = table[y - places[:, :1], x - places[:, 1:]]
        weights = np.linalg.solve(apart + nugget * np.eye(N_NEAREST), away[..., None])
        yield np.asarray(nearest, np.int32), weights[..., 0]  # type: ignore[misc]
