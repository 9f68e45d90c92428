"""Codes that stand for missing values, in files and arrays."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

UNKNOWN = 255
"""Facies index of a cell without a facies: not simulated yet, inactive, or unknown in an image."""
CUSTOMARY_CODES = (
    *(-99.0, -999.0, -999.25, -9999.0, -99999.0, -997799.0, -9966699.0, -9977799.0),
    *(-1e20, 1e20, -1e21, -1e30, 1e30, 1e33, 1.70141e38, -3.4028235e38, 3.4028235e38, 9.96921e36),
    *(2e9, 2147483647.0, -2147483648.0),
)
"""Codes that stand for a missing value anywhere, as many programs write them."""
PRECISION = 1e-6
"""Largest relative difference between a code and a value that stands for it; files often contain
values of 32 bits, but state the code with more digits."""
# a code is a value if there are many other values, of which one is at least half as frequent, and
# if the next one differs by at most 5 % of their range or, at an end of it, by 3 usual steps
MANY, OFTEN, GAP, STEPS = 10, 2, 0.05, 3


def known_values(values: NDArray, stated: Collection[float] = ()) -> NDArray[np.bool_]:
    """Return a mask of `values` that are neither NaN nor a `stated` or customary missing code."""
    mask = ~np.isnan(values) if values.dtype.kind == "f" else np.ones(values.shape, bool)
    for code in _missing_codes(values, stated):
        mask &= ~_stand_for(code, values)
    return mask


def unknown_note(values: NDArray, stated: Collection[float] = ()) -> str:
    """Return a sentence about the cells without a value; empty if there is none."""
    n = int(np.count_nonzero(~known_values(values, stated)))
    if not n:
        return ""
    codes = [c for c in _missing_codes(values, stated) if _stand_for(c, values).any()]
    meaning = f" ({', '.join(f'{code:.9g}' for code in codes)} means unknown)" if codes else ""
    return f"{n} of {values.size} cells have no value{meaning}"


def _missing_codes(values: NDArray, stated: Collection[float]) -> list[float]:
    """Return the codes for missing values between the minimum and the maximum of `values`."""
    finite = values[np.isfinite(values)] if values.dtype.kind == "f" else values
    if not finite.size:
        return []
    low, high = float(finite.min()), float(finite.max())
    codes = dict.fromkeys((*stated, *CUSTOMARY_CODES))
    return [
        c
        for c in codes
        if low - PRECISION * abs(c) <= c <= high + PRECISION * abs(c)
        and (c in stated or not _is_value(c, finite))
    ]


def _is_value(code: float, finite: NDArray) -> bool:
    """Whether a customary code is a value of a continuous variable, among similar values."""
    distinct, counts = np.unique(finite.astype(np.float64), return_counts=True)
    is_code = np.logical_or.reduce([_stand_for(c, distinct) for c in CUSTOMARY_CODES])
    others, n = distinct[~is_code], counts[_stand_for(code, distinct)].sum()
    if len(others) < MANY or n > OFTEN * counts[~is_code].max():
        return False
    is_inside = others[0] < code < others[-1]
    most = GAP * np.ptp(others) if is_inside else STEPS * np.median(np.diff(others))
    return bool(np.abs(others - code).min() <= most)


def _stand_for(code: float, values: NDArray) -> NDArray[np.bool_]:
    """Return a mask of the values that stand for a missing value by this code."""
    return np.abs(values.astype(np.float64) - code) <= PRECISION * abs(code)
