"""The variables of a file before conversion to a training image or hard data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from math import atan2, degrees, inf

import numpy as np

from ccwsim.io.limits import check_cells
from ccwsim.model import (
    Array,
    CCWSIMError,
    Grid,
    Integers,
    Ints,
    Mask,
    Shape,
    fault_of_crs,
    is_integer,
    known_values,
    refused,
    shown,
    unknown_note,
)

PARALLEL = 1e-4  # maximum slope of columns and rows that count as parallel to the axes


@dataclass(frozen=True)
class Geometry:
    """The geometry that a file states for its grids; numbers along x, y and perhaps z."""

    cell_size: tuple[float, ...] = ()  # empty if the file does not state it
    origin: tuple[float, ...] = ()  # outer corner of the first cell; empty if it is not stated
    crs: str = ""  # coordinate system, such as "EPSG:32632" or a text in WKT
    azimuth: float = 90.0  # direction of the columns; a rotated grid has no cell size and origin

    def grid(self, shape: Shape) -> Grid:
        """Return a grid of the given shape; unknown cells have the size 1 and begin at 0."""
        n, crs = len(shape), "" if fault_of_crs(self.crs) else self.crs
        size, origin = self.cell_size[:n] or (1.0, 1.0), self.origin[:n] or (0.0, 0.0)
        return replace(Grid.of(shape), cell_size=size, origin=origin, crs=crs)

    def part(self, first: Sequence[int], every: int) -> Geometry:
        """Return the geometry of a part that begins at (layer,) row and column `first`."""
        origin = self.origin or (0.0,) * len(self.cell_size)
        starts = zip(origin, self.cell_size, (*first[::-1], 0), strict=False)
        sizes = [every * size for size in self.cell_size[:2]] + [*self.cell_size[2:]]
        return replace(
            self, cell_size=tuple(sizes), origin=tuple(o + size * k for o, size, k in starts)
        )


@dataclass(frozen=True, eq=False)
class DataFile:
    """The unconverted variables of a file."""

    kind: str  # name of the format, for messages
    name: str  # name of the file in messages
    # grids (nz, ny, nx), stacks of volumes, or columns of a table, shape (n,)
    variables: dict[str, Array]
    # whether the variables are columns of a table: points, or a grid of unknown size
    is_table: bool = False
    # line number of each row of a table or text matrix in the file, from 1, shape (n,)
    lines: Ints | None = None
    south_first: bool = True  # whether the first row is the south in this format
    asks_up: bool = False  # whether the user must check `south_first`
    # whether the first layer in the file is the bottom, as it always is in `variables`
    bottom_first: bool = True
    # codes for missing values that the file states; `CUSTOMARY_CODES` and NaN count too
    missing: tuple[float, ...] = ()
    geometry: Geometry = Geometry()
    # names of the values 0, 1, … of a variable, if the file contains names
    labels: dict[str, tuple[str, ...]] = field(default_factory=dict)
    # text columns of a table, such as names of wells and facies
    words: dict[str, tuple[str, ...]] = field(default_factory=dict)
    columns: tuple[str, ...] = ()  # names of all columns of a table, in file order
    counted: str = "line"  # unit of `lines`: "line", "row" or "cell"
    numbering: str = "codes"  # what integers are: codes, or indices of a palette of "colours"

    def __post_init__(self) -> None:
        if not self.variables and not self.is_table:
            raise refused("no_grid", name=self.name)
        origin = self.geometry.origin or (0.0,) * 3
        for axis, size, start in zip("xyz", self.geometry.cell_size, origin, strict=False):
            if not (0 < size < inf and abs(start) < inf):
                raise refused("impossible_cells", name=self.name, size=size, axis=axis, start=start)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all columns or variables, in the order of the file."""
        return self.columns or tuple(self.variables)

    def chosen(
        self, variable: str | None, preferred: tuple[str, ...] = (), argument: str = "variable"
    ) -> str:
        """Return the name of the variable to read; by default, the only variable of the file."""
        names = list(self.variables)
        if variable is not None:
            return self.column(variable, names)
        liked = [name for name in names if name.lower() in preferred]
        if len(names) == 1 or len(liked) == 1:
            return (liked or names)[0]
        problem = f"{self.name} has {len(names)} variables: {listed(names)}"
        raise CCWSIMError(f"{problem}; pick one ({argument}=)")

    def column(self, name: str, among: Sequence[str] = ()) -> str:
        """Find a column or variable; return its name as written in the file."""
        names, wanted = among or self.names, name if isinstance(name, str) else shown(name)
        same = [n for n in names if n == wanted] or [
            n for n in names if n.lower() == wanted.lower()
        ]
        if len(same) != 1:
            choices = listed(names)
            raise CCWSIMError(f"{self.name} has no variable {shown(name)}; choose from {choices}")
        return same[0]

    def grid_of(self, variable: str, shape: Shape | None) -> Array:
        """Return a variable in the shape (nz, ny, nx); a table (x fastest) needs `shape`."""
        values = self.variables[variable]
        if not self.is_table:
            if shape is not None and tuple(shape) not in (values.shape, values.shape[-2:]):
                sides = " × ".join(map(str, values.shape))
                raise refused("other_shape_in_file", name=self.name, said=sides, shape=tuple(shape))
            return values
        if shape is None:
            raise refused("file_without_size", name=self.name, n=len(values))
        return values.reshape(_full_shape(self.name, shape, len(values)))

    def at(self, cell_size: Sequence[float], corner: Sequence[float] = ()) -> DataFile:
        """Return the file with the given cell size and outer corner along x, y and perhaps z."""
        if not len(cell_size):
            return self
        place = replace(self.geometry, cell_size=tuple(cell_size), origin=tuple(corner))
        return replace(self, geometry=place)

    def along(self, columns: Sequence[float], rows: Sequence[float]) -> DataFile:
        """Return the file with the directions (x, y) in which its columns and rows count.

        Columns and rows parallel to the axes run east and north. Otherwise, columns keep their
        direction, and rows run to the left of it.
        """
        (east, north), (rows_east, rows_north) = columns, rows
        is_parallel = max(abs(north / (east or 1)), abs(rows_east / (rows_north or 1))) < PARALLEL
        step = -1 if is_parallel and east < 0 else 1
        south_first = step * (east * rows_north - north * rows_east) > 0
        azimuth = degrees(atan2(east, north)) % 360
        place = self.geometry if is_parallel else Geometry(crs=self.geometry.crs, azimuth=azimuth)
        turned = {key: values[..., ::step] for key, values in self.variables.items()}
        return replace(self, variables=turned, south_first=bool(south_first), geometry=place)

    def oriented(
        self,
        grid: Array,
        *,
        up: bool | None = None,
        slice_index: int | None = None,
        volume: bool = False,
        z_up: bool | None = None,
    ) -> Array:
        """Return one layer or a whole volume, with row 0 at the south and layer 0 at the bottom."""
        if not volume:
            grid = self._layer(grid, slice_index)
        elif z_up not in (None, self.bottom_first):
            grid = grid[::-1]
        south_first = self.south_first if up is None else up
        return grid if south_first else np.flip(grid, -2)

    def _layer(self, grid: Array, slice_index: int | None) -> Array:
        """Return one layer; if the grid is one cell wide, return the grid as a vertical section."""
        n = len(grid)
        if slice_index is None and (n == 1 or 1 in grid.shape[1:]):
            return grid[0] if n == 1 else grid.reshape(n, -1)
        if not is_integer(slice_index) or not 0 <= slice_index < n:
            instead = "" if slice_index is None else f", not {shown(slice_index)}"
            raise refused("file_of_slices", name=self.name, n=n, last=n - 1, given=instead)
        return grid[slice_index]

    def known(self, values: Array) -> Mask:
        """Return a mask of `values` that are neither NaN nor a code for a missing value."""
        return known_values(values, self.missing)

    def unknown_note(self, values: Array) -> str:
        """Return a sentence about the cells without a value; empty if there is none."""
        return unknown_note(values, self.missing)


