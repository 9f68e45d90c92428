"""What all metrics take: one image (ny, nx) or a stack of them (n, ny, nx) of facies indices."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.model.arrays import as_array, check_int
from ccwsim.model.bounds import MAX_FACIES
from ccwsim.model.errors import CCWSIMError
from ccwsim.system.workers import Watch, check_stop, n_cores, run_all

CELLS_A_PIECE = 200_000_000
"""Cells that are compared between two checks for a stop: some tenths of a second."""
Result = TypeVar("Result")
Fraction = Callable[[float], None]
"""Called as progress(fraction) in the caller's own thread."""


def as_stack(images: ArrayLike) -> NDArray[np.integer]:
    """Return one image or many as an array (n, ny, nx) of whole numbers, or raise `CCWSIMError`.

    Examples
    --------
    >>> as_stack([[0, 1], [1, 1]]).shape
    (1, 2, 2)
    """
    array = as_array(images, "images")
    if array.ndim not in (2, 3) or array.size == 0:
        raise CCWSIMError(
            f"images of shape (ny, nx) or (n, ny, nx) are needed, not {array.shape}; "
            "give one image or a stack of realizations"
        )
    if array.dtype.kind not in "bui":
        raise CCWSIMError(
            f"images of whole numbers are needed, not of type {array.dtype}; give facies indices"
        )
    if array.dtype.kind == "b":
        array = array.view(np.uint8)
    return array if array.ndim == 3 else array[None]


def as_image(image: ArrayLike) -> NDArray[np.integer]:
    """Return one image as an array (ny, nx) of whole numbers.

    Examples
    --------
    >>> as_image([[0, 1], [1, 1]]).shape
    (2, 2)
    """
    stack = as_stack(image)
    if len(stack) > 1:
        raise CCWSIMError(f"one image of shape (ny, nx) is needed, not {len(stack)} of them")
    return stack[0]


def as_indices(images: ArrayLike, n_facies: int) -> NDArray[np.uint8]:
    """Return one image or many as bytes (n, ny, nx) from 0 to n_facies − 1.

    Examples
    --------
    >>> as_indices([[0, 1], [1, 1]], 2).dtype
    dtype('uint8')
    """
    stack = as_stack(images)
    n_facies = check_int("n_facies", n_facies, 1, MAX_FACIES)
    low, high = int(stack.min()), int(stack.max())
    if low < 0 or high >= n_facies:
        wrong = low if low < 0 else high
        raise CCWSIMError(
            f"facies index {wrong} is not one of 0 … {n_facies - 1}; "
            "give the indices of the training image, not its codes"
        )
    return np.ascontiguousarray(stack, dtype=np.uint8)


def in_pieces(
    function: Callable[[NDArray], NDArray], rows: NDArray, cells: int
) -> NDArray[np.integer]:
    """Return function(rows), computed in pieces of some rows, between which it can be stopped.

    `function` returns one row for each of those it is given, from so many `cells` each.

    Examples
    --------
    >>> in_pieces(lambda rows: 2 * rows, np.arange(3), cells=CELLS_A_PIECE)
    array([0, 2, 4])
    """
    at_once = max(CELLS_A_PIECE // max(cells, 1), 1)
    if len(rows) <= at_once:
        return function(rows)
    found = []
    for first in range(0, len(rows), at_once):
        check_stop()
        found.append(function(rows[first : first + at_once]))
    return np.concatenate(found)


def map_parallel(
    function: Callable[[int], Result], n: int, progress: Fraction | None = None
) -> list[Result]:
    """Return function(0) … function(n − 1), computed on all cores by kernels without the lock.

    Examples
    --------
    >>> map_parallel(lambda k: k * k, 4)
    [0, 1, 4, 9]
    """
    if n == 1:  # no threads for a single image
        only = [function(0)]
        if progress:
            progress(1.0)
        return only
    results: list = [None] * n

    def task(number: int, watch: Watch) -> None:
        watch.check()
        results[number] = function(number)
        watch.report(1.0)

    if n:
        run_all(task, n, n_cores(), (lambda fraction, _: progress(fraction)) if progress else None)
    return results
