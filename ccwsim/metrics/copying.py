"""Pieces of a realization that were copied from the training image."""

from dataclasses import dataclass
from math import prod

import numpy as np

from ccwsim import Grid
from ccwsim.engine.kernels import allocating_kernel, kernel
from ccwsim.metrics.stack import N_AXES, as_volume
from ccwsim.model import ArrayLike, Bytes, Ints, Mask, Shape, as_array, as_integers, refused


@dataclass(frozen=True, eq=False)
class Copying:
    """Copied pieces of a realization, and the use of each cell of the training image."""

    copied: float
    """Share of adjacent cell pairs whose sources have the same offset as the cells."""
    largest_square: int
    """Side in cells of the largest copied square, or cube in volumes."""
    square_at: tuple[int, ...]
    """(Layer,) row and column of the lowest south-west cell in the largest copied square."""
    largest_block: int
    """Number of cells in the largest copied piece; cells of a piece are joined by sides."""
    uses: Ints
    """Number of uses of each cell of the training image."""
    used: float
    """Share of the cells of the training image that were used."""
    seams: Mask
    """Mask of cells with a seam, shape of the realization. A cell has a seam if its eastern,
    northern or upper neighbour was not copied from the same neighbour of the cell's source."""
    n_unknown: int
    """Number of active cells without a source (negative position)."""
    seam_sides: Bytes
    """Sum of the codes of each cell's sides with a seam: 1 (east), 2 (north) and 4 (up)."""

    def seams_within(self, axis: int) -> Mask:
        """Return the mask `seams` of a volume, without seams between slices along an axis.

        Examples
        --------
        >>> twice = copying([[[0, 1]], [[0, 1]]], (2, 1, 2))  # the lower layer twice
        >>> twice.seams.any(), twice.seams_within(0).any()
        (np.True_, np.False_)
        """
        return (self.seam_sides & ~np.uint8((4, 2, 1)[axis])) != 0


def copying(positions: ArrayLike, ti_shape: Shape, active: Mask | None = None) -> Copying:
    """Return the copied pieces of a realization, computed from the source of each cell.

    `positions` contains the source of each cell in the training image of shape `ti_shape`:
    row · nx + column, or in a volume (layer · ny + row) · nx + column. Cells without a source have
    a negative number. With a mask of `active` cells, inactive cells and their sides do not count.

    Examples
    --------
    >>> copies = copying([[0, 1, 4], [3, 4, 7]], (3, 3))
    >>> copies.largest_square, copies.largest_block, round(copies.copied, 3)
    (2, 4, 0.714)
    """
    source, ti_shape = as_array(positions, "positions"), Grid.of(ti_shape).shape
    if source.ndim != len(ti_shape) or source.dtype.kind not in "ui" or not source.size:
        shape = "(ny, nx)" if len(ti_shape) < N_AXES else "(nz, ny, nx)"
        raise refused("positions", shape=shape, given=source.shape, dtype=source.dtype)
    n_cells = prod(ti_shape)
    image_text = f"a training image of {' × '.join(map(str, ti_shape))} cells"
    source = as_integers(source, f"positions in {image_text}", high=n_cells - 1)
    ti_ny, ti_nx = ti_shape[-2:]
    shift = _shifts(as_volume(source), ti_ny, ti_nx)
    sides = np.zeros(shift.shape, np.uint8)
    n_copied = int(_mark_seams(shift, sides))
    counted = np.broadcast_to(True if active is None else active, source.shape)
    n_pairs = 0
    for axis, code in enumerate((4, 2, 1)):  # no seams at inactive cells
        inside = np.moveaxis(as_volume(counted), axis, 0)
        pairs = inside[:-1] & inside[1:]
        np.moveaxis(sides, axis, 0)[:-1][~pairs] &= np.uint8(7 - code)
        n_pairs += int(np.count_nonzero(pairs))
    sources = source[source >= 0]
    uses = np.bincount(sources.ravel(), minlength=n_cells).reshape(ti_shape)
    side, *corner = _largest_cube(shift, source.ndim)
    return Copying(
        copied=n_copied / n_pairs if n_pairs else 0.0,
        largest_square=int(side),
        square_at=tuple(int(n) for n in corner[-source.ndim :]),
        largest_block=int(_largest_block(shift)),
        uses=uses,
        used=float(np.mean(uses > 0)),
        seams=(sides != 0).reshape(source.shape),
        n_unknown=int(np.count_nonzero(counted) - sources.size),
        seam_sides=sides.reshape(source.shape),
    )


