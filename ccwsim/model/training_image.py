"""The training image: the map or volume of facies whose patterns realizations reproduce."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ccwsim.model import arrays
from ccwsim.model.arrays import Array, Bytes, Floats, Ints, Mask
from ccwsim.model.backends import notebook
from ccwsim.model.bounds import MAX_FACIES
from ccwsim.model.classes import Classes, asks_for_codes, classify
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.extras import is_installed
from ccwsim.model.missing import UNKNOWN, known_values
from ccwsim.model.numbers import minus, three_digits

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

MIN_SHARE_OF_INTEREST = 0.02  # minimum share of the cells of a facies that is shown first
N_CLASSES_OF_VALUES = 8
"""Number of classes, with equal numbers of cells, into which values are put for the search."""
N_RANKS = 255  # ranks of values are 0 … 254


_CONTINUOUS = "for continuous values use TrainingImage.from_array (continuous=True or classes)"


class TrainingImage(arrays.ReadOnly):
    """A map or volume of facies codes, in which patches are searched (the TI).

    Facies are at most 254 integer codes, whose order has no meaning. Images with equal codes and
    facies names are equal. Raises `CCWSIMError` for too many codes, a wrong number of dimensions,
    no cells, or a code that is not an integer. Cells with NaN, and masked cells, are unknown: no
    patch contains them, and statistics ignore them.

    Parameters
    ----------
    array : array_like, shape (ny, nx) or (nz, ny, nx)
        Facies codes; row 0 is at the south, layer 0 at the bottom. A volume of one layer stays a
        volume. The array is stored read-only, in the smallest integer type for its codes, or as
        float64 with NaN if some cells are unknown.
    name : str
        Name on screen and in files.
    facies_names : sequence of str, optional
        Name of each facies, in the order of the sorted codes.
    numbering : str
        What the codes are: "codes" that also other files use, or only numbers of "colours" from
        dark to light, of "names", or of classes of continuous "values" from low to high. It
        decides whether facies of data match by code, and is no part of the digest.
    values : mapping of str to array_like, optional
        Values of a continuous variable by its name, in the shape of `array`, which has their
        classes; see `from_array`.
    units : str
        Units of the values.

    Attributes
    ----------
    codes : ndarray, shape (n_facies,)
        The codes that occur, sorted.
    indices : ndarray of uint8, shape of `array`
        Index in `codes` of each cell's code; 255 in unknown cells.
    known : ndarray of bool, shape of `array`, or None
        Cells whose facies is known; None if all cells are known.
    values : dict of str to ndarray of float
        Values of the continuous variable, with NaN in unknown cells; empty for facies.

    Examples
    --------
    >>> ti = TrainingImage([[0, 0, 7], [0, 7, 7]])
    >>> ti.codes, ti.proportions
    (array([0, 7], dtype=uint8), array([0.5, 0.5]))
    >>> TrainingImage(np.eye(40)[None].repeat(5, axis=0), name="plates")
    TrainingImage('plates', 40 × 40 × 5, 2 facies)
    """

    def __init__(
        self,
        array: ArrayLike,
        *,
        name: str = "",
        facies_names: Sequence[str] | None = None,
        numbering: str = "codes",
        values: Mapping[str, ArrayLike] | None = None,
        units: str = "",
    ) -> None:
        raw, known_mask = _values_and_known(array)
        if raw.ndim not in (2, 3) or raw.size == 0:
            raise refused("image_shape", shape=raw.shape)
        of_known = raw if known_mask is None else raw[known_mask]
        of_known = arrays.as_integers(of_known, "training image", remedy=_CONTINUOUS)
        codes = arrays.codes_of(of_known)
        if len(codes) > MAX_FACIES:
            raise refused("image_looks_continuous", n=len(codes), advice=_CONTINUOUS)
        integers = _in_cells(of_known, known_mask, otherwise=codes[0])
        array, indices = arrays.smallest_integers(integers), _indices_in(codes, integers)
        self.codes = arrays.frozen(codes.astype(array.dtype))
        if known_mask is not None:
            array = np.where(known_mask, integers, np.nan)
            indices = np.where(known_mask, indices, UNKNOWN)
        self.array, self.indices = arrays.frozen(array), arrays.frozen(indices.astype(np.uint8))
        self.known = known_mask
        if not isinstance(name, str):
            raise CCWSIMError(f"name = {shown(name)} must be a text")
        self.name, self.numbering, self.units = name, numbering, units
        self.values = {
            key: arrays.frozen(arrays.as_array(each, key).astype(np.float64))
            for key, each in (values or {}).items()
        }
        for of_cells in self.values.values():
            if not np.array_equal(self.class_indices(of_cells), self.indices):
                raise refused("values_not_of_classes")
        self.facies_names = self._named(facies_names)

    @classmethod
    def of(cls, image: TrainingImage | ArrayLike) -> TrainingImage:
        """Return a training image unchanged, or make a training image from an array of codes.

        Examples
        --------
        >>> TrainingImage.of(np.eye(3)).codes
        array([0, 1], dtype=uint8)
        """
        if isinstance(image, (str, PathLike)):
            raise refused("image_is_a_name", said=shown(str(image)))
        return image if isinstance(image, TrainingImage) else cls(image)

    @classmethod
    def from_array(
        cls,
        values: ArrayLike,
        *,
        threshold: float | None = None,
        classes: Classes = None,
        name: str = "",
        facies_names: Sequence[str] | None = None,
        continuous: bool = False,
        variable: str = "value",
        units: str = "",
    ) -> TrainingImage:
        """Make a training image from facies codes, or from values of a continuous variable.

        Cells with NaN, masked cells, and cells with a customary code such as −9999 (unless
        `classes` is "codes") are unknown. Raises `CCWSIMError` for continuous values without
        classes.

        Parameters
        ----------
        values : array_like, shape (ny, nx) or (nz, ny, nx)
            Row 0 is at the south. A field of GSTools begins with x, so its transpose is needed:
            `srf.field.T`. The axes of a DataArray are put into this order.
        threshold, classes : optional
            Values at or above the threshold become facies 1, values below it facies 0. `classes` is
            a number of classes with equal numbers of cells, a list of ascending inner edges, or
            "codes" to keep integers as codes, even if there are many.
        name, facies_names : optional
            As in `TrainingImage`.
        continuous : bool
            Keep the values: realizations of this image have values too (`Ensemble.values`). Its
            facies are then at most 8 classes with equal numbers of cells, for the search, named
            after their limits.
        variable, units : str
            Name and units of a continuous variable, such as "porosity" and "%".

        Examples
        --------
        >>> porosity = [[0.05, 0.21, 0.30], [0.11, 0.19, 0.25]]
        >>> TrainingImage.from_array(porosity, continuous=True, variable="porosity").values
        {'porosity': array([[0.05, 0.21, 0.3 ],
               [0.11, 0.19, 0.25]])}
        >>> TrainingImage.from_array(porosity, threshold=0.2, name="sand").array
        array([[0, 1, 1],
               [0, 0, 1]], dtype=uint8)
        """
        array, mask = _values_and_known(values)
        if array.dtype.kind in "iuf" and (classes is None or not isinstance(classes, str)):
            stated = known_values(array)
            mask = stated & mask if mask is not None else None if stated.all() else stated
        of_known = array if mask is None else array[mask]
        if continuous:
            if threshold is not None or classes is not None:
                raise CCWSIMError(
                    "continuous=True keeps all values; leave out threshold and classes"
                )
            of_known = arrays.as_floats(of_known, "training image")
            edges = _edges_of(of_known)
            codes = np.searchsorted(edges, of_known, side="right")
            facies_names = _names_of_classes(edges, units) if facies_names is None else facies_names
        else:
            codes = classify(of_known, threshold=threshold, classes=classes, what="training image")
        has_codes = threshold is None and asks_for_codes(classes) and not continuous
        return cls(
            _in_cells(codes, mask),
            name=name,
            facies_names=facies_names,
            numbering="codes" if has_codes else "values",
            values={variable: _in_cells(of_known, mask)} if continuous else None,
            units=units,
        )

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        return np.array(self.array, dtype, copy=copy)

    def __eq__(self, other: object) -> bool:
        arrays.refuse_array("training image", other)
        if not isinstance(other, TrainingImage):
            return NotImplemented
        return (self.digest, self.facies_names) == (other.digest, other.facies_names)

    def __hash__(self) -> int:
        return hash((self.digest, self.facies_names))

    def _named(self, names: Sequence[str] | None) -> tuple[str, ...]:
        if names is None:
            return tuple(f"facies {code}" for code in self.codes)
        if not isinstance(names, Sequence) or not all(isinstance(name, str) for name in names):
            raise CCWSIMError(f"facies names: a list of names is needed, not {shown(names)}")
        if len(names) != self.n_facies:
            raise CCWSIMError(
                f"facies names: {len(names)} were given for {self.n_facies} facies "
                f"({', '.join(map(str, self.codes))})"
            )
        return tuple(names)

    @property
    def shape(self) -> arrays.Shape:
        """Rows and columns of a map; layers, rows and columns of a volume."""
        return self.array.shape

    @property
    def n_dimensions(self) -> int:
        """Number of dimensions: 2 for a map, 3 for a volume."""
        return self.array.ndim

    @property
    def n_facies(self) -> int:
        """Number of facies that occur."""
        return len(self.codes)

    @cached_property
    def names_by_code(self) -> dict[int, str]:
        """Facies names by code, in the order of `codes`."""
        return dict(zip(self.codes.tolist(), self.facies_names, strict=True))

    @cached_property
    def codes_by_name(self) -> dict[str, int]:
        """Codes by facies name in lower case; without usual names of a mere numbering.

        Examples
        --------
        >>> TrainingImage([[0, 7]], facies_names=("Mud", "Sand")).codes_by_name
        {'mud': 0, 'sand': 7}
        """
        names = [name.strip().casefold() for name in self.facies_names]
        usual = () if self.numbering == "codes" else [f"facies {code}" for code in self.codes]
        pairs = zip(names, self.codes.tolist(), strict=True)
        return {n: code for n, code in pairs if names.count(n) == 1 and n not in usual}

    @cached_property
    def proportions(self) -> Floats:
        """Share of the cells of each facies, in the order of `codes`."""
        counts = np.bincount(self.indices.ravel(), minlength=self.n_facies)[: self.n_facies]
        return counts / counts.sum()

    @property
    def facies_of_interest(self) -> int:
        """Index of the facies that is shown first.

        This is the rarest facies with more than 2 % of the cells or, if only the most frequent
        facies has so many cells, the second most frequent.

        Examples
        --------
        >>> TrainingImage([[0, 0, 1, 1, 1, 2, 2, 2, 2]]).facies_of_interest
        0
        """
        first, *others = np.argsort(-self.proportions, kind="stable").tolist()
        frequent = [k for k in others if self.proportions[k] > MIN_SHARE_OF_INTEREST]
        return [first, *others[:1], *frequent][-1]

    @cached_property
    def disorder(self) -> float:
        """Randomness of the image, 0 … 1; 0 if at most half as many neighbours differ as by chance.

        Examples
        --------
        >>> TrainingImage(np.tile([[0], [1]], (4, 8))).disorder
        0.0
        """
        by_chance = 1 - float(np.square(self.proportions).sum())
        if by_chance == 0 or self.shape[-1] == 1:
            return 0.0
        west, east = self.indices[..., :-1], self.indices[..., 1:]
        pairs = True if self.known is None else (west != UNKNOWN) & (east != UNKNOWN)
        differ = float(np.mean(west != east, where=pairs))
        return min(max(2 * differ / by_chance - 1, 0.0), 1.0)

    @cached_property
    def digest(self) -> str:
        """Hash of the content, equal for equal images."""
        parts = [part for item in self.values.items() for part in item]
        return arrays.digest(self.array.shape, self.codes.tolist(), self.indices, *parts)

    @property
    def variable(self) -> str:
        """Name of the continuous variable; empty for facies."""
        return next(iter(self.values), "")

    @cached_property
    def sorted_values(self) -> Floats:
        """All values of the continuous variable, sorted."""
        values = self.values[self.variable]
        return arrays.frozen(np.sort(values[np.isfinite(values)]))

    def indicator(self, threshold: float) -> TrainingImage:
        """Return an image of two facies: values at or below a threshold, and values above it.

        Raises `CCWSIMError` if the threshold does not divide the values.

        Examples
        --------
        >>> slope = TrainingImage.from_array([[0.5, 1.5, 2.5]], continuous=True, variable="depth")
        >>> slope.indicator(1.5).names_by_code
        {0: 'depth ≤ 1.5', 1: 'depth > 1.5'}
        """
        low, high = self.sorted_values[[0, -1]].tolist()
        arrays.check_number("threshold", threshold, low, np.nextafter(high, -np.inf))
        limit = f"{minus(three_digits(threshold))} {self.units}".rstrip()
        return TrainingImage(
            above(self.values[self.variable], threshold),
            name=self.name,
            facies_names=[f"{self.variable} {sign} {limit}" for sign in "≤>"],
            numbering="values",
        )

    @cached_property
    def median(self) -> float:
        """Median of the continuous variable, below its largest value unless all are equal."""
        values = self.sorted_values
        below = values[values < values[-1]]
        return min(float(np.median(values)), below.max(initial=values[0]))

    @cached_property
    def two_facies(self) -> TrainingImage:
        """The indicator of the median of a continuous variable; an image of facies itself."""
        return self.indicator(self.median) if self.values else self

    @cached_property
    def class_medians(self) -> list[float]:
        """Median of the values in each class of the continuous variable."""
        values = self.values[self.variable]
        return [float(np.median(values[self.indices == k])) for k in range(self.n_facies)]

    def class_indices(self, values: Floats) -> Bytes:
        """Return the index in `codes` of the class of each value; 255 for NaN."""
        edges = _edges_of(self.values[self.variable])
        classes = np.searchsorted(edges, values, side="right")
        return np.where(np.isnan(values), UNKNOWN, classes).astype(np.uint8)

    def ranks_of(self, values: Floats) -> Bytes:
        """Return the ranks, 0 … 254, of values among those of the image; 0 for NaN."""
        low, high = (
            np.searchsorted(self.sorted_values, values, side) for side in ("left", "right")
        )
        ranks = (low + high) * (N_RANKS / (2 * len(self.sorted_values)))
        return np.where(np.isnan(values), 0, np.minimum(ranks, N_RANKS - 1)).astype(np.uint8)

    @property
    def numbering_of_data(self) -> str:
        """Numbering of data that have the codes of this image: "codes", or the image's digest."""
        return "codes" if self.numbering == "codes" else self.digest

    def index_of(self, code: int | str) -> int:
        """Return the index in `codes` of a facies, given by code or name (in any case).

        Raises `CCWSIMError` for an unknown facies.
        """
        return index_of(self.codes, code, names=self.facies_names)

    def code_of(self, facies: int | str) -> int:
        """Return the code of a facies, given by code or name, or raise `CCWSIMError`."""
        return int(self.codes[self.index_of(facies)])

    def plot(self) -> Figure:
        """Return the image, or the middle layer of a volume, as a plotly Figure."""
        return notebook().image_chart(self)

    def _repr_html_(self) -> str | None:
        return notebook().image_html(self) if is_installed("plotly") else None

    def __repr__(self) -> str:
        name, size = self.name or "unnamed", arrays.describe_shape(self.shape)
        return f"TrainingImage({name!r}, {size}, {self.n_facies} facies)"


