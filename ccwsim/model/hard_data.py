"""Hard data: cells whose facies is known."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.model.arrays import as_array, as_integers, digest, frozen
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.training_image import TrainingImage


class HardData:
    """Cells whose facies is known, at most one facies a cell.

    Parameters
    ----------
    cells : array_like, shape (n, 2)
        Row (from the south) and column of each datum.
    facies : array_like, shape (n,)
        Its facies code.

    Attributes
    ----------
    cells : ndarray of int64, shape (n, 2)
        Sorted by row, then column; a datum given twice with the same facies is kept once.
    facies : ndarray of int64, shape (n,)
        The codes, read-only.

    Raises
    ------
    CCWSIMError
        For shapes that do not fit, values that are not whole numbers, or two different facies in
        one cell (the message names the data).

    Examples
    --------
    >>> data = HardData([[3, 4], [0, 2]], [1, 0])
    >>> data.n, data.cells.tolist()
    (2, [[0, 2], [3, 4]])
    """

    def __init__(self, cells: ArrayLike = (), facies: ArrayLike = ()) -> None:
        places = as_array(cells, "cells of hard data")
        codes = as_array(facies, "facies of hard data")
        places = as_integers(places, "cells of hard data") if places.size else np.empty((0, 2))
        codes = as_integers(codes, "facies of hard data") if codes.size else np.empty(0)
        if places.ndim != 2 or places.shape[1] != 2 or codes.shape != (len(places),):
            raise CCWSIMError(
                f"hard data: cells of shape (n, 2) and facies of shape (n,) are needed, "
                f"not {np.shape(cells)} and {np.shape(facies)}"
            )
        unique = np.unique(np.column_stack([places, codes]).astype(np.int64), axis=0)
        clashing = np.flatnonzero((np.diff(unique[:, :2], axis=0) == 0).all(axis=1))
        if len(clashing):
            raise CCWSIMError(_clash(places, codes, unique[clashing[0], :2]))
        self.cells = frozen(unique[:, :2])
        self.facies = frozen(unique[:, 2])

    @property
    def n(self) -> int:
        """How many data there are."""
        return len(self.facies)

    @cached_property
    def digest(self) -> str:
        """A short name of the content: equal for equal data in any order."""
        return digest(self.cells, self.facies)

    @cached_property
    def triples(self) -> tuple[tuple[int, int, int], ...]:
        """Each datum as (row, column, facies), to look for it among others.

        Examples
        --------
        >>> HardData([[3, 4]], [1]).triples
        ((3, 4, 1),)
        """
        return tuple(map(tuple, np.column_stack([self.cells, self.facies]).tolist()))

    def check(self, grid: Grid, training_image: TrainingImage) -> None:
        """Say which data lie outside the grid or have a facies that the TI does not have.

        Raises
        ------
        CCWSIMError
            The message names the first such data.
        """
        outside = np.flatnonzero(~grid.holds(self.cells)) if self.n else np.empty(0, int)
        if len(outside):
            raise CCWSIMError(
                f"{len(outside)} of {self.n} hard data lie outside the grid of {grid.ny} rows and "
                f"{grid.nx} columns: {_listed(self, outside)}; drop them or enlarge the grid"
            )
        unknown = np.flatnonzero(~np.isin(self.facies, training_image.codes))
        if len(unknown):
            there = ", ".join(map(str, training_image.codes))
            raise CCWSIMError(
                f"{len(unknown)} of {self.n} hard data have a facies that the training image does "
                f"not have (it has {there}): {_listed(self, unknown)}; recode or drop them"
            )

    def n_mismatched(self, realization: NDArray[np.integer]) -> int:
        """Return how many data a realization, shape (ny, nx) in facies codes, does not honour."""
        rows, columns = self.cells.T
        return int(np.count_nonzero(realization[rows, columns] != self.facies))

    def __repr__(self) -> str:
        return f"HardData(n={self.n})"


def _listed(data: HardData, which: NDArray[np.integer]) -> str:
    shown = [
        f"row {row}, column {col}, facies {code}"
        for (row, col), code in zip(data.cells[which[:3]], data.facies[which[:3]], strict=True)
    ]
    return "; ".join(shown) + (" …" if len(which) > 3 else "")


def _clash(places: NDArray, codes: NDArray, cell: NDArray) -> str:
    same = np.flatnonzero((places == cell).all(axis=1))
    said = ", ".join(f"no. {k + 1} says {codes[k]}" for k in same[:6])
    return (
        f"hard data: two facies in the cell at row {cell[0]}, column {cell[1]} ({said}); "
        "keep one of them"
    )
