"""The simulation grid: number, size and position of its cells."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ccwsim.model import arrays
from ccwsim.model.arrays import Array, Floats, Integers, Ints, Mask
from ccwsim.model.bounds import MAX_CRS_LETTERS, MAX_GRID_SIDE
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.numbers import coordinate


@dataclass(frozen=True)
class Grid:
    """A regular grid of cells in world coordinates.

    Raises `CCWSIMError` for a size that is not positive; the message names the axis.

    Parameters
    ----------
    ny, nx : int
        Rows (y, from the south) and columns (x, from the west).
    cell_size : pair or triple of float
        Width of a cell in world units along x, y and, for a volume, z; by default 1 along z.
    origin : pair or triple of float
        Outer corner of the first cell: x, y and, for a volume, z, which is 0 by default.
    nz : int, optional
        Layers (z, from the bottom) of a volume; None for a map.
    crs : str
        Coordinate system of x and y: a code such as "EPSG:32632", WKT or a PROJ text; "" if it is
        unknown.

    Examples
    --------
    >>> grid = Grid(100, 200, cell_size=(10.0, 10.0), origin=(5000.0, 0.0))
    >>> grid.cells_of([5015.0], [25.0])
    array([[2, 1]])
    >>> volume = Grid(100, 200, cell_size=(10.0, 10.0, 0.5), nz=40)
    >>> volume.shape, volume.origin, volume.cells_of([5.0], [15.0], [1.2])
    ((40, 100, 200), (0.0, 0.0, 0.0), array([[2, 1, 0]]))
    """

    ny: int
    nx: int
    cell_size: tuple[float, ...] = (1.0, 1.0)
    origin: tuple[float, ...] = (0.0, 0.0)
    nz: int | None = None
    crs: str = ""

    def __post_init__(self) -> None:
        for name in ("ny", "nx") if self.nz is None else ("ny", "nx", "nz"):
            n_cells = arrays.check_int(f"grid {name}", getattr(self, name), 1, MAX_GRID_SIDE)
            object.__setattr__(self, name, n_cells)
        for name, along_z in (("cell_size", 1.0), ("origin", 0.0)):
            numbers = _numbers(name, getattr(self, name), self.n_dimensions, along_z)
            object.__setattr__(self, name, numbers)
        if self.crs != "" and (reason := fault_of_crs(self.crs)):
            raise CCWSIMError(f"grid crs = {shown(self.crs)} {reason}")

    def __repr__(self) -> str:
        names = ["ny", "nx", "cell_size", "origin"]
        names += [name for name in ("nz", "crs") if getattr(self, name)]
        return f"Grid({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    @classmethod
    def of(cls, shape: Grid | Sequence[int] | Integers) -> Grid:
        """Return a grid unchanged, or make a grid of unit cells from (layers,) rows and columns.

        Raises `CCWSIMError` for a shape that is not two or three whole numbers.

        Examples
        --------
        >>> Grid.of((50, 100, 200)).nz
        50
        """
        if isinstance(shape, Grid):
            return shape
        if arrays.as_array(shape, "grid_shape").shape not in ((2,), (3,)):
            raise refused("grid_shape", shape=shown(shape))
        *nz, ny, nx = shape
        return cls(ny, nx, nz=nz[0] if nz else None)

    @classmethod
    def fit(
        cls,
        places: ArrayLike,
        *,
        shape: Sequence[int] | None = None,
        cell_size: float | Sequence[float] | None = None,
    ) -> Grid:
        """Return a grid that contains all points, with a margin around the points.

        The origin is a multiple of the cell size, or of ten cell sizes if the margin allows. Raises
        `CCWSIMError` if there is no point, if a coordinate is NaN or too large, and if a grid of
        `shape` and `cell_size` cannot contain the points.

        Parameters
        ----------
        places : array_like, shape (n, 2) or (n, 3)
            x, y and, for a volume, z in world coordinates, at least one point.
        shape : pair or triple of int, optional
            (Layers,) rows and columns. The default follows from `cell_size`. Without `cell_size`,
            the longer horizontal side has 100 to 300 cells, and a volume has 20 to 60 layers.
        cell_size : float, pair or triple of float, optional
            Widths along x, y and z in world units. By default, cells are square, and their width
            and height are each 1, 2 or 5 times a power of ten.

        Examples
        --------
        >>> Grid.fit([[436120.0, 4505250.0], [439880.0, 4509100.0]], shape=(512, 512))
        Grid(ny=512, nx=512, cell_size=(10.0, 10.0), origin=(435400.0, 4504600.0))
        """
        points = arrays.as_floats(places, "points")
        if points.ndim != 2 or points.shape[1] not in (2, 3) or not len(points):
            raise refused("points_shape", shape=points.shape)
        n = points.shape[1]
        if not np.isfinite(points).all() or np.abs(points).max() > _MAX_PLACE:
            raise CCWSIMError(
                f"{arrays.listing(arrays.WORLD_AXES[:n])} of every point must be finite numbers "
                f"up to {_MAX_PLACE:g}"
            )
        low, high = points.min(axis=0), points.max(axis=0)
        counts = None if shape is None else cls.of(shape).shape[::-1]
        if counts is not None and len(counts) != n:
            raise CCWSIMError(
                f"grid shape {shown(shape)} does not suit points of "
                f"{arrays.listing(arrays.WORLD_AXES[:n])}; give "
                f"{'rows and columns' if n == 2 else 'layers, rows and columns'}"
            )
        sizes = cell_size if isinstance(cell_size, (Sequence, np.ndarray)) else (cell_size,) * n
        widths = None if cell_size is None else _numbers("cell_size", sizes, n, 1.0)
        grid = _fitting(low, high, counts, widths)
        if not grid.holds(grid.cells_of(*points.T)).all():
            raise CCWSIMError(
                f"{arrays.describe_shape(grid.shape)} cells of "
                f"{' × '.join(map(coordinate, grid.cell_size))} do not "
                f"cover points from {low.tolist()} to {high.tolist()}; give more or larger cells"
            )
        return grid

    @property
    def shape(self) -> arrays.Shape:
        """Rows and columns of a map; layers, rows and columns of a volume."""
        return (self.ny, self.nx) if self.nz is None else (self.nz, self.ny, self.nx)

    @property
    def n_dimensions(self) -> int:
        """Number of dimensions: 2 for a map, 3 for a volume."""
        return 2 if self.nz is None else 3

    @property
    def is_volume(self) -> bool:
        """Whether the grid has layers."""
        return self.nz is not None

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return self.ny * self.nx * (self.nz or 1)

    def describe(self, unit: str = "", crs: str | None = None) -> str:
        """Describe the grid: its cells, their size and unit, the south-west corner, and the CRS.

        `crs` is a name of the coordinate system, by default `Grid.crs`.

        Examples
        --------
        >>> Grid(120, 160, (50.0, 50.0), (844000.0, 6521500.0), crs="EPSG:2154").describe()
        '160 × 120 cells of 50 × 50 from (844000, 6521500), EPSG:2154'
        """
        size = " × ".join(map(coordinate, self.cell_size))
        corner = ", ".join(map(coordinate, self.origin))
        cells = f"{arrays.describe_shape(self.shape)} cells of {size}{unit and ' '}{unit}"
        name = self.crs if crs is None else crs
        return f"{cells} from ({corner}){name and ', '}{name}"

    @property
    def axes(self) -> tuple[Array, ...]:
        """Centres of cells along each axis: x of columns, y of rows, and z of layers in volumes."""
        sides = zip(self.origin, self.cell_size, reversed(self.shape), strict=True)
        return tuple(corner + (np.arange(n) + 0.5) * width for corner, width, n in sides)

    def cells_of(self, x: ArrayLike, y: ArrayLike, z: ArrayLike | None = None) -> Ints:
        """Return (row, column) or (layer, row, column) of world points, inside or outside the grid.

        The result has shape (n, 2) or (n, 3). A point on the far edge of the grid belongs to the
        last cell. Raises `CCWSIMError` for coordinates that are not numbers, if z is given for a
        map, and if z is missing for a volume.
        """
        coordinates = (x, y) if z is None else (x, y, z)
        names = arrays.WORLD_AXES[: len(coordinates)]
        if len(coordinates) != self.n_dimensions:
            raise CCWSIMError(
                "the grid is a map: leave out z of points, or give the grid nz"
                if z is not None
                else f"the grid has {self.nz} layers: z of points is needed as well"
            )
        named = zip(coordinates, names, strict=True)
        points = [np.atleast_1d(arrays.as_floats(p, f"{name} of points")) for p, name in named]
        if any(p.ndim != 1 or p.shape != points[0].shape for p in points):
            raise CCWSIMError(f"{arrays.listing(names)} of points must be lists of the same length")
        if not all(np.isfinite(p).all() for p in points):
            raise CCWSIMError(f"{arrays.listing(names)} of every point must be finite numbers")
        with np.errstate(over="ignore"):
            places = (np.column_stack(points) - self.origin) / self.cell_size
        if not (np.abs(places) < 2.0**62).all():
            raise CCWSIMError("some points are too far from the grid; check the coordinates")
        sides = np.array(self.shape[::-1])
        places = np.where(places == sides, sides - 1, np.floor(places))
        return places[:, ::-1].astype(np.int64, order="C")

    def centers_of(self, cells: Integers) -> Floats:
        """Return x, y (and z) of the centres of cells in world units, shape (n, 2) or (n, 3)."""
        middles = self._checked(cells).astype(float)[:, ::-1] + 0.5
        return middles * np.array(self.cell_size) + np.array(self.origin)

    def holds(self, cells: Integers) -> Mask:
        """Return the mask of the cells ((layer,) row and column) that are in the grid."""
        places = self._checked(cells)
        sides = zip(places.T, self.shape, strict=True)
        return np.logical_and.reduce([(place >= 0) & (place < n) for place, n in sides])

    def enlarged(self, cells: Integers) -> Grid:
        """Return the grid with whole rows, columns and layers added, so that it holds cells.

        Examples
        --------
        >>> Grid(100, 200, (10.0, 10.0)).enlarged(np.array([[5, -3], [120, 7]]))
        Grid(ny=121, nx=203, cell_size=(10.0, 10.0), origin=(-30.0, 0.0))
        """
        places = np.vstack([self._checked(cells), np.array(self.shape) - 1])
        first = np.minimum(places.min(axis=0), 0)
        *layers, ny, nx = (places.max(axis=0) + 1 - first).tolist()
        corner = np.array(self.origin) + first[::-1] * np.array(self.cell_size)
        nz = layers[0] if layers else None
        return replace(self, ny=ny, nx=nx, nz=nz, origin=tuple(corner.tolist()))

    def _checked(self, cells: Integers) -> Ints:
        """Return cells as an array, or raise `CCWSIMError` for a wrong number of dimensions."""
        places = arrays.as_integers(cells, "cells")
        if places.ndim == 2 and places.shape[1] == self.n_dimensions:
            return places
        raise CCWSIMError(
            f"cells of shape {places.shape} do not suit a grid of "
            f"{arrays.describe_shape(self.shape)}: "
            f"(n, {self.n_dimensions}) is needed, "
            f"{'row and column' if self.nz is None else 'layer, row and column'}"
        )


def describe_cell(cell: Sequence[int] | Integers) -> str:
    """Return the (layer,) row and column of a cell as text."""
    names = ("layer", "row", "column")[-len(cell) :]
    return ", ".join(f"{name} {place}" for name, place in zip(names, cell, strict=True))


_CRS = re.compile(
    r"EPSG:\d{4,6}(\+\d{4,6})?|(?!EPSG:)[A-Z][\w-]{1,15}:[\w:.+-]{1,60}"
    r"|WGS84|WGS72|NAD27|NAD83|\+?(?:proj|init)=.+|[A-Z][A-Z_]{3,20}\s*\[.+\]",
    re.IGNORECASE | re.DOTALL,
)
"""Forms of a coordinate system: code of an authority, name, PROJ text or WKT."""


def fault_of_crs(crs: object) -> str:
    """Return why a text is not a coordinate system; empty for a coordinate system."""
    text = crs if isinstance(crs, str) else ""
    if len(text) > MAX_CRS_LETTERS:
        return f"has {len(text)} letters; a coordinate system has at most {MAX_CRS_LETTERS}"
    if _CRS.fullmatch(text) and all(c.isprintable() or c in "\r\n\t" for c in text):
        return ""
    return "is not a coordinate system; give a code such as EPSG:32632, or WKT"


_MAX_PLACE = 1e12
_MARGIN = 0.05
"""Free space on each side of the fitted points, as a share of the extent of the points."""
_FITTED_CELLS = 250  # approximate number of cells along the longer horizontal side of a fitted grid
_FITTED_LAYERS = 50  # approximate number of layers of a fitted grid; small because volumes are flat


def _fitting(
    low: Floats, high: Floats, shape: arrays.Shape | None, cell_size: tuple[float, ...] | None
) -> Grid:
    """Return a grid that contains the box from `low` to `high`; arguments are ordered x, y, z."""
    extent = (high - low) * (1 + 2 * _MARGIN)
    least = 1e-12 * max(np.abs([low, high]).max(), 1.0)  # rounding error of coordinates
    if cell_size is None:
        usual = (_FITTED_CELLS, _FITTED_CELLS, _FITTED_LAYERS)
        needed = extent / np.array(shape or usual[: len(low)], float)
        needed[:2] = needed[:2].max()
        cell = np.array([_nice(float(n)) if n > least else 1.0 for n in needed])
    else:
        cell = np.array(cell_size)
    counts = np.array(shape or np.maximum(np.ceil(extent / cell) + 1, 1))
    start = (low + high) / 2 - counts * cell / 2
    rounded = (_rounded(start, step * cell) for step in (10, 1, 0.1))
    containing = (o for o in rounded if ((o <= low) & (high < o + counts * cell)).all())
    origin = next(containing, start)
    nx, ny, *nz = (min(int(n), MAX_GRID_SIDE + 1) for n in counts)
    return Grid(ny, nx, tuple(cell.tolist()), tuple(origin.tolist()), nz[0] if nz else None)


def _rounded(values: Floats, step: Floats) -> Floats:
    """Return values rounded to multiples of a step, without rounding errors."""
    digits = np.clip(2 - np.floor(np.log10(step)), 0, 300).astype(int)
    multiples = np.round(values / step) * step
    return np.array([round(float(v), int(d)) for v, d in zip(multiples, digits, strict=True)])


def _nice(least: float) -> float:
    """Return the smallest number ≥ `least` that is 1, 2 or 5 times a power of ten."""
    power = float(np.floor(np.log10(least)))
    steps = (float(f"{k}e{power:.0f}") for k in (1, 2, 5, 10))
    return next((step for step in steps if step >= least * (1 - 1e-9)), least)


def _numbers(name: str, values: object, n: int, along_z: float) -> tuple[float, ...]:
    """Return two numbers for a map, or three for a volume; a missing third number is `along_z`."""
    try:
        numbers = tuple(float(value) for value in values)  # type: ignore[attr-defined]
    except (TypeError, ValueError, OverflowError):
        numbers = ()
    if n == 3 and len(numbers) == 2:
        numbers = *numbers, along_z
    if len(numbers) != n or not np.isfinite(numbers).all():
        needed = "two numbers, along x and y" if n == 2 else "three numbers, along x, y and z"
        more = "; a third one needs nz" if n == 2 and len(numbers) == 3 else ""
        raise CCWSIMError(f"grid {name} = {shown(values)} must be {needed}{more}")
    if name == "cell_size" and min(numbers) <= 0:
        raise CCWSIMError(f"grid cell size {numbers} must be positive")
    return numbers
