"""Convert between grid coordinates and path coordinates, in which the path begins at cell 0."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ccwsim.engine.stages import path
from ccwsim.model import Array, Ints, Shape, window_at

OPPOSITE = {"east": "west", "west": "east", "north": "south", "south": "north"}


class Frame(NamedTuple):
    """A map or a volume in path coordinates."""

    orientation: int  # orientation of the path, 0 … 15 (see `ccwsim.engine.stages.path`)
    shape: Shape  # (layers,) rows and columns
    offset: tuple[int, ...] = ()  # cells from the beginning of the path to the grid; () for 0

    @property
    def original_shape(self) -> tuple[int, ...]:
        """Shape of the grid or image in grid coordinates: (layers,) rows and columns."""
        *layers, rows, columns = self.shape
        return (*layers, columns, rows) if self.orientation & 4 else self.shape

    @property
    def _offset(self) -> Ints:
        return np.array(self.offset or (0,) * len(self.shape))

    def to_grid(self, array: Array) -> Array:
        """Return the grid in grid coordinates, from an array of all tiles in path coordinates."""
        return self.turned(array[window_at(self._offset.tolist(), self.shape)])

    def turned(self, part: Array) -> Array:
        """Return a copy of a part of a map or volume, in the orientation of the grid."""
        return np.ascontiguousarray(path.from_path(part, self.orientation))

    def cells_to_grid(self, cells: ArrayLike) -> Ints:
        """Return the grid coordinates of cells in path coordinates, shape (n, 2) or (n, 3)."""
        n = len(self.shape)
        inside = np.asarray(cells, np.int64).reshape(-1, n) - self._offset
        return path.cells_from_path(
            path.in_three(inside), path.in_layers(self.shape), self.orientation
        )[:, -n:]

    def box_to_grid(self, first: Sequence[int], lengths: Sequence[int]) -> tuple[slice, ...]:
        """Return a box in grid coordinates, restricted to cells in the map or volume."""
        high = np.minimum(np.add(first, lengths), self._offset + self.shape)
        ends = self.cells_to_grid([np.maximum(first, self._offset), high - 1])
        sides = zip(ends.min(axis=0).tolist(), ends.max(axis=0).tolist(), strict=True)
        return tuple(slice(start, last + 1) for start, last in sides)

    def cell_to_path(self, *cell: int) -> tuple[int, ...]:
        """Return the path coordinates of a grid cell, (layer,) row and column."""
        in_grid = path.cells_to_path(np.array([cell]), self.original_shape, self.orientation)[0]
        return tuple((in_grid + self._offset).tolist())

    def faces(self, sides: int = path.LEFT | path.TOP | path.BELOW) -> list[str]:
        """Return the names of `sides`, by default of the sides at which the path begins."""
        bits = self.orientation
        ew, ns = ("west", "east"), ("south", "north")
        across, along = (ns, ew) if bits & 4 else (ew, ns)
        names = {across[bool(bits & 2)]: path.LEFT, along[bool(bits & 1)]: path.TOP}
        if len(self.shape) == 3:
            names["above" if bits & path.FROM_ABOVE else "below"] = path.BELOW
        return [name for name in ("below", "above", *ns, *ew) if sides & names.get(name, 0)]

    @property
    def direction(self) -> str:
        """Direction of the path along its rows: "east", "west", "north" or "south"."""
        return OPPOSITE[self.faces(path.LEFT)[0]]
