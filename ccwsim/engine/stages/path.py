"""The simulation grid, the raster path and the overlaps (section 4.1; Algorithm 1, lines 3, 4).

A path has a random origin and a random direction. A map has 8 possible paths, the symmetries of a
square. A volume has 48 = 8 × 2 × 3 possible paths: layers are simulated upwards or downwards, and z
is the slowest, middle or fastest axis of the path. All stages use *path coordinates*: every path
starts at layer 0, row 0, column 0, and the overlap is always below, at the top and on the left. The
images are rotated and reflected to match the path.
"""

from math import prod
from typing import NamedTuple, TypeVar

import numpy as np

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.model import (
    UNKNOWN as UNKNOWN,
    Array,
    Ints,
    Shape,
    Triple as Triple,
    in_layers as in_layers,
)

T = TypeVar("T")
LEFT, TOP, BELOW, RIGHT, BOTTOM, ABOVE = 1, 2, 4, 8, 16, 32
"""Bits of the sides along which a box overlaps simulated cells."""
N_ORIENTATIONS = 8
"""Number of orientations of a path over a map. An orientation is a sum of bits: 1 for a start at
the last row, 2 for a start at the last column, 4 for a path along columns instead of rows."""
FROM_ABOVE = 8  # bit of the orientation for a path that starts at the top layer
ORDERS = ((0, 1, 2), (1, 0, 2), (1, 2, 0))
"""Possible orders of the axes of a path, from the slowest to the fastest axis."""


class Box(NamedTuple):
    """A box of cells in the simulation grid, and its overlap; a box in a map has one layer."""

    # first layer, row and column
    z0: int
    y0: int
    x0: int
    # layers, rows and columns
    nz: int
    ny: int
    nx: int
    sides: int  # sides with an overlap: a sum of LEFT, TOP, BELOW, RIGHT, BOTTOM and ABOVE
    # widths of the overlap along each axis, in cells
    oz: int
    oy: int
    ox: int


class Interior(NamedTuple):
    """Start and end of the layers, rows and columns of a box that are not in its overlap."""

    low_z: int
    high_z: int
    low_y: int
    high_y: int
    low_x: int
    high_x: int


@part_of_kernel
def inside_overlap(box):
    """Return the interior of a box: its cells that are not in its overlap."""
    return Interior(
        box.oz if box.sides & BELOW else 0,
        box.nz - box.oz if box.sides & ABOVE else box.nz,
        box.oy if box.sides & TOP else 0,
        box.ny - box.oy if box.sides & BOTTOM else box.ny,
        box.ox if box.sides & LEFT else 0,
        box.nx - box.ox if box.sides & RIGHT else box.nx,
    )


def in_three(cells: Ints) -> Ints:
    """Return cells with three coordinates; the layer is 0 in a map."""
    with_layers = np.zeros((len(cells), 3), cells.dtype)  # faster than `np.pad`
    with_layers[:, 3 - cells.shape[1] :] = cells
    return with_layers


def overlap_cells(template: Triple, overlap: Triple) -> int:
    """Return the number of overlap cells of a patch with earlier neighbours along each axis."""
    return prod(template) - prod(t - o for t, o in zip(template, overlap, strict=True))


def to_path(image: Array, orientation: int) -> Array:
    """Return a view, in path coordinates, of `image`, shape (ny, nx) or (nz, ny, nx)."""
    oriented = image.swapaxes(-2, -1) if orientation & 4 else image
    oriented = oriented[..., ::-1, :] if orientation & 1 else oriented
    oriented = oriented[..., ::-1] if orientation & 2 else oriented
    return oriented[::-1] if orientation & FROM_ABOVE else oriented


def from_path(image: Array, orientation: int) -> Array:
    """Return a view of `image` in grid coordinates: the inverse of `to_path`."""
    oriented = image[::-1] if orientation & FROM_ABOVE else image
    oriented = oriented[..., ::-1] if orientation & 2 else oriented
    oriented = oriented[..., ::-1, :] if orientation & 1 else oriented
    return oriented.swapaxes(-2, -1) if orientation & 4 else oriented


