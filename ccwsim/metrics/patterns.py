"""Histograms of patterns on a pyramid of resolutions, their divergence, and unseen patterns."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccwsim import TrainingImage
from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.metrics.coarsening import coarsened_volume
from ccwsim.metrics.pattern_codes import are_unknown, codes_in, count_patterns, make_hash_table
from ccwsim.metrics.stack import (
    Codes,
    Fraction,
    Images,
    Stack,
    as_image,
    as_stack,
    known_part,
    map_parallel,
)
from ccwsim.model import (
    Array,
    ArrayLike,
    Bytes,
    CCWSIMError,
    Floats,
    Integers,
    Mask,
    Shape,
    UInt64s,
    as_array,
    as_integers,
    check_int,
    ratio,
    refused,
    shown,
)

PATTERN_SIZE, VOLUME_PATTERN_SIZE = 4, 3  # default side of patterns in maps and in volumes
FACTORS = (1, 2, 3)  # coarsening factors of full, half and third resolution


@dataclass(frozen=True, eq=False)
class PatternHistogram:
    """Frequency of each pattern of size × size cells, or size × size × size cells in a volume."""

    codes: UInt64s
    """Sorted codes of the patterns that occur. The digits of a code in base n_facies are the facies
    of the pattern's cells. A code of more than 64 bits is replaced by a 64-bit hash."""
    frequencies: Floats
    """Relative frequency of each pattern; the sum is 1."""
    size: int
    """Side of the patterns in cells."""
    facies: tuple[int, ...] = ()
    """Sorted facies codes; a digit k in a pattern's code stands for facies[k]."""
    layers: int = 1
    """Height of the patterns: 1 in maps; in volumes `size`, but at most the number of layers."""


def pattern_histogram(
    image: Images, codes: Codes | None = None, size: int | None = None
) -> PatternHistogram:
    """Count the patterns of size × size (× size) cells at all locations of an image exactly.

    In a volume with fewer than `size` layers, patterns are as high as the volume.

    Examples
    --------
    >>> histogram = pattern_histogram(np.eye(3, dtype=int), size=2)
    >>> histogram.codes, histogram.frequencies
    (array([2, 4, 9], dtype=uint64), array([0.25, 0.25, 0.5 ]))
    """
    stack = as_image(image, codes)
    side = pattern_size_of(stack, size)
    return _histogram(stack.volume(0), stack.codes, side, min(side, thinnest_n_layers(stack)))


def pattern_size_of(stack: Stack, size: int | None) -> int:
    """Return the side of patterns after checking it; the default is 4 in maps and 3 in volumes."""
    if size is None:
        return VOLUME_PATTERN_SIZE if stack.is_volumes else PATTERN_SIZE
    return check_int("pattern size", size, 1, 2**31)


def thinnest_n_layers(stack: Stack, *others: Stack) -> int:
    """Return the number of layers of the thinnest volume; 1 for maps."""
    for other in others:
        if other.is_volumes != stack.is_volumes:
            raise refused("maps_and_volumes", other=other.shape, shape=stack.shape)
    return min(one.shape[0] for one in (stack, *others)) if stack.is_volumes else 1


def _histogram(volume: Bytes, facies: Integers, size: int, height: int) -> PatternHistogram:
    size = check_int("pattern size", size, 1, min(volume.shape[1:]))
    pattern_codes, counts = count_patterns(volume, len(facies), height, size)
    return PatternHistogram(
        pattern_codes, ratio(counts, counts.sum()), size, tuple(facies.tolist()), height
    )