def index_of(
    codes: Array, facies: int | str, name: str = "facies", names: Sequence[str] = ()
) -> int:
    """Return the index of a facies, given by code or, in any case, by name; or raise an error."""
    matches = []
    if isinstance(facies, str):
        matches = [k for k, each in enumerate(names) if each.casefold() == facies.casefold()]
    elif arrays.is_integer(facies):
        matches = np.flatnonzero(codes == facies).tolist()
    if len(matches) == 1:
        return matches[0]
    there = names if isinstance(facies, str) and names else codes.tolist()
    there = ", ".join(map(str, there[:10]))
    raise refused("facies_of_image", name=name, code=shown(facies), there=there)


def _values_and_known(values: ArrayLike) -> tuple[Array, Mask | None]:
    """Return values as an array, and the mask of known values; None if all are known.

    Raises `CCWSIMError` if no value is known.
    """
    mask = None
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        mask, values = np.ma.getmaskarray(values), values.data
    array = arrays.as_array(values, "training image")
    missing = np.isnan(array) if array.dtype.kind == "f" else np.zeros(array.shape, bool)
    missing = missing if mask is None else missing | mask
    if not missing.any():
        return array, None
    if missing.all():
        raise CCWSIMError("training image: no cell has a value; give facies codes")
    return array, arrays.frozen(~missing)