def along_path(lengths: tuple[T, T, T], orientation: int) -> tuple[T, T, T]:
    """Return values along z, y and x of the grid in the order of the path's axes."""
    z, y, x = lengths
    return (z, x, y) if orientation & 4 else (z, y, x)


def cells_to_path(cells: Ints, shape: Shape, orientation: int) -> Ints:
    """Return the path coordinates of cells, shape (n, 2) or (n, 3), of a grid of `shape`."""
    *layers, rows, columns = cells.T
    n_rows, n_columns = shape[-2:]
    if orientation & 4:
        rows, columns, n_rows, n_columns = columns, rows, n_columns, n_rows
    rows = n_rows - 1 - rows if orientation & 1 else rows
    columns = n_columns - 1 - columns if orientation & 2 else columns
    layers = [shape[0] - 1 - z if orientation & FROM_ABOVE else z for z in layers]
    return np.stack([*layers, rows, columns], axis=1)


def cells_from_path(cells: Ints, shape: Shape, orientation: int) -> Ints:
    """Convert cells, shape (n, 3), from path to grid coordinates; `shape` is the path's shape."""
    layers, rows, columns = cells.T
    layers = shape[0] - 1 - layers if orientation & FROM_ABOVE else layers
    columns = shape[2] - 1 - columns if orientation & 2 else columns
    rows = shape[1] - 1 - rows if orientation & 1 else rows
    across = (columns, rows) if orientation & 4 else (rows, columns)
    return np.stack([layers, *across], axis=1)


