"""Local re-simulation window by window: what was around a missed datum before and after."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.stages.conditioning import data_grid
from ccwsim.engine.stages.resimulation import Target, first_cell, resimulate
from ccwsim.model.study import Study


class ResimulatedWindow(NamedTuple):
    """A window around a datum, in grid coordinates; a single cell where it was forced.

    Attributes
    ----------
    datum : int
        Its number in the hard data.
    size, row, column : int
        Side, and first cell.
    before, after : ndarray of uint8, shape (size, size)
    sources : ndarray of int32, shape (size, size)
        Flat index in the training image of each cell after it, −1 where it was forced.
    fits : bool
        Whether a patch was found that honours all data and fits; else nothing changed.
    isolated : bool
        Whether the datum was right already but isolated.
    """

    datum: int
    size: int
    row: int
    column: int
    before: NDArray[np.uint8]
    after: NDArray[np.uint8]
    sources: NDArray[np.int32]
    fits: bool
    isolated: bool


def resimulated_windows(
    study: Study,
    template: int,
    image: PreparedImage,
    rng: np.random.Generator,
    grid: NDArray[np.uint8],
    sources: NDArray[np.int32],
) -> tuple[list[ResimulatedWindow], NDArray[np.int16]]:
    """Re-simulate `grid` locally, in place; return every window that was tried and the data status.

    Windows around data that another window had honoured already are left out.
    """
    cells = study.hard_data.cells
    data = data_grid(cells, study.facies_of_data, grid.shape)
    last = grid.copy()
    windows: list[ResimulatedWindow] = []

    def note(datum: int, size: int, fits: bool) -> None:
        y, x = cells[datum]
        row = first_cell(y, size, grid.shape[0])
        column = first_cell(x, size, grid.shape[1])
        part = np.s_[row : row + size, column : column + size]
        before, after, right = last[part].copy(), grid[part].copy(), last[y, x] == data[y, x]
        last[part] = after
        if right and (before == after).all():
            return
        came_from = sources[part].copy()
        windows.append(
            ResimulatedWindow(
                datum, size, int(row), int(column), before, after, came_from, fits, bool(right)
            )
        )

    thresholds = image.isolated_datum_thresholds if study.hard_data.n else None
    target = Target(image.scaled(), image.bits(), data, grid, sources)
    data_status = resimulate(target, cells, template, rng, thresholds, on_window=note)
    return windows, data_status
