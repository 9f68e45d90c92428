"""The guide of a path: maps of the image and of the grid, prepared for the search."""

from collections.abc import Iterator
from itertools import product
from math import prod

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.corrections.guidance import AT_ONCE, NAT, Guide, mismatch_cost, tilts_of
from ccwsim.engine.lengths import USUAL_OVERLAP, ScaledLengths
from ccwsim.engine.prepared_image import OrientedImage, PreparedImage
from ccwsim.engine.stages.path import RasterPath, in_layers, to_path
from ccwsim.engine.stages.similarity import summed_up
from ccwsim.model.arrays import Floats, Ints

N_PARTS = (2, 4, 4)
"""Number of parts of a patch along z, y and x; one part along an axis of one block."""


def make_guide(
    image: PreparedImage,
    oriented: OrientedImage,
    path: RasterPath,
    lengths: ScaledLengths,
    patches: Ints,
) -> Guide | None:
    """Return the guide of the patches of a path, or None if nothing guides the search.

    `lengths` are those of the coarsest scale along the path.
    """
    secondary = image.study.secondary
    if secondary is None or not secondary.guides:
        return None
    blocks = [t // b for t, b in zip(lengths.template, lengths.block, strict=True)]
    counts = [min(n, k) for n, k in zip(N_PARTS, blocks, strict=True)]
    part = np.array([-(-k // n) for k, n in zip(blocks, counts, strict=True)])
    starts, first, last = _parts(patches, np.array(lengths.block), counts, part)
    cells = [k * np.array(lengths.cell_size) - np.array(path.offset) for k in (first, last)]
    key = path.orientation, lengths.template

    def of_image() -> NDArray[np.float32]:
        size = np.multiply(lengths.block, lengths.cell_size)
        shape = oriented.pyramid.sums.shape[1:]
        axes = [np.arange(n)[:, None] * k for n, k in zip(shape, size, strict=True)]
        found = []
        for values, is_whole in _maps_of_image(image, path.orientation):
            box = np.array(lengths.template) * lengths.cell_size if is_whole else part * size
            ends = [axis + length for axis, length in zip(axes, box, strict=True)]
            found.append(_means_along(summed_up(values), axes, ends))
        return np.array(found, np.float32).reshape(-1, *shape)

    def of_grid(name: object, values: NDArray) -> Floats:
        table = image.part(
            ("map of grid", name, *key),
            lambda: summed_up(to_path(_volume(values), path.orientation)),
        )
        return _box_means(table, *cells) / prod(counts)

    values = image.part(("maps of image", *key), of_image)
    factors = np.zeros((len(patches), len(values), prod(counts)), np.float32)
    mismatch, plane = mismatch_cost(lengths, len(oriented.pyramid.sums)), 0
    if secondary.probabilities is not None:
        c = mismatch * NAT / USUAL_OVERLAP * secondary.soft_weight
        known = secondary.probabilities, oriented.proportions, oriented.pyramid.sums
        illegal = oriented.illegal
        tilts = image.part(("tilts", key[1]), lambda: tilts_of(*known, illegal, lengths))
        for tilt in tilts:
            factors[:, plane] = -c * of_grid(plane, tilt)
            plane += 1
    is_whole = (patches[:, 3:6] == lengths.template).all(axis=1)
    for each in secondary.auxiliary:
        factors[is_whole, plane, 0] = mismatch * each.weight
        factors[~is_whole, plane + 1] = mismatch * each.weight / prod(counts)
        wanted = of_grid(plane, np.clip(_scaled(each.grid, each.image), -0.5, 1.5))
        factors[:, plane + 2] = -2 * mismatch * each.weight * wanted
        plane += 3
    n_terms = len(values) * prod(counts) + AT_ONCE
    work = np.zeros(n_terms, np.int64), np.zeros(n_terms, np.float32)
    costs = np.zeros(prod(values.shape[2:]), np.float32)
    return Guide(values, starts, factors, *work, costs)


def _parts(patches: Ints, block: Ints, counts: list[int], part: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the first block of each part in its patch, and its first and last cell in the grid.

    All arrays have the shape (n_patches, n_parts, 3). Parts of smaller patches overlap.
    """
    sizes = patches[:, None, 3:6] // block
    numbers = np.stack(np.unravel_index(np.arange(prod(counts)), counts), axis=1)
    starts = np.minimum(numbers * part, np.maximum(sizes - part, 0))
    first = patches[:, None, :3] + starts * block
    return starts, first, first + np.minimum(part, sizes) * block


def _maps_of_image(image: PreparedImage, orientation: int) -> Iterator[tuple[NDArray, bool]]:
    """Yield the maps whose means over parts, or whole patches, are `Guide.values`."""
    secondary = image.study.secondary
    if secondary is not None and secondary.probabilities is not None:
        for k in range(1, image.study.training_image.n_facies):
            yield image.scaled(orientation) == k, False
    for each in secondary.auxiliary if secondary else ():
        values = _volume(each.image)
        if image.copies:
            values = values.ravel()[image.copies.origins]  # in unknown cells, any value
        values = _scaled(to_path(values, orientation), each.image)
        yield values**2, True
        yield values**2, False
        yield values, False


def _volume(values: NDArray) -> NDArray:
    return values.reshape(in_layers(values.shape))


def _scaled(values: NDArray, reference: NDArray) -> Floats:
    """Return values of an auxiliary variable with the range of the image as the unit."""
    low, high = float(reference.min()), float(reference.max())
    return (values - low) / ((high - low) or 1.0)


def _means_along(table: Floats, first: list[NDArray], last: list[NDArray]) -> Floats:
    """Return `_box_means` of boxes with these ends along each axis, one box per combination."""
    means = table
    for axis, (start, end) in enumerate(zip(first, last, strict=True)):
        n = table.shape[axis] - 1
        low = np.clip(start.ravel(), 0, n - 1)
        high = np.maximum(np.clip(end.ravel(), 1, n), low + 1)
        sums = np.take(means, high, axis) - np.take(means, low, axis)
        means = sums / (high - low).reshape([-1 if k == axis else 1 for k in range(3)])
    return means


def _box_means(table: Floats, first: Ints, last: Ints) -> Floats:
    """Return the means over boxes of cells, as far as they are inside the map.

    `first` and `last` (exclusive) have the shape (…, 3). A box outside takes the nearest cell.
    """
    low, high, n_cells = [], [], np.ones(first.shape[:-1])
    for axis, n in enumerate(np.array(table.shape) - 1):
        low.append(np.clip(first[..., axis], 0, n - 1))
        high.append(np.maximum(np.clip(last[..., axis], 1, n), low[-1] + 1))
        n_cells *= high[-1] - low[-1]
    total, (_, ny, nx), flat = np.zeros(n_cells.shape), table.shape, table.ravel()
    for upper in product(*((1,) if n == 2 else (0, 1) for n in table.shape)):  # sums begin with 0
        z, y, x = (b if up else a for a, b, up in zip(low, high, upper, strict=True))
        total += (-1) ** (3 - sum(upper)) * flat[(z * ny + y) * nx + x]
    return total / n_cells
