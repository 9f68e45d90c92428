"""Whether realizations have the statistics of crops of their training image.

A training image is one picture: its own crops differ, and statistics depend on the size of the
window they are taken in (a smaller one cuts geobodies). So crops of the training image are compared
with pieces of the realizations of the same size, and the spread between the crops alone says how
much a difference means. The realizations' own spread plays no part: it grows as they get worse.

With s the standard deviation between crops, the mean over m pieces of realizations may differ from
the mean over crops that are worth k independent ones by c · s · √(1/k + 1/m).

Crops as large as the training image are too few for that. There a curve is outside where nearly no
piece of the realizations has the image's value and their mean is far from it.
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
from ccwsim.metrics.etype import proportions
from ccwsim.metrics.lags import Direction, distinct_lags, max_lag
from ccwsim.metrics.stack import Stack
from ccwsim.model.arrays import as_floats
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.training_image import TrainingImage

MIN_SIDE, MAX_SIDE = 8, 512
"""Of rows and columns of a crop in cells: in a smaller one there is no pattern, and larger ones
take long."""
MAX_CROP_CELLS = 2_000_000
"""Of a crop of a volume."""
MAX_CROPS_ALONG = 4
"""Crops along an axis; they overlap by about half or less."""
MAX_CROPS_ABOVE = 2
"""Crops above each other in a volume."""
MIN_CROPS = 3
"""Crops in which a value has to be known to be judged."""
MAX_PIECES = 32
"""Pieces of realizations; more make the mean hardly surer than the crops are."""
CURVE_ERRORS, VALUE_ERRORS = 4.0, 2.0
"""Standard errors that may be missed: more at some lag of many than by a single value."""
STATISTICS = ("connectivity", "variogram")
MIN_GAP = 0.1
"""A smaller difference of a curve is not called one: of τ, and of γ in sills p (1 − p)."""
MIN_LARGE_GAP = 0.5
"""The same in pieces as large as the training image, whose own scatter is not known."""
MIN_LARGE_PIECES, MAX_LARGE_PIECES = 10, 16
LARGE_STEP = 3
"""Only every third lag is looked at there, to save time."""
TAIL = 0.05
"""Share of such pieces that may reach the training image where realizations miss it."""
MIN_PROPORTION_GAP = 0.05
"""The same of a proportion, relative to the training image's."""
MIN_GAMMA_GAP, MIN_PERCOLATION_GAP = 0.1, 0.25
"""The same of Γ and of the share of pieces that percolate."""
Floats = NDArray[np.float64]
Shape = tuple[int, ...]
ValuesOf = Callable[[Stack], Floats]


@dataclass(frozen=True, eq=False)
class Fit:
    """Values of realizations beside those of crops of their training image.

    Attributes
    ----------
    at : ndarray, shape (m,)
        Lags in cells for a curve, facies codes for proportions, else 0, 1, ….
    found : ndarray, shape (m,)
        Mean over pieces of the realizations; NaN where unknown.
    reference : ndarray, shape (m,)
        Mean over crops of the training image.
    tolerance : ndarray, shape (m,)
        How far `found` may be from `reference`; NaN where that cannot be judged.
    crop_shape : tuple of int
        Rows and columns of crops and pieces; of volumes layers, rows and columns.
    """

    at: Floats
    found: Floats
    reference: Floats
    tolerance: Floats
    crop_shape: Shape

    @property
    def judged(self) -> bool:
        """Whether any value can be judged."""
        return bool(np.isfinite(self._excess).any())

    @property
    def outside(self) -> NDArray[np.bool_]:
        """Which values are outside the band, shape (m,)."""
        return self._excess > 1

    @property
    def fits(self) -> bool:
        """Whether no value is outside the band."""
        return not self.outside.any()

    @property
    def worst(self) -> int:
        """Which value is farthest from the reference, in tolerances; the first where none is."""
        return int(np.argmax(np.nan_to_num(self._excess, nan=-1.0)))

    @property
    def _excess(self) -> Floats:
        """Differences in tolerances; NaN where unknown."""
        with np.errstate(divide="ignore", invalid="ignore"):  # a constant image has no tolerance
            return np.abs(self.found - self.reference) / self.tolerance


