"""Hard data: cells with a known facies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ccwsim.model.arrays import (
    Array,
    Integers,
    ReadOnly,
    as_array,
    as_floats,
    as_integers,
    digest,
    frozen,
    is_table,
)
from ccwsim.model.backends import notebook, reader
from ccwsim.model.errors import CCWSIMError, refused, shown, warn
from ccwsim.model.extras import is_installed
from ccwsim.model.facies_match import FaciesNames, facies_label, match_facies
from ccwsim.model.grid import Grid, describe_cell
from ccwsim.model.missing import known_values
from ccwsim.model.training_image import TrainingImage

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


class HardData(ReadOnly):
    """Cells with a known facies, one datum for each cell.

    Arrays are read-only int64, sorted by layer, row, then column, without duplicates. Empty data,
    of shape (0, 2) or (0, 3), suit maps and volumes. Data are equal if their cells, and facies or
    values, are equal. Raises `CCWSIMError` for a wrong shape, for values that are not integers, and
    for two facies in one cell; the message lists such data.

    Parameters
    ----------
    cells : array_like, shape (n, 2) or (n, 3)
        Row (from the south) and column of each datum; in a volume, the layer (from the bottom)
        comes first.
    facies : array_like, shape (n,)
        Facies code of each datum.
    values : mapping of str to array_like, optional
        Measured value of each datum by the name of a continuous variable, NaN where it was not
        measured. `facies` are then classes, which a `Study` sets.

    Examples
    --------
    >>> data = HardData([[3, 4], [0, 2]], [1, 0])
    >>> data.n, data.cells.tolist()
    (2, [[0, 2], [3, 4]])
    >>> HardData([[3, 4], [0, 2]], values={"porosity": [0.25, 0.1]}).values
    {'porosity': array([0.1 , 0.25])}
    """

    def __init__(
        self,
        cells: ArrayLike = (),
        facies: ArrayLike = (),
        *,
        values: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        places = as_array(cells, "cells of hard data")
        measured = {key: as_floats(each, key) for key, each in (values or {}).items()}
        if measured and not np.size(facies):
            facies = np.zeros(len(places), np.int64)
        codes = as_array(facies, "facies of hard data")
        none = np.empty((0, 3 if places.shape == (0, 3) else 2))
        places = as_integers(places, "cells of hard data") if places.size else none
        codes = as_integers(codes, "facies of hard data") if codes.size else np.empty(0)
        if places.ndim != 2 or places.shape[1] not in (2, 3) or codes.shape != (len(places),):
            raise refused("cells_and_facies", cells=np.shape(cells), facies=np.shape(facies))
        if wrong := [key for key, each in measured.items() if each.shape != codes.shape]:
            raise refused("values_of_data", name=wrong[0], n=len(places))
        table = np.column_stack([places, codes]).astype(np.int64)
        unique = np.unique(np.column_stack([table, *measured.values()]), axis=0)
        clashing = np.flatnonzero((np.diff(unique[:, : places.shape[1]], axis=0) == 0).all(axis=1))
        if len(clashing):
            said = next(iter(measured.values()), codes)
            raise CCWSIMError(_clash(places, said, unique[clashing[0], : places.shape[1]]))
        *of_cells, of_facies = unique[:, : table.shape[1]].T.astype(np.int64)
        self.cells = frozen(np.column_stack(of_cells))
        self.facies = frozen(of_facies)
        columns = unique[:, table.shape[1] :].T
        self.values = {key: frozen(each) for key, each in zip(measured, columns, strict=True)}
        self.numbering = "codes"  # or `TrainingImage.numbering_of_data`

    @classmethod
    def of(
        cls,
        data: Any,
        grid: Grid | Sequence[int],
        training_image: TrainingImage | None = None,
        facies: FaciesNames | None = None,
    ) -> HardData:
        """Return hard data with facies of a training image, from hard data or another object.

        A warning names facies that are matched by number although the image has no codes of its
        own. Raises `CCWSIMError` for unsuitable objects, unknown names, and invalid data
        (`HardData`).

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
        facies : mapping or pairs, optional
            Facies of the training image, by code or name, for codes or names in the data.

        Examples
        --------
        >>> grid = Grid(2, 3, cell_size=(10.0, 10.0))
        >>> HardData.of([[np.nan, 1, np.nan], [np.nan, np.nan, 0]], grid).triples
        ((0, 1, 1), (1, 2, 0))
        >>> image = TrainingImage([[0, 1]], facies_names=("mud", "sand"))
        >>> HardData.of(([[1, 2]], ["Sand"]), grid, image).triples
        ((1, 2, 1),)
        """
        continuous = training_image is not None and bool(training_image.values)
        if isinstance(data, HardData):
            if data.values or continuous:
                return data if training_image is None else data.of_image(training_image)
            return _with_facies(data.cells, data.facies, training_image, facies, data.numbering)
        if data is None:
            return cls()
        if isinstance(data, (str, PathLike)):
            raise refused("data_are_a_name", said=shown(str(data)))
        grid = Grid.of(grid)
        if is_table(data):
            report = reader().import_hard_data(data, grid, training_image, facies_names=facies)
            for note in report.notes:  # assumptions about columns, and rows that are left out
                warn(f"hard data: {note}")
            return report.hard_data
        if isinstance(data, tuple) and len(data) == 2:
            return _with_facies(*data, training_image, facies)
        if isinstance(data, np.ma.MaskedArray):
            data = np.ma.filled(data.astype(float), np.nan)
        values = as_floats(data, "hard data")
        if values.shape != grid.shape:
            world = "x, y, z" if grid.is_volume else "x, y"
            raise refused("data_not_of_grid", shape=values.shape, grid=grid.shape, world=world)
        has_datum = known_values(values, stated=() if continuous else [-1.0])
        if training_image is not None and not continuous:
            has_datum |= np.isin(values, training_image.codes)
        cells = np.argwhere(has_datum)
        return _with_facies(cells, values[has_datum], training_image, facies)

    @classmethod
    def measured_as(cls, image: TrainingImage, cells: ArrayLike, measured: ArrayLike) -> HardData:
        """Return data of an image: values of its continuous variable, or else facies codes."""
        if image.values:
            return cls(cells, values={image.variable: measured}).of_image(image)
        return cls(cells, measured)

    def of_image(self, image: TrainingImage) -> HardData:
        """Return data with the classes of an image of a continuous variable.

        Cells in which its variable was not measured are left out. Raises `CCWSIMError` if data have
        no values and the image has, or the reverse.
        """
        if self.n and [*self.values] != [*image.values]:
            has, needs = (", ".join(each.values) or "facies" for each in (self, image))
            raise refused("variables_of_data", has=has, needs=needs)
        if not self.n or not image.values:
            return self
        data = self.part(np.isfinite(self.values[image.variable]))
        classes = image.codes[image.class_indices(data.values[image.variable])]
        return HardData(data.cells, classes, values=data.values)

    def part(self, which: Any, cells: ArrayLike | None = None) -> HardData:
        """Return some of the data, by mask or indices; `cells` replaces their cells."""
        values = {key: each[which] for key, each in self.values.items()}
        data = HardData(
            self.cells[which] if cells is None else cells, self.facies[which], values=values
        )
        data.numbering = self.numbering
        return data

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
        if not self.n:
            return digest(np.empty((0, 2), np.int64), self.facies)
        return digest(self.cells, self.measured, *self.values)  # facies of values are classes

    @property
    def measured(self) -> Array:
        """Value of each datum or, without values, its facies, shape (n,)."""
        return next(iter(self.values.values()), self.facies)

    @cached_property
    def triples(self) -> tuple[tuple[float, ...], ...]:
        """Data as tuples ((layer,) row, column, facies or value), for comparisons."""
        pairs = zip(self.cells.tolist(), self.measured.tolist(), strict=True)
        return tuple((*cell, measured) for cell, measured in pairs)

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

    def n_mismatched(self, realization: Integers) -> int:
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


def _with_facies(
    cells: ArrayLike,
    facies: Any,
    image: TrainingImage | None,
    stated: FaciesNames | None,
    numbering: str = "codes",
) -> HardData:
    """Return hard data with the codes of an image, by facies or values; other codes are kept."""
    if image is not None and image.values:
        return HardData.measured_as(image, cells, facies)
    values = facies.tolist() if isinstance(facies, np.ndarray) else facies
    if not isinstance(values, (list, tuple)) or not any(isinstance(v, str) for v in values):
        data = HardData(cells, facies)
        if image is None or (stated is None and numbering == image.numbering_of_data):
            return data
        cells, values = data.cells, data.facies.tolist()
    counts = Counter(map(facies_label, values))
    shares = np.array([*counts.values()]) / max(len(values), 1)
    match = image and match_facies(
        counts, image, numbering=numbering, facies=stated, shares=shares.tolist()
    )
    codes = [match.codes[facies_label(value)] if match else value for value in values]
    if unknown := [code for code in codes if isinstance(code, str)]:
        there = ", ".join(image.facies_names) if image else "none"
        raise refused("unknown_facies_name", unknown=shown(unknown[0]), there=there)
    data = HardData(cells, codes)
    if match:
        match.warn("hard data")
        data.numbering = match.image.numbering_of_data
    return data


def _examples(data: HardData, which: Integers) -> str:
    """Return the first three data of `which` as text."""
    examples = [
        f"{describe_cell(cell)}, facies {code}"
        for cell, code in zip(data.cells[which[:3]], data.facies[which[:3]], strict=True)
    ]
    return "; ".join(examples) + (" …" if len(which) > 3 else "")


def _clash(places: Array, codes: Array, cell: Array) -> str:
    numbers = np.flatnonzero((places == cell).all(axis=1))
    clashing = ", ".join(f"no. {k + 1} says {codes[k]}" for k in numbers[:6])
    where = describe_cell(cell)
    return f"hard data: two facies in the cell at {where} ({clashing}); keep one datum"
