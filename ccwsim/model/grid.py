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

    @classmethod
    def fit(
        cls,
        places: ArrayLike,
        *,
        shape: Sequence[int] | None = None,
        cell_size: float | Sequence[float] | None = None,
    ) -> Grid:
        """Return a grid whose cells hold all points, with a margin around them.

        Parameters
        ----------
        places : array_like, shape (n, 2)
            x and y in world coordinates, at least one point.
        shape : pair of int, optional
            Rows and columns to keep. Without it the longer side has 100 to 300 cells, or as many
            as `cell_size` asks for.
        cell_size : float or pair of float, optional
            World units. Without it cells are squares of 1, 2 or 5 times a power of ten.

        Returns
        -------
        Grid
            Its origin is rounded to whole cells, to tens of them where the margin allows.

        Raises
        ------
        CCWSIMError
            For no points, points that are not known numbers or too far apart to tell cells, and
            where `shape` and `cell_size` together do not hold the points.

        Examples
        --------
        >>> Grid.fit([[436120.0, 4505250.0], [439880.0, 4509100.0]], shape=(512, 512))
        Grid(ny=512, nx=512, cell_size=(10.0, 10.0), origin=(435400.0, 4504600.0))
        """
        points = as_floats(places, "points")
        if points.ndim != 2 or points.shape[1:] != (2,) or not len(points):
            raise CCWSIMError(f"points of shape {points.shape} must be (n, 2), x and y, n above 0")
        if not np.isfinite(points).all() or np.abs(points).max() > _MAX_PLACE:
            raise CCWSIMError(f"x and y of every point must be known numbers up to {_MAX_PLACE:g}")
        low, high = points.min(axis=0), points.max(axis=0)
        asked = None if shape is None else (cls.of(shape).nx, cls.of(shape).ny)
        pair = cell_size if isinstance(cell_size, (Sequence, np.ndarray)) else (cell_size,) * 2
        given = None if cell_size is None else _two_numbers("cell_size", pair)
        if given is not None and min(given) <= 0:
            raise CCWSIMError(f"grid cell size {given} must be positive")
        grid = _fitting(low, high, asked, given)
        if not grid.holds(grid.cells_of(*points.T)).all():
            raise CCWSIMError(
                f"{grid.nx} × {grid.ny} cells of {grid.cell_size[0]:g} × {grid.cell_size[1]:g} do "
                f"not hold points from {low.tolist()} to {high.tolist()}; give more or larger cells"
            )
        return grid

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, as the arrays have them."""
        return self.ny, self.nx

    @property
    def axes(self) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """x of the centres of columns and y of those of rows, in world units."""
        (width, height), (west, south) = self.cell_size, self.origin
        x, y = np.arange(self.nx) + 0.5, np.arange(self.ny) + 0.5
        return west + x * width, south + y * height

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


_MAX_PLACE = 1e12
_MARGIN = 0.05
"""Free space on each side of fitted points, of their extent."""
_FITTED_CELLS = 250
"""About as many along the longer side of a fitted grid."""


def _fitting(
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    shape: tuple[int, int] | None,
    cell_size: tuple[float, float] | None,
) -> Grid:
    """A grid around the points from `low` to `high`; `shape` is along x and y here."""
    extent = (high - low) * (1 + 2 * _MARGIN)
    least = 1e-12 * max(np.abs([low, high]).max(), 1.0)  # what numbers of this size can tell
    if cell_size is None:
        n = np.array(shape or (_FITTED_CELLS, _FITTED_CELLS), float)
        needed = float((extent / n).max())
        cell = np.full(2, _nice(needed) if needed > least else 1.0)
    else:
        cell = np.array(cell_size)
    counts = np.array(shape or np.maximum(np.ceil(extent / cell) + 1, 1))
    start = (low + high) / 2 - counts * cell / 2
    rounded = (_rounded(start, step * cell) for step in (10, 1, 0.1))
    held = (o for o in rounded if ((o <= low) & (high < o + counts * cell)).all())
    origin = next(held, start)
    nx, ny = (min(int(n), MAX_GRID_SIDE + 1) for n in counts)
    return Grid(ny, nx, tuple(cell.tolist()), tuple(origin.tolist()))


def _rounded(values: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Multiples of a step, without the noise of multiplying."""
    digits = np.clip(2 - np.floor(np.log10(step)), 0, 300).astype(int)
    multiples = np.round(values / step) * step
    return np.array([round(float(v), int(d)) for v, d in zip(multiples, digits, strict=True)])


def _nice(least: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not less."""
    power = float(np.floor(np.log10(least)))
    steps = (float(f"{k}e{power:.0f}") for k in (1, 2, 5, 10))
    return next((step for step in steps if step >= least * (1 - 1e-9)), least)


def _two_numbers(name: str, pair: object) -> tuple[float, float]:
    try:
        x, y = (float(value) for value in pair)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        x = y = np.nan
    if not np.isfinite([x, y]).all():
        raise CCWSIMError(f"grid {name} = {shown(pair)} must be two numbers, along x and y")
    return x, y