@allocating_kernel
def _shifts(source, ti_ny, ti_nx):
    """Return the offset from each cell to its source as one number; −1 without a source."""
    nz, ny, nx = source.shape
    shift = np.full(source.shape, -1)
    for k in range(nz):
        for i in range(ny):
            for j in range(nx):
                if source[k, i, j] >= 0:
                    line, column = divmod(source[k, i, j], ti_nx)
                    layer, row = divmod(line, ti_ny)
                    up, north, east = layer - k + nz, row - i + ny, column - j + nx
                    shift[k, i, j] = (up * (ti_ny + ny + 1) + north) * (ti_nx + nx + 1) + east
    return shift


@kernel
def _mark_seams(shift, sides):
    """Mark sides between cells with different shifts; count the pairs with equal shifts."""
    nz, ny, nx = shift.shape
    n_copied = 0
    for k in range(nz):
        for i in range(ny):
            line, row = shift[k, i], sides[k, i]
            for dz, dy, dx, side in ((0, 0, 1, 1), (0, 1, 0, 2), (1, 0, 0, 4)):
                if k + dz < nz and i + dy < ny:
                    other = shift[k + dz, i + dy, dx:]
                    for j in range(nx - dx):
                        same = (line[j] == other[j]) & (line[j] >= 0)
                        n_copied += np.int64(same)
                        row[j] |= np.uint8(0 if same else side)
    return n_copied


@allocating_kernel
def _largest_cube(shift, n_axes):
    """Return side and position of the largest square (or cube) of cells with equal shifts."""
    nz, ny, nx = shift.shape
    depth = n_axes - 1
    sides = np.zeros((2, ny, nx), np.int64)
    best, layer, row, column = 0, 0, 0, 0
    for k in range(nz):
        for i in range(ny):
            for j in range(nx):
                value = shift[k, i, j]
                side = np.int64(value >= 0)
                if side and i and j and k >= depth - 1:
                    smallest = nx
                    for dz in range(depth):
                        for dy in range(2):
                            for dx in range(2):
                                if dz + dy + dx == 0:
                                    continue
                                if shift[k - dz, i - dy, j - dx] == value:
                                    smallest = min(smallest, sides[(k - dz) % 2, i - dy, j - dx])
                                else:
                                    smallest = 0
                    side += smallest
                sides[k % 2, i, j] = side
                if side > best:
                    best, layer, row, column = side, k + 1 - side, i + 1 - side, j + 1 - side
    return best, layer, row, column


@allocating_kernel
def _largest_block(shift):
    """Return the size of the largest piece of cells with equal shifts (union-find)."""
    nz, ny, nx = shift.shape
    flat = shift.ravel()
    parents = np.arange(len(flat))
    for k in range(nz):
        for i in range(ny):
            for j in range(nx):
                cell = (k * ny + i) * nx + j
                if flat[cell] < 0:
                    continue
                root = cell
                for inside, step in ((j, 1), (i, nx), (k, ny * nx)):
                    other = cell - step
                    if inside == 0 or flat[other] != flat[cell]:
                        continue
                    while parents[other] != other:
                        parents[other] = parents[parents[other]]
                        other = parents[other]
                    parents[max(root, other)] = min(root, other)
                    root = min(root, other)
    sizes = np.zeros(len(flat), np.int64)
    for cell in range(len(flat)):
        if flat[cell] >= 0:  # the parent of a cell precedes it and has a root already
            parents[cell] = parents[parents[cell]]
            sizes[parents[cell]] += 1
    return sizes.max()
