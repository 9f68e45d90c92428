"""How realizations honour the hard data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics.stack import Images, as_values
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.hard_data import HardData


@dataclass(frozen=True, eq=False)
class DataMatch:
    """Hard data that realizations do not honour.

    Attributes
    ----------
    wrong : ndarray of bool, shape (n, n_data)
        Which data each realization misses, in the order of the hard data.
    n_wrong : ndarray of int, shape (n,)
        How many data each realization misses.
    times_wrong : ndarray of int, shape (n_data,)
        How many realizations miss each datum.
    map : ndarray of int, shape (ny, nx)
        `times_wrong` in the cells with data, −1 elsewhere.
    """

    wrong: NDArray[np.bool_]
    n_wrong: NDArray[np.int64]
    times_wrong: NDArray[np.int64]
    map: NDArray[np.int64]


def data_match(realizations: Images, hard_data: HardData) -> DataMatch:
    """Compare realizations with the hard data, cell by cell at full resolution.

    Parameters
    ----------
    realizations : Ensemble or array_like, shape (ny, nx) or (n, ny, nx)
        An array has facies codes, as the data have them.
    hard_data : HardData

    Returns
    -------
    DataMatch

    Raises
    ------
    CCWSIMError
        Where a datum lies outside the realizations.

    Examples
    --------
    >>> match = data_match([[0, 1], [1, 1]], HardData([[0, 0], [1, 1]], [1, 1]))
    >>> match.n_wrong, match.map.tolist()
    (array([1]), [[1, -1], [-1, 0]])
    """
    stack = as_values(realizations)
    if not isinstance(hard_data, HardData):
        raise CCWSIMError(f"hard_data: HardData is needed, not {shown(hard_data)}")
    rows, columns = hard_data.cells.T
    ny, nx = stack.shape[1:]
    outside = (rows < 0) | (rows >= ny) | (columns < 0) | (columns >= nx)
    if outside.any():
        k = int(np.flatnonzero(outside)[0])
        raise CCWSIMError(
            f"the datum at row {rows[k]}, column {columns[k]} lies outside realizations of "
            f"{ny} rows and {nx} columns; drop it or take the grid it belongs to"
        )
    wrong = stack[:, rows, columns] != hard_data.facies
    times = np.count_nonzero(wrong, axis=0)
    where = np.full((ny, nx), -1)
    where[rows, columns] = times
    return DataMatch(wrong, np.count_nonzero(wrong, axis=1), times, where)
