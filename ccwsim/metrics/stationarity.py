"""Whether an image looks alike everywhere: its quarters against the whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics.proportions import proportions
from ccwsim.metrics.stack import as_indices
from ccwsim.metrics.variograms import variogram
from ccwsim.model.errors import CCWSIMError

QUARTERS = ("south-west", "south-east", "north-west", "north-east")
PROPORTION_LIMIT = 0.15
"""A quarter's proportion may differ by so many √(p (1 − p)), the spread of the indicator."""
VARIOGRAM_LIMIT = 0.2
"""A quarter's variogram may differ by so much of the sill, as a root mean square over lags."""


@dataclass(frozen=True, eq=False)
class Stationarity:
    """Proportions and variograms of the four quarters of an image.

    Attributes
    ----------
    proportions : ndarray, shape (4, n_facies)
        Of the quarters in the order of `QUARTERS`.
    proportion_shift : ndarray, shape (4, n_facies)
        |p of the quarter − p| / √(p (1 − p)).
    lags : ndarray of int, shape (n_lags,)
    variograms : ndarray, shape (4, n_facies, 2, n_lags)
        [quarter, facies, E-W or N-S, lag].
    variogram_shift : ndarray, shape (4, n_facies, 2)
        Root mean square over lags of γ of the quarter − γ, in sills.
    """

    proportions: NDArray[np.float64]
    proportion_shift: NDArray[np.float64]
    lags: NDArray[np.int64]
    variograms: NDArray[np.float64]
    variogram_shift: NDArray[np.float64]

    @property
    def stationary(self) -> bool:
        """Whether no quarter differs by more than the limits."""
        same_shares = bool((self.proportion_shift <= PROPORTION_LIMIT).all())
        return same_shares and bool((self.variogram_shift <= VARIOGRAM_LIMIT).all())


def stationarity(indices: NDArray[np.integer], n_facies: int) -> Stationarity:
    """Compare the four quarters of an image with the whole.

    Parameters
    ----------
    indices : ndarray, shape (ny, nx)
        Facies indices.
    n_facies : int

    Raises
    ------
    CCWSIMError
        For an image of fewer than 8 rows or columns.

    Examples
    --------
    >>> half = np.zeros((40, 40), int)
    >>> half[:, 20:] = 1
    >>> stationarity(half, 2).stationary
    False
    """
    image = as_indices(indices, n_facies)[0]
    ny, nx = image.shape
    if min(ny, nx) < 8:
        raise CCWSIMError(
            f"an image of {ny} × {nx} cells is too small to compare its quarters; "
            "at least 8 × 8 are needed"
        )
    rows, columns = (slice(0, ny // 2), slice(ny // 2, ny)), (slice(0, nx // 2), slice(nx // 2, nx))
    quarters = [image[r, c] for r in rows for c in columns]
    shares = np.array([proportions(quarter, n_facies)[0] for quarter in quarters])
    whole = proportions(image, n_facies)[0]
    deviation = np.sqrt(whole * (1 - whole))
    lags = np.arange(min(ny, nx) // 4 + 1)
    own = np.array([_curves(quarter, n_facies, lags) for quarter in quarters])
    distance = np.sqrt(np.mean((own - _curves(image, n_facies, lags)) ** 2, axis=3))
    return Stationarity(
        shares,
        _in_units(np.abs(shares - whole), deviation),
        lags,
        own,
        _in_units(distance, (deviation**2)[:, None]),
    )


def _curves(image: NDArray, n_facies: int, lags: NDArray) -> NDArray[np.float64]:
    return np.array(
        [
            [variogram(image, k, direction, lags).gamma[0] for direction in ("E-W", "N-S")]
            for k in range(n_facies)
        ]
    )


def _in_units(values: NDArray, unit: NDArray) -> NDArray[np.float64]:
    """Return values / unit, and 0 for a facies that fills the image or none of it."""
    units = np.broadcast_to(unit, values.shape)
    return np.divide(values, units, out=np.zeros(values.shape), where=units > 0)
