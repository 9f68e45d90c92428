"""Imported points in the cells of a grid, and what is wrong with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.formats.classes import Classes, asks_for_codes, classify
from ccwsim.io.hard_data.collisions import colliding
from ccwsim.io.hard_data.points import ImportedPoints
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.training_image import TrainingImage

_FAR = 2.0**40


@dataclass(frozen=True, eq=False)
class PlacedPoints:
    """Imported points in cells of a grid, with what is wrong with them.

    Attributes
    ----------
    points : ImportedPoints
        What was placed.
    cells : ndarray of int64, shape (n, 2)
        Row and column of each point, also outside the grid.
    facies : ndarray of int64, shape (n,)
        The facies code of each.
    offsets : ndarray of float64, shape (n,)
        How far each lies from the centre of its cell, in cells.
    outside, unknown : ndarray of int64
        Which points lie outside the grid, and which (of the others) have a facies that the
        training image does not have.
    collisions : tuple of ndarray of int64
        For each cell (inside, known facies) with two or more facies, which points are in it.
    """

    points: ImportedPoints
    cells: NDArray[np.int64]
    facies: NDArray[np.int64]
    offsets: NDArray[np.float64]
    outside: NDArray[np.int64]
    unknown: NDArray[np.int64]
    collisions: tuple[NDArray[np.int64], ...]

    @property
    def n_off_centre(self) -> int:
        """How many points were moved to the centre of their cell."""
        return int(np.count_nonzero(self.offsets > 1e-6))


def place_points(
    points: ImportedPoints,
    grid: Grid | None = None,
    training_image: TrainingImage | None = None,
    *,
    threshold: float | None = None,
    classes: Classes = None,
) -> PlacedPoints:
    """Put imported points into the cells of a grid and find what is wrong with them.

    Parameters
    ----------
    points : ImportedPoints
        From `read_points`.
    grid : Grid, optional
        Without one, cells are of size 1 from the origin (0, 0), and only negative ones are outside.
    training_image : TrainingImage, optional
        Says which facies there are.
    threshold, classes : optional
        For continuous values, as in `classify`; classes as edges, those of the training image.

    Raises
    ------
    CCWSIMError
        For rows and columns that are no whole numbers, or values that are no facies codes.

    Examples
    --------
    >>> from io import BytesIO
    >>> from ccwsim.io import read_points
    >>> points = read_points(BytesIO(b"x,y,facies\\n5.2,0.5,1\\n5.9,0.4,0\\n"))
    >>> placed = place_points(points, Grid(4, 8))
    >>> placed.cells.tolist(), [c.tolist() for c in placed.collisions]
    ([[0, 5], [0, 5]], [[0, 1]])
    """
    if isinstance(classes, (int, np.integer)):
        raise CCWSIMError(
            f"classes = {shown(classes)} means equally many of what is classed, and hard data must "
            "be classed as the training image is: give its class edges"
        )
    cells, offsets = _cells(points, grid)
    facies = _facies(points, threshold, classes)
    inside = grid.holds(cells) if grid is not None else (cells >= 0).all(axis=1)
    known = np.ones(points.n, bool)
    if training_image is not None:
        known = np.isin(facies, training_image.codes)
    return PlacedPoints(
        points, cells, facies, offsets, np.flatnonzero(~inside), np.flatnonzero(inside & ~known),
        colliding(cells, facies, np.flatnonzero(inside & known)),
    )  # fmt: skip


def _cells(
    points: ImportedPoints, grid: Grid | None
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Cells of the points, and how far they lie from the centres, in cells."""
    if not points.world:
        cells = np.rint(points.places)
        broken = np.abs(points.places - cells).max(axis=1, initial=0) > 1e-3
        broken |= np.abs(cells).max(axis=1, initial=0) > _FAR
        if broken.any():
            raise CCWSIMError(
                f"{points.name}, {points.named(np.flatnonzero(broken))}: rows and columns must be "
                "whole numbers; for world coordinates name the columns x and y"
            )
        return cells.astype(np.int64), np.zeros(points.n)
    frame = grid or Grid(1, 1, origin=(0.0, 0.0))
    in_cells = (points.places - frame.origin) / frame.cell_size
    far = np.abs(in_cells).max(axis=1, initial=0) > _FAR
    if far.any():
        raise CCWSIMError(
            f"{points.name}, {points.named(np.flatnonzero(far))}: the coordinates are absurdly far "
            "from the grid; correct them"
        )
    floors = np.floor(in_cells[:, ::-1]).astype(np.int64)
    cells = grid.cells_of(*points.places.T) if grid else floors
    return cells, np.linalg.norm(in_cells[:, ::-1] - cells - 0.5, axis=1)


def _facies(points: ImportedPoints, threshold: float | None, classes: Classes) -> NDArray[np.int64]:
    if not points.n:
        return np.empty(0, np.int64)
    if threshold is None and asks_for_codes(classes):
        off = np.abs(points.values - np.rint(points.values)) > 1e-3
        if off.any():
            bad = np.flatnonzero(off)
            raise CCWSIMError(
                f"{points.name}, {points.named(bad)}: {points.values[bad[0]]:g} is no facies code; "
                "for a continuous variable give the threshold or class edges of the training image"
            )
        classes = "codes"
    return classify(points.values, threshold=threshold, classes=classes, what=points.name)
