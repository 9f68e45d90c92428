"""Convert values to facies codes: unchanged, by classes, or by a threshold."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

import numpy as np

from ccwsim.model.arrays import (
    Array,
    ArrayLike,
    Floats,
    Ints,
    as_array,
    as_floats,
    as_integers,
    check_int,
    codes_of,
    is_integer,
)
from ccwsim.model.bounds import MAX_FACIES
from ccwsim.model.errors import CCWSIMError, refused, shown

MAX_CODES = 32
"""Maximum number of facies codes; integers with more distinct values count as continuous."""

Classes = int | Sequence[float] | Literal["codes"] | None
"""Classes: a number, a sequence of inner edges, or "codes" to keep the values unchanged."""

Merge = Mapping[int, int | None] | Iterable[tuple[int, int | None]]
"""The new code of each merged facies, or None, as a mapping or as pairs."""


def classify(
    values: ArrayLike, *, threshold: float | None = None, classes: Classes = None, what: str = ""
) -> Ints:
    """Return the facies codes of values; the values must not contain NaN.

    Raises `CCWSIMError` for continuous values without classes, and for invalid edges.

    Parameters
    ----------
    values : array_like
        Facies codes, or values of a continuous variable.
    threshold : float, optional
        Values at or above the threshold become 1, values below it 0.
    classes : int, sequence of float or "codes", optional
        A number of classes with equal counts of values (except for ties), or ascending inner edges.
        A value on an edge belongs to the upper class. "codes" keeps the values as codes, even if
        there are more than `MAX_CODES` distinct values. Classes are numbered from 0, low to high.
    what : str
        Name of the values in error messages.

    Examples
    --------
    >>> classify([0.1, 0.4, 0.7], threshold=0.4).tolist()
    [0, 1, 1]
    >>> classify([0.1, 0.4, 0.7, 0.9], classes=2).tolist()
    [0, 0, 1, 1]
    """
    label = what or "values"
    array = as_array(values, label)
    if array.dtype.kind not in "buif":
        raise CCWSIMError(f"{label}: numbers are needed, not values of type {array.dtype}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        bad = array[~np.isfinite(array)][0]
        raise CCWSIMError(f"{label}: {bad} is not finite; every value must be a number")
    if threshold is not None and classes is not None:
        raise CCWSIMError("give either a threshold or classes, not both")
    if threshold is not None:
        classes = [threshold]
    if classes is None and not are_codes(array):
        raise refused("values_look_continuous", label=label, low=array.min(), high=array.max())
    if asks_for_codes(classes):
        return as_integers(array, label)
    edges = class_edges(array, int(classes)) if is_integer(classes) else _edges(classes)
    return np.searchsorted(edges, array, side="right").astype(np.int64)


def merge_facies(codes: Ints, merge: Merge) -> Ints:
    """Return facies codes with some facies merged; None takes the nearest cell of a kept facies."""
    try:
        changed = {int(code): None if to is None else int(to) for code, to in dict(merge).items()}
    except (TypeError, ValueError, OverflowError):
        raise CCWSIMError(f"merge = {shown(merge)} must map facies codes to codes") from None
    present = codes_of(codes).tolist()
    if absent := [code for code in changed if code not in present]:
        raise CCWSIMError(f"merge: code {absent[0]} does not occur; the codes are {shown(present)}")
    merged = codes.copy()
    for code, to in changed.items():
        if to is not None:
            merged[codes == code] = to
    dropped = np.isin(codes, [code for code, to in changed.items() if to is None])
    if dropped.all():
        raise CCWSIMError(f"merge = {shown(merge)} leaves no facies; keep at least one")
    if dropped.any():
        from scipy.ndimage import distance_transform_edt

        nearest = distance_transform_edt(dropped, return_distances=False, return_indices=True)
        merged = merged[tuple(np.asarray(nearest))]
    return merged


def asks_for_codes(classes: Classes) -> bool:
    """Return whether the values stay unchanged, because `classes` is None or "codes"."""
    return classes is None or (isinstance(classes, str) and classes == "codes")


def class_edges(values: ArrayLike, n: int) -> Floats:
    """Return the n − 1 ascending inner edges of n classes with equal counts of values.

    Raises `CCWSIMError` if n is outside 2 to 254, or if equal values prevent n distinct edges.

    Examples
    --------
    >>> class_edges([1, 2, 3, 4], 2).tolist()
    [3.0]
    """
    array = as_floats(values, "values").ravel()
    n = check_int("classes", n, 2, MAX_FACIES)
    places = np.arange(1, n) * array.size // n
    edges = np.unique(np.partition(array, places)[places] if array.size else array)
    edges = edges[edges > array.min()] if array.size else edges
    if len(edges) < n - 1:
        raise refused("too_few_classes", possible=len(edges) + 1, n=n)
    return edges.astype(np.float64)


def are_codes(values: Array) -> bool:
    """Return whether values are integers with at most `MAX_CODES` distinct values."""
    seen = np.empty(0, np.int64)
    flat = values.ravel()
    for start in range(0, flat.size, 2**20):
        part = np.unique(flat[start : start + 2**20])
        whole = np.rint(part.astype(np.float64))
        if not (np.abs(whole) < 2.0**62).all() or np.abs(part - whole).max() > 1e-3:
            return False
        seen = np.union1d(seen, whole.astype(np.int64))
        if len(seen) > MAX_CODES:
            return False
    return True


def _edges(classes: object) -> Floats:
    try:
        edges = np.asarray(classes, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        edges = np.empty((0, 0))
    if edges.ndim != 1 or not edges.size or not np.isfinite(edges).all():
        raise refused("classes_not_numbers", classes=shown(classes))
    if (np.diff(edges) <= 0).any() or len(edges) >= MAX_FACIES:
        raise refused("edges_of_classes", classes=shown(classes), most=MAX_FACIES)
    return edges
