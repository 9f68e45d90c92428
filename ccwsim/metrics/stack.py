"""Conversion of ensembles, training images and arrays to one type, `Stack`, for all metrics."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ccwsim.jobs.workers import check_stop, run_all
from ccwsim.model import (
    MAX_FACIES,
    UNKNOWN,
    Array,
    ArrayLike,
    Bytes,
    CCWSIMError,
    Ensemble,
    Floats,
    Fraction as Fraction,
    Integers,
    TrainingImage,
    Watch as Watch,
    as_array,
    as_integers,
    codes_of,
    codes_with_nan,
    index_of,
    refused,
    shown,
    smallest_box,
)
from ccwsim.system.machine import n_cores

N_AXES = 3  # axes of a volume: layers from the bottom, rows from the south, columns from the west
CELLS_A_PIECE = 200_000_000
"""Number of cells compared between two checks for cancellation (some tenths of a second)."""
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Stack:
    """Images as facies indices, with the codes of all facies, including absent facies."""

    # shape (n, ny, nx), or (n, nz, ny, nx) for volumes; 255 in unknown and inactive cells
    indices: Bytes
    codes: Integers  # shape (n_facies,): sorted
    names: tuple[str, ...] = ()  # of the facies of an ensemble or training image
    values: Floats | None = None  # of a continuous variable, in the shape of `indices`

    def __len__(self) -> int:
        return len(self.indices)

    @property
    def n_facies(self) -> int:
        """Number of facies, including absent facies."""
        return len(self.codes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns of each map; layers, rows and columns of each volume."""
        return self.indices.shape[1:]

    @property
    def is_volumes(self) -> bool:
        """Whether the images are volumes."""
        return len(self.shape) == N_AXES

    def volume(self, k: int) -> Bytes:
        """Return image k as a volume, shape (nz, ny, nx); a map has one layer."""
        return as_volume(self.indices[k])

    def index_of(self, facies: int | str, name: str = "facies") -> int:
        """Return the index of a facies, given by code or name, or raise `CCWSIMError`."""
        return index_of(self.codes, facies, name, self.names)


Images = Stack | Ensemble | TrainingImage | ArrayLike
"""Types of images; by default, the codes of an array are the values that occur in it."""
Codes = ArrayLike  # codes of all facies, including absent facies


def as_stack(images: Images, codes: Codes | None = None, n_axes: int = 2) -> Stack:
    """Return images as a stack, NaN as unknown; three axes are a volume only if `n_axes` is 3."""
    wanted = None if codes is None else checked_codes(codes)
    if isinstance(images, Stack):
        stack = images
    elif isinstance(images, Ensemble):
        image, values = images.training_image, next(iter(images.values.values()), None)
        stack = Stack(np.asarray(images.indices), image.codes, image.facies_names, values)
    elif isinstance(images, TrainingImage):
        values = images.values[images.variable][None] if images.values else None
        stack = Stack(images.indices[None], images.codes, images.facies_names, values)
    else:
        values, valid = as_values(images, n_axes), None
        if values.dtype.kind == "f":
            valid = ~np.isnan(values)
            if not valid.any():
                raise CCWSIMError("images: no cell has a value; give facies codes")
            values = np.where(valid, values, values[valid][0])
            values = as_integers(values, "images")
        if wanted is None:  # a mask has both codes, even if none or all of its cells are set
            is_mask = getattr(images, "dtype", None) == np.bool_
            wanted = np.arange(2) if is_mask else _codes_in(values)
        indices = _indices(values, wanted)
        return Stack(indices if valid is None else np.where(valid, indices, UNKNOWN), wanted)
    if wanted is None or np.array_equal(wanted, stack.codes):
        return stack
    places = np.full(256, UNKNOWN, np.uint8)
    present = np.setdiff1d(stack.indices, UNKNOWN)
    places[present] = _indices(stack.codes[present], wanted)
    return Stack(places[stack.indices], wanted)


def known_part(images: Images, codes: Codes | None = None) -> Stack:
    """Return images in the smallest window that has all cells with a facies in any image."""
    stack = as_stack(images, codes)
    window = slice(None), *smallest_box(stack.indices.min(axis=0) != UNKNOWN)
    return replace(stack, indices=stack.indices[window])


def as_image(image: Images, codes: Codes | None = None, n_axes: int = 2) -> Stack:
    """Return one image as a stack; an array of several layers is a volume."""
    if not isinstance(image, (Stack, Ensemble, TrainingImage)):
        image = as_array(image, "images")
        if image.ndim == N_AXES and len(image) > 1:
            n_axes = N_AXES
    stack = as_stack(image, codes, n_axes)
    if len(stack) > 1:
        raise refused("one_image", n=len(stack))
    return stack


