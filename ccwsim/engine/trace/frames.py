"""From path coordinates, in which every path begins in one corner, to grid coordinates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.stages.path import cells_to_path, from_path

CORNERS = {(0, 0): "south-west", (0, 1): "south-east", (1, 0): "north-west", (1, 1): "north-east"}


class Rectangle(NamedTuple):
    """A rectangle of cells: its south-west cell, height and width."""

    row: int
    column: int
    height: int
    width: int


class Frame(NamedTuple):
    """An image as the path sees it.

    Attributes
    ----------
    orientation : int
        0 … 7, see `ccwsim.engine.stages.path`.
    shape : pair of int
        Rows and columns in path coordinates.
    offset : pair of int
        Rows and columns by which the path begins before the first ones.
    """

    orientation: int
    shape: tuple[int, int]
    offset: tuple[int, int] = (0, 0)

    @property
    def original_shape(self) -> tuple[int, int]:
        """Rows and columns of the grid, or of the image."""
        rows, columns = self.shape
        return (columns, rows) if self.orientation & 4 else (rows, columns)

    def map_to_grid(self, image: NDArray) -> NDArray:
        """Return a copy of a map in path coordinates, in grid coordinates.

        Examples
        --------
        >>> Frame(1, (2, 2)).map_to_grid(np.array([[1, 2], [3, 4]])).tolist()
        [[3, 4], [1, 2]]
        """
        (rows, columns), (y, x) = self.shape, self.offset
        return np.ascontiguousarray(
            from_path(image[y : y + rows, x : x + columns], self.orientation)
        )

    def patch_to_grid(self, patch: NDArray) -> NDArray:
        """Return a part of a map, in the orientation of the grid."""
        return np.ascontiguousarray(from_path(patch, self.orientation))

    def box_to_grid(self, y0: int, x0: int, height: int, width: int) -> Rectangle:
        """Return a box in grid coordinates, cut to the image.

        Examples
        --------
        >>> Frame(4, (10, 20)).box_to_grid(0, 5, 2, 3)
        Rectangle(row=5, column=0, height=3, width=2)
        """
        (rows, columns), (y, x) = self.shape, self.offset
        last_y, last_x = min(y0 - y + height, rows), min(x0 - x + width, columns)
        y0, x0 = max(y0 - y, 0), max(x0 - x, 0)
        y0, height = (rows - last_y if self.orientation & 1 else y0), last_y - y0
        x0, width = (columns - last_x if self.orientation & 2 else x0), last_x - x0
        sides = (x0, y0, width, height) if self.orientation & 4 else (y0, x0, height, width)
        return Rectangle(*sides)

    def cell_to_path(self, row: int, column: int) -> tuple[int, int]:
        """Return the path coordinates of a cell of the grid."""
        cells = cells_to_path(np.array([[row, column]]), self.original_shape, self.orientation)
        return int(cells[0, 0]) + self.offset[0], int(cells[0, 1]) + self.offset[1]

    @property
    def origin(self) -> str:
        """The corner in which the path begins."""
        far_y, far_x = self.orientation & 1, self.orientation >> 1 & 1
        return CORNERS[(far_x, far_y) if self.orientation & 4 else (far_y, far_x)]

    @property
    def direction(self) -> str:
        """The direction of the path along its rows.

        Examples
        --------
        >>> Frame(0, (9, 9)).origin, Frame(0, (9, 9)).direction, Frame(6, (9, 9)).direction
        ('south-west', 'east', 'south')
        """
        back = bool(self.orientation & 2)
        if self.orientation & 4:
            return "south" if back else "north"
        return "west" if back else "east"
