"""Codes that stand for missing values, in files and arrays."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

UNKNOWN = 255
"""Facies index of a cell without a facies: not simulated yet, inactive, or unknown in an image."""
CUSTOMARY_CODES = (
    *(-99.0, -999.0, -999.25, -9999.0, -99999.0, -997799.0, -9966699.0, -9977799.0),
    *(-1e21, -1e30, 1e30, 1.70141e38, -3.4028235e38, 3.4028235e38, 9.96921e36),
)
"""Codes that stand for a missing value anywhere, as many programs write them."""
PRECISION = 1e-6
"""Largest relative difference between a code and a value that stands for it; files often contain
values of 32 bits, but state the code with more digits."""


def known_values(values: NDArray, stated: Iterable[float] = ()) -> NDArray[np.bool_]:
    """Return a mask of `values` that are neither NaN nor a `stated` or customary missing code."""
    mask = ~np.isnan(values) if values.dtype.kind == "f" else np.ones(values.shape, bool)
    for code in _codes_in_range(values, stated):
        mask &= ~_stand_for(code, values)
    return mask


def unknown_note(values: NDArray, stated: Iterable[float] = ()) -> str:
    """Return a sentence about the cells without a value; empty if there is none."""
    n = int(np.count_nonzero(~known_values(values, stated)))
    if not n:
        return ""
    codes = [c for c in _codes_in_range(values, stated) if _stand_for(c, values).any()]
    meaning = f" ({', '.join(f'{code:.9g}' for code in codes)} means unknown)" if codes else ""
    return f"{n} of {values.size} cells have no value{meaning}"


def _codes_in_range(values: NDArray, stated: Iterable[float]) -> list[float]:
    """Return the codes for missing values between the minimum and the maximum of `values`."""
    finite = values[np.isfinite(values)] if values.dtype.kind == "f" else values
    if not finite.size:
        return []
    low, high = float(finite.min()), float(finite.max())
    codes = dict.fromkeys((*stated, *CUSTOMARY_CODES))
    return [c for c in codes if low - PRECISION * abs(c) <= c <= high + PRECISION * abs(c)]


def _stand_for(code: float, values: NDArray) -> NDArray[np.bool_]:
    """Return a mask of the values that stand for a missing value by this code."""
    return np.abs(values.astype(np.float64) - code) <= PRECISION * abs(code)
