"""A first look at a file, so that a user can be asked what it leaves open."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile
from ccwsim.io.formats.classes import are_codes
from ccwsim.io.formats.colours import MAX_COLOURS, distinct_colours, grey_of
from ccwsim.io.formats.pictures import Picture
from ccwsim.io.opening import open_file
from ccwsim.io.source import PathOrFile

MOST = 1000
"""Different values are counted up to here."""


@dataclass(frozen=True)
class VariableSummary:
    """One variable of a file.

    Attributes
    ----------
    name : str
        Its name in the file.
    shape : tuple of int
        (nz, ny, nx) of a grid, (n,) of a column.
    n_known : int
        Cells or rows with a value.
    n_distinct : int
        Different values, counted up to `MOST`.
    minimum, maximum : float
        NaN where nothing is known.
    continuous : bool
        Whether it needs classes or a threshold to become facies.
    """

    name: str
    shape: tuple[int, ...]
    n_known: int
    n_distinct: int
    minimum: float
    maximum: float
    continuous: bool


@dataclass(frozen=True)
class FileSummary:
    """What a file holds and what it leaves open.

    Attributes
    ----------
    kind : str
        The format, in words.
    name : str
        The file's name.
    variables : tuple of VariableSummary
        One of the name "grey" for a picture; `continuous` then means too many colours.
    is_table : bool
        Whether it is a table: points, or a grid that needs `shape`.
    is_picture : bool
        Whether facies come from colours.
    asks_up : bool
        Whether the format leaves open which end is the north.
    cell_size, origin : pair of float, optional
        Where the file says them.
    """

    kind: str
    name: str
    variables: tuple[VariableSummary, ...]
    is_table: bool
    is_picture: bool
    asks_up: bool
    cell_size: tuple[float, float] | None
    origin: tuple[float, float] | None

    @property
    def asks_shape(self) -> bool:
        """Whether a training image can be read only with `shape`."""
        return self.is_table

    @property
    def n_slices(self) -> int:
        """How many slices there are to choose from; 1 for tables and vertical sections."""
        sizes = [v.shape for v in self.variables if len(v.shape) == 3 and 1 not in v.shape[1:]]
        return max((size[0] for size in sizes), default=1)


def inspect(path_or_file: PathOrFile) -> FileSummary:
    """Return what a file holds: its kind, variables, sizes, and whether they look continuous.

    Raises
    ------
    CCWSIMError
        For a file that cannot be read.

    Examples
    --------
    >>> from io import BytesIO
    >>> summary = inspect(BytesIO(b"2 1 1\\n1\\nporosity\\n0.25\\n-999\\n"))
    >>> summary.kind, summary.variables[0].n_known, summary.variables[0].continuous
    ('SGeMS/GSLIB grid', 1, True)
    """
    file = open_file(path_or_file)
    if isinstance(file, Picture):
        return _of_picture(file)
    variables = tuple(_variable(file, key) for key in file.variables)
    return FileSummary(
        file.kind, file.name, variables, file.is_table, False, file.asks_up, file.cell_size,
        file.origin,
    )  # fmt: skip


def _of_picture(picture: Picture) -> FileSummary:
    colours, _ = distinct_colours(picture.rgb)
    n = len(colours)
    grey = grey_of(colours)
    ny, nx, _ = picture.rgb.shape
    variable = VariableSummary(
        "grey",
        (1, ny, nx),
        ny * nx,
        min(n, MOST),
        float(grey.min()),
        float(grey.max()),
        n > MAX_COLOURS and not picture.says_codes,
    )
    return FileSummary("picture", picture.name, (variable,), False, True, False, None, None)


def _variable(file: DataFile, key: str) -> VariableSummary:
    values = file.variables[key]
    known = values[file.known(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (np.nan, np.nan)
    return VariableSummary(
        key, values.shape, known.size, _n_distinct(known), low, high,
        known.size > 0 and not are_codes(known),
    )  # fmt: skip


def _n_distinct(values: NDArray) -> int:
    seen = values[:0]
    for start in range(0, values.size, 2**20):
        seen = np.union1d(seen, values[start : start + 2**20])
        if len(seen) >= MOST:
            return MOST
    return len(seen)