@dataclass(frozen=True, eq=False)
class ReferenceBand:
    """Values of crops of a training image, and how far realizations may be from their mean.

    Attributes
    ----------
    at : ndarray, shape (m,)
        As in `Fit`.
    values : ndarray, shape (n_crops, m)
        Of each crop; NaN counts as missing.
    n_independent : float
        How many crops beside each other the training image holds: overlapping ones count less.
    n_errors : float
        Standard errors that may be missed.
    min_gap : ndarray, shape (m,)
        A smaller difference is inside the band in any case.
    crop_shape : tuple of int

    Examples
    --------
    >>> crops = np.array([[0.4], [0.5], [0.6], [0.5]])
    >>> band = ReferenceBand(np.zeros(1), crops, 4.0, 2.0, np.zeros(1), (64, 64))
    >>> band.compare([0.45], 12).fits, band.compare([0.3], 12).fits
    (True, False)
    """

    at: Floats
    values: Floats
    n_independent: float
    n_errors: float
    min_gap: Floats
    crop_shape: Shape

    def compare(self, found: ArrayLike, n_pieces: float) -> Fit:
        """Return how the mean of `n_pieces` pieces of realizations, shape (m,), fits."""
        known = ~np.isnan(self.values)
        n = known.sum(axis=0)
        enough = n >= MIN_CROPS
        zeros = np.where(known, self.values, 0.0)
        mean = np.divide(zeros.sum(axis=0), n, out=np.full(len(n), np.nan), where=enough)
        squares = np.where(known, (self.values - mean) ** 2, 0.0).sum(axis=0)
        spread = np.sqrt(np.divide(squares, n - 1, out=np.full(len(n), np.nan), where=enough))
        error = spread * np.sqrt(
            1 / np.minimum(self.n_independent, np.maximum(n, 1)) + 1 / n_pieces
        )
        tolerance = np.maximum(self.n_errors * error, self.min_gap)
        return Fit(self.at, as_floats(found, "values"), mean, tolerance, self.crop_shape)


