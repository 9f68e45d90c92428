"""A property of rocks, such as hydraulic conductivity, in each cell.

It follows from the value of each facies, or from the values of a continuous variable.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import DTypeLike

from ccwsim.model.arrays import Array, Bytes, Floats, Shape, check_number
from ccwsim.model.bounds import MAX_CONTRAST, MAX_MAGNITUDE, MIN_MAGNITUDE
from ccwsim.model.errors import CCWSIMError, refused, shown, warn
from ccwsim.model.numbers import with_power
from ccwsim.model.training_image import TrainingImage


@dataclass(frozen=True)
class FromValues:
    """A property that follows from the value of the continuous variable in each cell.

    It is `factor` times the value or, if `logarithmic`, `factor` times 10 to the power of the
    value.
    """

    logarithmic: bool = False
    factor: float = 1.0


FaciesValues = Mapping[int | str, float] | FromValues
"""Value of each facies, by name or code; or the property follows from a continuous variable."""
PropertyValues: TypeAlias = Floats | tuple[float, ...] | FromValues
"""Value of each facies in the order of the codes; or it follows from a continuous variable."""


class Cells(NamedTuple):
    """Facies indices of cells and, if a continuous variable was simulated, its values."""

    indices: Bytes
    values: Floats | None = None


class HasCells(Protocol):
    """A training image, or the realizations of an ensemble."""

    @property
    def indices(self) -> Bytes: ...

    @property
    def values(self) -> dict[str, Floats]: ...


def cells_of(images: HasCells, realization: Any = ...) -> Cells:
    """Return the cells of a training image, or of one realization or a slice of realizations."""
    values = next(iter(images.values.values()), None)
    indices = np.asarray(images.indices[realization])
    return Cells(indices, None if values is None else values[realization])


def values_by_facies(
    image: TrainingImage,
    values: FaciesValues,
    what: str = "conductivity",
    most: float = MAX_MAGNITUDE,
) -> Floats | FromValues:
    """Return the value of each facies in the order of the codes, shape (n_facies,).

    Warns of codes if those of the image are only numbers of colours or classes. Raises
    `CCWSIMError` for a facies without a value, an unknown facies, a value that is not
    positive or above `most`, and values that differ by more than a factor of `MAX_CONTRAST`.
    `FromValues` is returned unchanged if the continuous variable of the image allows it.
    """
    if isinstance(values, FromValues):
        if not image.values:
            raise refused("no_values", name=what, there="only facies")
        extremes = cell_values(values, Cells(image.indices[:0], image.sorted_values[[0, -1]]))
        check_magnitudes(f"{what} by {image.variable}", extremes)
        check_number(f"{what} by {image.variable}", extremes[1], MIN_MAGNITUDE, most)
        return values
    if not isinstance(values, Mapping):
        raise CCWSIMError(f"{what} = {shown(values)} must be a dict with a value of each facies")
    facies = ", ".join(image.facies_names)
    if image.numbering != "codes" and not all(isinstance(key, str) for key in values):
        message = "numbers of colours or classes are no codes; give names of facies"
        warn(f"{what}: {message} ({facies})")
    by_index = {image.index_of(key): value for key, value in values.items()}
    by_facies = np.empty(image.n_facies)
    for k, name in enumerate(image.facies_names):
        if k not in by_index:
            raise CCWSIMError(f"{what}: facies {name} has no value; give one for each of {facies}")
        by_facies[k] = check_number(f"{what} of {name}", by_index[k], MIN_MAGNITUDE, most)
    check_magnitudes(what, by_facies)
    return by_facies


def check_magnitudes(what: str, values: Floats, remedy: str = "") -> None:
    """Raise `CCWSIMError` for values that are not positive, or too different, for 64-bit sums."""
    low, high = float(values.min()), float(values.max())
    if low < MIN_MAGNITUDE or high > min(MAX_MAGNITUDE, MAX_CONTRAST * low):
        raise refused(
            "magnitudes", what=what, low=low, high=high, remedy=remedy, least=MIN_MAGNITUDE,
            most=MAX_MAGNITUDE, factor=MAX_CONTRAST,
        )  # fmt: skip


def cell_values(rocks: PropertyValues, cells: Cells) -> Floats:
    """Return a property in each cell; NaN in inactive cells."""
    if isinstance(rocks, FromValues):
        values = np.asarray(cells.values)
        with np.errstate(over="ignore"):  # infinite values are refused
            return rocks.factor * (10.0**values if rocks.logarithmic else values)
    return np.append(rocks, np.full(256 - len(rocks), np.nan))[cells.indices]


@dataclass(frozen=True, eq=False)
class FaciesProperty:
    """A property of each cell of an ensemble, computed for each realization on access."""

    images: HasCells
    training_image: TrainingImage
    by_facies: Floats | FromValues
    """Value of each facies, in the order of the codes; or it follows from a continuous variable."""
    unit: str

    @property
    def shape(self) -> Shape:
        """Shape of the realizations, (n, ny, nx) or (n, nz, ny, nx)."""
        return self.images.indices.shape

    def __len__(self) -> int:
        return len(self.images.indices)

    def __getitem__(self, which: int | slice) -> Floats:
        return cell_values(self.by_facies, cells_of(self.images, which))

    def __iter__(self) -> Iterator[Floats]:
        return (self[r] for r in range(len(self)))

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        return np.asarray(self[:], dtype)

    def __repr__(self) -> str:
        named = describe_rocks(self.by_facies, self.training_image)
        return f"FaciesProperty({named}{f' {self.unit}' if self.unit else ''})"


def describe_rocks(rocks: PropertyValues, image: TrainingImage) -> str:
    """Return the values of the facies, or how they follow from a continuous variable."""
    if isinstance(rocks, FromValues):
        power = "10^" if rocks.logarithmic else ""
        factor = "" if rocks.factor == 1 else f"{with_power(rocks.factor, 6)} × "
        return f"{factor}{power}{image.variable}"
    named = zip(image.facies_names, rocks, strict=True)
    return ", ".join(f"{name} {with_power(value, 6)}" for name, value in named)