def pyramid_histograms(
    images: Images,
    codes: Codes | None = None,
    size: int | None = None,
    factors: Sequence[int] = FACTORS,
    progress: Fraction | None = None,
    layers: int | None = None,
) -> list[list[PatternHistogram]]:
    """Return a pattern histogram for each image and resolution.

    Along z, factors are reduced so that patterns fit into `layers` layers. `layers` is the number
    of layers of the thinnest compared volume, by default of the thinnest volume in `images`.

    Examples
    --------
    >>> [len(row) for row in pyramid_histograms(np.eye(12, dtype=int), factors=[1, 2])]
    [2]
    """
    factors = as_integers(as_array(factors, "factors"), "factors").reshape(-1).tolist()
    stack = as_stack(images, codes)
    side = pattern_size_of(stack, size)
    if max(factors) > 1:
        part = known_part(stack)
        stack = part if min(part.shape[-2:]) >= side * max(factors) else stack
    thickest = thinnest_n_layers(stack)
    thinnest = thickest if layers is None else check_int("layers", layers, 1, thickest)
    height = min(side, thinnest)
    along_z = [max(min(factor, thinnest // height), 1) for factor in factors]

    def one(k: int) -> list[PatternHistogram]:
        resolutions = []
        for factor, z in zip(factors, along_z, strict=True):
            coarse = coarsened_volume(stack.volume(k), (z, factor, factor), stack.n_facies)
            resolutions.append(_histogram(coarse, stack.codes, side, height))
        return resolutions

    return map_parallel(one, len(stack), progress)


def js_divergence(a: PatternHistogram, b: PatternHistogram) -> float:
    """Return the Jensen–Shannon divergence of two histograms in bits, from 0 to 1.

    JS = ½ Σ a log₂(a / m) + ½ Σ b log₂(b / m) with m = (a + b) / 2 (Lin 1991). The divergence is 0
    for equal histograms, 1 for histograms without a common pattern, and NaN for a histogram without
    patterns. The square root is a metric. Raises `CCWSIMError` for histograms of different pattern
    sizes or facies codes.

    Examples
    --------
    >>> plain = pattern_histogram(np.zeros((4, 4), int), codes=[0, 1])
    >>> other = pattern_histogram(np.eye(4, dtype=int))
    >>> js_divergence(plain, plain), js_divergence(plain, other)
    (0.0, 1.0)
    """
    if not isinstance(a, PatternHistogram) or not isinstance(b, PatternHistogram):
        raise CCWSIMError("two results of pattern_histogram are needed")
    if (a.size, a.layers) != (b.size, b.layers):
        one, other = (
            f"{h.size}" if h.layers == 1 else f"{h.layers} × {h.size} × {h.size}" for h in (a, b)
        )
        raise CCWSIMError(f"patterns of {one} and of {other} cells cannot be compared")
    if a.facies != b.facies:
        raise refused("patterns_of_other_facies", first=shown(a.facies), second=shown(b.facies))
    result = np.zeros((2, 2))
    codes, shares, starts = _joined([a, b])
    _fill_row(codes, shares, starts, 0, result)
    return float(result[0, 1])


def pattern_distance(
    images: Images,
    training_image: TrainingImage | ArrayLike,
    codes: Codes | None = None,
    size: int | None = None,
    factors: Sequence[int] = FACTORS,
    progress: Fraction | None = None,
) -> Floats:
    """Return the Jensen–Shannon divergence between patterns of each image and the training image.

    The result has shape (n, n_factors), in bits.

    Examples
    --------
    >>> image = np.eye(12, dtype=int)
    >>> pattern_distance(image, image)
    array([[0., 0., 0.]])
    """
    image = as_image(training_image, codes)
    stack = as_stack(images, image.codes)
    layers = thinnest_n_layers(image, stack)
    target = pyramid_histograms(image, size=size, factors=factors, layers=layers)[0]
    histograms = pyramid_histograms(
        stack, size=size, factors=factors, progress=progress, layers=layers
    )
    return np.array(
        [[js_divergence(h, t) for h, t in zip(row, target, strict=True)] for row in histograms]
    )


def unseen_patterns(
    images: Images,
    training_image: Images,
    size: int = 3,
    mask: Mask | None = None,
    codes: Codes | None = None,
    progress: Fraction | None = None,
) -> Floats:
    """Return the share of the patterns of each image that do not occur in the training image.

    Patterns of volumes have `size` layers, or all layers of the thinner image. The result has shape
    (n,). Only patterns that contain a cell of `mask` (shape of one image), such as a cell with hard
    data, are counted; the share is NaN if the mask is empty.

    Examples
    --------
    >>> stripes = np.tile([0, 0, 1, 1], (8, 2))
    >>> unseen_patterns([stripes, stripes.T], stripes)
    array([0., 1.])
    """
    image = as_image(training_image, codes)
    stack = as_stack(images, image.codes)
    size = check_int("pattern size", size, 1, min(image.shape[-2:] + stack.shape[-2:]))
    n_facies, height = image.n_facies, min(size, thinnest_n_layers(image, stack))
    chosen = None if mask is None else _containing(mask, stack.shape, height, size)
    keys, full = make_hash_table(count_patterns(image.volume(0), n_facies, height, size)[0])

    def one(k: int) -> float:
        strips = codes_in(stack.volume(k), n_facies, height, size)
        unknown = np.concatenate([are_unknown(strip.ravel(), keys, full) for strip in strips])
        if chosen is not None:
            unknown = unknown[chosen]
        return float(unknown.mean()) if len(unknown) else float("nan")

    return np.array(map_parallel(one, len(stack), progress))


def _containing(mask: Mask, shape: Shape, height: int, size: int) -> Mask:
    """Return the flat mask of the locations whose pattern contains a cell of `mask`."""
    mask = as_array(mask, "mask")
    if mask.shape != shape or mask.dtype != np.bool_:
        raise refused("mask", shape=shape, dtype=mask.dtype, given=mask.shape)
    chosen = mask.reshape((-1, *shape[-2:]))
    for axis, side in enumerate((height, size, size)):
        chosen = np.lib.stride_tricks.sliding_window_view(chosen, side, axis).any(axis=-1)
    return chosen.ravel()


def divergences(
    histograms: list[list[PatternHistogram]], progress: Fraction | None = None
) -> Floats:
    """Return the Jensen–Shannon divergences of all pairs in bits, shape (n_factors, n, n).

    `histograms` is the result of `pyramid_histograms`: `histograms[k][g]` belongs to image k and
    factor g.

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
        # rows k and n − 1 − k together have the same length for every k
        for row in {k, n - 1 - k}:
            for g in range(n_factors):
                codes, shares, starts = joined[g]
                _fill_row(codes, shares, starts, row, result[g])

    map_parallel(fill, (n + 1) // 2, progress)
    return result + result.transpose(0, 2, 1)


def _joined(histograms: list[PatternHistogram]) -> tuple[Array, Array, Array]:
    """Return codes and frequencies of all histograms, and the start of each histogram in them."""
    starts = np.cumsum([0] + [len(h.codes) for h in histograms])
    codes = np.concatenate([h.codes for h in histograms])
    return codes, np.concatenate([h.frequencies for h in histograms]), starts


@kernel
def _fill_row(codes, shares, starts, row, result):
    """Compare one histogram with all later histograms."""
    a, b = starts[row], starts[row + 1]
    for other in range(row + 1, len(starts) - 1):
        c, d = starts[other], starts[other + 1]
        result[row, other] = _js_of(codes[a:b], shares[a:b], codes[c:d], shares[c:d])


@part_of_kernel
def _js_of(codes_a, shares_a, codes_b, shares_b):
    """Return the divergence of two sorted histograms; an unpaired pattern adds half its share."""
    if len(codes_a) == 0 or len(codes_b) == 0:
        return np.nan
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
