"""Windows of active cells, in which statistics are compared with those of a training image.

A statistic of a piece that is cut by inactive cells differs from that of a whole piece: geobodies
end at the border, and nothing percolates or flows. Statistics are therefore judged in windows
without inactive cells.
"""

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np

from ccwsim.model.arrays import Ints, Mask, Shape

Window = tuple[slice, ...]


def smallest_box(mask: Mask) -> Window:
    """Return the smallest window with all cells of a mask, which has at least one."""
    axes = set(range(mask.ndim))
    indices = [np.flatnonzero(mask.any(axis=tuple(axes - {axis}))) for axis in sorted(axes)]
    return tuple(slice(int(along[0]), int(along[-1]) + 1) for along in indices)


def window_shape(window: Window) -> Shape:
    """Return the number of cells of a window along each axis."""
    return tuple(part.stop - part.start for part in window)


def count_in_windows(mask: Mask, shape: Sequence[int]) -> Ints:
    """Return the number of cells of a mask in each window of a shape, by its first cell."""
    counts = mask.astype(np.int64)
    for side in shape:  # axes are permuted cyclically
        sums = np.insert(np.cumsum(counts, axis=0), 0, 0, axis=0)
        counts = np.moveaxis(sums[side:] - sums[:-side], 0, -1)
    return counts


def even_corners(sides: Shape, shape: Shape, counts: Iterable[int]) -> Ints:
    """Return the first cells of evenly spaced windows, `counts` of them along the sides."""
    starts = [
        np.linspace(0, side - length, count).astype(int)
        for side, length, count in zip(sides, shape, counts, strict=True)
    ]
    return np.array([*product(*starts)])


def windows_at(corners: Ints, shape: Shape) -> list[Window]:
    """Return the windows of a shape with these first cells."""
    return [
        tuple(map(slice, corner, end))
        for corner, end in zip(corners.tolist(), (corners + shape).tolist(), strict=True)
    ]


def active_windows(active: Mask, shape: Shape) -> list[Window]:
    """Return windows of a shape without inactive cells and without overlap.

    The windows are evenly spaced in the smallest box with all active cells. If the box has inactive
    cells, they are those of a regular lattice, at the offset with the largest number of windows.
    """
    box = smallest_box(active)
    counts = np.floor_divide(window_shape(box), shape)
    corners = even_corners(window_shape(box), shape, counts)
    if not active[box].all():
        corners = np.argwhere(count_in_windows(~active[box], shape) == 0)
        offsets = np.ravel_multi_index(tuple((corners % shape).T), shape)
        corners = corners[offsets == np.bincount(offsets, minlength=1).argmax()]
    return windows_at(corners + [part.start for part in box], shape)


def widest_window(active: Mask) -> Window:
    """Return the smallest box with all active cells or, if this box has inactive cells, a part.

    The part is the largest square or cube without inactive cells, cut to the sides of the box.
    """
    box = smallest_box(active)
    if active[box].all():
        return box

    def windows(side):
        return active_windows(active, tuple(min(n, side) for n in window_shape(box)))

    sides = range(1, max(window_shape(box)) + 1)
    return windows(bisect_left(sides, True, key=lambda side: not windows(side)))[0]
