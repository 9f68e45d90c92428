"""Heads along the outline of active cells, and the faces of cells whose heads are fixed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ccwsim import Grid
from ccwsim.model import (
    MAX_MAGNITUDE,
    Array,
    ArrayLike,
    Floats,
    Int32s,
    Ints,
    Mask,
    Shape,
    as_floats,
    refused,
    shown,
)

EndPoints = tuple[tuple[float, float], tuple[float, float]]  # (x, y) of both ends of a line


@dataclass(frozen=True)
class Edge:
    """Heads along the outline of the active cells; in a volume, along that of each layer.

    Each connected part of the active cells has its own outline. Inactive cells that a part encloses
    are no-flow. Raises `CCWSIMError` unless heads and points are finite, and points differ.

    Parameters
    ----------
    heads : number or pair of numbers
        The head, or the heads at both ends of `along`, between which heads are linear.
    along : str or pair of points
        "x": from the west to the east end of the active cells; "y": from the south to the north
        end; or two points (x, y). Heads depend on the position along this straight line, and are
        constant beyond its ends.

    Examples
    --------
    >>> Edge(12.0).heads, Edge((12.0, 7.5), along="y").axis
    ((12.0, 12.0), 'y')
    >>> Edge((12.0, 7.5), along=((0, 0), (500, 200))).axis
    'x'
    """

    heads: tuple[float, float]
    along: str | EndPoints = "x"

    def __init__(self, heads: ArrayLike = (1.0, 0.0), along: str | ArrayLike = "x") -> None:
        values = as_floats(heads, "heads along the outline")
        if values.shape not in ((), (1,), (2,)) or not (np.abs(values) <= MAX_MAGNITUDE).all():
            raise refused("edge_heads", heads=shown(heads), most=MAX_MAGNITUDE)
        object.__setattr__(self, "heads", tuple(np.broadcast_to(values, 2).tolist()))
        if not isinstance(along, str):
            ends = as_floats(along, "points of the outline")
            bad = ends.shape != (2, 2) or not (np.abs(ends) <= MAX_MAGNITUDE).all()
            along = "" if bad or (ends[0] == ends[1]).all() else tuple(map(tuple, ends.tolist()))
        if not along or (isinstance(along, str) and along not in ("x", "y")):
            raise refused("edge_along", most=MAX_MAGNITUDE)
        object.__setattr__(self, "along", along)

    @property
    def axis(self) -> str:
        """The axis, "x" or "y", that is closer to the line along which heads change."""
        if isinstance(self.along, str):
            return self.along
        wide, high = np.abs(np.subtract(*self.along))
        return "x" if wide >= high else "y"

    def line(self, active: Mask, grid: Grid) -> EndPoints:
        """Return both ends of the straight line along which heads change."""
        if not isinstance(self.along, str):
            return self.along
        number = "xy".index(self.along)
        lines = np.flatnonzero(np.moveaxis(active, -1 - number, 0).any((*range(1, active.ndim),)))
        ends = np.zeros((2, 2))
        ends[:, number] = grid.origin[number] + grid.cell_size[number] * (lines[[0, -1]] + [0, 1])
        (x0, y0), (x1, y1) = ends.tolist()
        return (x0, y0), (x1, y1)

    def gradient(self, active: Mask, grid: Grid) -> float:
        """Return the fall of the heads per length of the line along which they change."""
        return float(-np.diff(self.heads)[0] / np.hypot(*np.subtract(*self.line(active, grid))))

    def at_faces(self, active: Mask, grid: Grid) -> list[Floats]:
        """Return the heads at the n + 1 faces along each axis; NaN unless on the outline."""
        start, end = np.array(self.line(active, grid))
        way = (end - start) / np.sum((end - start) ** 2)
        faces = []
        for axis, on_outline in enumerate(_outlines(active)):
            centres = np.argwhere(on_outline) + 0.5 * (np.arange(active.ndim) != axis)
            places = centres[:, :-3:-1] * grid.cell_size[:2] + grid.origin[:2]  # x, y
            share = np.clip((places - start) @ way, 0, 1)
            faces.append(np.full(on_outline.shape, np.nan))
            faces[-1][on_outline] = self.heads[0] + share * (self.heads[1] - self.heads[0])
        return faces


def _outlines(active: Mask) -> list[Array]:
    """Return which of the n + 1 faces along each axis are on the outline of a connected part."""
    lateral = ndimage.generate_binary_structure(2, 1)[(None,) * (active.ndim - 2)]
    along = np.eye(active.ndim, dtype=int)
    faces = [np.zeros(active.shape + step, bool) for step in along]
    labels: Int32s = ndimage.label(active)[0]  # type: ignore[index]
    for number, box in enumerate(ndimage.find_objects(labels), 1):
        part = np.asarray(ndimage.binary_fill_holes(labels[box] == number, lateral))
        for axis in range(active.ndim - 2, active.ndim):
            wider = (*box[:axis], slice(box[axis].start, box[axis].stop + 1), *box[axis + 1 :])
            faces[axis][wider] |= np.diff(part, axis=axis, prepend=False, append=False)
    return faces


def side_faces(ends: Sequence[Sequence[Floats]], shape: Shape) -> list[Floats]:
    """Return the heads at the n + 1 faces along each axis; NaN unless they are at a side."""
    faces = []
    for axis, heads in enumerate(ends):
        face_heads = np.full(shape + np.eye(len(shape), dtype=int)[axis], np.nan)
        for end, head in zip((0, -1), heads, strict=True):
            face_heads[(*[slice(None)] * axis, end)] = head
        faces.append(face_heads)
    return faces


@dataclass(frozen=True, eq=False)
class FixedFaces:
    """The m faces of active cells whose heads are fixed."""

    cells: Ints  # indices ((layer,) row, column) of the cells, shape (m, dimensions)
    axes: Ints  # axis of the arrays across each face, shape (m,)
    ends: Ints  # 0 for a face at the low end of its cell, 1 at the high end
    heads: Floats
    conductances: Floats  # 2 K · area / cell size
    inflows: Floats  # volume per time that flows in, negative for outflow


def fixed_faces(
    at_faces: Sequence[Floats], mask: Mask, conductances: Sequence[Floats]
) -> FixedFaces:
    """Return the faces with heads: those across x first, and low ends before high ends.

    `conductances` of whole cells are those of a face times the size of a cell, K · area / size.
    """
    parts = []
    for axis in reversed(range(mask.ndim)):
        n = mask.shape[axis]
        for end in (0, 1):
            heads = at_faces[axis].take(np.arange(end, n + end), axis)
            cells = np.argwhere(mask & np.isfinite(heads))
            index, ones = tuple(cells.T), np.ones(len(cells), int)
            numbers = heads[index], 2 * conductances[axis][index], 0.0 * ones
            parts.append((cells, axis * ones, end * ones, *numbers))
    return FixedFaces(*map(np.concatenate, zip(*parts, strict=True)))
