"""Comparison of realizations with crops of their training image.

Statistics vary between crops of one training image. Statistics also depend on the window size,
because a smaller window cuts more geobodies. Pieces of the realizations are therefore compared with
crops of equal size. The mean over m pieces and the mean over crops may differ by
c · σ · √(1/k + 1/m) if k crops are independent. σ is the standard deviation between crops.
Neighbouring crops share long features and vary too little, so the standard deviation between pieces
counts if it is larger, but only up to a multiple of that of the crops. Otherwise the larger spread
of worse realizations would hide their errors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import isqrt, prod
from typing import Any, get_args
from weakref import WeakKeyDictionary

import numpy as np
from scipy.special import ndtri, stdtrit

from ccwsim import Ensemble, Grid, TrainingImage
from ccwsim.jobs.memo import Memo
from ccwsim.metrics.bands import Statistic, curves_of
from ccwsim.metrics.connectivity import geobody_statistics
from ccwsim.metrics.etype import proportions
from ccwsim.metrics.lags import Direction, distinct_lags, max_lag
from ccwsim.metrics.pattern_codes import count_patterns
from ccwsim.metrics.patterns import PatternHistogram, js_divergence
from ccwsim.metrics.stack import N_AXES, Stack, as_volume
from ccwsim.model import (
    Array,
    ArrayLike,
    Floats,
    Integers,
    Mask,
    Shape,
    UInt64s,
    active_windows,
    as_floats,
    check_choice,
    check_int,
    even_corners,
    ratio,
    refused,
    windows_at,
)

MIN_SIDE, MAX_SIDE = 8, 512
"""Limits of a crop's side in cells: smaller crops contain no pattern, larger crops are slow."""
MAX_CROP_CELLS = 2_000_000  # maximum number of cells in a crop from a volume
MAX_CROPS_ALONG = 4  # maximum number of crops along an axis; crops overlap by about half or less
MAX_CROPS_ABOVE = 2  # maximum number of crops along z in a volume
MIN_CROPS, MIN_SHARE = 3, 0.75
"""Minimum number of crops and of pieces that have a judged value, and minimum share of crops that
have it, because connectivity at long lags is that of few cells in few crops."""
MAX_PIECES = 32  # more pieces would not help, because the crops limit the precision
ERROR_LIMITS = {
    "proportions": (3.0, 3.0),
    "variogram": (4.0, 4.0),
    "values": (4.0, 4.0),
    "connectivity": (4.0, 4.0),
    "geobodies": (3.0, 2.5),
    "patterns": (3.0, 3.0),
}
"""Allowed differences in standard errors, for maps and for volumes."""
USEFUL_TOLERANCES = {
    "proportions": (0.3, True),
    "variogram": (0.5, True),
    "values": (0.5, True),
    "connectivity": (0.3, False),
    "geobodies": (0.5, False),
    "patterns": (1.0, True),
    "joins": (1.0, True),
    "measures": (0.5, True),
    "flow": (0.15, False),
}
"""Median tolerance above which agreement confirms nothing, and whether it is relative to crops."""
STUDENT_PROBABILITY = 0.001
"""Probability at which limits for few crops widen: by Student's t quantile / normal quantile."""
MAX_OWN = (2.0, 3.0)  # limit of the spread of pieces, in spreads of crops, for maps and volumes
MIN_GAP = 0.1  # smallest reported difference of a curve, in τ or, for γ, in sills p (1 − p)
MIN_PROPORTION_GAP = 0.05  # smallest reported difference, relative to the image's proportion
PATTERN_SIZES = (2, 3)  # sides of compared patterns, which are squares, or cubes in volumes
MIN_GAMMA_GAP, MIN_PERCOLATION_GAP = 0.1, 0.25
"""Smallest reported differences of Γ and of the share of pieces that percolate."""
MIN_CONNECTED_SPREAD = 0.1
"""Smallest standard deviation between crops of τ, Γ and the share that percolates: crops of one
image share its long bodies, so they differ less than images do."""
MIN_PATTERN_SPREAD = 0.5  # smallest deviation of pattern distances, relative to their mean
ValuesOf = Callable[[Stack], Floats]


