"""Comparison of realizations with crops of their training image.

Statistics vary between crops of one training image. Statistics also depend on the window size,
because a smaller window cuts more geobodies. Pieces of the realizations are therefore compared with
crops of equal size. The allowed difference follows from the standard deviation s between crops. The
spread of realizations is not used, because worse realizations have a larger spread. The mean over m
pieces and the mean over crops may differ by c · s · √(1/k + 1/m) if k crops are independent.

Windows nearly as large as the training image give too few crops to estimate s. In these windows, a
curve is outside the band if the mean over pieces is far from the image's value and nearly no piece
reaches the image's value.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import isqrt, prod
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.metrics.bands import Statistic, band, curves_of
from ccwsim.metrics.connectivity import geobody_statistics
from ccwsim.metrics.etype import proportions, vertical_proportions
from ccwsim.metrics.lags import Direction, distinct_lags, max_lag
from ccwsim.metrics.patterns import pattern_distance
from ccwsim.metrics.stack import N_AXES, Stack
from ccwsim.model.arrays import as_floats, check_int, ratio
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.training_image import TrainingImage

MIN_SIDE, MAX_SIDE = 8, 512
"""Limits of a crop's side in cells: smaller crops contain no pattern, larger crops are slow."""
MAX_CROP_CELLS = 2_000_000
"""Maximum number of cells in a crop from a volume."""
MAX_CROPS_ALONG = 4
"""Maximum number of crops along an axis; crops overlap by about half or less."""
MAX_CROPS_ABOVE = 2
"""Maximum number of crops along z in a volume."""
MIN_CROPS = 3
"""Minimum number of crops in which a value is not NaN; otherwise the value is not judged."""
MAX_PIECES = 32
"""Maximum number of pieces; more would not help because the crops limit the precision."""
CURVE_ERRORS, VALUE_ERRORS = 4.0, 2.0
"""Allowed differences in standard errors, larger for curves because curves have many values."""
STATISTICS = ("connectivity", "variogram")
MIN_GAP = 0.1
"""Smallest reported difference of a curve, in units of τ or, for γ, in sills p (1 − p)."""
MIN_LARGE_GAP = 0.5
"""Smallest reported difference for pieces that are nearly as large as the training image."""
MIN_LARGE_PIECES, MAX_LARGE_PIECES = 10, 16
LARGE_STEP = 3
"""Step between the lags that are compared in large pieces; a step above 1 saves time."""
TAIL = 0.05
"""Maximum share of large pieces that reach the image's value if a curve is outside the band."""
MIN_PROPORTION_GAP = 0.05
"""Smallest reported difference of a proportion, relative to the training image's proportion."""
PATTERN_SIZES = (2, 3)
"""Sides of the compared patterns in cells; patterns are squares, or cubes in volumes."""
MIN_GAMMA_GAP, MIN_PERCOLATION_GAP = 0.1, 0.25
"""Smallest reported differences of Γ and of the share of pieces that percolate."""
Floats = NDArray[np.float64]
Shape = tuple[int, ...]
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

    @property
    def judged(self) -> bool:
        """Whether any value can be judged."""
        return bool(np.isfinite(self._excess).any())

    @property
    def outside(self) -> NDArray[np.bool_]:
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
            return np.abs(self.found - self.reference) / self.tolerance


