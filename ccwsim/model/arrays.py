"""Checks, conversions and hashes of arrays, also of arrays on disk and with named axes."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from hashlib import blake2b
from typing import TYPE_CHECKING, Any, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import NDArray

from ccwsim.model.errors import CCWSIMError, refused, shown
from ccwsim.model.missing import UNKNOWN

if TYPE_CHECKING:
    from numpy.typing import ArrayLike as ArrayLike
else:

    class ArrayLike:
        """An object that `numpy.asarray` converts; `help` shows this name, not NumPy's union."""


Shape: TypeAlias = tuple[int, ...]
"""Shape of a map or a volume."""
Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Bytes: TypeAlias = NDArray[np.uint8]
Mask: TypeAlias = NDArray[np.bool_]
"""Arrays of real numbers, of integers, of indices of facies, and of True and False."""
Array: TypeAlias = NDArray[Any]
Integers: TypeAlias = NDArray[np.integer]
"""Arrays of any type, and of integers of any size, such as facies codes."""
Float32s: TypeAlias = NDArray[np.float32]
Int16s: TypeAlias = NDArray[np.int16]
Int32s: TypeAlias = NDArray[np.int32]
UInt32s: TypeAlias = NDArray[np.uint32]
UInt64s: TypeAlias = NDArray[np.uint64]
"""Arrays of numbers of a smaller or unsigned type."""
MIN_INT, MAX_INT = -(2**63), 2**63 - 1  # smallest and largest 64-bit integer
CELL_AXES = ("layer", "row", "column")
"""Names of the axes of volumes; maps have no layers."""
WORLD_AXES = "x", "y", "z"
"""Axes of world coordinates; the axes of arrays are in reverse order, and maps have no z."""


def describe_shape(shape: Sequence[int]) -> str:
    """Return the numbers of cells along x, y and, for a volume, z as text."""
    return " × ".join(str(n) for n in reversed(shape))


def window_at(first: Iterable[int], lengths: Iterable[int]) -> tuple[slice, ...]:
    """Return the slices of a window with these first cells and lengths along the axes.

    Examples
    --------
    >>> window_at((2, 5), (4, 4))
    (slice(2, 6, None), slice(5, 9, None))
    """
    return tuple(slice(start, start + n) for start, n in zip(first, lengths, strict=True))


def listing(words: Iterable[str]) -> str:
    """Return words joined by commas and "and"."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def as_array(values: ArrayLike, what: str) -> NDArray:
    """Return `values` as an array, or raise `CCWSIMError`."""
    if hasattr(values, "dims") and hasattr(values, "coords"):  # a DataArray names its axes
        values = oriented_values(values)
    if np.ma.is_masked(values):
        raise refused("masked_values", what=what)
    try:
        return np.asarray(values)
    except ValueError:
        raise CCWSIMError(f"{what}: a regular array is needed; the rows differ in length") from None
    except (TypeError, OverflowError, MemoryError):
        raise CCWSIMError(f"{what}: {shown(values)} is not an array of numbers") from None


def as_floats(values: ArrayLike, what: str) -> NDArray[np.float64]:
    """Return `values` as an array of real numbers; NaN is allowed."""
    array = as_array(values, what)
    if array.dtype.kind not in "buif":
        raise CCWSIMError(f"{what}: {shown(values)} is not an array of real numbers")
    return array.astype(np.float64)


def refuse_array(name: str, other: object) -> None:
    """Raise an error if an object, not its cells, is compared with a number or an array."""
    if isinstance(other, (int, float, np.generic, np.ndarray)):
        raise TypeError(f"the {name} is no array; compare its cells: np.asarray({name[0]}) == 1")


def as_seed(seed: object, high: int | None = None) -> int:
    """Return a seed from 0 to `high`; one integer is drawn from a Generator or SeedSequence."""
    if isinstance(seed, (np.random.Generator, np.random.SeedSequence)):
        seed = np.random.default_rng(seed).integers(2**31)
    return check_int("seed", seed, 0, high)


def is_table(data: Any) -> bool:
    """Return whether data are columns with names: a DataFrame, dict or structured array."""
    structured = getattr(getattr(data, "dtype", None), "names", None)
    return hasattr(data, "columns") or isinstance(data, Mapping) or bool(structured)


def is_integer(value: object) -> TypeGuard[int]:
    """Return whether a value is an integer; True and False are not integers."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def check_int(name: str, value: object, low: int, high: int | None = None) -> int:
    """Return an integer from `low` to `high`, or raise `CCWSIMError`."""
    high = MAX_INT if high is None else high
    if is_integer(value) and low <= value <= high:
        return int(value)
    too_large = is_integer(value) and value > high
    bounds = f", at least {low}" if high == MAX_INT and not too_large else f" from {low} to {high}"
    raise CCWSIMError(f"{name} = {shown(value)} must be a whole number{bounds}")


