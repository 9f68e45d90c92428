"""Copies of the training images, turned, scaled and mirrored, in which patches are searched.

All copies are layers of one array, the *stack*. Each cell of the grid has a *kind*: the zone, and
the class of its angle, scale and dip. The copies of a kind are adjacent in the stack, so that a
patch is compared with these layers only. Cells of a copy outside the image are unknown; patches
with unknown cells are excluded. This is not in the paper.
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations
from math import prod
from typing import NamedTuple

import numpy as np

from ccwsim.engine.stages.path import Triple, in_layers
from ccwsim.model import (
    UNKNOWN,
    Array,
    Bytes,
    CCWSIMError,
    Floats,
    Grid,
    Int32s,
    Ints,
    Mask,
    Secondary,
    Study,
    describe_shape,
    refused,
)

MAX_TURNS = 16  # maximum number of combinations of angle, scale and dip
WIDER = 1.25  # factor by which tolerances grow until there are at most MAX_TURNS combinations
SCALE_TOLERANCE = 0.04  # maximum difference of ln(scale) from the map
MAX_COPIED_CELLS = 400_000_000  # maximum number of cells of all copies


class Copies(NamedTuple):
    """The stack of copies of a study, in the orientation of the grid."""

    indices: Bytes  # shape (nz, ny, nx); n_facies in unknown cells
    known_mask: Mask  # known cells of the stack
    # number of the cell, counted through all training images; −1 in unknown cells
    origins: Int32s
    layers: Ints  # shape (n_kinds, 2): first layer and number of layers of a kind
    kinds: Bytes  # shape (nz, ny, nx) of the grid: the kind of each cell
    # weight of each image, (1.0,) without weights; the kind of a cell is that of the first image,
    # and the kinds of the other images follow
    weights: tuple[float, ...]
    proportions: Floats  # shape (n_kinds, n_facies)
    turns: Floats  # shape (n_kinds, 5): angle, scale along x, y and z, dip
    names: list[str]  # image and turn of each layer of the stack, in words

    @property
    def expected(self) -> Floats:
        """Mean proportions of the kinds in the grid, shape (n_facies,)."""
        shares = np.bincount(self.kinds.ravel(), minlength=len(self.layers)) / self.kinds.size
        if len(self.weights) > 1:
            shares = np.outer(shares[:: len(self.weights)], self.weights).ravel()
        return shares @ self.proportions

    def around(self) -> Ints:
        """Return `layers` for windows, which use the images of all weights."""
        n, layers = len(self.weights), self.layers.copy()
        for k in range(0, len(layers), n):
            layers[k : k + n] = layers[k, 0], layers[k : k + n, 1].sum()
        return layers


def make_copies(study: Study) -> Copies | None:
    """Return the copies of a study; None if it uses only the unchanged training image.

    Raises `CCWSIMError` if the copies have too many cells.
    """
    secondary = study.secondary_or_empty
    if not secondary.has_copies:
        return None
    if (n_cells := n_cells_of_copies(study)) > MAX_COPIED_CELLS:
        raise refused("too_many_copies", n=n_cells, most=MAX_COPIED_CELLS)
    images = [study.training_image, *secondary.images]
    turns, turn_of = turns_of(secondary, in_layers(study.grid.shape))
    together = secondary.zones is None and secondary.weights is None
    groups = [range(len(images))] if together else [range(k, k + 1) for k in range(len(images))]
    kinds, used = turn_of * len(groups), np.arange(len(turns) * len(groups))
    if secondary.zones is not None:
        zones = secondary.zones.reshape(kinds.shape)
        used, kinds = np.unique(kinds + zones, return_inverse=True)
    gap = _gap(study)
    n_facies, numbers = study.training_image.n_facies, _numbers([i.shape for i in images])
    stack: list[tuple[Array, Array]] = []
    layers, proportions, names = [], [], list[str]()
    for kind in used.tolist():
        turn, group = divmod(kind, len(groups))
        first, counts = sum(len(values) for values, _ in stack), np.zeros(n_facies)
        for k in groups[group]:
            indices = images[k].indices
            counts += np.bincount(indices.ravel(), minlength=256)[:n_facies]
            for flipped in _flips(secondary.mirrored):
                origins = _turned(numbers[k], flipped, turns[turn], study.grid.cell_size, gap)
                stack.append((_values(indices, numbers[k], origins), origins))
                name = images[k].name.replace("_", " ") or f"image {k}"
                names += [_name_of_copy(name, turns[turn], flipped)] * len(origins)
        layers.append((first, sum(len(values) for values, _ in stack) - first))
        proportions.append(counts / counts.sum())
    shape = [max(values.shape[axis] for values, _ in stack) for axis in (1, 2)]
    indices = np.concatenate([_padded(values, shape, UNKNOWN) for values, _ in stack])
    return Copies(
        indices=np.minimum(indices, n_facies),
        known_mask=indices != UNKNOWN,
        origins=np.concatenate([_padded(origins, shape, -1) for _, origins in stack]),
        layers=np.array(layers, np.int64),
        kinds=kinds.reshape(in_layers(study.grid.shape)).astype(np.uint8),
        weights=secondary.weights or (1.0,),
        proportions=np.array(proportions),
        turns=turns[used // len(groups)],
        names=names,
    )


def _name_of_copy(image: str, turn: Floats, flipped: tuple[int, ...]) -> str:
    angle, *scale, dip = turn.tolist()
    parts = [image, *[f"turned to {angle:.0f}°"] * (angle != 0)]
    along = dict.fromkeys(f"{s:.2g}" for s in (scale if scale[2] != 1 else scale[:2]))
    parts += [f"scaled by {' × '.join(along)}"] * (scale != [1, 1, 1])
    parts += [f"with a dip of {dip:.0f}°"] * (dip != 0)
    parts += [f"mirrored along {' and '.join('zyx'[axis] for axis in flipped)}"] * bool(flipped)
    return ", ".join(parts)


def n_cells_of_copies(study: Study) -> int:
    """Return the number of cells of the copies of a study, or slightly more."""
    secondary = study.secondary_or_empty
    if not secondary.has_copies:
        return study.training_image.indices.size
    images = (study.training_image, *secondary.images)
    return _n_cells(secondary, tuple(in_layers(i.shape) for i in images), study.grid, _gap(study))


def _gap(study: Study) -> int:
    """Return the layers of a block; a copy of a volume consists of whole blocks along z."""
    return 2 ** study.parameters.along(study.grid.shape).level[0]


@lru_cache(maxsize=16)  # the estimate of memory calls this function several times
def _n_cells(secondary: Secondary, shapes: tuple[Triple, ...], grid: Grid, gap: int) -> int:
    turns, _ = turns_of(secondary, in_layers(grid.shape))
    turned = [_shape_of(_forward(turn, grid.cell_size), n) for turn in turns for n in shapes]
    n_layers = sum(z + (gap if z > 1 else 0) for z, _, _ in turned)
    y, x = (max(shape[axis] for shape in turned) for axis in (1, 2))
    return n_layers * y * x * 2 ** len(set(secondary.mirrored))


def turns_of(secondary: Secondary, shape: tuple[int, int, int]) -> tuple[Floats, Ints]:
    """Return the combinations of angle, scales and dip, shape (n, 5), and each cell's number."""
    scales = secondary.scale or ()
    fields = [secondary.angle, *(np.log(s) for s in scales), secondary.dip]
    values = [np.zeros(1) if field is None else np.ravel(field) for field in fields]
    uniques = [np.unique(field, return_inverse=True) for field in values]
    tolerance, wider = secondary.angle_tolerance, 1.0
    tolerances = [tolerance, *[SCALE_TOLERANCE] * len(scales), tolerance]
    columns = [0, *range(1, 1 + len(scales)), 4]  # columns of `turns`
    while True:
        classes = [
            classes_of(distinct, limit * wider, 360.0 if k == 0 else None)
            for k, ((distinct, _), limit) in enumerate(zip(uniques, tolerances, strict=True))
        ]
        centres = [middles for middles, _ in classes]
        if max(map(len, centres)) <= MAX_TURNS:
            codes = np.zeros(1, np.int64)
            for (_, of_value), (middles, of_distinct) in zip(uniques, classes, strict=True):
                codes = codes * len(middles) + of_distinct[of_value]
            used, of_cell = np.unique(codes, return_inverse=True)
            if len(used) <= MAX_TURNS:
                break
        wider *= WIDER
    turns = np.zeros((len(used), 5))
    for column, middles in zip(reversed(columns), reversed(centres), strict=True):
        used, k = np.divmod(used, len(middles))
        turns[:, column] = middles[k]
    turns[:, 1:4] = np.exp(turns[:, 1:4])
    return turns, np.broadcast_to(of_cell, prod(shape)).reshape(shape)


