"""Two-point statistics: indicator variograms and transiograms, along a direction and as maps."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from ccwsim.engine.kernels import allocating_kernel
from ccwsim.metrics.lags import Direction, Lags, count_pairs, lags_within
from ccwsim.metrics.stack import (
    N_AXES,
    Codes,
    Fraction,
    Images,
    as_stack,
    as_volume,
    in_pieces,
    map_parallel,
)
from ccwsim.model import (
    MAX_LAG,
    UNKNOWN,
    Array,
    Bytes,
    Floats,
    Ints,
    Shape,
    check_int,
    ratio,
    refused,
)


@dataclass(frozen=True, eq=False)
class Variogram:
    """Indicator variograms of one facies."""

    lags: Ints
    """Lags in steps of the direction, shape (n_lags,)."""
    gamma: Floats
    """γ(h) of each image, shape (n, n_lags)."""
    sill: Floats
    """p (1 − p), the value of γ for independent cells, shape (n,)."""


@dataclass(frozen=True, eq=False)
class VariogramMap:
    """Indicator variograms of one facies for all lags."""

    lags: Ints
    """Lags −max_lag … max_lag of the rows (to the north) and the columns (to the east)."""
    gamma: Floats
    """γ(h) of each image, shape (n, 2 max_lag + 1, 2 max_lag + 1)."""


def variogram(
    images: Images,
    facies: int | str,
    direction: Direction = "E-W",
    lags: Lags | None = None,
    progress: Fraction | None = None,
) -> Variogram:
    """Return γ(h) = ½ E[(I(x) − I(x + h))²] of a facies, over all pairs of cells.

    Examples
    --------
    >>> variogram([[0, 0, 1, 1]], 1, lags=2).gamma
    array([[0.        , 0.16666667, 0.5       ]])
    """
    stack = as_stack(images)
    steps, offsets = lags_within(stack.shape, direction, lags)
    index = stack.index_of(facies)

    def one(k: int) -> Array:
        volume, n = stack.volume(k), stack.n_facies
        if (volume == UNKNOWN).any():
            pairs = _known_transitions(volume, n, offsets)
            n_touching = pairs[:, index].sum(axis=1) + pairs[:, :, index].sum(axis=1)
            return ratio(n_touching - 2 * pairs[:, index, index], 2 * pairs.sum(axis=(1, 2)))
        inside = (volume == index).view(np.uint8)
        unequal = in_pieces(lambda piece: _count_unequal(inside, piece), offsets, inside.size)
        return unequal / (2 * count_pairs(stack.shape, offsets))

    gamma = np.array(map_parallel(one, len(stack), progress), np.float64)
    counts = [[np.count_nonzero(i == index), np.count_nonzero(i != UNKNOWN)] for i in stack.indices]
    shares = ratio(*np.array(counts).T)
    return Variogram(steps, gamma, shares * (1 - shares))


def variogram_of_values(
    images: Images,
    direction: Direction = "E-W",
    lags: Lags | None = None,
    progress: Fraction | None = None,
) -> Variogram:
    """Return γ(h) = ½ E[(Z(x) − Z(x + h))²] of a continuous variable Z, in its units squared.

    The pairs are those of cells with values, and the sill is the variance. Raises `CCWSIMError`
    for images of facies.

    Examples
    --------
    >>> from ccwsim import TrainingImage
    >>> ramp = TrainingImage.from_array([[0.0, 1.0, 2.0, 3.0]], continuous=True)
    >>> variogram_of_values(ramp, lags=2).gamma
    array([[0. , 0.5, 2. ]])
    """
    stack = as_stack(images)
    values = stack.values
    if values is None:
        raise refused("no_values", name="values", there="only facies")
    steps, offsets = lags_within(stack.shape, direction, lags)

    def one(k: int) -> Floats:
        return _mean_squares(as_volume(values[k]), offsets) / 2

    gamma = np.array(map_parallel(one, len(stack), progress), np.float64)
    return Variogram(steps, gamma, np.nanvar(values.reshape(len(stack), -1), axis=1))


@allocating_kernel
def _mean_squares(values, offsets):
    """Return for each lag the mean squared difference over pairs of cells that are not NaN."""
    nz, ny, nx = values.shape
    means = np.full(len(offsets), np.nan)
    for lag in range(len(offsets)):
        dz, dy, dx = offsets[lag]
        first, last = max(0, -dx), nx - max(0, dx)
        total, n = 0.0, 0
        for k in range(max(0, -dz), nz - max(0, dz)):
            for i in range(max(0, -dy), ny - max(0, dy)):
                for j in range(first, last):
                    difference = values[k + dz, i + dy, j + dx] - values[k, i, j]
                    if not np.isnan(difference):
                        total += difference * difference
                        n += 1
        if n:
            means[lag] = total / n
    return means


def variogram_map(
    images: Images, facies: int | str, max_lag: int | None = None, progress: Fraction | None = None
) -> VariogramMap:
    """Return the exact γ(h) of a facies in maps for all lags up to max_lag rows and columns.

    Over the pairs inside the map, Σ (I(x) − I(x + h))² = Σ I(x) + Σ I(x + h) − 2 Σ I(x) I(x + h).
    The sums are correlations of masks, of the facies and of known cells; they are computed by FFT
    (Marcotte 1996).

    Examples
    --------
    >>> variogram_map(np.eye(3, dtype=int), 1, 1).gamma[0, 2].tolist()
    [0.25, 0.3333333333333333, 0.0]
    """
    stack = as_stack(images)
    lags, index = _lags_of_map(max_lag, stack.shape), stack.index_of(facies)
    reach = int(lags[-1])

    def one(k: int) -> Floats:
        inside, valid = stack.indices[k] == index, stack.indices[k] != UNKNOWN
        near, n_pairs = (_product_sums(part, valid, reach) for part in (inside, valid))
        squares = near + near[::-1, ::-1] - 2 * _product_sums(inside, inside, reach)
        return ratio(squares, 2 * n_pairs)

    return VariogramMap(lags, np.array(map_parallel(one, len(stack), progress)))


@allocating_kernel
def _count_unequal(inside, offsets):
    """Return for each lag the number of pairs with one cell in the facies and one cell outside."""
    nz, ny, nx = inside.shape
    counts = np.zeros(len(offsets), np.int64)
    for lag in range(len(offsets)):
        dz, dy, dx = offsets[lag]
        first, last = max(0, -dx), nx - max(0, dx)
        for k in range(max(0, -dz), nz - max(0, dz)):
            for i in range(max(0, -dy), ny - max(0, dy)):
                tail = inside[k, i, first:last]
                head = inside[k + dz, i + dy, first + dx : last + dx]
                unequal = np.int32(0)
                for j in range(len(tail)):
                    unequal += np.int32(tail[j] != head[j])
                counts[lag] += unequal
    return counts


@dataclass(frozen=True, eq=False)
class Transiograms:
    """Transition probabilities between all facies."""

    lags: Ints
    """Lags in steps of the direction, shape (n_lags,)."""
    probability: Floats
    """P(x + h in head | x in tail), shape (n, tails, heads, n_lags); NaN for an absent tail."""


def transiograms(
    images: Images,
    codes: Codes | None = None,
    direction: Direction = "E-W",
    lags: Lags | None = None,
    progress: Fraction | None = None,
) -> Transiograms:
    """Return P(x + h in head | x in tail) for all pairs of facies (Li 2007).

    The head x + h is east or north of the tail x, or above x in volumes. The matrix of a lag is
    therefore not symmetric in general.

    Examples
    --------
    >>> transiograms([[0, 0, 1, 1]], lags=[1]).probability[0, :, :, 0]
    array([[0.5, 0.5],
           [0. , 1. ]])
    """
    stack = as_stack(images, codes)
    steps, offsets = lags_within(stack.shape, direction, lags)
    counted = map_parallel(
        lambda k: _known_transitions(stack.volume(k), stack.n_facies, offsets), len(stack), progress
    )
    counts = np.moveaxis(np.array(counted, dtype=float), 1, 3)
    return Transiograms(steps, ratio(counts, counts.sum(axis=2, keepdims=True)))


def _known_transitions(volume: Bytes, n_facies: int, offsets: Ints) -> Ints:
    """Return the result of `_count_transitions` for the pairs of known cells."""
    with_unknown = np.minimum(volume, n_facies)
    return _count_transitions(with_unknown, n_facies + 1, offsets)[:, :n_facies, :n_facies]


@allocating_kernel
def _count_transitions(image, n_facies, offsets):
    """Return the number of pairs by tail and head facies, shape (n_lags, n_facies, n_facies)."""
    nz, ny, nx = image.shape
    counts = np.zeros((len(offsets), n_facies, n_facies), np.int64)
    for lag in range(len(offsets)):
        dz, dy, dx = offsets[lag]
        first, last = max(0, -dx), nx - max(0, dx)
        for k in range(max(0, -dz), nz - max(0, dz)):
            for i in range(max(0, -dy), ny - max(0, dy)):
                for j in range(first, last):
                    counts[lag, image[k, i, j], image[k + dz, i + dy, j + dx]] += 1
    return counts


def _lags_of_map(max_lag: int | None, shape: Shape) -> Ints:
    """Return the lags −max_lag … max_lag, by default up to 50 or the longest lag that fits."""
    if len(shape) == N_AXES:
        raise refused("lags_of_volume", n=shape[0])
    longest = min(shape) - 1
    if max_lag is None:
        max_lag = min(MAX_LAG // 2, max(longest, 1))
    max_lag = check_int("max_lag", max_lag, 1, longest)
    return np.arange(-max_lag, max_lag + 1)


def _product_sums(tail: Array, head: Array, max_lag: int) -> Floats:
    """Return the exact sum Σ tail(x) · head(x + h) for each lag h of two masks (ny, nx)."""
    size = [fft.next_fast_len(n + max_lag, real=True) for n in tail.shape]
    one, other = (np.asarray(fft.rfft2(np.asarray(a, float), size)) for a in (tail, head))
    sums = np.asarray(fft.irfft2(one.conj() * other, size))
    lags = np.arange(-max_lag, max_lag + 1)
    return np.rint(sums[np.ix_(lags, lags)]) + 0.0