@dataclass(frozen=True, eq=False)
class Fit:
    """Values of realizations and of crops of their training image; arrays have shape (m,)."""

    at: Floats
    """Position of each value: the lag in cells on a curve, the facies code, or an index."""
    found: Floats
    """Mean of each value over pieces of the realizations; NaN if no piece has the value."""
    reference: Floats
    """Mean of each value over crops of the training image."""
    tolerance: Floats
    """Allowed difference between `found` and `reference`; NaN if the value cannot be judged."""
    crop_shape: Shape
    """(Layers,) rows and columns of crops and pieces."""
    one_sided: bool | Mask = False
    """Whether only values above `reference` are outside the band, one for all values or a mask."""
    useful_tolerance: tuple[float, bool] = (np.inf, True)
    """As in `USEFUL_TOLERANCES`."""

    @property
    def relative_tolerance(self) -> Floats:
        """Tolerance of each value as it is compared with `useful_tolerance`.

        If less is never a fault, the tolerance of a value below the crops is 0.
        """
        one_sided = np.where(self.one_sided & (self.found <= self.reference), 0.0, self.tolerance)
        if not self.useful_tolerance[1]:
            return one_sided
        return ratio(one_sided, np.abs(self.reference))

    @property
    def median_tolerance(self) -> float:
        """Median of the relative tolerances, ∞ where there is nothing to compare with."""
        comparable = self.relative_tolerance[np.isfinite(self.relative_tolerance)]
        return float(np.median(comparable)) if comparable.size else np.inf

    @property
    def cannot_tell(self) -> bool:
        """Whether no value is outside a band that is so wide that most faults would be inside."""
        return self.fits and self.median_tolerance > self.useful_tolerance[0]

    @property
    def judged(self) -> bool:
        """Whether any value can be judged."""
        return bool(np.isfinite(self._excess).any())

    @property
    def outside(self) -> Mask:
        """Mask of the values outside the band, shape (m,)."""
        return self._excess > 1

    @property
    def fits(self) -> bool:
        """Whether no value is outside the band."""
        return not self.outside.any()

    @property
    def worst(self) -> int:
        """Index of the value with the largest difference / tolerance; 0 if no value is judged."""
        return int(np.argmax(np.nan_to_num(self._excess, nan=-1.0)))

    @property
    def _excess(self) -> Floats:
        """Ratio of difference to tolerance of each value; NaN if the value cannot be judged."""
        with np.errstate(divide="ignore", invalid="ignore"):  # a constant image has no tolerance
            above = (self.found - self.reference) / self.tolerance
        return np.where(self.one_sided, above, np.abs(above))


@dataclass(frozen=True, eq=False)
class ReferenceBand:
    """Values of crops of a training image, for comparison with realizations.

    Examples
    --------
    >>> crops = np.array([[0.4], [0.5], [0.6], [0.5]])
    >>> band = ReferenceBand(np.zeros(1), crops, 4.0, 2.0, np.zeros(1), (64, 64))
    >>> band.compare([[0.5]] * 12).fits, band.compare([[0.1]] * 12).fits
    (True, False)
    """

    at: Floats
    """Position of each value, as in `Fit`."""
    values: Floats
    """Values of each crop, shape (n_crops, m); NaN if a value is missing."""
    n_independent: float
    """Number of crops that would fit into the training image without overlap."""
    n_errors: ArrayLike
    """Allowed difference of each value in standard errors, shape (m,), or of all values."""
    min_gap: ArrayLike
    """Smallest reported difference of each value, shape (m,), or of all values."""
    crop_shape: Shape
    min_spread: ArrayLike = 0.0
    """Smallest standard deviation of each value between crops."""
    one_sided: bool | Mask = False
    """As in `Fit`."""
    useful_tolerance: tuple[float, bool] = (np.inf, True)
    """As in `USEFUL_TOLERANCES`."""

    def compare(self, pieces: ArrayLike, n_pieces: float | None = None) -> Fit:
        """Compare the values of pieces of realizations, shape (n, m), with the crops.

        `n_pieces` is the number of independent pieces, by default n.
        """
        values = as_floats(pieces, "values")
        n, n_valid = ((~np.isnan(each)).sum(axis=0) for each in (self.values, values))
        enough = n >= max(MIN_CROPS, MIN_SHARE * len(self.values))
        enough &= n_valid >= min(MIN_CROPS, len(values))
        reference, spread = (np.where(enough, each, np.nan) for each in moments(self.values))
        spread = np.maximum(spread, self.min_spread)
        mean_of_pieces, spread_of_pieces = moments(values)
        largest = MAX_OWN[len(self.crop_shape) - 2] * spread
        spread = np.maximum(spread, np.minimum(np.nan_to_num(spread_of_pieces), largest))
        k, m = np.minimum(self.n_independent, np.maximum(n, 1)), n_pieces or np.maximum(n_valid, 1)
        few = stdtrit(np.maximum(k + m - 2, 1.0), 1 - STUDENT_PROBABILITY / 2) / ndtri(
            1 - STUDENT_PROBABILITY / 2
        )
        error = spread * np.sqrt(1 / k + 1 / m) * few  # the spread of few crops is uncertain
        return Fit(
            at=self.at,
            found=mean_of_pieces,
            reference=reference,
            tolerance=np.maximum(self.n_errors * error, self.min_gap),
            crop_shape=self.crop_shape,
            one_sided=self.one_sided,
            useful_tolerance=self.useful_tolerance,
        )


