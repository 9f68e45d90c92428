"""Geobodies of a facies: connectivity function, sizes, percolation, Euler number."""

from dataclasses import dataclass
from typing import cast

import numpy as np

from ccwsim.engine.kernels import allocating_kernel
from ccwsim.metrics.lags import Direction, Lags, count_pairs, lags_within
from ccwsim.metrics.stack import (
    N_AXES,
    Fraction,
    Images,
    as_image,
    as_stack,
    in_pieces,
    known_part,
    map_parallel,
)
from ccwsim.model import (
    UNKNOWN,
    Array,
    ArrayLike,
    CCWSIMError,
    Floats,
    Int32s,
    Integers,
    Ints,
    Mask,
    Shape,
    as_floats,
    ratio,
    shown,
)

NEIGHBOURS = {2: (8, 4), 3: (26, 18, 6)}
"""Allowed numbers of neighbours of a cell, by number of axes; the first number is the default."""
_SHARED_AXES = {4: 1, 6: 1, 18: 2, 8: 3, 26: 3}  # maximum number of axes along which they differ


@dataclass(frozen=True, eq=False)
class Connectivity:
    """Connectivity function of one facies."""

    lags: Ints
    """Lags in steps of the direction, shape (n_lags,)."""
    tau: Floats
    """τ(h) = P(in one geobody | both in the facies), shape (n, n_lags); NaN without such pairs."""
    unconditional: Floats
    """P(x and x + h in one geobody) over all pairs of known cells, shape (n, n_lags)."""
    neighbours: int


def connected_geobodies(
    image: Images, facies: int | str, neighbours: int | None = None
) -> tuple[Int32s, int]:
    """Return the number (1, 2, …) of each cell's geobody, 0 outside the facies, and their number.

    Examples
    --------
    >>> connected_geobodies(np.eye(3, dtype=int), 1, neighbours=4)[1]
    3
    """
    stack = as_image(image)
    inside = stack.volume(0) == stack.index_of(facies)
    labels, n_geobodies = _label(inside, _checked_neighbours(stack.shape, neighbours))
    return labels.reshape(stack.shape), n_geobodies


def connectivity(
    images: Images,
    facies: int | str,
    direction: Direction = "E-W",
    lags: Lags | None = None,
    neighbours: int | None = None,
    progress: Fraction | None = None,
) -> Connectivity:
    """Return the connectivity function τ(h) of a facies (Renard & Allard 2013).

    Two cells are connected if they belong to the same geobody; the path that joins them may be
    anywhere in the image. Pairs are counted exactly.

    Examples
    --------
    >>> connectivity([[1, 1, 0, 1]], 1, lags=[1, 3]).tau
    array([[1., 0.]])
    """
    stack = as_stack(images)
    steps, offsets = lags_within(stack.shape, direction, lags)
    index = stack.index_of(facies)
    touching = _checked_neighbours(stack.shape, neighbours)

    def counts(labels: Int32s) -> Integers:
        return in_pieces(lambda piece: _count_pairs(labels, piece), offsets, labels.size)

    def one(k: int) -> Array:
        known, n_pairs = stack.volume(k) != UNKNOWN, count_pairs(stack.shape, offsets)
        if not known.all():
            n_pairs = counts(known.astype(np.int32))[:, 0]
        both, joined = counts(_label(stack.volume(k) == index, touching)[0]).T
        return np.array([ratio(joined, both), ratio(joined, n_pairs)])

    tau, unconditional = np.array(map_parallel(one, len(stack), progress)).swapaxes(0, 1)
    return Connectivity(steps, tau, unconditional, touching)


@allocating_kernel
def _count_pairs(labels, offsets):
    """Count, for each lag, pairs with both cells in the facies and pairs in one geobody."""
    nz, ny, nx = labels.shape
    counts = np.zeros((len(offsets), 2), np.int64)
    for lag in range(len(offsets)):
        dz, dy, dx = offsets[lag]
        first, last = max(0, -dx), nx - max(0, dx)
        for k in range(max(0, -dz), nz - max(0, dz)):
            for i in range(max(0, -dy), ny - max(0, dy)):
                tail = labels[k, i, first:last]
                head = labels[k + dz, i + dy, first + dx : last + dx]
                both, joined = np.int32(0), np.int32(0)
                for j in range(len(tail)):
                    both += np.int32((tail[j] != 0) & (head[j] != 0))
                    joined += np.int32((tail[j] != 0) & (tail[j] == head[j]))
                counts[lag, 0] += both
                counts[lag, 1] += joined
    return counts


@dataclass(frozen=True, eq=False)
class Geobodies:
    """Geobody statistics of one facies; arrays have one value per image."""

    n_geobodies: Ints
    sizes: tuple[Ints, ...]
    """Sizes of each image's geobodies in cells, largest first."""
    gamma: Floats
    """Γ = Σ nᵢ² / m² = P(two cells of the facies are connected); NaN if the facies is absent."""
    percolates_ew: Mask
    """Whether one geobody touches the west edge and the east edge."""
    percolates_ns: Mask
    """Whether one geobody touches the south edge and the north edge."""
    euler_number: Ints
    """Euler number: geobodies − holes in maps, geobodies − tunnels + cavities in volumes."""
    neighbours: int
    percolates_vertical: Mask | None = None
    """Whether one geobody touches the lowest layer and the highest layer; None for maps."""

    def share_in(self, at_least: ArrayLike) -> Floats:
        """Return the share of the facies in geobodies of at least `at_least` cells, shape (n, m).

        `at_least` contains m sizes in cells. The share is NaN if the facies is absent.

        Examples
        --------
        >>> geobody_statistics([[1, 1, 1, 0, 1]], 1).share_in([1, 2, 4])
        array([[1.  , 0.75, 0.  ]])
        """
        smallest = as_floats(at_least, "at_least").reshape(-1)
        shares = np.full((len(self.sizes), len(smallest)), np.nan)
        for row, sizes in zip(shares, self.sizes, strict=True):
            if len(sizes):
                totals = np.append(0, np.cumsum(sizes))  # totals of the 0, 1, … largest geobodies
                row[:] = totals[np.searchsorted(-sizes, -smallest, side="right")] / totals[-1]
        return shares


