"""Classical multidimensional scaling: distances drawn as positions in the plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.model.arrays import as_floats, check_int
from ccwsim.model.errors import CCWSIMError


@dataclass(frozen=True, eq=False)
class Scaling:
    """Positions whose distances are close to the given ones.

    Attributes
    ----------
    positions : ndarray, shape (n, n_dimensions)
        Centred on 0; the axis with the largest spread first.
    explained : ndarray, shape (n_dimensions,)
        Share of the spread along each axis, of the sum of all positive eigenvalues.
    """

    positions: NDArray[np.float64]
    explained: NDArray[np.float64]


def classical_scaling(distances: NDArray[np.float64], n_dimensions: int = 2) -> Scaling:
    """Return positions from distances (Torgerson 1952).

    Eigenvectors of −½ J D² J, with J = I − 1/n, times the roots of their eigenvalues. The sign of
    each axis is chosen so that its largest coordinate is positive.

    Parameters
    ----------
    distances : ndarray, shape (n, n)
        Symmetric, 0 on the diagonal.
    n_dimensions : int

    Raises
    ------
    CCWSIMError
        For distances that are not square or not symmetric.

    Examples
    --------
    >>> line = np.abs(np.subtract.outer([0.0, 1.0, 5.0], [0.0, 1.0, 5.0]))
    >>> classical_scaling(line, 1).positions.ravel().round(6).tolist()
    [-2.0, -1.0, 3.0]
    """
    d = as_floats(distances, "distances")
    n_dimensions = check_int("n_dimensions", n_dimensions, 1, 1000)
    square = d.ndim == 2 and d.shape[0] == d.shape[1] and len(d) > 0
    if not square or not np.isfinite(d).all() or not np.allclose(d, d.T):
        raise CCWSIMError(f"distances must be a symmetric matrix, not an array of shape {d.shape}")
    squares = d**2
    means = squares.mean(axis=0)
    values, vectors = np.linalg.eigh(-0.5 * (squares - means - means[:, None] + means.mean()))
    values, vectors = np.maximum(values[::-1], 0), vectors[:, ::-1]
    positions = np.zeros((len(d), n_dimensions))
    explained = np.zeros(n_dimensions)
    kept = min(n_dimensions, len(d))
    positions[:, :kept] = vectors[:, :kept] * np.sqrt(values[:kept])
    explained[:kept] = values[:kept] / max(values.sum(), np.finfo(float).tiny)
    largest = positions[np.abs(positions).argmax(axis=0), np.arange(n_dimensions)]
    return Scaling(positions * np.where(largest < 0, -1.0, 1.0), explained)