def n_tiles(length: int, template_size: int, overlap_size: int) -> int:
    """Return the number of patches that cover `length` cells."""
    return max(1, -(-(length - overlap_size) // (template_size - overlap_size)))


class RasterPath(NamedTuple):
    """A raster path over a grid."""

    orientation: int  # sum of bits: 0 … 7 in a map, 0 … 15 in a volume
    order: int  # index in ORDERS
    shape: Triple  # shape of the grid in path coordinates
    tiles: Triple  # number of tiles along each axis
    full: Triple  # number of cells that the tiles cover, at least `offset` + `shape`
    offset: Triple = (0, 0, 0)  # number of cells from the beginning of the first tile to the grid


def make_path(
    grid_shape: Triple,
    orientation: int,
    template: Triple,
    overlap: Triple,
    order: int = 0,
    offset: Triple = (0, 0, 0),
) -> RasterPath:
    """Return the path over a grid; all arguments except `grid_shape` are along the path's axes.

    The first tile begins `offset` cells before the grid. Without random offsets, all realizations
    would have seams at the same cells, and the mean of the realizations would show the seams.
    """
    shape = along_path(grid_shape, orientation)
    covered = [n + before for n, before in zip(shape, offset, strict=True)]
    sizes = [*zip(covered, template, overlap, strict=True)]
    tiles = tuple(n_tiles(n, t, o) for n, t, o in sizes)
    return RasterPath(
        orientation=orientation,
        order=order,
        shape=shape,
        tiles=tiles,  # type: ignore[arg-type]
        full=tuple(n * (t - o) + o for n, (_, t, o) in zip(tiles, sizes, strict=True)),  # type: ignore[arg-type]
        offset=offset,
    )


def in_order(path: RasterPath) -> Ints:
    """Return the numbers of the tiles (by layer, row and column) in the order of the path."""
    numbers = np.arange(prod(path.tiles)).reshape(path.tiles)
    return numbers.transpose(ORDERS[path.order]).ravel()


def make_patches(
    path: RasterPath, step: Triple, overlap: Triple, splits: Ints, split_of: Ints
) -> Ints:
    """Return the patches in the order of the path, shape (n, 10).

    The columns are: first layer, row and column; number of layers, rows and columns; sides of the
    overlap (0 for the first patch); index of the split of the tile; number of the tile; number of
    the part of the tile. `step` (T − OR) and `overlap` are along the path. `splits` comes from
    `legal_splits`, `split_of` from `split_tiles`.
    """
    tiles = in_order(path)
    n_parts = splits.prod(axis=1)[split_of[tiles]]
    tile = np.repeat(tiles, n_parts)
    part = np.arange(len(tile)) - np.repeat(np.cumsum(n_parts) - n_parts, n_parts)
    parts = splits[split_of[tile]]
    position = np.stack(np.unravel_index(tile, path.tiles), axis=1)
    within = np.stack(
        [part // (parts[:, 1] * parts[:, 2]), part // parts[:, 2] % parts[:, 1],
         part % parts[:, 2]], axis=1,
    )  # fmt: skip
    first = position * step + within * (step // parts)
    size = step // parts + overlap
    sides = ((position + within > 0) * _side_bits(overlap)).sum(axis=1)
    return np.column_stack([first, size, sides, split_of[tile], tile, part]).astype(np.int64)


def _side_bits(overlap: Triple) -> Ints:
    """Return BELOW, TOP and LEFT, or 0 for an axis without overlap."""
    return np.array([BELOW, TOP, LEFT]) * (np.array(overlap) > 0)


def clip_patches(
    patches: Ints, path: RasterPath, overlap: Triple, block: Triple, cell_size: Triple
) -> Ints:
    """Return the patches of a path, restricted to whole blocks that contain cells of the grid.

    In a volume of few tiles, at least a third of the cells of unrestricted patches are outside the
    grid. A patch that later patches would replace completely is omitted. `cell_size` is the number
    of grid cells, along each axis, in a cell of the coarsest scale.
    """
    size = np.multiply(block, cell_size)
    low = np.array(path.offset) // size * block
    high = -(-np.add(path.offset, path.shape) // size) * block
    first = patches[:, :3]
    end = first + patches[:, 3:6]
    needed = (end - overlap > low) & ((first + overlap < high) | (first <= low))
    sides = ((first > low) * _side_bits(overlap)).sum(axis=1)
    first, end = np.maximum(first, low), np.minimum(end, high)
    return np.column_stack([first, end - first, sides, patches[:, 7:]])[needed.all(axis=1)]


def active_patches(
    patches: Ints, path: RasterPath, sums: Ints, step: Triple, cell_size: Triple
) -> Ints:
    """Return the patches of the tiles that contain active cells, without overlaps with other tiles.

    `sums` are the running sums of the active cells in path coordinates, made by `summed_up`; `step`
    (T − OR) is in cells of `cell_size` grid cells along each axis.
    """
    n_active = sums
    for axis in (1, 2, 0):  # the sums of a map have only two layers
        n, size = path.tiles[axis], step[axis] * cell_size[axis]
        first = np.arange(n) * size - path.offset[axis]
        last = first + path.full[axis] - (n - 1) * size  # with the overlap with the next tile
        low, high = np.maximum(first, 0), np.minimum(last, sums.shape[axis] - 1)
        n_active = np.take(n_active, high, axis) - np.take(n_active, low, axis)
    is_used = n_active > 0
    patches = patches[is_used.ravel()[patches[:, 8]]]
    tiles = patches[:, 8]
    for axis, side in enumerate((BELOW, TOP, LEFT)):
        stride = prod(path.tiles[axis + 1 :])  # from a tile to the next one along the axis
        unused = ~is_used.ravel()[np.maximum(tiles - stride, 0)]
        at_start = patches[:, axis] % step[axis] == 0  # not a later part of a tile
        patches[unused & at_start & (patches[:, axis] > 0), 6] &= ~side
    return patches


def patches_before(patches: Ints, path: RasterPath) -> Ints:
    """Return, for each patch of a map, the numbers of its earlier neighbours, shape (n, 4).

    The neighbours are at the upper left, top, upper right and left; −1 means no neighbour. Split
    tiles are omitted.
    """
    whole = patches[:, 7] == 0
    _, n_rows, n_columns = path.tiles
    wide = n_columns + 2
    number_of = np.full((n_rows + 2) * wide, -1)  # with a margin of one tile
    tile = patches[:, 8] + 2 * (patches[:, 8] // n_columns) + wide + 1  # index in `number_of`
    number_of[tile[whole]] = np.flatnonzero(whole)
    beside = number_of[tile[:, None] - (wide + 1, wide, wide - 1, 1)]
    beside[~whole] = -1
    return beside