def _in_cells(of_known: Array, mask: Mask | None, otherwise: float = np.nan) -> Array:
    """Return the values of known cells as an array of all cells."""
    if mask is None:
        return of_known
    array = np.full(mask.shape, otherwise)
    array[mask] = of_known
    return array


def _edges_of(values: Floats) -> Floats:
    """Return ascending inner edges of classes; many equal values leave fewer classes."""
    known = values[np.isfinite(values)]
    places = np.arange(1, N_CLASSES_OF_VALUES) * known.size // N_CLASSES_OF_VALUES
    above = known[known > known.min()].min(initial=np.inf)
    edges = np.unique(np.maximum(np.partition(known, places)[places], above))
    return edges[np.isfinite(edges)]


def above(values: Floats, threshold: float) -> Floats:
    """Return 1 for values above a threshold, 0 for other values, and NaN for NaN."""
    return np.where(np.isnan(values), np.nan, values > threshold)


def _names_of_classes(edges: Floats, units: str) -> list[str]:
    """Return the limits of classes between ascending edges as text."""
    end = f" {units}" if units else ""
    limits = [minus(three_digits(edge)) for edge in edges.tolist()]
    if not limits:
        return ["all values"]
    between = [f"{low} to {high}{end}" for low, high in pairwise(limits)]
    return [f"below {limits[0]}{end}", *between, f"{limits[-1]}{end} and more"]


def _indices_in(codes: Ints, integers: Ints) -> Bytes:
    """Return the index of each cell's code in the sorted codes."""
    low, high = int(codes[0]), int(codes[-1])
    if high - low >= 2**16:
        return np.searchsorted(codes, integers).astype(np.uint8)
    places = np.zeros(high - low + 1, np.uint8)  # a table is fast for similar codes
    places[codes - low] = np.arange(len(codes))
    return places[integers - low]