@dataclass(frozen=True, eq=False)
class ReferenceBand:
    """Values of crops of a training image, for comparison with realizations.

    Examples
    --------
    >>> crops = np.array([[0.4], [0.5], [0.6], [0.5]])
    >>> band = ReferenceBand(np.zeros(1), crops, 4.0, 2.0, np.zeros(1), (64, 64))
    >>> band.compare([0.45], 12).fits, band.compare([0.3], 12).fits
    (True, False)
    """

    at: Floats
    """Position of each value, as in `Fit`."""
    values: Floats
    """Values of each crop, shape (n_crops, m); NaN if a value is missing."""
    n_independent: float
    """Number of crops that would fit into the training image without overlap."""
    n_errors: float
    """Allowed difference in standard errors."""
    min_gap: Floats
    """Smallest reported difference of each value, shape (m,)."""
    crop_shape: Shape

    def compare(self, found: ArrayLike, n_pieces: float) -> Fit:
        """Compare `found` (the means over `n_pieces` pieces, shape (m,)) with the crops."""
        known = ~np.isnan(self.values)
        n = known.sum(axis=0)
        enough = n >= MIN_CROPS
        mean = ratio(np.where(known, self.values, 0.0).sum(axis=0), np.where(enough, n, 0))
        squares = np.where(known, (self.values - mean) ** 2, 0.0).sum(axis=0)
        spread = np.sqrt(ratio(squares, np.where(enough, n - 1, 0)))
        error = spread * np.sqrt(
            1 / np.minimum(self.n_independent, np.maximum(n, 1)) + 1 / n_pieces
        )
        tolerance = np.maximum(self.n_errors * error, self.min_gap)
        return Fit(self.at, as_floats(found, "values"), mean, tolerance, self.crop_shape)


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
    rows, columns = (
        min(n, image // 2) for n, image in zip((ny, nx), image_shape[-2:], strict=True)
    )
    return (*layers, rows, columns) if min(rows, columns) >= MIN_SIDE else None


def largest_crop(image_shape: Shape, grid_shape: Shape) -> Shape:
    """Return the shape of the largest window that fits into the training image and the grid."""
    if len(image_shape) != len(grid_shape):
        raise CCWSIMError(
            f"a training image of shape {tuple(image_shape)} and realizations of "
            f"{tuple(grid_shape)} cannot be compared: give maps only or volumes only"
        )
    *layers, rows, columns = map(min, image_shape, grid_shape)
    longest = min(MAX_SIDE, isqrt(MAX_CROP_CELLS // max(*layers, 1, 1)))
    return (*layers, min(rows, longest), min(columns, longest))


def crops_of(image: NDArray[np.uint8], shape: Shape) -> NDArray[np.uint8]:
    """Return evenly spaced crops, shape (n, *shape): at most 4 × 4, or 2 × 4 × 4 of a volume."""
    starts = []
    most = (MAX_CROPS_ABOVE, MAX_CROPS_ALONG, MAX_CROPS_ALONG)[-len(shape) :]
    for side, own, largest in zip(image.shape, shape, most, strict=True):
        n = min(largest, 1 + -(-2 * (side - own) // own))
        starts.append(np.linspace(0, side - own, n).astype(int))
    return np.array([image[_window(start, shape)] for start in product(*starts)])


def _window(start: Sequence[int], shape: Shape) -> tuple[slice, ...]:
    return tuple(slice(first, first + n) for first, n in zip(start, shape, strict=True))


def pieces_of(
    realizations: NDArray[np.uint8], shape: Shape, max_pieces: int = MAX_PIECES
) -> NDArray[np.uint8]:
    """Return m ≤ `max_pieces` pieces of realizations without overlap, shape (m, *shape)."""
    along = (
        np.linspace(0, side - own, side // own).astype(int)
        for side, own in zip(realizations.shape[1:], shape, strict=True)
    )
    starts = list(product(*along))
    total = len(realizations) * len(starts)
    chosen = np.linspace(0, total - 1, min(total, max_pieces)).astype(int)
    pieces = np.empty((len(chosen), *shape), np.uint8)
    for k, (r, which) in enumerate(zip(*np.divmod(chosen, len(starts)), strict=True)):
        pieces[k] = realizations[r][_window(starts[which], shape)]
    return pieces


def fit_curve(
    ensemble: Ensemble, statistic: Statistic, facies: int, direction: Direction = "E-W"
) -> Fit | None:
    """Compare a curve of realizations with the curves of crops of their training image.

    `statistic` is "variogram" or "connectivity". Lags extend to half of a crop. If the curve
    deviates more in the largest common window than in crops, lags extend to half of this window.
    The result is None if the training image or the grid is too small.

    Examples
    --------
    >>> from ccwsim import Parameters, simulate
    >>> stripes = np.tile([[0], [0], [1], [1]], (16, 64))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> fit_curve(simulate(stripes, (40, 50), p), "connectivity", 1).fits
    True
    """
    image = ensemble.training_image
    index = image.index_of(facies)
    if statistic not in STATISTICS:
        raise CCWSIMError(f"statistic {shown(statistic)} must be one of {', '.join(STATISTICS)}")
    shape = crop_shape(image.array.shape, ensemble.indices.shape[1:])
    if shape is None or not max_lag(direction, shape):  # there is no lag along a single layer
        return None
    p = float(image.proportions[index])
    unit = p * (1 - p) if statistic == "variogram" else 1.0

    def compared(
        shape: Shape, least: float, n_pieces: int, step: int = 1
    ) -> tuple[ReferenceBand, Floats]:
        lags, distances = distinct_lags(direction, max_lag(direction, shape))
        lags, distances = lags[:0:-step][::-1], distances[:0:-step][::-1]  # with the largest lag

        def values(images: Stack) -> Floats:
            return curves_of(statistic, images, facies, direction, lags)

        key = statistic, index, str(direction)  # a direction may be a list or an array
        gap = np.full(len(lags), least * unit)
        reference = band_of_crops(image, key, shape, distances, values, CURVE_ERRORS, gap)
        return reference, values(Stack(pieces_of(ensemble.indices, shape, n_pieces), image.codes))

    reference, each = compared(shape, MIN_GAP, MAX_PIECES)
    fit = reference.compare(_mean(each), len(each))
    largest = largest_crop(image.array.shape, ensemble.indices.shape[1:])
    if largest == shape:
        return fit
    large = compared(largest, MIN_LARGE_GAP, MAX_LARGE_PIECES, LARGE_STEP)
    whole = _without_the_image(*large)
    if whole is None or whole.fits:
        return fit
    return whole if fit.fits or _gap(whole) > _gap(fit) else fit


def fit_geobodies(ensemble: Ensemble, facies: int, neighbours: int | None = None) -> Fit | None:
    """Compare Γ and the percolation of a facies with crops of the training image.

    The values are Γ and the share of pieces that percolate E–W, N–S and, in volumes, vertically.
    """
    image = ensemble.training_image
    index = image.index_of(facies)

    def values(images: Stack) -> Floats:
        found = geobody_statistics(images, facies, neighbours)
        ways = found.percolates_ew, found.percolates_ns, found.percolates_vertical
        known = (way.astype(float) for way in ways if way is not None)
        return np.column_stack([found.gamma, *known])

    least = np.array([MIN_GAMMA_GAP, *[MIN_PERCOLATION_GAP] * image.n_dimensions])
    at = np.arange(len(least), dtype=float)
    return fit_values(ensemble, ("geobodies", index, neighbours), at, values, least)


def fit_values(
    ensemble: Ensemble, name: tuple, at: Floats, values: ValuesOf, least: Floats
) -> Fit | None:
    """Compare m values of pieces of realizations with the values of crops of the training image.

    `name` is a unique key of these values. `values` takes a stack of n images and returns an array
    of shape (n, m). `at` and `least` become `at` and `min_gap` of the `ReferenceBand`. The result
    is None if the training image or the grid is too small for crops.
    """
    image = ensemble.training_image
    shape = crop_shape(image.array.shape, ensemble.indices.shape[1:])
    if shape is None:
        return None
    pieces = Stack(pieces_of(ensemble.indices, shape), image.codes)
    reference = band_of_crops(image, name, shape, at, values, VALUE_ERRORS, least)
    return reference.compare(_mean(values(pieces)), len(pieces))


def fit_proportions(ensemble: Ensemble) -> Fit | None:
    """Compare the mean facies proportions of realizations with the whole training image.

    In the result, `reference` contains the image's proportions; crops determine the tolerance.

    Examples
    --------
    >>> from ccwsim import Parameters, simulate
    >>> stripes = np.tile([[0], [0], [1], [1]], (16, 64))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> fit_proportions(simulate(stripes, (40, 50), p)).reference
    array([0.5, 0.5])
    """
    image = ensemble.training_image
    shape = crop_shape(image.array.shape, ensemble.indices.shape[1:])
    if shape is None:
        return None
    at, least = image.codes.astype(float), MIN_PROPORTION_GAP * image.proportions
    crops = band_of_crops(image, ("proportions",), shape, at, proportions, VALUE_ERRORS, least)
    return fit_shares(ensemble, crops, ensemble.proportions, image.proportions)


def fit_patterns(ensemble: Ensemble, sizes: Sequence[int] = PATTERN_SIZES) -> Fit | None:
    """Compare realizations with crops by their pattern distance from the training image.

    Values are Jensen–Shannon divergences in bits at full resolution; `at` contains the pattern
    sizes. The divergence of a crop results only from the smaller size of the crop. The result is
    None if the training image or the grid is too small for crops.

    Examples
    --------
    >>> from ccwsim import Parameters, simulate
    >>> stripes = np.tile([[0], [0], [1], [1]], (16, 64))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> fit_patterns(simulate(stripes, (40, 50), p)).at
    array([2., 3.])
    """
    image, sides = ensemble.training_image, [check_int("pattern size", s, 1) for s in sizes]

    def values(images: Stack) -> Floats:
        each = (pattern_distance(images, image, None, side, (1,)) for side in sides)
        return np.column_stack([distances[:, 0] for distances in each])

    at, least = np.array(sides, float), np.zeros(len(sides))
    return fit_values(ensemble, ("patterns", *sides), at, values, least)


def fit_vertical_proportions(ensemble: Ensemble, facies: int) -> Fit | None:
    """Compare the share of a facies in each layer of volumes with the training image.

    In the result, `at` is the layer (0 at the bottom), and `reference` the share in this layer of
    the training image. The result is None if the image has a different number of layers or is too
    small for crops. Raises `CCWSIMError` for maps.

    Examples
    --------
    >>> from ccwsim import Parameters, simulate
    >>> beds = np.tile([[[0]], [[0]], [[1]], [[1]]], (2, 32, 32))
    >>> p = Parameters(template_size=8, overlap_size=2, wavelet_level=1)
    >>> fit_vertical_proportions(simulate(beds, (8, 16, 16), p), 1).reference
    array([0., 0., 1., 1., 0., 0., 1., 1.])
    """
    image, grid = ensemble.training_image, ensemble.indices.shape[1:]
    index = image.index_of(facies)
    if image.n_dimensions != len(grid) or len(grid) != N_AXES:
        raise CCWSIMError("proportions by layer need volumes, not maps")
    shape = crop_shape(image.shape, grid)
    if shape is None or image.shape[0] != grid[0]:
        return None

    def values(images: Stack) -> Floats:
        return vertical_proportions(images)[:, index]

    p, layers = float(image.proportions[index]), np.arange(float(grid[0]))
    least = np.full(grid[0], MIN_GAP * (p * (1 - p)) ** 0.5)
    crops = band_of_crops(image, ("layers", index), shape, layers, values, CURVE_ERRORS, least)
    own = vertical_proportions(ensemble)[:, index], vertical_proportions(image)[0, index]
    return fit_shares(ensemble, crops, *own)


def fit_shares(ensemble: Ensemble, crops: ReferenceBand, each: Floats, reference: Floats) -> Fit:
    """Compare shares `each`, shape (n, m), with the image; crops determine the tolerance."""
    n_pieces = ensemble.n * prod(ensemble.indices.shape[1:]) / prod(crops.crop_shape)
    found = each.mean(axis=0)
    tolerance = crops.compare(found, n_pieces).tolerance
    return Fit(crops.at, found, reference, tolerance, crops.crop_shape)


_bands: WeakKeyDictionary[TrainingImage, dict] = WeakKeyDictionary()
MAX_BANDS = 256
"""Maximum number of bands stored for each training image; a band needs some kilobytes."""


def band_of_crops(
    image: TrainingImage,
    name: tuple,
    shape: Shape,
    at: Floats,
    values: ValuesOf,
    n_errors: float,
    min_gap: Floats,
) -> ReferenceBand:
    """Return the band of an image's crops, which is computed once for each name and crop shape."""
    bands, key = _bands.setdefault(image, {}), (*name, shape)
    if key not in bands:
        if len(bands) >= MAX_BANDS:
            bands.clear()
        crops = values(Stack(crops_of(image.indices, shape), image.codes))
        n_independent = image.indices.size / prod(shape)
        bands[key] = ReferenceBand(at, crops, n_independent, n_errors, min_gap, shape)
    return bands[key]


def _without_the_image(reference: ReferenceBand, each: Floats) -> Fit | None:
    """Judge pieces nearly as large as the image; return None if there are too few pieces."""
    if len(each) < MIN_LARGE_PIECES:
        return None
    crops, pieces = band(reference.values, 0.0, 1.0), band(each, TAIL, 1 - TAIL)
    above = pieces.mean > crops.mean
    own = np.where(above, pieces.mean - pieces.low, pieces.high - pieces.mean)
    beside = np.where(above, crops.high - crops.mean, crops.mean - crops.low)
    tolerance = np.maximum(own + beside, reference.min_gap)
    return Fit(reference.at, pieces.mean, crops.mean, tolerance, reference.crop_shape)


def _gap(fit: Fit) -> float:
    return float(abs(fit.found[fit.worst] - fit.reference[fit.worst]))


def _mean(values: Floats) -> Floats:
    """Return the mean of each column without NaN; NaN if all values of a column are NaN."""
    known = ~np.isnan(values)
    return ratio(np.where(known, values, 0.0).sum(axis=0), known.sum(axis=0))
