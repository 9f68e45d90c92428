"""The guide of a path: maps of the image and of the grid, prepared for the search."""

from collections.abc import Iterator
from math import prod

import numpy as np

from ccwsim.engine.corrections import guidance
from ccwsim.engine.lengths import USUAL_OVERLAP, ScaledLengths
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.stages.path import FROM_ABOVE, RasterPath, Triple, along_path, in_layers, to_path
from ccwsim.engine.stages.similarity import summed_up
from ccwsim.model import Array, Float32s, Floats

N_PARTS = (2, 4, 4)
"""Number of parts of a patch along z, y and x; one part along an axis of one block."""


def make_guide(
    prepared: PreparedImage, template: Triple, path: RasterPath, lengths: ScaledLengths
) -> guidance.Guide | None:
    """Return the guide of the patches of a path, or None if nothing guides the search.

    `template` has the lengths along the axes of the grid; `lengths` are those of the coarsest scale
    along the path.
    """
    study, orientation = prepared.study, path.orientation
    if not study.is_guided:
        return None
    secondary = study.secondary_or_empty
    soft, auxiliary = secondary.probabilities, secondary.auxiliary
    located = {axis: w for axis, w in enumerate(study.parameters.location_weights) if w > 0}
    sums = prepared.oriented(orientation, template).pyramid.sums
    blocks = [t // b for t, b in zip(lengths.template, lengths.block, strict=True)]
    counts = [min(n, k) for n, k in zip(N_PARTS, blocks, strict=True)]
    part = [-(-k // n) for k, n in zip(blocks, counts, strict=True)]
    n_parts, key = prod(counts), (orientation, template)

    def values_of_image() -> Float32s:
        size, shape = np.multiply(lengths.block, lengths.cell_size), sums.shape[1:]
        axes = [np.arange(n)[:, None] * k for n, k in zip(shape, size, strict=True)]
        means = []
        for values, is_whole in _maps_of_image(prepared, [*located], template, orientation):
            box = np.array(lengths.template) * lengths.cell_size if is_whole else part * size
            ends = [axis + length for axis, length in zip(axes, box, strict=True)]
            means.append(_means_along(summed_up(values), axes, ends))
        if located:
            positions = means[len(means) - len(located) :]
            weighted = zip(located.values(), positions, strict=True)
            means.append(sum(w * position**2 for w, position in weighted))
        return np.array(means, np.float32).reshape((-1, *shape))

    def tilts(soft: Floats) -> Floats:
        usual = prepared.oriented(0, template)  # the same tilts for all realizations
        return guidance.tilts_of(
            soft,
            usual.proportions,
            sums=usual.pyramid.sums,
            illegal=usual.illegal,
            lengths=lengths.along(orientation),
        )

    def tables_of_grid() -> Floats:
        low, high = guidance.LIMITS
        maps = [np.clip(_in_range_of(v.image, v.grid), low, high) for v in auxiliary]
        maps = maps if soft is None else [*tilts(soft), *maps]
        sz, sy, sx = (n + 1 for n in in_layers(study.grid.shape))
        # with a column that is not used, no view is contiguous, so that kernels have one type
        tables = np.zeros((len(maps), sz, sy, sx + 1))
        for table, values in zip(tables, maps, strict=True):
            table[..., :sx] = summed_up(values.reshape(in_layers(values.shape)))
        return tables[:, sz == 2 :, :, :sx]

    values = prepared.part(("maps of image", *key), values_of_image)
    mismatch = guidance.mismatch_cost(lengths, len(sums))
    n_soft = 0 if soft is None else study.training_image.n_facies - 1
    c = mismatch * guidance.NAT / USUAL_OVERLAP * secondary.soft_weight
    tables_of, weights = [*range(n_soft)], [-c] * n_soft
    for k, variable in enumerate(auxiliary):
        cost = mismatch * variable.weight
        tables_of += [guidance.WHOLE_PATCHES, guidance.SMALLER_PATCHES, n_soft + k]
        weights += [cost, cost / n_parts, -2 * cost]
    for axis, weight in located.items():
        along = along_path((0, 1, 2), orientation).index(axis)
        is_reversed = orientation & (FROM_ABOVE, 1, 2)[along] > 0
        tables_of.append(guidance.POSITION - along - 3 * is_reversed)
        weights.append(-2 * mismatch * weight)
    tables_of += [guidance.EVERY_PATCH] * bool(located)
    weights += [mismatch] * bool(located)
    tables = prepared.part(("maps of grid", template), tables_of_grid)
    # sums over boxes change their sign with the direction of an axis
    turned = orientation & (1 | 2 | (FROM_ABOVE if tables.shape[1] > 1 else 0))
    signs = np.where(np.array(tables_of) < 0, 1, (-1) ** turned.bit_count())
    tables = to_path(tables.swapaxes(0, 1), orientation).swapaxes(0, 1)
    n_terms, n_places = len(values) * n_parts + guidance.TERMS_AT_ONCE, prod(values.shape[2:])
    spread = c * guidance.RANDOM_COST_SPREAD / n_soft if n_soft and not lengths.volume else 0.0
    n_random = n_places if spread else 0
    return guidance.Guide(
        values=values,
        tables=tables,
        tables_of=np.array(tables_of),
        weights=signs * np.array(weights),
        n_soft=n_soft,
        counts=tuple(counts),  # type: ignore[arg-type]
        part=tuple(part),  # type: ignore[arg-type]
        template=lengths.template,
        block=lengths.block,
        cell_size=lengths.cell_size,
        offset=path.offset,
        start=np.zeros(3, np.int64),
        ends=np.zeros((3, 2), np.int64),
        offsets=np.zeros(n_terms, np.int64),
        terms=np.zeros(n_terms, np.float32),
        costs=np.zeros(n_places, np.float32),
        random=prepared.part(("random costs", n_random), lambda: guidance.random_costs(n_random)),
        spread=spread,
    )


def _maps_of_image(
    prepared: PreparedImage, located: list[int], template: Triple, orientation: int
) -> Iterator[tuple[Array, bool]]:
    """Yield the maps of `Guide.values`, and whether their means are over whole patches or parts.

    The last maps are relative positions along the axes `located`.
    """
    study, secondary = prepared.study, prepared.study.secondary_or_empty
    if secondary.probabilities is not None:
        for k in range(1, study.training_image.n_facies):
            yield prepared.scaled(orientation) == k, False
    images = (study.training_image, *secondary.images)
    shapes = [in_layers(training_image.shape) for training_image in images]

    def oriented(values: Array) -> Array:  # unknown cells of copies get any value
        copies = prepared.copies
        return to_path(values[copies.origins] if copies else values.reshape(shapes[0]), orientation)

    for variable in secondary.auxiliary:
        values = oriented(_in_range_of(variable.image, variable.image).ravel())
        yield values**2, True
        yield values**2, False
        yield values, False
    for axis in located:
        t = template[axis]
        positions = [
            (np.indices(n)[axis].ravel() - (t - 1) / 2) / max(n[axis] - t, 1) for n in shapes
        ]
        yield oriented(np.concatenate(positions)), True


def _in_range_of(of_image: Array, values: Array) -> Floats:
    """Return values of an auxiliary variable as shares of the range of its values in the image."""
    low, high = float(of_image.min()), float(of_image.max())
    return (values - low) / ((high - low) or 1.0)


def _means_along(table: Floats, first: list[Array], last: list[Array]) -> Floats:
    """Return the means over boxes with these ends along each axis, one box per combination.

    `table` comes from `summed_up`. For a box outside the map, the nearest cells are used.
    """
    means = table
    for axis, (start, end) in enumerate(zip(first, last, strict=True)):
        n = table.shape[axis] - 1
        low = np.clip(start.ravel(), 0, n - 1)
        high = np.maximum(np.clip(end.ravel(), 1, n), low + 1)
        sums = np.take(means, high, axis) - np.take(means, low, axis)
        means = sums / (high - low).reshape([-1 if k == axis else 1 for k in range(3)])
    return means
