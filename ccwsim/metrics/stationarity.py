"""Test whether parts of a training image differ by more than chance explains."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import cast

import numpy as np

from ccwsim.metrics.etype import proportions
from ccwsim.metrics.stack import Codes, Images, Stack, as_image, as_volume
from ccwsim.metrics.variograms import variogram
from ccwsim.model import UNKNOWN, Array, Float32s, Floats, Int32s, Ints, Mask, ratio, refused

QUARTERS = ("south-west", "south-east", "north-west", "north-east")
IMAGE_PARTS = (
    *(f"{quarter} quarter" for quarter in QUARTERS),
    *(f"{side} half" for side in ("southern", "northern", "western", "eastern")),
)
WEIGHTS = (
    np.array([*np.eye(4), *np.array([[1, 1, 0, 0], [0, 0, 1, 1], [1, 0, 1, 0], [0, 1, 0, 1]]) / 2])
    - 0.25
)
"""Weights of the quarters' means in (mean of each part − mean of the image), shape (8, 4)."""
PROPORTION_LIMIT = 0.15  # allowed difference of a part's proportion, in units of √(p (1 − p))
VARIOGRAM_LIMIT = 0.2  # allowed root mean square of (γ of a quarter − γ of the image), in sills
PROPORTION_DOUBT, VARIOGRAM_DOUBT = 3.0, 4.0
"""Minimum significant difference in standard errors. At least 90 % of stationary images then pass,
even if features are as long as an eighth of the image."""
# minimum correlation in sums of a covariance over lags; smaller values are noise
MIN_CORRELATION = 0.1
BLOCKS = 32  # maximum number of blocks along a side of a quarter when its covariance is computed
SLOPES = 0.5  # degrees of freedom of the common plane per quarter: two slopes, four quarters


@dataclass(frozen=True, eq=False)
class Stationarity:
    """Proportions and variograms of the quarters of an image, with standard errors."""

    proportions: Floats
    """Proportions of the quarters in the order of `QUARTERS`, shape (4, n_facies)."""
    lags: Ints
    variograms: Floats
    """γ(h) of each quarter, shape (4, n_facies, 2, n_lags), E-W first, then N-S."""
    variogram_shift: Floats
    """Root mean square of (γ of quarter − γ of image) over lags, in sills, (4, n_facies, 2)."""
    differences: Floats
    """Proportion of each of the `IMAGE_PARTS` − mean of the quarters, shape (8, n_facies)."""
    errors: Floats
    """Standard errors of `differences` in a stationary image with the same covariance."""
    variogram_scores: Floats
    """|Mean variogram of the part − of the image|, in standard errors, shape (8, n_facies, 2)."""
    vertical_differences: Floats | None = None
    """Proportion in the upper half − mean of both halves, shape (n_facies,); None for maps."""
    vertical_errors: Floats | None = None
    """Standard errors of `vertical_differences`, estimated from the variation between columns."""

    @property
    def vertical_trend(self) -> Mask:
        """Mask of the facies whose proportion differs between the halves of a volume."""
        if self.vertical_differences is None or self.vertical_errors is None:
            return np.zeros(self.proportions.shape[1], bool)
        return self._differ(self.vertical_differences, self.vertical_errors)

    @property
    def drifting(self) -> Mask:
        """Mask of proportions that differ by more than limit and chance, shape (8, n_facies)."""
        return self._differ(self.differences, self.errors)

    def _differ(self, differences: Array, errors: Array) -> Mask:
        """Return the mask of the differences above `PROPORTION_LIMIT` and `PROPORTION_DOUBT`."""
        p = self.proportions.mean(axis=0)
        limit = np.maximum(PROPORTION_LIMIT * np.sqrt(p * (1 - p)), PROPORTION_DOUBT * errors)
        return np.abs(differences) > limit

    @property
    def changing(self) -> Mask:
        """Mask of variograms that differ by more than limit and chance, shape (4, n_facies, 2)."""
        certain = self.variogram_scores.max(axis=0) > VARIOGRAM_DOUBT
        return (self.variogram_shift > VARIOGRAM_LIMIT) & certain

    @property
    def stationary(self) -> bool:
        """Whether no part differs from the whole image."""
        drifts = self.drifting.any() or self.vertical_trend.any()
        return not drifts and not self.changing.any()


