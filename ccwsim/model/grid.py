"""The simulation grid: how many cells, how large, and where in the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.model.arrays import as_array, as_floats, is_whole
from ccwsim.model.bounds import MAX_GRID_SIDE
from ccwsim.model.errors import CCWSIMError, shown


@dataclass(frozen=True)
class Grid:
    """A regular grid of cells in world coordinates.

    Parameters
    ----------
    ny, nx : int
        Rows (y, from the south) and columns (x, from the west).
    cell_size : pair of float
        Width of a cell along x and y, in world units.
    origin : pair of float
        x and y of the outer corner of the first cell, in world units.

    Raises
    ------
    CCWSIMError
        For sizes that are not positive.

    Examples
    --------
    >>> grid = Grid(100, 200, cell_size=(10.0, 10.0), origin=(5000.0, 0.0))
    >>> grid.cells_of([5015.0], [25.0])
    array([[2, 1]])
    """

    ny: int
    nx: int
    cell_size: tuple[float, float] = (1.0, 1.0)
    origin: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("ny", "nx"):
            value = getattr(self, name)
            if not is_whole(value) or value < 1:
                raise CCWSIMError(
                    f"grid {name} = {shown(value)} must be a whole number of cells, at least 1"
                )
            if value > MAX_GRID_SIDE:
                raise CCWSIMError(
                    f"grid {name} = {shown(value)} must be at most {MAX_GRID_SIDE} cells"
                )
            object.__setattr__(self, name, int(value))
        for name in ("cell_size", "origin"):
            object.__setattr__(self, name, _two_numbers(name, getattr(self, name)))
        if min(self.cell_size) <= 0:
            raise CCWSIMError(f"grid cell size {self.cell_size} must be positive")

    @classmethod
    def of(cls, shape: Grid | Sequence[int]) -> Grid:
        """Return a grid as it is, or the grid of unit cells with these rows and columns.

        Raises
        ------
        CCWSIMError
            For anything but two whole numbers.
        """
        if isinstance(shape, Grid):
            return shape
        if as_array(shape, "grid_shape").shape != (2,):
            raise CCWSIMError(f"grid_shape = {shown(shape)} must be two numbers, rows and columns")
        return cls(shape[0], shape[1])

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, as the arrays have them."""
        return self.ny, self.nx

    def cells_of(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.int64]:
        """Return the (row, col) of the cells that hold world points, also outside the grid.

        Parameters
        ----------
        x, y : array_like, shape (n,)
            World coordinates.

        Returns
        -------
        ndarray, shape (n, 2)
            Row and column; a point on the far edge of the grid belongs to the last cell.

        Raises
        ------
        CCWSIMError
            For coordinates that are not numbers.
        """
        points = [np.atleast_1d(as_floats(p, f"{n} of points")) for p, n in ((x, "x"), (y, "y"))]
        if points[0].ndim != 1 or points[0].shape != points[1].shape:
            raise CCWSIMError("as many x as y of points are needed, each in one row")
        if not all(np.isfinite(p).all() for p in points):
            raise CCWSIMError("x and y of every point must be known numbers")
        with np.errstate(over="ignore"):
            columns = (points[0] - self.origin[0]) / self.cell_size[0]
            rows = (points[1] - self.origin[1]) / self.cell_size[1]
        far = np.concatenate([columns, rows])
        if not (np.abs(far) < 2.0**62).all():
            raise CCWSIMError("some points are absurdly far from the grid; correct them")
        columns[columns == self.nx] = self.nx - 1
        rows[rows == self.ny] = self.ny - 1
        return np.floor(np.stack([rows, columns], axis=1)).astype(np.int64)

    def centers_of(self, cells: NDArray[np.integer]) -> NDArray[np.float64]:
        """Return x and y of the centres of cells (row, col), shape (n, 2), in world units."""
        middles = np.asarray(cells, float)[:, ::-1] + 0.5
        return middles * np.array(self.cell_size) + np.array(self.origin)

    def holds(self, cells: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Return which cells (row, col) lie in the grid, shape (n,)."""
        rows, columns = np.asarray(cells).T
        return (rows >= 0) & (rows < self.ny) & (columns >= 0) & (columns < self.nx)


def _two_numbers(name: str, pair: object) -> tuple[float, float]:
    try:
        x, y = (float(value) for value in pair)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        x = y = np.nan
    if not np.isfinite([x, y]).all():
        raise CCWSIMError(f"grid {name} = {shown(pair)} must be two numbers, along x and y")
    return x, y