def geobody_statistics(
    images: Images,
    facies: int | str,
    neighbours: int | None = None,
    progress: Fraction | None = None,
) -> Geobodies:
    """Return geobody statistics of a facies in each image (Renard & Allard 2013).

    With unknown or inactive cells, edges are those of the smallest window with all known cells.

    Examples
    --------
    >>> geobodies = geobody_statistics([[1, 1, 0, 1]], 1)
    >>> geobodies.n_geobodies, geobodies.sizes[0].tolist(), geobodies.gamma.round(3)
    (array([2]), [2, 1], array([0.556]))
    """
    stack = known_part(images)
    index = stack.index_of(facies)
    touching = _checked_neighbours(stack.shape, neighbours)
    axes = (2, 1, 0) if stack.is_volumes else (2, 1)

    def one(k: int) -> tuple[Ints, list[bool], int]:
        inside = stack.volume(k) == index
        labels, n = _label(inside, touching)
        sizes = np.sort(np.bincount(labels.ravel(), minlength=n + 1)[1:])[::-1]
        ends = [(labels.take(0, axis), labels.take(-1, axis)) for axis in axes]
        percolates = [bool(np.intersect1d(first, last).any()) for first, last in ends]
        return sizes, percolates, _euler_number(inside, touching)

    each = map_parallel(one, len(stack), progress)
    sizes = tuple(body_sizes for body_sizes, _, _ in each)
    ew, ns, *vertical = np.array([edges for _, edges, _ in each], bool).reshape(-1, len(axes)).T
    totals = np.array([body_sizes.sum() for body_sizes in sizes], dtype=float)
    squares = np.array([(body_sizes.astype(float) ** 2).sum() for body_sizes in sizes])
    return Geobodies(
        n_geobodies=np.array([len(body_sizes) for body_sizes in sizes]),
        sizes=sizes,
        gamma=ratio(squares, totals**2),
        percolates_ew=ew,
        percolates_ns=ns,
        euler_number=np.array([euler for _, _, euler in each]),
        neighbours=touching,
        percolates_vertical=vertical[0] if vertical else None,
    )


def _checked_neighbours(shape: Shape, neighbours: int | None) -> int:
    """Return the number of neighbours of a cell after checking it; 8 or 26 by default."""
    allowed = NEIGHBOURS[len(shape)]
    if neighbours is None:
        return allowed[0]
    if not isinstance(neighbours, (int, np.integer)) or neighbours not in allowed:
        one_of = "4 or 8" if len(shape) < N_AXES else "6, 18 or 26 in volumes"
        raise CCWSIMError(f"neighbours = {shown(neighbours)} must be {one_of}")
    return int(neighbours)


def _label(inside: Mask, neighbours: int) -> tuple[Int32s, int]:
    """Label the connected sets of a volume 1, 2, …; also return their number."""
    from scipy import ndimage  # imported here because loading takes time

    mask = inside[0] if len(inside) == 1 else inside  # a single layer is labelled faster as a map
    touching = ndimage.generate_binary_structure(mask.ndim, _SHARED_AXES[neighbours])
    labels, n = cast(tuple[Int32s, int], ndimage.label(mask, touching))
    return labels.reshape(inside.shape), n


def _euler_number(inside: Mask, neighbours: int) -> int:
    """Return geobodies − holes in a map, or geobodies − tunnels + cavities in a volume.

    With 8 or 26 neighbours, this is corners − edges + faces − cells of the union of cells. With 4
    or 6, cells are points, and adjacent points span edges, faces and cubes. With 18 neighbours, a
    corner that only two opposite cells share counts twice.
    """
    mask = np.pad(inside[0] if len(inside) == 1 else inside, 1)
    only_sides = _SHARED_AXES[neighbours] == 1
    total = _alternating_sum(mask, np.logical_and if only_sides else np.logical_or)
    if not only_sides:
        total *= (-1) ** mask.ndim
    if neighbours == 18 and mask.ndim == N_AXES:
        total += _count_corner_contacts(mask)
    return total


def _alternating_sum(mask: Mask, combine: np.ufunc, axis: int = 0) -> int:
    """Return Σ (−1)ⁿ · (number of cells, combined in pairs along n axes), over all sets of axes."""
    if axis == mask.ndim:
        return int(np.count_nonzero(mask))
    lines = np.moveaxis(mask, axis, 0)
    pairs = np.moveaxis(combine(lines[:-1], lines[1:]), 0, axis)
    return _alternating_sum(mask, combine, axis + 1) - _alternating_sum(pairs, combine, axis + 1)


def _count_corner_contacts(mask: Mask) -> int:
    """Count the 2 × 2 × 2 blocks in which only two cells are set, at opposite corners."""
    blocks, within = np.lib.stride_tricks.sliding_window_view(mask, (2, 2, 2)), (3, 4, 5)
    opposite = (blocks & blocks[..., ::-1, ::-1, ::-1]).any(axis=within)
    return int(np.count_nonzero(opposite & (blocks.sum(axis=within, dtype=np.uint8) == 2)))
