"""Two-point simulation, which shows the patterns that the variogram of an image does not contain.

Facies are truncated Gaussian fields (Matheron et al. 1987) with the proportions and the indicator
variograms of the training image, which determine their connectivity.
"""

import time

import numpy as np
from scipy.special import ndtri

from ccwsim import Ensemble, Grid, TrainingImage
from ccwsim.model import Array, ArrayLike, Floats, Mask, Shape, Study, as_seed, check_int


def simulate_two_point(
    training_image: TrainingImage | ArrayLike,
    grid_shape: Grid | Shape,
    n_realizations: int = 1,
    seed: int = 0,
) -> Ensemble:
    """Return unconditional realizations with only the two-point statistics of an image.

    Facies are simulated from the least to the most frequent. Each facies truncates its own Gaussian
    field in the cells that are still free; the most frequent facies fills the remaining cells.
    Proportions and variograms of the facies are those of the image as far as a Gaussian field
    allows; variograms reach their sill within half the image. The order of facies is not
    reproduced. The ensemble has the default
    parameters, which are not used.

    Examples
    --------
    >>> simulate_two_point(np.tile([[0], [0], [0], [1]], (8, 32)), (40, 50), 2).shape
    (2, 40, 50)
    """
    n, start = check_int("n_realizations", n_realizations, 1), time.perf_counter()
    image, grid, seconds = TrainingImage.of(training_image), Grid.of(grid_shape), np.zeros(n)
    seed = as_seed(seed)
    *rare, most_frequent = np.argsort(image.proportions, kind="stable")
    indices = np.full((n, *grid.shape), most_frequent, np.uint8)
    inner, is_free = tuple(map(slice, grid.shape)), image.indices < image.n_facies
    for k in rare:
        is_facies = image.indices == k
        threshold = ndtri(1 - is_facies.sum() / is_free.sum())
        amplitudes = _amplitudes(is_facies, is_free, threshold, grid.shape)
        for r in range(n):
            begin = time.process_time()
            noise = np.random.default_rng([seed, r, k]).standard_normal(amplitudes.shape)
            field = np.fft.ifftn(np.fft.fftn(noise) * amplitudes).real[inner]
            indices[r][(indices[r] == most_frequent) & (field > threshold)] = k
            seconds[r] += time.process_time() - begin
        is_free &= ~is_facies
    return Ensemble(
        study=Study(image, grid, seed=seed, checked=False),
        indices=indices,
        cpu_seconds=seconds,
        wall_seconds=time.perf_counter() - start,
        data_status=np.zeros((n, 0), np.int16),
        numbers=np.arange(n),
    )


def _amplitudes(is_facies: Mask, is_free: Mask, threshold: float, shape: Shape) -> Floats:
    """Return the Fourier amplitudes of a periodic field, larger than the grid, to be truncated."""
    share = is_facies.sum() / is_free.sum()
    covariances, weights = _pairs(is_facies) / np.maximum(_pairs(is_free), 1) - share**2, 1.0
    for axis, (side, length) in enumerate(zip(is_facies.shape, shape, strict=True)):
        reach = side // 2  # covariances of longer lags are too uncertain
        size = length + reach
        lags = np.minimum(np.arange(size), size - np.arange(size))
        covariances = covariances.take(np.minimum(lags, reach), axis)
        taper = 0.5 + 0.5 * np.cos(np.pi * np.minimum(lags / max(reach, 1), 1))
        weights = weights * np.expand_dims(taper, [a for a in range(len(shape)) if a != axis])
    spectrum = np.fft.fftn(_correlations(covariances * weights, threshold)).real
    # the nearest spectrum without negative values whose mean, the variance, is 1
    ordered = np.sort(spectrum, axis=None)[::-1]
    excess = (np.cumsum(ordered) - spectrum.size) / np.arange(1, spectrum.size + 1)
    return np.sqrt(np.maximum(spectrum - excess[np.flatnonzero(ordered > excess)[-1]], 0))


def _pairs(inside: Mask) -> Floats:
    """Return the number of pairs of cells inside, for each lag modulo twice the image."""
    shape, axes = [2 * side for side in inside.shape], range(inside.ndim)
    return np.fft.irfftn(np.abs(np.fft.rfftn(inside, shape, axes)) ** 2, shape, axes).round()


def _correlations(covariances: Array, threshold: float) -> Floats:
    """Return the correlations of a Gaussian field from covariances of the truncated field.

    A covariance is ∫ exp(−t² / (1 + sin θ)) / 2π dθ from 0 to arcsin of the correlation, with
    threshold t.
    """
    angles = np.linspace(-np.pi / 2, np.pi / 2, 4001)
    middles = (angles[1:] + angles[:-1]) / 2
    steps = np.exp(-(threshold**2) / (1 + np.sin(middles))) * np.diff(angles) / (2 * np.pi)
    table = np.cumsum([0, *steps])
    return np.interp(covariances, table - table[len(table) // 2], np.sin(angles))
