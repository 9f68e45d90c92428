"""Range and spacing of the features of an image, read from its variogram."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics.directions import Direction
from ccwsim.metrics.stack import as_indices
from ccwsim.metrics.variograms import variogram

SILL_SHARE = 0.95
PROMINENCE = 0.1
"""A peak of the correlation that stands out less is noise."""


@dataclass(frozen=True, eq=False)
class Spacing:
    """How far features reach and how they repeat along a direction.

    Attributes
    ----------
    lags : ndarray of int, shape (n_lags,)
    correlation : ndarray, shape (n_lags,)
        1 − Σ γ / Σ sill, pooled over facies.
    range : int or None
        The first lag where γ reaches 95 % of the sill; None where it does not.
    spacing : int or None
        The first lag where the correlation rises to a peak again: the distance from feature to
        feature; None where there is no such peak.
    strength : float
        How far that peak stands out, from 0 (no repetition) to about 2 (strict period).
    """

    lags: NDArray[np.int64]
    correlation: NDArray[np.float64]
    range: int | None
    spacing: int | None
    strength: float


def feature_spacing(
    indices: NDArray[np.integer], n_facies: int, direction: Direction = "E-W"
) -> Spacing:
    """Return range and spacing of the features, from lags up to half the smaller side.

    Parameters
    ----------
    indices : ndarray, shape (ny, nx)
        Facies indices.
    n_facies : int
    direction : str, float or pair of int
        As in `variogram`.

    Examples
    --------
    >>> found = feature_spacing(np.tile(np.arange(60) // 5 % 2, (60, 1)), 2)
    >>> found.range, found.spacing, round(found.strength, 3)
    (3, 10, 2.0)
    """
    image = as_indices(indices, n_facies)[0]
    lags = np.arange(max(min(image.shape) // 2, 1))
    parts = [variogram(image, k, direction, lags) for k in range(n_facies)]
    sill = sum(float(part.sill[0]) for part in parts)
    if not sill:
        return Spacing(lags, np.ones(len(lags)), None, None, 0.0)
    correlation = 1 - np.sum([part.gamma[0] for part in parts], axis=0) / sill
    reached = np.flatnonzero(correlation <= 1 - SILL_SHARE)
    from scipy.signal import find_peaks  # here: it takes longer to import than all the rest

    peaks, about = find_peaks(correlation, prominence=PROMINENCE)
    return Spacing(
        lags,
        correlation,
        int(reached[0]) if len(reached) else None,
        int(peaks[0]) if len(peaks) else None,
        float(about["prominences"][0]) if len(peaks) else 0.0,
    )