def crop_shape(image_shape: Shape, grid_shape: Shape) -> Shape | None:
    """Return the shape of the crops that a training image and realizations are compared in.

    A crop has the size of the grid, where the training image is at least twice as large, so that
    several crops differ; else it is half as long as the training image along that axis. No crop is
    longer than 512 cells. One of a volume has all layers that both have, as volumes are thin, and
    at most two million cells.

    Parameters
    ----------
    image_shape, grid_shape : tuple of int
        Rows and columns, or layers, rows and columns.

    Returns
    -------
    tuple of int, or None
        None where crops would have fewer than 8 rows or columns.

    Raises
    ------
    CCWSIMError
        For a map and a volume.

    Examples
    --------
    >>> crop_shape((256, 256), (100, 512)), crop_shape((12, 300), (100, 100))
    ((100, 128), None)
    >>> crop_shape((50, 300, 300), (20, 100, 200))
    (20, 100, 150)
    """
    *layers, ny, nx = largest_crop(image_shape, grid_shape)
    rows, columns = (
        min(n, image // 2) for n, image in zip((ny, nx), image_shape[-2:], strict=True)
    )
    return (*layers, rows, columns) if min(rows, columns) >= MIN_SIDE else None


def largest_crop(image_shape: Shape, grid_shape: Shape) -> Shape:
    """Return the shape of the largest window that training image and grid both hold.

    Examples
    --------
    >>> largest_crop((256, 256), (100, 1024)), largest_crop((50, 300, 400), (80, 512, 100))
    ((100, 256), (50, 200, 100))
    """
    if len(image_shape) != len(grid_shape):
        raise CCWSIMError(
            f"a training image of shape {tuple(image_shape)} and realizations of "
            f"{tuple(grid_shape)} cannot be compared: give maps only or volumes only"
        )
    *layers, rows, columns = map(min, image_shape, grid_shape)
    longest = min(MAX_SIDE, isqrt(MAX_CROP_CELLS // max(*layers, 1, 1)))
    return (*layers, min(rows, longest), min(columns, longest))


def crops_of(image: NDArray[np.uint8], shape: Shape) -> NDArray[np.uint8]:
    """Return crops of an image at even distances, shape (n, *shape), up to (2 ×) 4 × 4.

    Examples
    --------
    >>> crops_of(np.arange(12).reshape(1, 12), (1, 6))[:, 0, 0]
    array([0, 3, 6])
    """
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
    """Return some pieces of realizations that do not overlap, shape (m, *shape).

    Examples
    --------
    >>> pieces_of(np.zeros((3, 40, 60), int), (20, 20)).shape
    (18, 20, 20)
    """
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
    """Compare a curve of realizations with that of crops of their training image.

    Parameters
    ----------
    ensemble : Ensemble
    statistic : str
        "variogram" or "connectivity".
    facies : int
        The code of one.
    direction : str, float or pair of int
        As in `variogram`.

    Returns
    -------
    Fit, or None
        Over lags up to half of a crop; None where the training image or the grid is too small.
        Also the largest window that both hold is looked at, and returned where it is outside by
        more.

    Raises
    ------
    CCWSIMError
        For an unknown statistic, facies or direction.

    Examples
    --------
    >>> from ccwsim import Parameters, TrainingImage, simulate
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
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
        lags, distances = lags[:0:-step][::-1], distances[:0:-step][::-1]  # the largest is kept

        def values(images: Stack) -> Floats:
            return curves_of(statistic, images, facies, direction, lags)

        def make() -> ReferenceBand:
            gap = np.full(len(lags), least * unit)
            return band_of_crops(image, shape, distances, values, CURVE_ERRORS, gap)

        key = statistic, index, str(direction), shape  # a direction may be a list or an array
        reference = kept_band(image, key, make)
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
    """Compare Γ of a facies, and how often it percolates, with crops of the training image.

    Parameters
    ----------
    ensemble : Ensemble
    facies : int
        The code of one.
    neighbours : int, optional
        As in `geobody_statistics`.

    Returns
    -------
    Fit, or None
        Three values: Γ, the share of pieces that percolate E–W, and N–S; in volumes a fourth, of
        those that percolate vertically.
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
    """Compare values of pieces of realizations with those of crops of the training image.

    Parameters
    ----------
    ensemble : Ensemble
    name : tuple
        What the values are, not equal for any others.
    at, least : ndarray, shape (m,)
        As `at` and `min_gap` of `ReferenceBand`.
    values : callable
        Takes a stack of n images and returns an array of shape (n, m).

    Returns
    -------
    Fit, or None
        None where the training image or the grid is too small for crops.
    """
    image = ensemble.training_image
    shape = crop_shape(image.array.shape, ensemble.indices.shape[1:])
    if shape is None:
        return None

    def make() -> ReferenceBand:
        return band_of_crops(image, shape, at, values, VALUE_ERRORS, least)

    pieces = Stack(pieces_of(ensemble.indices, shape), image.codes)
    return kept_band(image, (*name, shape), make).compare(_mean(values(pieces)), len(pieces))


def fit_proportions(ensemble: Ensemble) -> Fit | None:
    """Compare the mean facies proportions with the training image's, by what its crops scatter.

    Returns
    -------
    Fit, or None
        One value a facies; `reference` is the proportion in the whole training image.

    Examples
    --------
    >>> from ccwsim import Parameters, TrainingImage, simulate
    >>> stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> fit_proportions(simulate(stripes, (40, 50), p)).reference
    array([0.5, 0.5])
    """
    image = ensemble.training_image
    shape = crop_shape(image.array.shape, ensemble.indices.shape[1:])
    if shape is None:
        return None

    def make() -> ReferenceBand:
        least = MIN_PROPORTION_GAP * image.proportions
        return band_of_crops(
            image, shape, image.codes.astype(float), proportions, VALUE_ERRORS, least
        )

    n_pieces = ensemble.n * prod(ensemble.indices.shape[1:]) / prod(shape)
    found = ensemble.proportions.mean(axis=0)
    fit = kept_band(image, ("proportions", shape), make).compare(found, n_pieces)
    return Fit(fit.at, found, image.proportions, fit.tolerance, shape)


_bands: WeakKeyDictionary[TrainingImage, dict] = WeakKeyDictionary()
MAX_BANDS = 256
"""Bands kept of a training image, some kilobytes each."""


def kept_band(image: TrainingImage, key: tuple, make: Callable[[], ReferenceBand]) -> ReferenceBand:
    """Return a band of an image, which is the same for all its ensembles on grids of one size."""
    bands = _bands.setdefault(image, {})
    if key not in bands:
        if len(bands) >= MAX_BANDS:
            bands.clear()
        bands[key] = make()
    return bands[key]


def band_of_crops(
    image: TrainingImage,
    shape: Shape,
    at: Floats,
    values: ValuesOf,
    n_errors: float,
    least: Floats,
) -> ReferenceBand:
    """Return the values of crops of an image; arguments are those of `ReferenceBand`."""
    crops = Stack(crops_of(image.indices, shape), image.codes)
    n_independent = image.indices.size / prod(shape)
    return ReferenceBand(at, values(crops), n_independent, n_errors, least, shape)


def _without_the_image(reference: ReferenceBand, each: Floats) -> Fit | None:
    """Return a fit outside which nearly no piece of realizations (m, n_lags) has the image's value.

    None for too few pieces. It only adds to what crops find: a wide scatter of the realizations
    hides nothing of that.
    """
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
    """Return the mean over rows of what is known; NaN where nothing is."""
    known = ~np.isnan(values)
    n = known.sum(axis=0)
    sums = np.where(known, values, 0.0).sum(axis=0)
    return np.divide(sums, n, out=np.full(values.shape[1], np.nan), where=n > 0)
