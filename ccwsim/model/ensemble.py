"""The result of a simulation: realizations, and the inputs that reproduce them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import DTypeLike

from ccwsim.model.arrays import (
    WORLD_AXES,
    Array,
    Bytes,
    Floats,
    Int16s,
    Int32s,
    Integers,
    Ints,
    LazyStack,
    Mask,
    check_number,
    describe_shape,
    digest,
    is_integer,
    listing,
    readonly,
    refuse_array,
)
from ccwsim.model.backends import notebook
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.extras import is_installed, needs
from ccwsim.model.facies_property import FaciesProperty, FaciesValues, values_by_facies
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.missing import UNKNOWN
from ccwsim.model.numbers import plural
from ccwsim.model.parameters import Parameters
from ccwsim.model.secondary import Secondary
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage, above

if TYPE_CHECKING:
    from plotly.graph_objects import Figure
    from xarray import DataArray

FORCED = -1
"""Value of `Ensemble.data_status` for a datum whose cell was forced because no window fitted."""
WRONG = -2  # value of `Ensemble.data_status` for a datum not honoured because `exact_data` is off


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Equally likely realizations of one study; all arrays are read-only."""

    study: Study
    """The inputs of the simulation."""
    indices: Bytes
    """Indices of the facies in `training_image.codes`, shape (n, ny, nx) or (n, nz, ny, nx); 255 in
    inactive cells. Realizations that `simulate` wrote to disk are read on access."""
    cpu_seconds: Floats
    """CPU time of each realization in seconds, shape (n,)."""
    wall_seconds: float
    """Elapsed time of the simulation in seconds."""
    data_status: Int16s
    """Status of each datum in each realization, shape (n, n_data): 0 if honoured in the raster
    pass; side of the window in cells if honoured by local re-simulation; FORCED (−1) if its cell
    was forced; WRONG (−2) if not honoured."""
    numbers: Ints
    """Number that identifies each realization in the study, shape (n,)."""
    sources: Int32s | None = None
    """Flat index of each cell's source in the training image, shape of `indices`; −1 for cells that
    were forced or set by seam repair. The numbers of cells of further images follow those of the
    training image. None if `simulate` was called without `keep_sources`."""
    revised: bool = False
    """Whether `revise` adapted the ensemble to edited data; the seed then cannot reproduce it."""
    values: dict[str, Floats] = field(default_factory=dict)
    """Values of the continuous variable of the training image, by its name, in the shape of
    `indices`, which have their classes; NaN in inactive cells. At hard data they equal the data.
    Without hard data they are those of the image at `sources`. Empty for facies."""

    def __post_init__(self) -> None:
        for name in ("indices", "cpu_seconds", "data_status", "numbers", "sources"):
            if isinstance(array := getattr(self, name), np.ndarray):
                object.__setattr__(self, name, readonly(array))
        values = {name: readonly(array) for name, array in self.values.items()}
        object.__setattr__(self, "values", values)

    @property
    def training_image(self) -> TrainingImage:
        """The training image of the study."""
        return self.study.training_image

    @property
    def grid(self) -> Grid:
        """The grid of the study."""
        return self.study.grid

    @property
    def parameters(self) -> Parameters:
        """The parameters of the study."""
        return self.study.parameters

    @property
    def hard_data(self) -> HardData:
        """The hard data of the study in active cells."""
        return self.study.hard_data

    @property
    def seed(self) -> int:
        """The seed of the study."""
        return self.study.seed

    @property
    def secondary(self) -> Secondary | None:
        """The secondary information of the study, as arrays of the grid."""
        return self.study.secondary

    @property
    def n(self) -> int:
        """Number of realizations."""
        return len(self.indices)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of `realizations`: (n, ny, nx) or, for volumes, (n, nz, ny, nx)."""
        return self.indices.shape

    def __len__(self) -> int:
        return self.n

    def __iter__(self) -> Iterator[Integers]:
        return iter(self.realizations)

    @overload
    def __getitem__(self, which: int | tuple[Any, ...]) -> Integers: ...
    @overload
    def __getitem__(self, which: slice | list[int] | Array) -> Ensemble: ...
    def __getitem__(self, which: Any) -> Integers | Ensemble:
        """Return one realization, or some of its cells, as codes, or an ensemble of several."""
        if is_integer(which) or isinstance(which, tuple):
            return self.realizations[which]
        numbers = np.arange(self.n)[which]
        return replace(
            self,
            indices=np.asarray(self.indices[numbers]),
            cpu_seconds=self.cpu_seconds[numbers],
            data_status=self.data_status[numbers],
            numbers=self.numbers[numbers],
            sources=None if self.sources is None else self.sources[numbers],
            values={name: array[numbers] for name, array in self.values.items()},
        )

    def __eq__(self, other: object) -> bool:
        refuse_array("ensemble", other)
        return self is other

    __hash__ = object.__hash__

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        return np.array(self.realizations, dtype, copy=copy)

    @cached_property
    def realizations(self) -> Integers:
        """The realizations as facies codes, read-only, in the shape of `indices`.

        With inactive cells, the codes are floating-point numbers, and inactive cells have NaN.
        """
        codes = codes_with_nan(self.training_image.codes, self.active is not None)
        if isinstance(self.indices, LazyStack):
            return self.indices.stack
        if self.active is None and np.array_equal(codes, np.arange(len(codes))):
            return self.indices
        return readonly(codes[self.indices])

    @property
    def active(self) -> Mask | None:
        """The active cells, shape of the grid; None if all cells are active."""
        return self.study.active

    @property
    def n_active(self) -> int:
        """Number of active cells."""
        return int(np.count_nonzero(self.study.active_mask))

    @cached_property
    def n_mismatched(self) -> Ints:
        """Number of hard data that each realization does not honour, shape (n,)."""
        at = (slice(None), *self.hard_data.cells.T)
        if self.values and self.hard_data.values:
            wrong = [v[at] != self.hard_data.values[name] for name, v in self.values.items()]
            return np.count_nonzero(np.any(wrong, axis=0), axis=1)
        return np.array([self.hard_data.n_mismatched(r) for r in self.realizations], dtype=int)

    @property
    def n_resimulated(self) -> Ints:
        """Number of hard data honoured by local re-simulation in each realization, shape (n,)."""
        return np.count_nonzero(self.data_status > 0, axis=1)

    @property
    def n_forced(self) -> Ints:
        """Number of cells forced in each realization because no window fitted, shape (n,)."""
        return np.count_nonzero(self.data_status == FORCED, axis=1)

    @property
    def n_wrong(self) -> Ints:
        """Number of hard data not honoured because `exact_data` is off, shape (n,)."""
        return np.count_nonzero(self.data_status == WRONG, axis=1)

    @property
    def is_stored(self) -> bool:
        """Whether the ensemble was delivered with the program, with unknown CPU times (NaN)."""
        return bool(np.isnan(self.cpu_seconds).any())

    @cached_property
    def proportions(self) -> Floats:
        """Proportion of each facies in each realization, shape (n, n_facies)."""
        facies = range(self.training_image.n_facies)
        counts = [np.count_nonzero(r == k) for r in self.indices for k in facies]
        shares = np.array(counts).reshape(-1, len(facies)) / self.n_active
        return readonly(shares)

    @property
    def is_of_other_images(self) -> bool:
        """Whether patches come from other images than the training image as it was read."""
        return self.study.secondary_or_empty.is_of_other_images

    @property
    def has_probabilities(self) -> bool:
        """Whether probabilities of facies are given."""
        return self.study.secondary_or_empty.probabilities is not None

    @cached_property
    def image_proportions(self) -> Floats:
        """Proportions, shape (n_facies,), of the training image, or of several images.

        Images count by their weights, by the active cells of their zones, or by their cells.
        """
        first, secondary = self.training_image, self.study.secondary_or_empty
        if not secondary.images:
            return first.proportions
        images, zones = (first, *secondary.images), secondary.zones
        counts = [[np.count_nonzero(i.array == code) for code in first.codes] for i in images]
        n_cells, shares = np.array(counts, float), secondary.weights
        if zones is not None:
            inside = zones[self.study.active_mask]
            shares = np.bincount(inside, minlength=len(images)) / inside.size
        if shares is not None:
            n_cells *= np.divide(shares, n_cells.sum(axis=1))[:, None]
        return readonly(n_cells.sum(axis=0) / n_cells.sum())

    @cached_property
    def expected_proportions(self) -> Floats:
        """Proportions, shape (n_facies,), that realizations should have on average.

        These are the means of given probabilities in the active cells, with `image_proportions`
        where no probabilities are given.
        """
        of_image, soft = self.image_proportions, self.study.secondary_or_empty.probabilities
        if soft is None:
            return of_image
        soft = soft[:, self.study.active_mask]
        return readonly(np.where(np.isnan(soft), of_image[:, None], soft).mean(axis=1))

    def probability(self, code: int | str) -> Floats:
        """Return the E-type of a facies: the share of realizations with that facies in each cell.

        The facies is given by code or name; inactive cells have NaN. Raises `CCWSIMError` for an
        unknown facies.
        """
        index = self.training_image.index_of(code)
        counts = np.zeros(self.grid.shape, np.int64)
        for realization in self.indices:  # one at a time because realizations may be on disk
            counts += realization == index
        return np.where(self.study.active_mask, counts / self.n, np.nan)

    def values_of(self, name: str | None = None) -> Floats:
        """Return the values of a variable, by default of the only one, or raise `CCWSIMError`."""
        name = self.training_image.variable if name is None else name
        if name not in self.values:
            there = ", ".join(self.values) or "only facies"
            raise refused("no_values", name=shown(name), there=there)
        return self.values[name]

    def mean(self, name: str | None = None) -> Floats:
        """Return the mean of the values in each cell; inactive cells have NaN.

        Examples
        --------
        >>> from ccwsim import simulate
        >>> hills = np.add.outer(np.sin(np.arange(60) / 5), np.cos(np.arange(80) / 7))
        >>> image = TrainingImage.from_array(hills, continuous=True, variable="elevation")
        >>> e = simulate(image, (40, 50), Parameters(16, 4, 1), ([[20, 30]], [0.5]), 4)
        >>> e.values["elevation"].shape, float(e.mean()[20, 30]), float(e.exceedance(0.4)[20, 30])
        ((4, 40, 50), 0.5, 1.0)
        """
        return self.values_of(name).mean(axis=0)

    def std(self, name: str | None = None) -> Floats:
        """Return the standard deviation of the values in each cell; inactive cells have NaN."""
        return self.values_of(name).std(axis=0)

    def quantile(self, q: float, name: str | None = None) -> Floats:
        """Return a quantile, 0 … 1, of the values in each cell; inactive cells have NaN."""
        return np.quantile(self.values_of(name), check_number("q", q, 0.0, 1.0), axis=0)

    def exceedance(self, threshold: float, name: str | None = None) -> Floats:
        """Return the share of realizations whose value exceeds a threshold in each cell."""
        shares = (self.values_of(name) > threshold).mean(axis=0)
        return np.where(self.study.active_mask, shares, np.nan)

    def indicator(self, threshold: float) -> Ensemble:
        """Return the ensemble of two facies: values at or below a threshold, and values above it.

        All metrics of facies apply to it, such as the connectivity of values above the threshold.
        Raises `CCWSIMError` if the threshold does not divide the values of the training image.

        Examples
        --------
        >>> from ccwsim import simulate
        >>> hills = np.add.outer(np.sin(np.arange(60) / 5), np.cos(np.arange(80) / 7))
        >>> image = TrainingImage.from_array(hills, continuous=True, variable="elevation")
        >>> e = simulate(image, (40, 50), Parameters(16, 4, 1))
        >>> e.indicator(0.5).training_image.facies_names
        ('elevation ≤ 0.5', 'elevation > 0.5')
        """
        indicated, data = above(self.values_of(), threshold), self.hard_data
        study = replace(
            self.study,
            training_image=self.training_image.indicator(threshold),
            hard_data=HardData(data.cells, above(np.asarray(data.measured, float), threshold)),
            checked=False,
        )
        indices = readonly(np.nan_to_num(indicated, nan=UNKNOWN).astype(np.uint8))
        return replace(self, study=study, indices=indices, values={})

    def property(self, values: FaciesValues, unit: str = "m/s") -> FaciesProperty:
        """Return a property, such as hydraulic conductivity, from the value of each facies.

        `values` has a value for each facies name or code; with `ccwsim.flow.FromValues`, the
        property follows from the continuous variable. The property of a realization is computed on
        access. Raises `CCWSIMError` for a facies without a value and a value that is not positive.

        Examples
        --------
        >>> from ccwsim import simulate
        >>> e = simulate(np.tile([[0], [0], [1], [1]], (16, 64)), (40, 50))
        >>> e.property({0: 1e-8, 1: 1e-4})
        FaciesProperty(facies 0 1 × 10⁻⁸, facies 1 0.0001 m/s)
        """
        image = self.training_image
        return FaciesProperty(self, image, values_by_facies(image, values), unit)

    @cached_property
    def digest(self) -> str:
        """Hash of the content, equal for equal realizations."""
        return digest(self.training_image.codes.tolist(), self.indices, *self.values.values())

    def plot(self, realizations: Sequence[int] | None = None) -> Figure:
        """Return realizations, by default the first three, as a plotly Figure.

        The figure of a volume shows the middle layer.
        """
        return notebook().ensemble_chart(self, realizations)

    def to_xarray(self) -> DataArray:
        """Return the realizations as an xarray DataArray of facies codes or values.

        Dimensions are realization, (z,) y and x; coordinates are the centres of cells in world
        units. Attributes contain the codes and names of facies, as in the CF conventions. Raises
        `CCWSIMError` if xarray is not installed.

        Examples
        --------
        >>> from ccwsim import simulate
        >>> stripes = np.tile([[0], [0], [1], [1]], (16, 64))
        >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
        >>> array = simulate(stripes, Grid(40, 50, (10.0, 10.0)), p).to_xarray()
        >>> array.sel(x=105.0, method="nearest").dims
        ('realization', 'y')
        """
        xarray = needs("xarray")
        image = self.training_image
        axes = reversed(list(zip(WORLD_AXES, self.grid.axes, strict=False)))
        coordinates = {"realization": self.numbers, **dict(axes)}
        if self.values:
            ((name, values),) = self.values.items()
            meaning = {"units": image.units} if image.units else {}
        else:
            name, values = "facies", np.array(self)
            names = " ".join("_".join(each.split()) for each in image.facies_names)
            meaning = {"flag_values": image.codes, "flag_meanings": names}
        attributes = {"long_name": name, **meaning, "seed": self.seed}
        attributes |= {"crs": self.grid.crs} if self.grid.crs else {}
        return xarray.DataArray(values, coordinates, list(coordinates), name, attributes)

    def _repr_html_(self) -> str | None:
        return notebook().ensemble_html(self) if is_installed("plotly") else None

    def __repr__(self) -> str:
        return f"Ensemble({plural(self.n, 'realization')} of {describe_shape(self.grid.shape)})"


def concatenate(ensembles: Iterable[Ensemble]) -> Ensemble:
    """Join ensembles of one study into one ensemble, with realizations in the given order.

    Raises `CCWSIMError` if training image, grid, parameters, hard data or seed differ, if a
    realization is in two ensembles, and if only some ensembles were revised.

    Examples
    --------
    >>> from ccwsim import Parameters, simulate
    >>> stripes, p = np.tile([[0], [0], [1], [1]], (16, 64)), Parameters(16, 4, 1)
    >>> days = [simulate(stripes, (40, 50), p, first_realization=k) for k in range(3)]
    >>> concatenate(days).numbers
    array([0, 1, 2])
    """
    parts = list(ensembles)
    if not parts or not all(isinstance(part, Ensemble) for part in parts):
        raise CCWSIMError("concatenate needs a list of ensembles, at least one")
    first = parts[0]
    for k, part in enumerate(parts):
        different = part.study.differs_from(first.study)
        if part.revised != first.revised:
            different.append("revision of data")
        if different:
            raise refused("ensembles_of_different_studies", k=k, different=listing(different))

    def joined(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    numbers = joined("numbers")
    distinct, counts = np.unique(numbers, return_counts=True)
    twice = distinct[counts > 1]
    if len(twice):
        raise refused("realization_twice", index=twice[0])
    has_sources = all(part.sources is not None for part in parts)
    return replace(
        first,
        indices=joined("indices"),
        cpu_seconds=joined("cpu_seconds"),
        wall_seconds=sum(part.wall_seconds for part in parts),
        data_status=joined("data_status"),
        numbers=numbers,
        sources=joined("sources") if has_sources else None,
        values={
            name: np.concatenate([part.values[name] for part in parts]) for name in first.values
        },
    )


def codes_with_nan(codes: Integers, has_unknown: bool) -> Array:
    """Return a table of codes by facies index, with NaN for unknown cells if there are any."""
    if not has_unknown:
        return codes
    table = np.full(256, np.nan)
    table[: len(codes)] = codes
    return table
