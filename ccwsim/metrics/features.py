"""Range, spacing and thickness of the features of a training image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics.lags import VERTICAL, Direction, lags_that_fit
from ccwsim.metrics.stack import N_AXES, Codes, Images, as_image
from ccwsim.metrics.variograms import variogram
from ccwsim.model.arrays import check_int

SILL_SHARE = 0.95
PROMINENCE = 0.1
"""Minimum prominence of a peak of the correlation; lower peaks are noise."""
THICK_SHARE = 0.95
"""Minimum share of a facies covered by squares whose side is the thickness of the facies."""


@dataclass(frozen=True, eq=False)
class Spacing:
    """Range and spacing of features along a direction."""

    lags: NDArray[np.int64]
    correlation: NDArray[np.float64]
    """Correlation 1 − Σ γ / Σ sill, with sums over facies, shape (n_lags,)."""
    range: int | None
    """First lag at which γ reaches 95 % of the sill; None if γ stays below this value."""
    spacing: int | None
    """Distance between features: the lag of the first peak of the correlation. None if there is no
    peak."""
    strength: float
    """Prominence of the first peak, from 0 (no repetition) to about 2 (strict period)."""


def feature_spacing(
    image: Images, codes: Codes | None = None, direction: Direction = "E-W"
) -> Spacing:
    """Return range and spacing of the features; lags are at most half of the smaller side.

    In a volume, this is the smaller side of a layer or, for "vertical", the number of layers.

    Examples
    --------
    >>> stripes = feature_spacing(np.tile(np.arange(60) // 5 % 2, (60, 1)))
    >>> stripes.range, stripes.spacing, round(stripes.strength, 3)
    (3, 10, 2.0)
    """
    stack = as_image(image, codes)
    side = stack.shape[0] if str(direction) == VERTICAL else min(stack.shape[-2:])
    lags = lags_that_fit(stack.shape, direction, np.arange(max(side // 2, 1)))
    parts = [variogram(stack, int(code), direction, lags) for code in stack.codes]
    sill = sum(float(part.sill[0]) for part in parts)
    if not sill:
        return Spacing(lags, np.ones(len(lags)), None, None, 0.0)
    correlation = 1 - np.sum([part.gamma[0] for part in parts], axis=0) / sill
    reached = np.flatnonzero(correlation <= 1 - SILL_SHARE)
    from scipy.signal import find_peaks  # imported here because loading takes time

    peaks, about = find_peaks(correlation, prominence=PROMINENCE)
    reach = int(reached[0]) if len(reached) else None
    if not len(peaks):
        return Spacing(lags, correlation, reach, None, 0.0)
    return Spacing(lags, correlation, reach, int(peaks[0]), float(about["prominences"][0]))


@dataclass(frozen=True, eq=False)
class Granulometry:
    """Share of a facies that remains when parts thinner than a size are removed."""

    sizes: NDArray[np.int64]
    """Sides of squares: 1, 2, … cells."""
    kept: NDArray[np.float64]
    """Share of the facies' cells covered by squares of each size that are inside the facies."""

    def thickness(self, share: float = THICK_SHARE) -> int:
        """Return the largest size that keeps at least `share` of the facies; 0 if absent."""
        return int(np.count_nonzero(self.kept >= share))


def granulometry(
    image: Images,
    facies: int,
    max_size: int = 64,
    down_to: float = 0.0,
    extend: bool = False,
    vertical: bool = False,
) -> Granulometry:
    """Compute morphological openings of a facies with growing squares (Matheron 1975).

    Squares are inside the image and, in volumes, within layers. A geobody cut by the edge has the
    thickness of the visible part, unless the image is extended.

    Parameters
    ----------
    max_size : int
        Side of the largest square in cells.
    down_to : float
        Stop after the first size at which less than this share of the facies remains.
    extend : bool
        Extend the image by repeating its edge cells.
    vertical : bool
        In volumes, use vertical columns of 1, 2, … layers instead of squares.

    Examples
    --------
    >>> river = np.zeros((9, 9), int)
    >>> river[3:6] = 1
    >>> granulometry(river, 1).thickness()
    3
    """
    max_size = check_int("max_size", max_size, 1, 2**31)
    stack = as_image(image)
    inside = stack.volume(0) == stack.index_of(facies)
    axes = (0,) if vertical else (1, 2)
    total, largest = int(inside.sum()), min(max_size, *(inside.shape[axis] for axis in axes))
    kept: list[float] = []
    for size in range(1, largest + 1):
        edges = [(size - 1 if axis in axes else 0,) * 2 for axis in range(N_AXES)]
        whole = np.pad(inside, edges, mode="edge") if extend else inside
        for axis in axes:
            whole = _combined(np.logical_and, whole, size, axis)
        if not whole.any():
            break
        reached = np.pad(whole, edges)
        for axis in axes:
            reached = _combined(np.logical_or, reached, size, axis)
        if extend:
            inner = (slice(a, n - b) for (a, b), n in zip(edges, reached.shape, strict=True))
            reached = reached[tuple(inner)]
        kept.append(np.count_nonzero(reached) / total)
        if kept[-1] < down_to:
            break
    return Granulometry(np.arange(1, len(kept) + 1), np.array(kept))


def _combined(
    operation: np.ufunc, mask: NDArray[np.bool_], size: int, axis: int
) -> NDArray[np.bool_]:
    """Combine runs of `size` cells along an axis; the result is in the first cell of each run."""
    length = 1
    mask = np.moveaxis(mask, axis, 0)
    while length < size:
        step = min(length, size - length)
        mask = operation(mask[:-step], mask[step:])
        length += step
    return np.moveaxis(mask, 0, axis)
