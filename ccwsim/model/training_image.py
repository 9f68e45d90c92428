"""The training image: the map or volume of facies whose patterns realizations reproduce."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from ccwsim.model import arrays
from ccwsim.model.backends import notebook
from ccwsim.model.bounds import MAX_FACIES
from ccwsim.model.classes import Classes, classify
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.extras import is_installed
from ccwsim.model.missing import UNKNOWN, known_values

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


_CONTINUOUS = "for continuous values use TrainingImage.from_array with a threshold or classes"


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

    Attributes
    ----------
    codes : ndarray, shape (n_facies,)
        The codes that occur, sorted.
    indices : ndarray of uint8, shape of `array`
        Index in `codes` of each cell's code; 255 in unknown cells.
    known : ndarray of bool, shape of `array`, or None
        Cells whose facies is known; None if all cells are known.

    Examples
    --------
    >>> ti = TrainingImage([[0, 0, 7], [0, 7, 7]])
    >>> ti.codes, ti.proportions
    (array([0, 7], dtype=uint8), array([0.5, 0.5]))
    >>> TrainingImage(np.eye(40)[None].repeat(5, axis=0), name="plates")
    TrainingImage('plates', 40 × 40 × 5, 2 facies)
    """

    def __init__(
        self, array: ArrayLike, *, name: str = "", facies_names: Sequence[str] | None = None
    ) -> None:
        raw, known_mask = _values_and_known(array)
        if raw.ndim not in (2, 3) or raw.size == 0:
            raise refused("image_shape", shape=raw.shape)
        if known_mask is None:
            integers = arrays.as_integers(raw, "training image", remedy=_CONTINUOUS)
            codes = arrays.codes_of(integers)
        else:
            of_known = arrays.as_integers(raw[known_mask], "training image", remedy=_CONTINUOUS)
            codes = arrays.codes_of(of_known)
            integers = np.full(raw.shape, of_known[0])
            integers[known_mask] = of_known
        if len(codes) > MAX_FACIES:
            raise refused("image_looks_continuous", n=len(codes), advice=_CONTINUOUS)
        array, indices = arrays.smallest_integers(integers), _indices_in(codes, integers)
        self.codes = arrays.frozen(codes.astype(array.dtype))
        if known_mask is not None:
            array = np.where(known_mask, integers, np.nan)
            indices = np.where(known_mask, indices, UNKNOWN)
        self.array, self.indices = arrays.frozen(array), arrays.frozen(indices.astype(np.uint8))
        self.known = known_mask
        if not isinstance(name, str):
            raise CCWSIMError(f"name = {shown(name)} must be a text")
        self.name = name
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

        Examples
        --------
        >>> porosity = [[0.05, 0.21, 0.30], [0.11, 0.19, 0.25]]
        >>> TrainingImage.from_array(porosity, threshold=0.2, name="sand").array
        array([[0, 1, 1],
               [0, 0, 1]], dtype=uint8)
        """
        array, mask = _values_and_known(values)
        if array.dtype.kind in "iuf" and (classes is None or not isinstance(classes, str)):
            stated = known_values(array)
            mask = stated & mask if mask is not None else None if stated.all() else stated
        of_known = array if mask is None else array[mask]
        codes = classify(of_known, threshold=threshold, classes=classes, what="training image")
        if mask is not None:
            full = np.full(array.shape, np.nan)
            full[mask] = codes
            codes = full
        return cls(codes, name=name, facies_names=facies_names)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray:
        return np.array(self.array, dtype, copy=copy)

    def __eq__(self, other: object) -> bool:
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
    def proportions(self) -> NDArray[np.float64]:
        """Share of the cells of each facies, in the order of `codes`."""
        counts = np.bincount(self.indices.ravel(), minlength=self.n_facies)[: self.n_facies]
        return counts / counts.sum()

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
        return arrays.digest(self.array.shape, self.codes.tolist(), self.indices)

    def index_of(self, code: int | str) -> int:
        """Return the index in `codes` of a facies, given by code or name (in any case).

        Raises `CCWSIMError` for an unknown facies.
        """
        if isinstance(code, str):
            names = [name.casefold() for name in self.facies_names]
            if names.count(code.casefold()) == 1:
                return names.index(code.casefold())
            raise refused("facies_of_image", code=shown(code), there=", ".join(self.facies_names))
        indices = np.flatnonzero(self.codes == code) if arrays.is_whole(code) else np.empty(0, int)
        if not len(indices):
            codes = ", ".join(map(str, self.codes))
            raise refused("facies_of_image", code=shown(code), there=codes)
        return int(indices[0])

    def plot(self) -> Figure:
        """Return the image, or the middle layer of a volume, as a plotly Figure."""
        return notebook().image_chart(self)

    def _repr_html_(self) -> str | None:
        return notebook().image_html(self) if is_installed("plotly") else None

    def __repr__(self) -> str:
        name, size = self.name or "unnamed", arrays.describe_shape(self.shape)
        return f"TrainingImage({name!r}, {size}, {self.n_facies} facies)"


def _values_and_known(values: ArrayLike) -> tuple[NDArray, NDArray[np.bool_] | None]:
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


def _indices_in(codes: NDArray[np.int64], integers: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the index of each cell's code in the sorted codes."""
    low, high = int(codes[0]), int(codes[-1])
    if high - low >= 2**16:
        return np.searchsorted(codes, integers).astype(np.uint8)
    places = np.zeros(high - low + 1, np.uint8)  # a table is fast for similar codes
    places[codes - low] = np.arange(len(codes))
    return places[integers - low]
