"""Jensen–Shannon divergence between pattern histograms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.metrics.patterns import FACTORS, PATTERN_SIZE, PatternHistogram, pyramid_histograms
from ccwsim.metrics.stack import Fraction, map_parallel
from ccwsim.model.errors import CCWSIMError


def js_divergence(a: PatternHistogram, b: PatternHistogram) -> float:
    """Return the Jensen–Shannon divergence of two histograms in bits, from 0 to 1.

    JS = ½ Σ a log₂(a / m) + ½ Σ b log₂(b / m), m = (a + b) / 2 (Lin 1991). Its square root is a
    distance.

    Raises
    ------
    CCWSIMError
        For histograms of different pattern sizes.

    Examples
    --------
    >>> from ccwsim.metrics.patterns import pattern_histogram
    >>> plain = pattern_histogram(np.zeros((4, 4), int), 2)
    >>> other = pattern_histogram(np.eye(4, dtype=int), 2)
    >>> js_divergence(plain, plain), js_divergence(plain, other)
    (0.0, 1.0)
    """
    if not isinstance(a, PatternHistogram) or not isinstance(b, PatternHistogram):
        raise CCWSIMError("two histograms of patterns are needed, as pattern_histogram makes them")
    if a.size != b.size:
        raise CCWSIMError(f"patterns of {a.size} and of {b.size} cells cannot be compared")
    return float(js_of_frequencies(a.codes, a.frequencies, b.codes, b.frequencies))


def pattern_distance(
    images: ArrayLike,
    training_image: NDArray[np.integer],
    n_facies: int,
    size: int = PATTERN_SIZE,
    factors: Sequence[int] = FACTORS,
    progress: Fraction | None = None,
) -> NDArray[np.float64]:
    """Return the Jensen–Shannon divergence of each image's patterns from the training image's.

    Parameters
    ----------
    images : array_like, shape (ny, nx) or (n, ny, nx)
        Facies indices.
    training_image : ndarray, shape (ny, nx)
        Its facies indices.
    n_facies, size, factors, progress
        As in `pyramid_histograms`.

    Returns
    -------
    ndarray, shape (n, n_factors)

    Examples
    --------
    >>> image = np.eye(12, dtype=int)
    >>> pattern_distance(image, image, 2)
    array([[0., 0., 0.]])
    """
    target = pyramid_histograms(training_image, n_facies, size, factors)[0]
    found = pyramid_histograms(images, n_facies, size, factors, progress)
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

    Examples
    --------
    >>> rows = pyramid_histograms(np.eye(8, dtype=int)[None].repeat(2, axis=0), 2, factors=[1])
    >>> divergences(rows).tolist()
    [[[0.0, 0.0], [0.0, 0.0]]]
    """
    n, n_factors = len(histograms), len(histograms[0])
    result = np.zeros((n_factors, n, n))
    packed = [_packed([row[g] for row in histograms]) for g in range(n_factors)]

    def fill(k: int) -> None:
        # rows k and n − 1 − k together are equally long for every k
        for row in {k, n - 1 - k}:
            for g in range(n_factors):
                _fill_row(*packed[g], row, result[g])

    map_parallel(fill, (n + 1) // 2, progress)
    return result + result.transpose(0, 2, 1)


def _packed(histograms: list[PatternHistogram]) -> tuple[NDArray, NDArray, NDArray]:
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
