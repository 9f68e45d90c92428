"""Histograms of the patterns in facies images, at several resolutions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.metrics.coarsening import coarsened
from ccwsim.metrics.stack import Fraction, as_indices, map_parallel
from ccwsim.model.arrays import as_array, as_integers, check_int
from ccwsim.system.workers import check_stop

PATTERN_SIZE = 4
FACTORS = (1, 2, 3)
"""Full, half and third resolution."""
CELLS_OF_STRIP = 4_000_000
"""Cells whose patterns are counted at a time."""
DENSE = 2**20
"""Up to so many possible patterns are counted in a table, more by sorting."""


@dataclass(frozen=True, eq=False)
class PatternHistogram:
    """How often each pattern of size × size cells occurs in an image.

    Attributes
    ----------
    codes : ndarray of uint64, shape (n_different,)
        The patterns that occur, sorted. A code is the pattern's cells as digits in base n_facies
        where they fit 64 bits, else a 64-bit hash of them.
    frequencies : ndarray, shape (n_different,)
        Their shares; they sum to 1.
    size : int
        Side of the patterns in cells.
    """

    codes: NDArray[np.uint64]
    frequencies: NDArray[np.float64]
    size: int


def pattern_histogram(
    indices: NDArray[np.integer], n_facies: int, size: int = PATTERN_SIZE
) -> PatternHistogram:
    """Count the patterns of size × size cells at every place of an image, exactly.

    Parameters
    ----------
    indices : ndarray, shape (ny, nx)
        Facies indices.
    n_facies : int
    size : int
        Side of the patterns.

    Raises
    ------
    CCWSIMError
        Where the pattern does not fit the image.

    Examples
    --------
    >>> histogram = pattern_histogram(np.eye(3, dtype=int), 2, size=2)
    >>> histogram.codes, histogram.frequencies
    (array([2, 4, 9], dtype=uint64), array([0.25, 0.25, 0.5 ]))
    """
    image = as_indices(indices, n_facies)[0]
    size = check_int("pattern size", size, 1, min(image.shape))
    fits = size * size * np.log2(max(n_facies, 2)) < 64
    base = n_facies if fits else 0
    if fits and n_facies ** (size * size) <= DENSE:
        table = np.zeros(n_facies ** (size * size), np.int64)
        for codes in _codes_of_strips(image, size, base):
            table += np.bincount(codes.view(np.int64), minlength=len(table))
        there = np.flatnonzero(table)
        found, counts = there.astype(np.uint64), table[there]
    else:
        strips = [np.unique(c, return_counts=True) for c in _codes_of_strips(image, size, base)]
        found, place = np.unique(np.concatenate([s[0] for s in strips]), return_inverse=True)
        counts = np.zeros(len(found), np.int64)
        np.add.at(counts, place, np.concatenate([s[1] for s in strips]))
    return PatternHistogram(found, counts / counts.sum(), size)


def _codes_of_strips(
    image: NDArray[np.uint8], size: int, base: int
) -> Iterator[NDArray[np.uint64]]:
    """Yield the codes of all patterns, some rows at a time: they take 16 times the image."""
    ny, nx = image.shape
    n_rows = max(CELLS_OF_STRIP // nx, 1)
    for first in range(0, ny - size + 1, n_rows):
        check_stop()
        yield _pattern_codes(image[first : first + n_rows + size - 1], size, base).ravel()


def pyramid_histograms(
    images: ArrayLike,
    n_facies: int,
    size: int = PATTERN_SIZE,
    factors: Sequence[int] = FACTORS,
    progress: Fraction | None = None,
) -> list[list[PatternHistogram]]:
    """Return the pattern histogram of each image at 1 / factor of its resolution.

    Parameters
    ----------
    images : array_like, shape (ny, nx) or (n, ny, nx)
        Facies indices.
    n_facies, size
        As in `pattern_histogram`.
    factors : sequence of int
        See `coarsened`.
    progress : callable, optional
        Called with the share that is done.

    Returns
    -------
    list of list
        [image][factor].
    """
    stack = as_indices(images, n_facies)
    factors = as_integers(as_array(factors, "factors"), "factors").reshape(-1).tolist()
    return map_parallel(
        lambda k: [
            pattern_histogram(coarsened(stack[k], factor, n_facies), n_facies, size)
            for factor in factors
        ],
        len(stack),
        progress,
    )


@kernel
def _mixed(value):
    """Spread a number over 64 bits (splitmix64)."""
    value = value + np.uint64(0x9E3779B97F4A7C15)
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return value ^ (value >> np.uint64(31))


@kernel
def _pattern_codes(image, size, base):
    """Return the code of the pattern at each place: digits in `base`, or hashed for base 0."""
    ny, nx = image.shape
    digit = np.uint64(base) if base else np.uint64(0x9E3779B97F4A7C15)
    strip = np.uint64(1)
    for _ in range(size):
        strip *= digit
    lines = np.zeros((ny, nx - size + 1), np.uint64)
    for i in range(ny):
        for k in range(size):
            for j in range(nx - size + 1):
                cell = np.uint64(image[i, j + k])
                lines[i, j] = lines[i, j] * digit + (cell if base else _mixed(cell))
    codes = np.zeros((ny - size + 1, nx - size + 1), np.uint64)
    for i in range(ny - size + 1):
        for k in range(size):
            for j in range(nx - size + 1):
                line = lines[i + k, j]
                codes[i, j] = codes[i, j] * strip + (line if base else _mixed(line))
    return codes