def as_values(images: Images, n_axes: int = 2) -> Array:
    """Return facies codes, shape (n, ny, nx) or (n, nz, ny, nx); NaN in unknown cells."""
    if isinstance(images, Stack):
        has_unknown = bool((images.indices == UNKNOWN).any())
        return codes_with_nan(images.codes, has_unknown)[images.indices]
    if isinstance(images, Ensemble):
        return images.realizations
    if isinstance(images, TrainingImage):
        return images.array[None]
    array = as_array(images, "images")
    if array.ndim not in (2, N_AXES, N_AXES + 1) or array.size == 0:
        raise refused("images_shape", shape=array.shape)
    has_gaps = array.dtype.kind == "f" and bool(np.isnan(array).any())
    is_whole_float = array.dtype.kind == "f" and (has_gaps or np.array_equal(array, array.round()))
    if array.dtype.kind not in "bui" and not is_whole_float:
        raise refused("images_of_integers", dtype=array.dtype)
    if array.dtype.kind == "b":
        array = array.view(np.uint8)
    elif array.dtype == np.uint64 or (is_whole_float and not has_gaps):
        array = as_integers(array, "images")
    is_one = array.ndim == 2 or array.ndim == n_axes == N_AXES
    return array[None] if is_one else array


def as_volume(image: Array) -> Array:
    """Return a map or volume as a volume: a map has one layer."""
    return image if image.ndim == N_AXES else image[None]


def _listed(codes: Integers) -> str:
    """Return the first ten codes as text."""
    return ", ".join(map(str, codes[:10].tolist())) + (" …" if len(codes) > 10 else "")


def codes_or_places(codes: Codes | None, n_facies: int) -> Integers:
    """Return the codes of `n_facies` facies; the default is 0 … n_facies − 1."""
    facies_codes = np.arange(n_facies) if codes is None else checked_codes(codes)
    if len(facies_codes) != n_facies or not (codes is None or np.array_equal(facies_codes, codes)):
        raise CCWSIMError(f"codes = {shown(codes)} must be {n_facies} ascending facies codes")
    return facies_codes


def checked_codes(codes: Codes) -> Integers:
    """Return facies codes as a sorted array, or raise `CCWSIMError`."""
    values = as_integers(list(codes) if isinstance(codes, range) else codes, "codes")
    distinct = np.unique(values)
    if values.ndim != 1 or not 1 <= len(distinct) <= MAX_FACIES or len(distinct) < len(values):
        raise refused("facies_codes", codes=shown(codes), most=MAX_FACIES)
    return distinct


def _codes_in(values: Integers) -> Integers:
    """Return the codes that occur, sorted."""
    codes = np.unique(np.concatenate([codes_of(as_integers(v, "facies codes")) for v in values]))
    if len(codes) > MAX_FACIES:
        raise refused("images_look_continuous", n=len(codes))
    return codes


def _indices(values: Integers, codes: Integers) -> Bytes:
    """Return the index in `codes` of each cell's code."""
    n = len(codes)
    if codes[0] == 0 and codes[-1] == n - 1:  # codes equal indices
        low, high = int(values.min()), int(values.max())
        wrong = low if low < 0 else high
        if low < 0 or high >= n:
            raise CCWSIMError(f"facies code {wrong} is not one of {_listed(codes)}")
        return np.ascontiguousarray(values, dtype=np.uint8)
    indices = np.full(values.shape, n, np.uint8)
    for k, code in enumerate(codes.tolist()):
        np.copyto(indices, k, where=values == code)
    unknown = values[indices == n]
    if len(unknown):
        raise CCWSIMError(f"facies code {unknown[0]} is not one of {_listed(codes)}")
    return indices


def in_pieces(function: Callable[[Array], Array], rows: Array, n_cells: int) -> Integers:
    """Return function(rows), computed for a few rows at a time, so that a user can cancel.

    A row has `n_cells` cells.
    """
    at_once = max(CELLS_A_PIECE // max(n_cells, 1), 1)
    if len(rows) <= at_once:
        return function(rows)
    pieces = []
    for first in range(0, len(rows), at_once):
        check_stop()
        pieces.append(function(rows[first : first + at_once]))
    return np.concatenate(pieces)


def map_parallel(
    function: Callable[[int], Result], n: int, progress: Fraction | None = None
) -> list[Result]:
    """Return function(0) … function(n − 1), computed in threads on all cores."""
    results: list = [None] * n
    whole = Watch.of_share(progress)

    def task(k: int, watch: Watch) -> None:
        results[k] = function(k)
        watch.tell(1.0)

    if n == 1:  # no threads for a single image
        task(0, whole)
    elif n:
        run_all(task, n, n_cores(), whole)
    return results
