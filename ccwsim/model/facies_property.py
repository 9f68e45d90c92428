"""A property of rocks, such as hydraulic conductivity, from the value of each facies."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ccwsim.model.arrays import Shape, check_number
from ccwsim.model.bounds import MAX_CONTRAST, MAX_MAGNITUDE, MIN_MAGNITUDE
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.training_image import TrainingImage

FaciesValues = Mapping[int | str, float]
"""Value of each facies, by name or code."""


def values_by_facies(
    image: TrainingImage,
    values: FaciesValues,
    what: str = "conductivity",
    most: float = MAX_MAGNITUDE,
) -> NDArray[np.float64]:
    """Return the value of each facies in the order of the codes, shape (n_facies,).

    Raises `CCWSIMError` for a facies without a value, an unknown facies, a value that is not
    positive or above `most`, and values that differ by more than a factor of `MAX_CONTRAST`.
    """
    if not isinstance(values, Mapping):
        raise CCWSIMError(f"{what} = {shown(values)} must be a dict with a value of each facies")
    names = dict(zip(image.facies_names, image.codes.tolist(), strict=True))
    by_code = {names.get(key, key) if isinstance(key, str) else key: values[key] for key in values}
    facies = ", ".join(names)
    if unknown := by_code.keys() - set(names.values()):
        raise CCWSIMError(
            f"{what}: there is no facies {shown(min(unknown, key=shown))}; give {facies}"
        )
    by_facies = np.empty(len(names))
    for k, (name, code) in enumerate(names.items()):
        value = by_code.get(code)
        if value is None:
            raise CCWSIMError(f"{what}: facies {name} has no value; give one for each of {facies}")
        by_facies[k] = check_number(f"{what} of {name}", value, MIN_MAGNITUDE, most)
    check_magnitudes(what, by_facies)
    return by_facies


def check_magnitudes(what: str, values: NDArray[np.float64], remedy: str = "") -> None:
    """Raise `CCWSIMError` for values that are not positive, or too different, for 64-bit sums."""
    low, high = float(values.min()), float(values.max())
    if low < MIN_MAGNITUDE or high > min(MAX_MAGNITUDE, MAX_CONTRAST * low):
        raise refused(
            "magnitudes", what=what, low=low, high=high, remedy=remedy, least=MIN_MAGNITUDE,
            most=MAX_MAGNITUDE, factor=MAX_CONTRAST,
        )  # fmt: skip


def cell_values(by_facies: NDArray[np.float64], indices: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the value of the facies in each cell; NaN in inactive cells."""
    return np.append(by_facies, np.full(256 - len(by_facies), np.nan))[indices]


@dataclass(frozen=True, eq=False)
class FaciesProperty:
    """A property of each cell of an ensemble, computed for each realization on access."""

    indices: NDArray[np.uint8]
    """Indices of the facies, shape (n, ny, nx) or (n, nz, ny, nx)."""
    by_facies: NDArray[np.float64]
    """Value of each facies, in the order of the codes."""
    names: tuple[str, ...]
    unit: str

    @property
    def shape(self) -> Shape:
        """Shape of `indices`."""
        return self.indices.shape

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, which: int | slice) -> NDArray[np.float64]:
        return cell_values(self.by_facies, self.indices[which])

    def __iter__(self) -> Iterator[NDArray[np.float64]]:
        return (self[r] for r in range(len(self)))

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray:
        return np.asarray(self[:], dtype)

    def __repr__(self) -> str:
        values = zip(self.names, self.by_facies, strict=True)
        named = ", ".join(f"{name} {value:g}" for name, value in values)
        return f"FaciesProperty({named}{f' {self.unit}' if self.unit else ''})"
