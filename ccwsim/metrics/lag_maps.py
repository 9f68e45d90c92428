"""Sums over all pairs of cells x, x + h for a whole map of lags h at once, by FFT."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ccwsim.model.arrays import check_int


def lags_of_map(max_lag: int, shape: tuple[int, ...]) -> NDArray[np.int64]:
    """Return −max_lag … max_lag, or say that they do not fit the image.

    Raises
    ------
    CCWSIMError
        For a lag below 1 or not smaller than the image.

    Examples
    --------
    >>> lags_of_map(1, (5, 5))
    array([-1,  0,  1])
    """
    max_lag = check_int("max_lag", max_lag, 1, min(shape) - 1)
    return np.arange(-max_lag, max_lag + 1)


def pairs_of_map(shape: tuple[int, ...], max_lag: int) -> NDArray[np.int64]:
    """Return how many pairs x, x + h lie in an image, by lag; lag 0 is in the middle.

    Examples
    --------
    >>> pairs_of_map((3, 3), 1)
    array([[4, 6, 4], [6, 9, 6], [4, 6, 4]])
    """
    lags = np.abs(np.arange(-max_lag, max_lag + 1))
    return np.outer(shape[0] - lags, shape[1] - lags)


def product_sums(tail: NDArray, head: NDArray, max_lag: int) -> NDArray[np.float64]:
    """Return Σ tail(x) · head(x + h) of two masks (ny, nx), by lag, exactly.

    Examples
    --------
    >>> product_sums(np.eye(3), np.eye(3), 1)
    array([[2., 0., 0.], [0., 3., 0.], [0., 0., 2.]])
    """
    size = [fft.next_fast_len(n + max_lag, real=True) for n in tail.shape]
    one, other = (np.asarray(fft.rfft2(np.asarray(a, float), size)) for a in (tail, head))
    sums = np.asarray(fft.irfft2(one.conj() * other, size))
    lags = np.arange(-max_lag, max_lag + 1)
    return np.rint(sums[np.ix_(lags, lags)]) + 0.0


def overlap_sums(inside: NDArray, max_lag: int) -> NDArray[np.float64]:
    """Return Σ inside(x) over the cells x of a mask (ny, nx) for which x + h is in it too, by lag.

    Examples
    --------
    >>> overlap_sums(np.eye(3), 1)
    array([[2., 2., 1.], [2., 3., 2.], [1., 2., 2.]])
    """
    ny, nx = inside.shape
    table = np.zeros((ny + 1, nx + 1))
    table[1:, 1:] = np.cumsum(np.cumsum(inside, axis=0, dtype=float), axis=1)
    lags = np.arange(-max_lag, max_lag + 1)
    y0, y1 = np.maximum(0, -lags), ny - np.maximum(0, lags)
    x0, x1 = np.maximum(0, -lags), nx - np.maximum(0, lags)
    return (
        table[np.ix_(y1, x1)] - table[np.ix_(y0, x1)]
        - table[np.ix_(y1, x0)] + table[np.ix_(y0, x0)]
    )  # fmt: skip
