"""Where the labels of points go so that none lies on another one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

WIDTH, HEIGHT, GAP = 6.6, 15.0, 9.0
"""Pixels of a letter at size 12, of a line, and from a point to its label."""
Box = tuple[float, float, float, float]
SIDES = {
    "middle right": (1, 0),
    "top center": (0, -1),
    "bottom center": (0, 1),
    "middle left": (-1, 0),
    "top right": (1, -1),
    "bottom right": (1, 1),
    "top left": (-1, -1),
    "bottom left": (-1, 1),
}


def label_sides(
    points: ArrayLike,
    texts: Sequence[str],
    order: Iterable[int],
    room: tuple[float, float],
    blocked: Iterable[Box] = (),
) -> list[str | None]:
    """Return on which side of its point each label goes, None where there is no room for it.

    Parameters
    ----------
    points : array_like, shape (n, 2)
        In pixels from the left and from the top.
    texts : sequence of str
    order : iterable of int
        Which points come first; others get no label.
    room : pair of float
        Width and height in pixels that labels stay in.
    blocked : iterable of box
        Left, top, right and bottom of what no label may lie on.

    Examples
    --------
    >>> label_sides([[10, 50], [14, 50]], ["one", "two"], [0, 1], (100, 100))
    ['top center', 'middle right']
    """
    centres = np.asarray(points, dtype=float).reshape(-1, 2)
    taken: list[Box] = [(x - 6, y - 6, x + 6, y + 6) for x, y in centres.tolist()]
    taken += blocked
    sides: list[str | None] = [None] * len(centres)
    for k in order:
        x, y = centres[k]
        if not np.isfinite((x, y)).all():
            continue
        for side, (right, down) in SIDES.items():
            box = _box(x, y, len(texts[k]) * WIDTH, right, down)
            inside = box[0] >= 0 and box[1] >= 0 and box[2] <= room[0] and box[3] <= room[1]
            own = taken[k]
            if inside and not any(_meet(box, other) for other in taken if other is not own):
                sides[k] = side
                taken.append(box)
                break
    return sides


def _box(x: float, y: float, width: float, right: int, down: int) -> Box:
    """Return left, top, right and bottom of a label beside a point."""
    middle = x + right * (GAP + width / 2)
    line = y + down * (GAP + HEIGHT / 2)
    return middle - width / 2, line - HEIGHT / 2, middle + width / 2, line + HEIGHT / 2


def _meet(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