def classes_of(
    distinct: Floats, tolerance: float, period: float | None = None
) -> tuple[Floats, Ints]:
    """Return the middles of as few classes as possible, and the class of each distinct value.

    The values ascend. No value differs from the middle of its class by more than `tolerance`.
    """
    first = 0
    if period is not None and len(distinct) > 1:  # classes begin after the largest gap
        first = int(np.argmax(np.diff(distinct, prepend=distinct[-1] - period)))
        distinct = np.concatenate([distinct[first:], distinct[:first] + period])
    ends, start = [], 0
    while start < len(distinct):
        ends.append(start)
        start = int(np.searchsorted(distinct, distinct[start] + 2 * tolerance, side="right"))
    last = np.array([*ends[1:], len(distinct)]) - 1
    middles = (distinct[ends] + distinct[last]) / 2
    of_distinct = np.searchsorted(ends, np.arange(len(distinct)), side="right") - 1
    return middles if period is None else middles % period, np.roll(of_distinct, first)


def _numbers(shapes: list[tuple[int, ...]]) -> list[Int32s]:
    """Return the numbers of the cells of images, one image after the other."""
    first = np.cumsum([0, *map(prod, shapes)])
    numbers = np.split(np.arange(first[-1], dtype=np.int32), first[1:-1])
    return [of.reshape(in_layers(shape)) for of, shape in zip(numbers, shapes, strict=True)]