def check_number(
    name: str, value: object, low: float, high: float, open_below: bool = False
) -> float:
    """Return a number from `low` (above it, if `open_below`) to `high`, or raise `CCWSIMError`."""
    is_number = isinstance(value, (int, float, np.integer, np.floating))
    in_range = is_number and low <= value <= high and not (open_below and value == low)
    too_long = isinstance(value, int) and abs(value) >= 2**1023  # for a floating-point number
    if not in_range or too_long or isinstance(value, bool):
        above = "more than" if open_below else "from"
        raise CCWSIMError(
            f"{name} = {shown(value)} must be a number {above} {low:g}, up to {high:g}"
        )
    return float(value)  # type: ignore[arg-type]


def check_choice(name: str, value: object, allowed: Iterable[str]) -> str:
    """Return a value that is one of the allowed texts, or raise `CCWSIMError`."""
    if not (isinstance(value, str) and value in tuple(allowed)):
        raise CCWSIMError(f"{name} = {shown(value)} must be one of {', '.join(allowed)}")
    return value


def check_type(name: str, value: object, *types: Any) -> None:
    """Raise `CCWSIMError` unless an argument has one of the types; the message names the first."""
    if not isinstance(value, types):
        raise CCWSIMError(f"{name} = {shown(value)} must be of type {types[0].__name__}")


def check_callable(name: str, value: object) -> None:
    """Raise `CCWSIMError` for an argument that is neither callable nor None; True is a bar."""
    if value is not None and not callable(value) and not (name == "progress" and value is True):
        raise CCWSIMError(f"{name} = {shown(value)} must be a function, or None")


def as_integers(
    values: ArrayLike,
    what: str,
    low: int = MIN_INT,
    high: int = MAX_INT,
    remedy: str = "for continuous values give classes or a threshold",
) -> NDArray[np.int64]:
    """Return `values` as int64; raise `CCWSIMError` unless all are integers from `low` to `high`.

    A cast would change values that do not fit into int64. Values within 1e-3 of an integer
    are rounded because MATLAB files have codes such as 0.9999.
    """
    array = as_array(values, what)
    if array.dtype.kind not in "buif":
        raise CCWSIMError(f"{what}: whole numbers are needed, not values of type {array.dtype}")
    if array.dtype.kind == "f":
        if not np.isfinite(array).all():
            bad = array[~np.isfinite(array)].flat[0]
            raise CCWSIMError(f"{what}: {bad} is not a number; no value may be missing")
        rounded = np.rint(array)
        far = np.abs(array - rounded) > 1e-3
        if far.any():
            raise CCWSIMError(f"{what}: {array[far].flat[0]:g} is not a whole number; {remedy}")
        array = rounded
    if array.size:
        ends = int(array.min()), int(array.max())  # Python compares them exactly
        wrong = next((end for end in ends if not low <= end <= high), None)
        if wrong is not None:
            size = "small" if wrong < low else "large"
            limit = f"at least {low}" if wrong < low else f"at most {high}"
            raise CCWSIMError(f"{what}: {shown(wrong)} is too {size}; give {limit}")
    return array.astype(np.int64)


