"""Hard data from files, in one call."""

from __future__ import annotations

from typing import Any

from ccwsim.io.formats.classes import Classes
from ccwsim.io.hard_data.placing import place_points
from ccwsim.io.hard_data.points import read_points
from ccwsim.io.hard_data.resolving import HardDataImport, resolve_points
from ccwsim.io.source import PathOrFile
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage


def import_hard_data(
    path_or_file: PathOrFile,
    grid: Grid | None = None,
    training_image: TrainingImage | None = None,
    *,
    variable: str | None = None,
    coordinates: str | None = None,
    up: bool | None = None,
    slice_index: int | None = None,
    threshold: float | None = None,
    classes: Classes = None,
    on_collision: str = "error",
    on_outside: str = "error",
    on_unknown: str = "error",
) -> HardDataImport:
    """Return the hard data of a file and a report of what happened on the way.

    Parameters
    ----------
    path_or_file, variable, coordinates, up, slice_index
        As in `read_points`.
    grid, training_image, threshold, classes
        As in `place_points`.
    on_collision, on_outside, on_unknown
        As in `resolve_points`.

    Raises
    ------
    CCWSIMError
        For a file that cannot be read, or troubles that are not settled.

    Examples
    --------
    >>> from io import BytesIO
    >>> file = BytesIO(b"row,col,facies\\n3,4,1\\n9,4,1\\n")
    >>> import_hard_data(file, Grid(8, 8), on_outside="drop").notes
    ('1 of 2 data lie outside the grid and were left out (line 3).',)
    """
    shape = grid.shape if grid is not None else None
    points = read_points(
        path_or_file, grid_shape=shape, variable=variable, coordinates=coordinates, up=up,
        slice_index=slice_index,
    )  # fmt: skip
    placed = place_points(points, grid, training_image, threshold=threshold, classes=classes)
    return resolve_points(
        placed, on_collision=on_collision, on_outside=on_outside, on_unknown=on_unknown
    )


def read_hard_data(
    path_or_file: PathOrFile,
    grid: Grid | None = None,
    training_image: TrainingImage | None = None,
    **choices: Any,
) -> HardData:
    """Return the hard data of a file; `import_hard_data` also says what happened on the way.

    Parameters
    ----------
    path_or_file, grid, training_image, **choices
        As in `import_hard_data`.

    Raises
    ------
    CCWSIMError
        For a file that cannot be read, or troubles that are not settled.

    Examples
    --------
    >>> from io import BytesIO
    >>> read_hard_data(BytesIO(b"x;y;facies\\n10,5;2,5;1\\n"), Grid(8, 16)).cells
    array([[ 2, 10]])
    """
    return import_hard_data(path_or_file, grid, training_image, **choices).hard_data