def moments(values: Floats) -> tuple[Floats, Floats]:
    """Return the mean and standard deviation of each column without NaN; NaN if unknown."""
    valid = ~np.isnan(values)
    n = valid.sum(axis=0)
    mean = ratio(np.where(valid, values, 0.0).sum(axis=0), n)
    squares = np.where(valid, (values - mean) ** 2, 0.0).sum(axis=0)
    return mean, np.sqrt(ratio(squares, np.maximum(n - 1, 0)))


def crop_shape(image_shape: Shape, grid_shape: Shape) -> Shape | None:
    """Return the shape of crops and pieces for comparing a training image with realizations.

    A crop is as long as the grid, but at most 512 cells and at most half as long as the training
    image. In volumes, a crop has the layers of the thinner shape and at most two million cells. The
    result is None if crops would have fewer than 8 rows or columns. Raises `CCWSIMError` if a map
    is compared with a volume.

    Examples
    --------
    >>> crop_shape((256, 256), (100, 512)), crop_shape((12, 300), (100, 100))
    ((100, 128), None)
    >>> crop_shape((50, 300, 300), (20, 100, 200))
    (20, 100, 150)
    """
    image_shape, grid_shape = Grid.of(image_shape).shape, Grid.of(grid_shape).shape
    *layers, ny, nx = largest_crop(image_shape, grid_shape)
    rows, columns = (min(n, side // 2) for n, side in zip((ny, nx), image_shape[-2:], strict=True))
    return (*layers, rows, columns) if min(rows, columns) >= MIN_SIDE else None


def shape_of_crops(ensemble: Ensemble) -> Shape | None:
    """Return the `crop_shape` of an ensemble in a window without inactive cells.

    It is None if crops of the training image are no reference: if patches come from other, turned
    or scaled images, or if given probabilities ask for another amount of a facies.
    """
    if ensemble.is_of_other_images or asks_other_amount(ensemble):
        return None
    return crop_shape(ensemble.training_image.shape, ensemble.study.whole_shape)


_asks_other_amount: WeakKeyDictionary[Ensemble, bool] = WeakKeyDictionary()


def asks_other_amount(ensemble: Ensemble) -> bool:
    """Return whether given probabilities ask for proportions outside the band of the image's."""
    if ensemble not in _asks_other_amount:
        fit = fit_proportions(ensemble) if ensemble.has_probabilities else None
        off = fit and np.abs(fit.reference - ensemble.training_image.proportions) > fit.tolerance
        _asks_other_amount[ensemble] = off is not None and bool(off.any())
    return _asks_other_amount[ensemble]


def largest_crop(image_shape: Shape, grid_shape: Shape) -> Shape:
    """Return the shape of the largest window that fits into the training image and the grid."""
    if len(image_shape) != len(grid_shape):
        raise refused("image_and_realizations", image=tuple(image_shape), grid=tuple(grid_shape))
    *layers, rows, columns = map(min, image_shape, grid_shape)
    longest = min(MAX_SIDE, isqrt(MAX_CROP_CELLS // max([*layers, 1])))
    return (*layers, min(rows, longest), min(columns, longest))


def crops_of(image: Array, shape: Shape) -> Array:
    """Return evenly spaced crops, shape (n, *shape): at most 4 × 4, or 2 × 4 × 4 of a volume."""
    most = (MAX_CROPS_ABOVE, MAX_CROPS_ALONG, MAX_CROPS_ALONG)[-len(shape) :]
    needed = (1 + -(-2 * (n - side) // side) for n, side in zip(image.shape, shape, strict=True))
    corners = even_corners(image.shape, shape, map(min, most, needed))
    return np.array([image[window] for window in windows_at(corners, shape)])


def pieces_of(ensemble: Ensemble, shape: Shape) -> Stack:
    """Return m ≤ `MAX_PIECES` pieces of realizations, without overlap and inactive cells."""
    windows, realizations = active_windows(ensemble.study.active_mask, shape), ensemble.indices
    total = len(realizations) * len(windows)
    chosen = np.linspace(0, total - 1, min(total, MAX_PIECES)).astype(int)
    numbers, which = np.divmod(chosen, len(windows))
    pairs = zip(numbers, which, strict=True)
    pieces = [(number, *windows[window]) for number, window in pairs]
    values = [array[piece] for array in ensemble.values.values() for piece in pieces]
    return Stack(
        np.array([realizations[piece] for piece in pieces]),
        ensemble.training_image.codes,
        values=np.array(values) if values else None,
    )


def fit_curve(
    ensemble: Ensemble, statistic: Statistic, facies: int | str, direction: Direction = "E-W"
) -> Fit | None:
    """Compare a curve of realizations with the curves of crops of their training image.

    `statistic` is "variogram", "connectivity", or "values" for the variogram of a continuous
    variable, which is that of all facies. Lags extend to half of a crop: one training image
    cannot tell whether longer connections fit. The result is None if the training image or the grid
    is too small.

    Examples
    --------
    >>> from ccwsim import datasets, simulate
    >>> realizations = simulate(datasets.load("channels"), (128, 128))
    >>> fit_curve(realizations, "connectivity", 1).fits
    True
    """
    image = ensemble.training_image
    facies, index = image.code_of(facies), image.index_of(facies)
    check_choice("statistic", statistic, get_args(Statistic))
    shape = shape_of_crops(ensemble)
    if shape is None or not max_lag(direction, shape):  # there is no lag along a single layer
        return None
    lags, distances = distinct_lags(direction, max_lag(direction, shape))

    def values(images: Stack) -> Floats:
        return curves_of(statistic, images, facies, direction, lags[1:])

    gap, spread = MIN_GAP, MIN_CONNECTED_SPREAD
    if statistic == "values":
        gap, spread = MIN_GAP * float(image.sorted_values.var()), 0.0
    elif statistic == "variogram":
        p = float(image.proportions[index])
        gap, spread = MIN_GAP * (p * (1 - p)), 0.0
    name = statistic, index, str(direction)  # a direction may be a list or an array
    return fit_values(ensemble, name, distances[1:], values, min_gap=gap, min_spread=spread)


def fit_geobodies(
    ensemble: Ensemble, facies: int | str, neighbours: int | None = None
) -> Fit | None:
    """Compare Γ and the percolation of a facies with crops of the training image.

    The values are Γ and the share of pieces that percolate E–W, N–S and, in volumes, vertically.
    """
    image = ensemble.training_image
    facies = image.code_of(facies)

    def values(images: Stack) -> Floats:
        geobodies = geobody_statistics(images, facies, neighbours)
        percolates = geobodies.percolates_ew, geobodies.percolates_ns, geobodies.percolates_vertical
        shares = (way.astype(float) for way in percolates if way is not None)
        return np.column_stack([geobodies.gamma, *shares])

    gap = np.array([MIN_GAMMA_GAP, *[MIN_PERCOLATION_GAP] * image.n_dimensions])
    positions, name = np.arange(len(gap), dtype=float), ("geobodies", facies, neighbours)
    return fit_values(
        ensemble, name, positions, values, min_gap=gap, min_spread=MIN_CONNECTED_SPREAD
    )


def fit_values(
    ensemble: Ensemble,
    name: tuple,
    positions: Floats,
    values: ValuesOf,
    of_crops: ValuesOf | None = None,
    **band: Any,
) -> Fit | None:
    """Compare m values of pieces of realizations with the values of crops of the training image.

    The first entry of the unique `name` is a key of `USEFUL_TOLERANCES`, and of `ERROR_LIMITS`
    unless `n_errors` has the allowed differences. `values` maps a stack of n images to shape
    (n, m); `of_crops` does so for crops, by default `values`. `band` has other fields of
    `ReferenceBand`. The result is None if crops are too small.
    """
    image, shape = ensemble.training_image, shape_of_crops(ensemble)
    if shape is None:
        return None
    reference = band_of_crops(image, name, shape, positions, of_crops or values, **band)
    return reference.compare(values(pieces_of(ensemble, shape)))


def fit_proportions(ensemble: Ensemble) -> Fit | None:
    """Compare the mean facies proportions of realizations with the whole training image.

    In the result, `reference` contains the image's proportions, or the means of given probabilities
    (`Ensemble.expected_proportions`); crops determine the tolerance.

    Examples
    --------
    >>> from ccwsim import datasets, simulate
    >>> realizations = simulate(datasets.load("channels"), (128, 128))
    >>> fit_proportions(realizations).reference.round(3)
    array([0.73, 0.27])
    """
    image = ensemble.training_image
    several = ensemble.study.secondary_or_empty.images
    shape = None if several else crop_shape(image.shape, ensemble.study.whole_shape)
    if shape is None:
        return None
    positions, gap = image.codes.astype(float), MIN_PROPORTION_GAP * image.proportions
    crops = band_of_crops(image, ("proportions",), shape, positions, proportions, min_gap=gap)
    each = proportions(pieces_of(ensemble, shape))
    n_pieces = ensemble.n * ensemble.n_active / prod(shape)
    fit = crops.compare(each, n_pieces)
    expected = ensemble.expected_proportions
    return replace(fit, found=ensemble.proportions.mean(axis=0), reference=expected)


def fit_patterns(ensemble: Ensemble, sizes: Sequence[int] = PATTERN_SIZES) -> Fit | None:
    """Compare realizations with crops by their pattern distance from the training image.

    Values are Jensen–Shannon divergences in bits at full resolution; `at` contains the pattern
    sizes. Crops and pieces have a quarter of the sides of the crops of other statistics, but at
    least 8 cells. A crop is compared with the training image without the patterns of this crop.
    Only distances above those of the crops are outside the band. The result is None if the
    training image or the grid is too small for crops.

    Examples
    --------
    >>> from ccwsim import datasets, simulate
    >>> realizations = simulate(datasets.load("channels"), (128, 128))
    >>> fit_patterns(realizations).at
    array([2., 3.])
    """
    image, sides = ensemble.training_image, [check_int("pattern size", s, 1) for s in sizes]
    shape = shape_of_crops(ensemble)
    if shape is None:
        return None
    shape = (*shape[:-2], *(max(side // 2, min(side, MIN_SIDE)) for side in shape[-2:]))
    n = image.n_facies
    volume = as_volume(image.indices)
    windows = [(min(side, shape[0]) if len(shape) == N_AXES else 1, side) for side in sides]
    whole = [count_patterns(volume, n, height, side) for height, side in windows]

    def distances(images: Stack, leave_out: bool = False) -> Floats:
        result = np.empty((len(images), len(sides)))
        for k in range(len(images)):
            for column, ((height, side), of_image) in enumerate(zip(windows, whole, strict=True)):
                of_piece = count_patterns(images.volume(k), n, height, side)
                other = _without(of_image, of_piece) if leave_out else of_image
                first, second = (PatternHistogram(c, m / m.sum(), 0) for c, m in (of_piece, other))
                result[k, column] = js_divergence(first, second) if len(of_piece[0]) else np.nan
        return result

    positions, without_crop = np.array(sides, float), partial(distances, leave_out=True)
    crops = band_of_crops(
        image, ("patterns", *sides), shape, positions, without_crop, min_gap=0.0, one_sided=True
    )
    crops = replace(crops, min_spread=MIN_PATTERN_SPREAD * np.nanmean(crops.values, axis=0))
    return crops.compare(distances(pieces_of(ensemble, shape)))


Counts = tuple[UInt64s, Integers]


def _without(of_image: Counts, of_crop: Counts) -> Counts:
    """Return the codes and counts of an image's patterns that are not inside a crop of it."""
    codes, counts = of_image[0], of_image[1].copy()
    counts[np.searchsorted(codes, of_crop[0])] -= of_crop[1]
    return codes[counts > 0], counts[counts > 0]


_bands: Memo[ReferenceBand] = Memo(max_values=1000)  # a band needs some kilobytes


def band_of_crops(
    image: TrainingImage,
    name: tuple,
    shape: Shape,
    positions: Floats,
    values: ValuesOf,
    **band: Any,
) -> ReferenceBand:
    """Return the band of an image's crops, which is computed once for each name and crop shape.

    `band` has other fields of `ReferenceBand`.
    """

    def computed() -> ReferenceBand:
        of_values = crops_of(image.values[image.variable], shape) if image.values else None
        if "n_errors" not in band:
            band["n_errors"] = ERROR_LIMITS[name[0]][image.n_dimensions - 2]
        return ReferenceBand(
            at=positions,
            values=values(Stack(crops_of(image.indices, shape), image.codes, values=of_values)),
            n_independent=np.count_nonzero(image.indices < image.n_facies) / prod(shape),
            crop_shape=shape,
            useful_tolerance=USEFUL_TOLERANCES[name[0]],
            **band,
        )

    return _bands.value((image.digest, *name, shape), computed)
