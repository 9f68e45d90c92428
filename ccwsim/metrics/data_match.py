"""Comparison of realizations with the hard data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics.stack import Images, as_values
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData


@dataclass(frozen=True, eq=False)
class DataMatch:
    """Hard data that realizations do not honour."""

    wrong: NDArray[np.bool_]
    """Mask of the data that each realization does not honour, shape (n, n_data)."""
    n_wrong: NDArray[np.int64]
    """Number of data that each realization does not honour, shape (n,)."""
    times_wrong: NDArray[np.int64]
    """Number of realizations that do not honour each datum, shape (n_data,)."""
    map: NDArray[np.int64]
    """Map (or volume) of `times_wrong`, with −1 in cells without data."""


def data_match(realizations: Images, hard_data: HardData) -> DataMatch:
    """Compare realizations with the hard data, cell by cell at full resolution.

    An array of shape (nz, ny, nx) is one volume if the data have layers. Raises `CCWSIMError` if a
    datum is outside the realizations, and if only the data or only the realizations have layers.

    Examples
    --------
    >>> match = data_match([[0, 1], [1, 1]], HardData([[0, 0], [1, 1]], [1, 1]))
    >>> match.n_wrong, match.map.tolist()
    (array([1]), [[1, -1], [-1, 0]])
    """
    if not isinstance(hard_data, HardData):
        raise CCWSIMError(f"hard_data must be of type HardData, not {shown(hard_data)}")
    cells = hard_data.cells
    stack = as_values(realizations, hard_data.n_dimensions)
    shape = stack.shape[1:]
    hard_data.check(Grid.of(shape))
    if not len(cells):
        cells = np.empty((0, len(shape)), np.int64)
    wrong = stack[:, *cells.T] != hard_data.facies
    times = np.count_nonzero(wrong, axis=0)
    where = np.full(shape, -1)
    where[tuple(cells.T)] = times
    return DataMatch(wrong, np.count_nonzero(wrong, axis=1), times, where)
