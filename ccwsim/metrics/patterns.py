"""Pattern histograms on a pyramid of resolutions, and their Jensen–Shannon divergence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.metrics.stack import Codes, Fraction, Images, as_image, as_stack, map_parallel
from ccwsim.model.arrays import as_array, as_integers, check_int
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.training_image import TrainingImage
from ccwsim.system.workers import check_stop

TIE = 1e-9
"""Shares closer than this are equal, so that rounding does not decide."""
PATTERN_SIZE = 4
FACTORS = (1, 2, 3)
"""Full, half and third resolution."""
CELLS_OF_STRIP = 4_000_000
"""Cells whose patterns are counted at a time."""
MAX_TABLE = 2**20
"""Up to so many possible patterns are counted in a table, more by sorting."""


def coarsened(image: Images, factor: int, codes: Codes | None = None) -> NDArray[np.integer]:
    """Return an image at 1 / factor of its resolution: the facies with the most weight.

    The indicator of each facies is smoothed by a Gaussian of standard deviation (factor − 1) / 2
    cells, mirrored at the edges, and read at the centres of ⌊ny / factor⌋ × ⌊nx / factor⌋ new
    cells by linear interpolation (the usual anti-aliased resizing). The largest share wins, a tie
    goes to the smaller code.

    Parameters
    ----------
    image : TrainingImage or array_like, shape (ny, nx)
        An array has facies codes.
    factor : int
        1 returns a copy.
    codes : array_like of int, optional
        The facies codes, where an array may lack some; those that occur where left out.

    Returns
    -------
    ndarray of int, shape (ny // factor, nx // factor)
        Facies codes.

    Raises
    ------
    CCWSIMError
        For a factor below 1 or larger than the image.

    Examples
    --------
    >>> coarsened(np.repeat(np.eye(2, dtype=int), 4, axis=0).repeat(4, axis=1), 4)
    array([[1, 0],
           [0, 1]])
    """
    stack = as_image(image, codes)
    return stack.codes[_coarsened(stack.indices[0], factor, stack.n_facies)]


def _coarsened(image: NDArray[np.uint8], factor: int, n_facies: int) -> NDArray[np.uint8]:
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
    facies : tuple of int
        Facies codes that the digits stand for, sorted.
    """

    codes: NDArray[np.uint64]
    frequencies: NDArray[np.float64]
    size: int
    facies: tuple[int, ...] = ()


def pattern_histogram(
    image: Images, codes: Codes | None = None, size: int = PATTERN_SIZE
) -> PatternHistogram:
    """Count the patterns of size × size cells at every location of an image, exactly.

    Parameters
    ----------
    image : TrainingImage or array_like, shape (ny, nx)
        An array has facies codes.
    codes : array_like of int, optional
        The facies codes, where an array may lack some; those that occur where left out.
    size : int
        Side of the patterns.

    Returns
    -------
    PatternHistogram

    Raises
    ------
    CCWSIMError
        Where the pattern does not fit the image.

    Examples
    --------
    >>> histogram = pattern_histogram(np.eye(3, dtype=int), size=2)
    >>> histogram.codes, histogram.frequencies
    (array([2, 4, 9], dtype=uint64), array([0.25, 0.25, 0.5 ]))
    """
    stack = as_image(image, codes)
    return _histogram(stack.indices[0], stack.codes, size)


def _histogram(
    image: NDArray[np.uint8], facies: NDArray[np.integer], size: int
) -> PatternHistogram:
    n_facies = len(facies)
    size = check_int("pattern size", size, 1, min(image.shape))
    fits = size * size * np.log2(max(n_facies, 2)) < 64
    base = n_facies if fits else 0
    if fits and n_facies ** (size * size) <= MAX_TABLE:
        table = np.zeros(n_facies ** (size * size), np.int64)
        for codes in _codes_of_strips(image, size, base):
            table += np.bincount(codes.view(np.int64), minlength=len(table))
        there = np.flatnonzero(table)
        found, counts = there.astype(np.uint64), table[there]
    else:
        strips = [np.unique(c, return_counts=True) for c in _codes_of_strips(image, size, base)]
        found, index = np.unique(np.concatenate([s[0] for s in strips]), return_inverse=True)
        counts = np.zeros(len(found), np.int64)
        np.add.at(counts, index, np.concatenate([s[1] for s in strips]))
    return PatternHistogram(found, counts / counts.sum(), size, tuple(facies.tolist()))


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
    images: Images,
    codes: Codes | None = None,
    size: int = PATTERN_SIZE,
    factors: Sequence[int] = FACTORS,
    progress: Fraction | None = None,
) -> list[list[PatternHistogram]]:
    """Return the pattern histogram of each image at 1 / factor of its resolution.

    Parameters
    ----------
    images : Ensemble, TrainingImage or array_like, shape (ny, nx) or (n, ny, nx)
        An array has facies codes.
    codes, size
        As in `pattern_histogram`.
    factors : sequence of int
        See `coarsened`.
    progress : callable, optional
        Called with the share that is done.

    Returns
    -------
    list of list of PatternHistogram
        [image][factor].

    Examples
    --------
    >>> [len(row) for row in pyramid_histograms(np.eye(12, dtype=int), factors=[1, 2])]
    [2]
    """
    stack = as_stack(images, codes)
    factors = as_integers(as_array(factors, "factors"), "factors").reshape(-1).tolist()
    return map_parallel(
        lambda k: [
            _histogram(_coarsened(stack.indices[k], factor, stack.n_facies), stack.codes, size)
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
    """Return the code of the pattern at each location: digits in `base`, or hashed for base 0."""
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


def js_divergence(a: PatternHistogram, b: PatternHistogram) -> float:
    """Return the Jensen–Shannon divergence of two histograms in bits, from 0 to 1.

    JS = ½ Σ a log₂(a / m) + ½ Σ b log₂(b / m), m = (a + b) / 2 (Lin 1991). Its square root is a
    distance.

    Parameters
    ----------
    a, b : PatternHistogram
        Of patterns of the same size.

    Returns
    -------
    float
        In bits; 0 for equal histograms, 1 for those without a common pattern.

    Raises
    ------
    CCWSIMError
        For histograms of different pattern sizes, or of different facies codes.

    Examples
    --------
    >>> from ccwsim.metrics.patterns import pattern_histogram
    >>> plain = pattern_histogram(np.zeros((4, 4), int), codes=[0, 1])
    >>> other = pattern_histogram(np.eye(4, dtype=int))
    >>> js_divergence(plain, plain), js_divergence(plain, other)
    (0.0, 1.0)
    """
    if not isinstance(a, PatternHistogram) or not isinstance(b, PatternHistogram):
        raise CCWSIMError("two histograms of patterns are needed, as pattern_histogram makes them")
    if a.size != b.size:
        raise CCWSIMError(f"patterns of {a.size} and of {b.size} cells cannot be compared")
    if a.facies != b.facies:
        raise CCWSIMError(
            f"patterns of the facies {shown(a.facies)} and {shown(b.facies)} cannot be compared; "
            "count both with the same codes"
        )
    return float(js_of_frequencies(a.codes, a.frequencies, b.codes, b.frequencies))


def pattern_distance(
    images: Images,
    training_image: TrainingImage | ArrayLike,
    codes: Codes | None = None,
    size: int = PATTERN_SIZE,
    factors: Sequence[int] = FACTORS,
    progress: Fraction | None = None,
) -> NDArray[np.float64]:
    """Return the Jensen–Shannon divergence of each image's patterns from the training image's.

    Parameters
    ----------
    images : Ensemble, TrainingImage or array_like, shape (ny, nx) or (n, ny, nx)
        An array has facies codes.
    training_image : TrainingImage or array_like, shape (ny, nx)
        An array has facies codes.
    codes : array_like of int, optional
        The facies codes; those of the training image where left out.
    size, factors, progress
        As in `pyramid_histograms`.

    Returns
    -------
    ndarray, shape (n, n_factors)

    Raises
    ------
    CCWSIMError
        For a cell with another code, and where patterns do not fit.

    Examples
    --------
    >>> image = np.eye(12, dtype=int)
    >>> pattern_distance(image, image)
    array([[0., 0., 0.]])
    """
    own = as_image(training_image, codes)
    target = pyramid_histograms(own, None, size, factors)[0]
    found = pyramid_histograms(images, own.codes, size, factors, progress)
    return np.array(
        [[js_divergence(h, t) for h, t in zip(row, target, strict=True)] for row in found]
    )


def divergences(
    histograms: list[list[PatternHistogram]], progress: Fraction | None = None
) -> NDArray[np.float64]:
    """Return the Jensen–Shannon divergence of all pairs, shape (n_factors, n, n).

    Parameters
    ----------
    histograms : list of list of PatternHistogram
        [image][factor], as `pyramid_histograms` gives them.
    progress : callable, optional
        Called with the share that is done.

    Returns
    -------
    ndarray, shape (n_factors, n, n)
        In bits, from 0 to 1; symmetric.

    Examples
    --------
    >>> rows = pyramid_histograms(np.eye(8, dtype=int)[None].repeat(2, axis=0), factors=[1])
    >>> divergences(rows).tolist()
    [[[0.0, 0.0], [0.0, 0.0]]]
    """
    n, n_factors = len(histograms), len(histograms[0])
    result = np.zeros((n_factors, n, n))
    joined = [_joined([row[g] for row in histograms]) for g in range(n_factors)]

    def fill(k: int) -> None:
        # rows k and n − 1 − k together are equally long for every k
        for row in {k, n - 1 - k}:
            for g in range(n_factors):
                _fill_row(*joined[g], row, result[g])

    map_parallel(fill, (n + 1) // 2, progress)
    return result + result.transpose(0, 2, 1)


def _joined(histograms: list[PatternHistogram]) -> tuple[NDArray, NDArray, NDArray]:
    starts = np.cumsum([0] + [len(h.codes) for h in histograms])
    codes = np.concatenate([h.codes for h in histograms])
    return codes, np.concatenate([h.frequencies for h in histograms]), starts


@kernel
def _fill_row(codes, shares, starts, row, result):
    a, b = starts[row], starts[row + 1]
    for other in range(row + 1, len(starts) - 1):
        c, d = starts[other], starts[other + 1]
        result[row, other] = js_of_frequencies(codes[a:b], shares[a:b], codes[c:d], shares[c:d])


@kernel
def js_of_frequencies(codes_a, shares_a, codes_b, shares_b):
    """Merge two sorted histograms; a pattern that only one has adds half its share."""
    total, i, j = 0.0, 0, 0
    while i < len(codes_a) and j < len(codes_b):
        if codes_a[i] == codes_b[j]:
            a, b = shares_a[i], shares_b[j]
            total += a * np.log2(2 * a / (a + b)) + b * np.log2(2 * b / (a + b))
            i += 1
            j += 1
        elif codes_a[i] < codes_b[j]:
            total += shares_a[i]
            i += 1
        else:
            total += shares_b[j]
            j += 1
    total += shares_a[i:].sum() + shares_b[j:].sum()
    return max(total / 2, 0.0)