def first_of(words: Sequence[object], most: int = 6) -> str:
    """Return the first of many words, separated by commas."""
    return ", ".join(map(str, words[:most])) + (" …" if len(words) > most else "")


def listed(names: Sequence[str]) -> str:
    """Return the first names of many in quotation marks, separated by commas."""
    return first_of([repr(name) for name in names[:21]], 20)


def named_lines(counted: str, lines: Integers) -> str:
    """Return line numbers as a phrase: "lines 3, 7 and 12"."""
    different = np.unique(lines)  # many cells of a well have one line number
    numbers = [str(line) for line in different[:6]]
    if len(numbers) < 2:
        return f"{counted} {''.join(numbers)}"
    last = f"{len(different) - 6} more" if len(different) > 6 else numbers.pop()
    many = "data" if counted == "datum" else f"{counted}s"
    return f"{many} {', '.join(numbers)} and {last}"


def _full_shape(name: str, shape: Shape, n: int) -> tuple[int, int, int]:
    if len(shape) not in (2, 3) or not all(map(is_integer, shape)):
        raise CCWSIMError(f"{name}: shape = {shown(shape)} must be (rows, columns)")
    n_cells = check_cells(name, tuple(int(s) for s in shape))
    if n != n_cells and (len(shape) == 3 or n % n_cells):
        sides = " × ".join(map(str, shape))
        raise CCWSIMError(f"{name} has {n} values, which do not fill {sides} cells; correct shape")
    return n // n_cells if len(shape) == 2 else int(shape[0]), int(shape[-2]), int(shape[-1])


@contextmanager
def broken(
    message: str,
    kinds: type[Exception] | tuple[type[Exception], ...] = Exception,
    remedy: str = "",
) -> Iterator[None]:
    """Convert errors of a library on a broken file; with a `remedy`, state the library's reason."""
    try:
        yield
    except (CCWSIMError, MemoryError):
        raise
    except kinds as error:
        text = getattr(error, "strerror", None) or str(error)
        reason = printable(" ".join(text.split()), 100)
        raise CCWSIMError(f"{message} ({reason}); {remedy}" if remedy else message) from error


def distinct_names(names: list[str]) -> list[str]:
    """Return the names; add a number to empty and repeated names."""
    distinct: dict[str, None] = {}
    for k, name in enumerate(names, start=1):
        label = printable(name) or f"column {k}"
        while label in distinct:
            label = f"{label} ({k})"
        distinct[label] = None
    return list(distinct)


def printable(name: str, most: int = 80) -> str:
    """Return a name from a file as short printable text on one line."""
    return "".join(c for c in name[: 10 * most] if c.isprintable()).strip()[:most]
