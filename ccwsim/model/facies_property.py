"""A property of rocks, such as hydraulic conductivity, from the value of each facies."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike

from ccwsim.model.arrays import Array, Bytes, Floats, Shape, check_number
from ccwsim.model.bounds import MAX_CONTRAST, MAX_MAGNITUDE, MIN_MAGNITUDE
from ccwsim.model.errors import CCWSIMError, refused, shown, warn
from ccwsim.model.numbers import with_power
from ccwsim.model.training_image import TrainingImage

FaciesValues = Mapping[int | str, float]
"""Value of each facies, by name or code."""


def values_by_facies(
    image: TrainingImage,
    values: FaciesValues,
    what: str = "conductivity",
    most: float = MAX_MAGNITUDE,
) -> Floats:
    """Return the value of each facies in the order of the codes, shape (n_facies,).

    Warns of codes if those of the image are only numbers of colours or classes. Raises
    `CCWSIMError` for a facies without a value, an unknown facies, a value that is not
    positive or above `most`, and values that differ by more than a factor of `MAX_CONTRAST`.
    """
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


def cell_values(by_facies: Floats, indices: Bytes) -> Floats:
    """Return the value of the facies in each cell; NaN in inactive cells."""
    return np.append(by_facies, np.full(256 - len(by_facies), np.nan))[indices]


@dataclass(frozen=True, eq=False)
class FaciesProperty:
    """A property of each cell of an ensemble, computed for each realization on access."""

    indices: Bytes
    """Indices of the facies, shape (n, ny, nx) or (n, nz, ny, nx)."""
    by_facies: Floats
    """Value of each facies, in the order of the codes."""
    names: tuple[str, ...]
    unit: str

    @property
    def shape(self) -> Shape:
        """Shape of `indices`."""
        return self.indices.shape

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, which: int | slice) -> Floats:
        return cell_values(self.by_facies, self.indices[which])

    def __iter__(self) -> Iterator[Floats]:
        return (self[r] for r in range(len(self)))

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        return np.asarray(self[:], dtype)

    def __repr__(self) -> str:
        values = zip(self.names, self.by_facies, strict=True)
        named = ", ".join(f"{name} {with_power(value, 6)}" for name, value in values)
        return f"FaciesProperty({named}{f' {self.unit}' if self.unit else ''})"
