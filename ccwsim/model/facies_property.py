"""A property of rocks, such as hydraulic conductivity, from the value of each facies."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ccwsim.model.arrays import Shape
from ccwsim.model.bounds import MAX_CONTRAST
from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.training_image import TrainingImage

FaciesValues = Mapping[int | str, float]
"""Value of each facies, by name or code."""


def values_by_facies(
    image: TrainingImage, values: FaciesValues, what: str = "conductivity"
) -> NDArray[np.float64]:
    """Return the value of each facies in the order of the codes, shape (n_facies,).

    Raises `CCWSIMError` for a facies without a value, an unknown facies, a value that is not
    positive, and values that differ by more than a factor of `MAX_CONTRAST`.
    """
    if not isinstance(values, Mapping):
        raise CCWSIMError(f"{what} = {shown(values)} must be a dict with a value of each facies")
    names = dict(zip(image.facies_names, image.codes.tolist(), strict=True))
    by_code = {names.get(key, key) if isinstance(key, str) else key: values[key] for key in values}
    known = ", ".join(names)
    if unknown := by_code.keys() - set(names.values()):
        raise CCWSIMError(
            f"{what}: there is no facies {shown(min(unknown, key=str))}; give {known}"
        )
    for name, code in names.items():
        value = by_code.get(code)
        if value is None:
            raise CCWSIMError(f"{what}: facies {name} has no value; give one for each of {known}")
        number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
        if not (number and np.isfinite(value) and value > 0):
            raise CCWSIMError(f"{what} of {name} = {shown(value)} must be a number above 0")
    found = np.array([by_code[code] for code in names.values()], float)
    if found.max() > MAX_CONTRAST * found.min():
        raise refused("contrast", what=what, low=found.min(), high=found.max(), most=MAX_CONTRAST)
    return found


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