def _flips(mirrored: Sequence[str]) -> list[tuple[int, ...]]:
    """Return the axes of each mirrored copy, beginning with the unchanged image."""
    axes = ["zyx".index(axis) for axis in dict.fromkeys(mirrored)]
    return [flipped for n in range(len(axes) + 1) for flipped in combinations(axes, n)]


def _forward(turn: Floats, cell_size: tuple[float, ...]) -> Floats:
    """Return the matrix that scales, inclines and turns vectors in cells along z, y and x."""
    angle, sx, sy, sz, dip = turn
    a, d = np.radians([angle, dip])
    # layers are inclined towards the north, then north turns to the azimuth; axes x, y and z
    inclined = np.array([[1, 0, 0], [0, np.cos(d), np.sin(d)], [0, -np.sin(d), np.cos(d)]])
    about_z = np.array([[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0], [0, 0, 1]])
    size = np.diag((*cell_size, 1.0)[:3])
    forward = np.linalg.inv(size) @ about_z @ inclined @ size @ np.diag([sx, sy, sz])
    return np.round(forward[::-1, ::-1], 12)


def _shape_of(forward: Floats, shape: Triple) -> Triple:
    """Return the shape of the box around a turned image."""
    nz, ny, nx = np.maximum(np.floor(np.abs(forward) @ np.array(shape) + 1e-6), 1).astype(int)
    return 1 if shape[0] == 1 else int(nz), int(ny), int(nx)


def _turned(
    numbers: Int32s,
    flipped: tuple[int, ...],
    turn: Floats,
    cell_size: tuple[float, ...],
    gap: int,
) -> Int32s:
    """Return the numbers of the cells of a mirrored, scaled and turned copy; −1 outside the image.

    Each cell of the copy gets the number of the nearest cell of the image. All cells of the image
    are kept, because cropping would change proportions.
    """
    forward = _forward(turn, cell_size)
    shape, inverse = _shape_of(forward, numbers.shape), np.linalg.inv(forward)  # type: ignore[arg-type]
    middle, axes = (np.array(shape) - 1) / 2, np.ogrid[tuple(map(slice, shape))]
    copy, inside, size = numbers[:1, :1, :1], np.array(True), np.int32(numbers.size)
    for axis, n in enumerate(numbers.shape):
        terms = [f * (k - m) for f, k, m in zip(inverse[axis], axes, middle, strict=True) if f]
        nearest = np.floor(sum(terms, n / 2)).astype(np.int32)
        inside, size = inside & (nearest >= 0) & (nearest < n), size // np.int32(n)
        copy = copy + size * (n - 1 - nearest if axis in flipped else nearest)
    copy = np.broadcast_to(np.where(inside, copy, np.int32(-1)), shape)
    if len(numbers) > 1:  # refinement must not shift a patch into the next copy
        copy = np.pad(copy, [(0, gap - len(copy) % gap), (0, 0), (0, 0)], constant_values=-1)
    return copy


def _values(indices: Bytes, numbers: Int32s, origins: Int32s) -> Bytes:
    """Return the facies indices of a copy, `UNKNOWN` outside the image."""
    flat = np.append(indices.ravel(), np.uint8(UNKNOWN))
    return flat[np.where(origins < 0, len(flat) - 1, origins - numbers.flat[0])]


def _padded(values: Array, shape: list[int], fill: int) -> Array:
    wide = [(0, 0), *((0, n - m) for n, m in zip(shape, values.shape[1:], strict=True))]
    return np.pad(values, wide, constant_values=fill)


def check_pieces(copies: Copies | None, legal: Ints, template: tuple[int, ...]) -> None:
    """Raise an error if a kind has no location without unknown cells; `legal`, shape (n_kinds,)."""
    if legal.all():
        return
    size = describe_shape(template[-2:] if template[0] == 1 else template)
    if copies is None:
        raise refused("no_whole_piece", size=size)
    angle, *scale, dip = copies.turns[int(np.argmin(legal))].tolist()
    raise CCWSIMError(
        f"no piece of {size} cells of the training image is complete when it is turned by "
        f"{angle:.0f}° and scaled by {min(scale):.2g}{f', with a dip of {dip:.0f}°' * bool(dip)}: "
        "use a smaller template or a larger image"
    )