def stationarity(image: Images, codes: Codes | None = None) -> Stationarity:
    """Compare quarters and halves of an image with the whole image.

    The standard error of a quarter's mean is estimated from the covariance within the quarters,
    after their means and a common plane are removed. The covariance is summed over the lags around
    0 at which the correlation is at least 0.1. For variograms, the indicator is replaced by the
    field ½ (I(x) − I(x + h))², averaged over lags.

    Quarters of a volume have all layers, and means over columns of cells are compared. The upper
    and the lower half of the layers are compared in the same way. Raises `CCWSIMError` for an image
    of fewer than 8 rows or columns.

    Examples
    --------
    >>> half = np.zeros((40, 40), int)
    >>> half[:, 20:] = 1
    >>> stationarity(half).stationary
    False
    """
    stack = as_image(image, codes)
    ny, nx = stack.shape[-2:]
    if min(ny, nx) < 8:
        raise refused("too_small_for_quarters", ny=ny, nx=nx)
    indices, n_facies = stack.indices[0], stack.n_facies
    quarters = [Stack(quarter[None], stack.codes) for quarter in _quarters(indices)]
    shares = np.array([proportions(quarter)[0] for quarter in quarters])
    whole = proportions(stack)[0]
    lags = np.arange(min(ny, nx) // 4 + 1)
    curves = np.array([_curves(quarter, lags) for quarter in quarters])
    distance = np.sqrt(np.mean((curves - _curves(stack, lags)) ** 2, axis=3))
    sills = whole * (1 - whole)  # 0 for a facies in all cells or in none
    volume = as_volume(np.ma.masked_equal(indices, UNKNOWN) if UNKNOWN in indices else indices)
    facies = [volume == k for k in range(n_facies)]
    compared = [_compare_parts(one.mean(axis=0, dtype=float)) for one in facies]
    scores = np.zeros((len(IMAGE_PARTS), n_facies, 2))
    for k, axis in product(range(n_facies), (0, 1)):
        layers = [_half_squares(layer, 1 - axis) for layer in facies[k]]
        difference, error = _compare_parts(np.ma.array(layers).mean(axis=0))
        without_error = np.where(difference, np.inf, 0.0)
        scores[:, k, axis] = ratio(np.abs(difference), error, without_error)
    differences, errors = (np.column_stack(each) for each in zip(*compared, strict=True))
    vertical = _compare_halves(facies) if stack.is_volumes else (None, None)
    return Stationarity(
        proportions=shares,
        lags=lags,
        variograms=curves,
        variogram_shift=ratio(distance, sills[:, None], 0.0),
        differences=differences,
        errors=errors,
        variogram_scores=scores,
        vertical_differences=vertical[0],
        vertical_errors=vertical[1],
    )


def _compare_halves(facies: Sequence[Mask]) -> tuple[Floats, Floats]:
    """Return proportions of the upper half minus proportions of the volume, and standard errors."""
    middle = len(facies[0]) // 2
    if not middle:
        return np.zeros(len(facies)), np.zeros(len(facies))
    fields = [
        (one[-middle:].mean(axis=0, dtype=float) - one[:middle].mean(axis=0, dtype=float)) / 2
        for one in facies
    ]
    variances = np.array([_mean_variance(field) for field in fields]) / 4  # four quarters
    return np.array([field.mean() for field in fields]), np.sqrt(variances)


def _quarters(field: Array) -> list[Array]:
    ny, nx = field.shape[-2:]
    rows, columns = (slice(0, ny // 2), slice(ny // 2, ny)), (slice(0, nx // 2), slice(nx // 2, nx))
    return [field[..., r, c] for r in rows for c in columns]


def _half_squares(facies: Mask, axis: int) -> Float32s:
    """Return ½ (I(x) − I(x + h))² of each cell, averaged over ±h and over the lags 1, 2, 4, …"""
    indicator = facies.T if axis == 0 else facies
    n, total = indicator.shape[1], np.zeros_like(indicator, np.float32)
    lags = [2**k for k in range(20) if 2**k <= max(min(indicator.shape) // 4, 1)]
    for lag in lags:
        differs = indicator[:, lag:] != indicator[:, :-lag]
        counts = np.zeros(n, np.float32)
        counts[lag:] += 2
        counts[:-lag] += 2
        each = np.zeros_like(indicator, np.float32)
        each[:, lag:] += differs
        each[:, :-lag] += differs
        total += each / counts
    mean = total / np.float32(len(lags))
    return mean.T if axis == 0 else mean


def _compare_parts(field: Array) -> tuple[Floats, Floats]:
    """Return each part's mean minus the mean of the image, and the standard errors.

    A quarter without known cells gets the mean of the others, with an infinite error.
    """
    means = np.array([np.ma.filled(q.mean(dtype=float), field.mean()) for q in _quarters(field)])
    filled = np.array([np.ma.count(quarter) / quarter.size for quarter in _quarters(field)])
    weights = WEIGHTS**2 @ (filled.mean() / np.maximum(filled, 1e-300)) / filled.mean() ** 2
    errors = np.sqrt(_mean_variance(field) * weights)
    differences = WEIGHTS @ means
    return np.where(np.abs(differences) < 1e-9, 0.0, differences), errors


def _mean_variance(field: Array) -> float:
    """Return the variance of a field's mean over a quarter, from the covariance of the field."""
    from scipy.ndimage import label  # imported here because loading takes time

    parts = [_blocks(quarter) for quarter in _quarters(field)]
    ny, nx = (min(part.shape[axis] for part in parts) for axis in range(2))
    residuals = _without_plane(np.ma.array([part[:ny, :nx] for part in parts])).filled(0.0)
    spectra = np.fft.rfft2(residuals, (2 * ny, 2 * nx))
    lag_sums = np.fft.irfft2(np.abs(spectra) ** 2, (2 * ny, 2 * nx))  # Σ z(x) z(x + h)
    sums = np.fft.fftshift(lag_sums.mean(axis=0))
    rows, columns = np.abs(np.arange(2 * ny) - ny), np.abs(np.arange(2 * nx) - nx)
    pairs = np.outer(ny - rows, nx - columns)
    covariance = ratio(sums, pairs, 0.0)
    if covariance[ny, nx] <= 1e-12:
        return 0.0
    within = (rows <= ny // 2)[:, None] & (columns <= nx // 2)
    certain = within & (covariance >= MIN_CORRELATION * covariance[ny, nx])
    pieces, _ = cast(tuple[Int32s, int], label(certain))
    near = pieces == pieces[ny, nx]
    n_pairs = float(ny * nx) ** 2
    taken = (1 + SLOPES) * pairs[near].sum() / n_pairs  # share removed with means and plane
    return float(sums[near].sum() / n_pairs / max(1 - taken, 0.25))


def _blocks(quarter: Array) -> Floats:
    """Return the means of blocks of a quarter; a side has at most `BLOCKS` blocks."""
    ny, nx = quarter.shape
    down, along = -(-ny // BLOCKS), -(-nx // BLOCKS)
    whole = quarter[: ny // down * down, : nx // along * along]
    return whole.reshape(ny // down, down, nx // along, along).mean(axis=(1, 3), dtype=float)


def _without_plane(parts: np.ma.MaskedArray) -> np.ma.MaskedArray:
    """Return the quarters, shape (4, ny, nx), minus their means and their common slopes."""
    centred = parts - parts.mean(axis=(1, 2), keepdims=True)
    for axis in (1, 2):
        along = np.indices(parts.shape)[axis] - (parts.shape[axis] - 1) / 2
        centred = centred - along * (centred * along).sum() / max((along**2).sum(), 1.0)
    return centred


def _curves(stack: Stack, lags: Array) -> Floats:
    return np.array(
        [
            [variogram(stack, int(code), way, lags).gamma[0] for way in ("E-W", "N-S")]
            for code in stack.codes
        ]
    )
