"""Hard data: cells with a known facies."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.model.arrays import (
    ReadOnly,
    as_array,
    as_floats,
    as_integers,
    digest,
    frozen,
    is_table,
)
from ccwsim.model.backends import notebook, reader
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.extras import is_installed
from ccwsim.model.grid import Grid, describe_cell
from ccwsim.model.missing import known_values
from ccwsim.model.training_image import TrainingImage

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


class HardData(ReadOnly):
    """Cells with a known facies, one datum for each cell.

    Arrays are read-only int64, sorted by layer, row, then column, without duplicates. Empty data,
    of shape (0, 2) or (0, 3), suit maps and volumes. Data are equal if their cells and facies are
    equal. Raises `CCWSIMError` for a wrong shape, for values that are not integers, and for two
    facies in one cell; the message lists such data.

    Parameters
    ----------
    cells : array_like, shape (n, 2) or (n, 3)
        Row (from the south) and column of each datum; in a volume, the layer (from the bottom)
        comes first.
    facies : array_like, shape (n,)
        Facies code of each datum.

    Examples
    --------
    >>> data = HardData([[3, 4], [0, 2]], [1, 0])
    >>> data.n, data.cells.tolist()
    (2, [[0, 2], [3, 4]])
    """

    def __init__(self, cells: ArrayLike = (), facies: ArrayLike = ()) -> None:
        places = as_array(cells, "cells of hard data")
        codes = as_array(facies, "facies of hard data")
        none = np.empty((0, 3 if places.shape == (0, 3) else 2))
        places = as_integers(places, "cells of hard data") if places.size else none
        codes = as_integers(codes, "facies of hard data") if codes.size else np.empty(0)
        if places.ndim != 2 or places.shape[1] not in (2, 3) or codes.shape != (len(places),):
            raise refused("cells_and_facies", cells=np.shape(cells), facies=np.shape(facies))
        unique = np.unique(np.column_stack([places, codes]).astype(np.int64), axis=0)
        clashing = np.flatnonzero((np.diff(unique[:, :-1], axis=0) == 0).all(axis=1))
        if len(clashing):
            raise CCWSIMError(_clash(places, codes, unique[clashing[0], :-1]))
        self.cells = frozen(unique[:, :-1])
        self.facies = frozen(unique[:, -1])

    @classmethod
    def of(
        cls, data: Any, grid: Grid | Sequence[int], training_image: TrainingImage | None = None
    ) -> HardData:
        """Return hard data unchanged, or make hard data from another object.

        Raises `CCWSIMError` for unsuitable objects, unknown names, and invalid data (`HardData`).

        Parameters
        ----------
        data : HardData, None, pair, table or array_like
            A pair is (cells, facies), the arguments of `HardData`. A table (a DataFrame, a dict of
            columns or a structured array) is read like a file, so its columns may have any usual
            names, such as Easting, Northing and lithology; assumptions are warnings.
            `ccwsim.read_hard_data` has options for other names. An array has the shape of the grid
            and contains facies codes. Cells without data are NaN, masked or −1, or have a customary
            code for missing values such as −9999, except for codes that are facies of the training
            image.
        grid : Grid, pair or triple of int
            Grid of the data, or its (layers,) rows and columns.
        training_image : TrainingImage, optional
            Training image whose facies names, in upper or lower case, may replace codes.

        Examples
        --------
        >>> grid = Grid(2, 3, cell_size=(10.0, 10.0))
        >>> HardData.of([[np.nan, 1, np.nan], [np.nan, np.nan, 0]], grid).triples
        ((0, 1, 1), (1, 2, 0))
        >>> image = TrainingImage([[0, 1]], facies_names=("mud", "sand"))
        >>> HardData.of(([[1, 2]], ["Sand"]), grid, image).triples
        ((1, 2, 1),)
        """
        if isinstance(data, HardData):
            return data
        if data is None:
            return cls()
        if isinstance(data, (str, PathLike)):
            raise refused("data_are_a_name", said=shown(str(data)))
        grid = Grid.of(grid)
        if is_table(data):
            report = reader().import_hard_data(data, grid, training_image)
            for note in report.notes:  # assumptions about columns, and rows that are left out
                warnings.warn(f"hard data: {note}", stacklevel=2)
            return report.hard_data
        if isinstance(data, tuple) and len(data) == 2:
            return cls(data[0], _codes(data[1], training_image))
        if isinstance(data, np.ma.MaskedArray):
            data = np.ma.filled(data.astype(float), np.nan)
        values = as_floats(data, "hard data")
        if values.shape != grid.shape:
            world = "x, y" if grid.nz is None else "x, y, z"
            raise refused("data_not_of_grid", shape=values.shape, grid=grid.shape, world=world)
        has_datum = known_values(values, stated=[-1.0])
        if training_image is not None:
            has_datum |= np.isin(values, training_image.codes)
        cells = np.argwhere(has_datum)
        return cls(cells, values[tuple(cells.T)])

    @property
    def n(self) -> int:
        """Number of data."""
        return len(self.facies)

    @property
    def n_dimensions(self) -> int:
        """Number of dimensions: 2 for a map, 3 for a volume; empty data suit both."""
        return self.cells.shape[1]

    @cached_property
    def digest(self) -> str:
        """Hash of the content, equal for equal data in any order."""
        return digest(self.cells if self.n else np.empty((0, 2), np.int64), self.facies)

    @cached_property
    def triples(self) -> tuple[tuple[int, ...], ...]:
        """Data as tuples ((layer,) row, column, facies), for comparisons."""
        return tuple(map(tuple, np.column_stack([self.cells, self.facies]).tolist()))

    def check(self, grid: Grid, training_image: TrainingImage | None = None) -> None:
        """Raise `CCWSIMError` for data outside the grid, wrong dimensions or unknown facies."""
        if self.n and self.n_dimensions != grid.n_dimensions:
            raise CCWSIMError(
                "hard data have rows and columns only, but the grid is a volume of "
                f"{grid.nz} layers: give layer, row and column of each datum"
                if grid.nz is not None
                else "hard data have layers, rows and columns, but the grid is a map: give the "
                "grid nz, or give only row and column of data in one layer"
            )
        outside = np.flatnonzero(~grid.holds(self.cells)) if self.n else np.empty(0, int)
        if len(outside):
            layers = "" if grid.nz is None else f"{grid.nz} layers, "
            raise CCWSIMError(
                f"{len(outside)} of {self.n} hard data lie outside the grid of {layers}{grid.ny} "
                f"rows and {grid.nx} columns: {_examples(self, outside)}; drop them or enlarge the "
                "grid"
            )
        if training_image is None:
            return
        unknown = np.flatnonzero(~np.isin(self.facies, training_image.codes))
        if len(unknown):
            codes = ", ".join(map(str, training_image.codes))
            raise CCWSIMError(
                f"{len(unknown)} of {self.n} hard data have a facies that the training image does "
                f"not have (its facies are {codes}): {_examples(self, unknown)}; recode or drop "
                "them"
            )

    def n_mismatched(self, realization: NDArray[np.integer]) -> int:
        """Return the number of data that a realization (facies codes) does not honour."""
        if not self.n:
            return 0
        return int(np.count_nonzero(realization[tuple(self.cells.T)] != self.facies))

    def plot(self) -> Figure:
        """Return a plotly Figure with the data as points at their columns and rows."""
        return notebook().data_chart(self)

    def _repr_html_(self) -> str | None:
        return notebook().data_html(self) if is_installed("plotly") else None

    def __eq__(self, other: object) -> bool:
        return self.digest == other.digest if isinstance(other, HardData) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        return f"HardData(n={self.n})"


def _codes(facies: Any, training_image: TrainingImage | None) -> Any:
    """Return facies codes; names of facies are replaced by codes."""
    values = facies.tolist() if isinstance(facies, np.ndarray) else facies
    if not isinstance(values, (list, tuple)) or not any(isinstance(v, str) for v in values):
        return facies
    code_of: dict[str, int] = {}
    if training_image is not None:
        names = (name.casefold() for name in training_image.facies_names)
        code_of = dict(zip(names, training_image.codes.tolist(), strict=True))
    codes = [code_of.get(v.strip().casefold()) if isinstance(v, str) else v for v in values]
    unknown = [v for v, code in zip(values, codes, strict=True) if code is None]
    if unknown:
        names = training_image.facies_names if training_image is not None else ("none",)
        raise refused("unknown_facies_name", unknown=shown(unknown[0]), there=", ".join(names))
    return codes


def _examples(data: HardData, which: NDArray[np.integer]) -> str:
    """Return the first three data of `which` as text."""
    examples = [
        f"{describe_cell(cell)}, facies {code}"
        for cell, code in zip(data.cells[which[:3]], data.facies[which[:3]], strict=True)
    ]
    return "; ".join(examples) + (" …" if len(which) > 3 else "")


def _clash(places: NDArray, codes: NDArray, cell: NDArray) -> str:
    numbers = np.flatnonzero((places == cell).all(axis=1))
    clashing = ", ".join(f"no. {k + 1} says {codes[k]}" for k in numbers[:6])
    where = describe_cell(cell)
    return f"hard data: two facies in the cell at {where} ({clashing}); keep one datum"