def codes_of(integers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the distinct values of an array, sorted."""
    low, high = int(integers.min()), int(integers.max())
    if high - low >= 2**16:
        return np.unique(integers)
    return np.flatnonzero(np.bincount((integers - low).ravel())) + low


def ratio(
    numerators: NDArray, denominators: NDArray, otherwise: ArrayLike = np.nan
) -> NDArray[np.float64]:
    """Return numerators / denominators, or `otherwise` if a denominator is not positive."""
    shape = np.broadcast_shapes(numerators.shape, denominators.shape)
    quotients = np.full(shape, otherwise, dtype=float)
    return np.divide(numerators, denominators, out=quotients, where=denominators > 0)


def frozen(array: NDArray) -> NDArray:
    """Return a contiguous, read-only copy."""
    copy = np.array(array, order="C", copy=True)
    copy.setflags(write=False)
    return copy


def readonly(array: NDArray) -> NDArray:
    """Return a read-only view, or the array itself if it is read-only."""
    if not array.flags.writeable:
        return array
    view = array.view()
    view.setflags(write=False)
    return view


class ReadOnly:
    """A base class of objects whose arrays stay read-only when they are copied or unpickled."""

    def __setstate__(self, state: dict[str, object]) -> None:
        for value in state.values():
            for array in value.values() if isinstance(value, dict) else (value,):
                if isinstance(array, np.ndarray):
                    array.setflags(write=False)
        vars(self).update(state)


def smallest_integers(array: NDArray[np.int64]) -> NDArray[np.integer]:
    """Return `array` in the smallest integer type for its values."""
    if not array.size:
        return array.astype(np.uint8)
    low, high = array.min(), array.max()
    furthest = high if low >= 0 else min(low, -high - 1)
    return array.astype(np.min_scalar_type(furthest))


def digest(*parts: object) -> str:
    """Return a short hash of arrays and plain values."""
    sums = blake2b(digest_size=12)
    for part in parts:
        if isinstance(part, (np.ndarray, LazyStack)):
            sums.update(repr((part.shape, part.dtype.str)).encode())
            for piece in part if part.ndim > 2 else (part,):  # stacks on disk are read in pieces
                sums.update(np.ascontiguousarray(piece).tobytes())
        elif isinstance(part, bytes):  # hashed directly: repr would need four times the memory
            sums.update(b"%d:" % len(part))
            sums.update(part)
        else:
            sums.update(repr(part).encode())
    return sums.hexdigest()


class LazyStack:
    """A stack of facies codes on disk that behaves like an array of facies indices."""

    dtype = np.dtype(np.uint8)

    def __init__(self, stack: NDArray, codes: NDArray) -> None:
        self.stack = stack
        self._codes = codes[~np.isnan(codes)]
        self.shape, self.ndim, self.size = stack.shape, stack.ndim, stack.size
        self.nbytes = stack.size

    def __len__(self) -> int:
        return len(self.stack)

    def __getitem__(self, which: Any) -> NDArray[np.uint8]:
        part = np.asarray(self.stack[which])
        indices = np.full(part.shape, UNKNOWN, np.uint8)
        for k, code in enumerate(self._codes):  # searchsorted would need eight bytes per cell
            np.copyto(indices, k, where=part == code)
        return indices

    def __iter__(self) -> Iterator[NDArray[np.uint8]]:
        return (self[k] for k in range(len(self)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray:
        return self[:].astype(dtype or self.dtype, copy=False)

    def copy(self) -> NDArray[np.uint8]:
        """Return all indices as an array in memory."""
        return self[:]


AXIS_NAMES = {
    "x": "x easting east lon longitude i column col xc x1",
    "y": "y northing north lat latitude j row yc y1",
    "z": "z elevation height altitude level lev zc band depth dept tvd layer layers lay ilay k",
}
"""Usual names of axes along x, y and z, in lower case."""
DOWNWARD = "depth dept tvd tvdss tiefe teufe layer layers lay ilay k"
"""Names of axes that count from the top, in lower case."""


def oriented_values(array: Any) -> NDArray:
    """Return the values of a DataArray as (z,) y, x, each axis ascending."""
    names = _axes(array)
    array = array.squeeze([d for d in array.dims if array.sizes[d] == 1 and d not in names[:2]])
    order = list(reversed(_axes(array)))
    values = np.transpose(array.values, [array.dims.index(name) for name in order])
    for axis, name in enumerate(order):
        if _is_descending(array, name):
            values = np.flip(values, axis)
    return values


def _is_descending(array: Any, name: Any) -> bool:
    coordinates = _coordinates(array, name)
    return coordinates is not None and len(coordinates) > 1 and coordinates[0] > coordinates[-1]


def is_top_first(array: Any) -> bool:
    """Return whether the first layer of a DataArray with three axes is the top."""
    return any(_is_descending(array, name) for name in _axes(array)[2:3])


def labelled_axes(array: Any) -> list[tuple[float, float]]:
    """Return cell size and origin along x, y (and z) of a DataArray."""
    names = _axes(array)
    names = [name for name in names if name in names[:2] or array.sizes[name] > 1]
    return [_cells_along(array, name) for name in names]


def _axes(array: Any) -> list[Any]:
    """Return the names of the axes in the order x, y, z and others."""
    name_of: dict[str, Any] = {}
    for name in array.dims:
        attributes = array.coords[name].attrs if name in array.coords else {}
        stated = str(attributes.get("axis", "")).lower()
        word = str(name).lower()
        axis = next((a for a, words in AXIS_NAMES.items() if word in words.split()), stated)
        if axis in AXIS_NAMES and axis not in name_of:
            name_of[axis] = name
    unnamed = [name for name in reversed(array.dims) if name not in name_of.values()]
    for axis in AXIS_NAMES:
        if axis not in name_of and unnamed:
            name_of[axis] = unnamed.pop(0)
    return [name_of[axis] for axis in AXIS_NAMES if axis in name_of] + unnamed


def _coordinates(array: Any, name: Any) -> NDArray[np.float64] | None:
    """Return the coordinates along an axis; depths and layers from the top are negative.

    The attribute `positive` decides; without it, the names of the axis.
    """
    is_listed = name in array.coords and array.coords[name].dtype.kind in "iuf"
    attributes = array.coords[name].attrs if is_listed else {}
    names = f"{name} {attributes.get('standard_name')} {attributes.get('long_name')}"
    counts_down = not {*names.lower().split()}.isdisjoint(DOWNWARD.split())
    if not is_listed and not counts_down:
        return None
    n = array.sizes[name]
    values = np.asarray(array.coords[name].values if is_listed else np.arange(n) + 0.5, np.float64)
    usual = "down" if counts_down and not (values < 0).any() else "up"
    return -values if str(attributes.get("positive", usual)).lower() == "down" else values


def _cells_along(array: Any, name: Any) -> tuple[float, float]:
    coordinates = _coordinates(array, name)
    if coordinates is None or len(coordinates) < 2:
        return 1.0, 0.0 if coordinates is None else float(coordinates[0]) - 0.5
    steps = np.diff(np.sort(coordinates))
    size = float(np.median(steps))
    if size <= 0 or np.abs(steps - size).max() > 1e-3 * size:
        raise refused("unequal_spacing", name=name)
    size = float(f"{(coordinates.max() - coordinates.min()) / (len(coordinates) - 1):.12g}")
    return size, float(coordinates.min()) - size / 2
