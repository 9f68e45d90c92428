"""Guidance of the search by secondary information (not in the paper).

Probabilities of facies and auxiliary variables add a cost to each location before the K best
locations are chosen. A patch is divided into a few parts. The cost of a location is a sum over the
parts: the mean of a map over the part of the image, times a factor that depends on the mean of a
map over the part of the grid.

*Probabilities*: The factor is −c·λ, and the map of the image is 1 in the cells of the facies. If
patches are drawn with probabilities proportional to exp(λ·f), with the proportion f of the facies
in the patch, the mean proportion is the given probability. λ is thus 0 where the given probability
is the proportion of the image. c is `NAT` wrong cells for an overlap of 448 cells. Where many
locations of a map fit the overlap equally well, the best would have extreme proportions. In maps
each location therefore also has a random cost, so that such locations are drawn with probabilities
proportional to exp(λ·f/`RANDOM_COST_SPREAD`).

Parts of split tiles have fewer overlap cells; their costs are smaller by this ratio, and those of
probabilities by its square.

*Auxiliary variables*: The cost is the squared difference between image and grid, divided by the
squared range of the image, Σ (a² − 2·a·b) without the constant b². With weight 1, the range costs
as much as a mismatch in every cell of the overlap. A `location_weight` is the weight of auxiliary
variables whose values are relative positions along the axes: 0 for a patch at the first end of grid
or image, and 1 at the other end.
"""

from math import prod
from typing import NamedTuple

import numpy as np

from ccwsim.engine.corrections.proportions import patch_shares
from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.lengths import USUAL_OVERLAP, ScaledLengths
from ccwsim.engine.stages.candidates import draw_index
from ccwsim.engine.stages.path import Triple, overlap_cells
from ccwsim.engine.stages.similarity import TERMS_AT_ONCE, exclude_illegal, excluded_from
from ccwsim.model import Bytes, Float32s, Floats, Integers, Ints, Study

NAT = 10.0
"""Number of wrong cells that count as much as a likelihood ratio of e, for an overlap of
`USUAL_OVERLAP` cells."""
RANDOM_COST_SPREAD = 0.5
"""Spread of the random costs of locations, as a share of the cost of a nat, with two facies. With n
facies it is divided by n − 1; maps of more facies are followed better with less spread."""
MAX_RANDOM, N_SHIFTS = 12.0, 4096
"""Maximum of a random cost with a spread of 1, and number of ways to assign the random numbers to
locations."""
# probabilities are limited to MIN_PROBABILITY … 1 − MIN_PROBABILITY, because λ would be infinite
MIN_PROBABILITY = 0.002
MAX_TILT = 60.0  # maximum of |λ|, at which drawn patches have the most extreme proportion
N_TILTS, N_SHARES = 241, 5000
"""Numbers of λ and of locations from which the relation of λ and probability is computed."""
LIMITS = -0.5, 1.5  # limits of values of the grid, with the range of the image as unit
WHOLE_PATCHES, SMALLER_PATCHES, EVERY_PATCH = -1, -2, -3
"""Values of `Guide.tables_of` if the factor of a plane is constant: for which patches it holds."""
POSITION = -4
"""The value POSITION − axis of `Guide.tables_of` means that the factor is the relative position of
the patch along this axis of the path; 3 is subtracted if the axis is reversed."""


class Guide(NamedTuple):
    """The maps from which the costs of locations are computed, at the coarsest scale of a path.

    The cost of a location for a patch is a sum of factor · `values` over planes and parts.
    """

    # shape (n_planes, nz, ny, nx) of blocks: mean of a map over the part that begins at a block
    values: Float32s
    # shape (n_tables, sz, sy, sx): made by `summed_up` from maps of the grid, a view in path
    # coordinates; a single layer has no layer of zeros before it
    tables: Floats
    # shape (n_planes,): number of the table whose means over parts are factors; or WHOLE_PATCHES,
    # SMALLER_PATCHES, EVERY_PATCH or a value of `POSITION`
    tables_of: Ints
    weights: Floats  # shape (n_planes,): weight of the means, or the constant
    n_soft: int  # number of planes of probabilities, which are the first
    counts: Triple  # number of parts of a patch along z, y and x
    part: Triple  # number of blocks of a part
    template: Triple  # number of cells of a whole patch
    block: Triple  # number of cells of a block
    cell_size: Triple  # number of cells of the grid in a cell of the path
    offset: Triple  # number of cells of the grid from the beginning of the path to the grid
    # workspace, shapes (3,) and (3, 2): first block, and first and last cell, of a part of a patch
    start: Ints
    ends: Ints
    # workspace: offsets and factors of the terms of a patch, and the costs of a layer of locations
    offsets: Ints
    terms: Float32s
    costs: Float32s
    random: Float32s  # minus Gumbel numbers, for a layer of locations and all shifts
    spread: float  # maximum factor of `random`; the factor is smaller if all other costs are small


def score_bound(study: Study, lengths: ScaledLengths, planes: int) -> float:
    """Return the maximum cost of a location by secondary information, in units of the scores."""
    secondary = study.secondary_or_empty
    bound = 4 * sum(study.parameters.location_weights)
    bound += 4 * sum(each.weight for each in secondary.auxiliary)
    if secondary.probabilities is not None:
        nats = MAX_TILT + RANDOM_COST_SPREAD * MAX_RANDOM
        bound += nats * secondary.soft_weight * NAT / USUAL_OVERLAP
    return mismatch_cost(lengths, planes) * bound


def mismatch_cost(lengths: ScaledLengths, planes: int) -> float:
    """Return the score of a mismatch in every cell of the overlap."""
    return overlap_cells(lengths.template, lengths.overlap) * prod(lengths.block) * min(planes, 2)


def random_costs(n: int) -> Float32s:
    """Return random costs of `n` locations and all shifts, the same numbers at each call."""
    numbers = np.random.default_rng(0).gumbel(size=n + N_SHIFTS)
    return np.clip(-numbers, -MAX_RANDOM, MAX_RANDOM).astype(np.float32)


def tilts_of(
    soft: Floats,
    proportions: Floats,
    sums: Integers,
    illegal: Bytes,
    lengths: ScaledLengths,
) -> Floats:
    """Return λ of facies 1 … n − 1 in each cell of the grid, shape (n − 1, *shape of the grid).

    `soft` are the probabilities, shape (n, *shape of the grid), `proportions` those of the image,
    shape (n,), and `sums` its block sums, shape (n_planes, nz, ny, nx). `illegal` locations do not
    count.
    """
    size = tuple(t // b for t, b in zip(lengths.template, lengths.block, strict=True))
    shares = patch_shares(sums, size, prod(lengths.template), illegal)  # type: ignore[arg-type]
    p, n = np.clip(soft, MIN_PROBABILITY, 1 - MIN_PROBABILITY), len(proportions)
    if n <= 2:
        return np.nan_to_num(_tilt_of(shares[:, -1], p[-1:] if n == 2 else p[:0]))
    variances = np.maximum(shares[:, -n:].var(axis=0), 1e-9)
    effective = proportions * (1 - proportions) / variances  # number of independent cells
    column = (-1, *[1] * (soft.ndim - 1))
    tilts = effective.reshape(column) * np.log(p / proportions.reshape(column))
    return np.nan_to_num(np.clip(tilts[1:] - tilts[:1], -MAX_TILT, MAX_TILT))


def _tilt_of(shares: Floats, p: Floats) -> Floats:
    """Return λ for which patches drawn with weights exp(λ·share) have a mean share of p."""
    shares = shares[:: -(-len(shares) // N_SHARES)]
    tilts = np.linspace(-MAX_TILT, MAX_TILT, N_TILTS)
    extremes = np.where(tilts > 0, shares.max(), shares.min())
    weights = np.exp(tilts[:, None] * (shares - extremes[:, None]))
    return np.interp(p, weights @ shares / weights.sum(axis=1), tilts)


@part_of_kernel
def guide_terms(guide, box):
    """Fill `guide.offsets` and `guide.terms` for the patch in `box`.

    Return the number of terms, and the overlap cells as a share of those of a whole patch.

    The factor of a part comes from the mean of a map of the grid over the cells of the part. Parts
    of small patches overlap. For a part outside the grid, the nearest cells are used. Small patches
    have smaller costs, because fewer overlap cells can mismatch; and the proportions of facies vary
    more in small patches, so that λ should be smaller.
    """
    _, mz, my, mx = guide.values.shape
    _, sz, sy, sx = guide.tables.shape
    tables, sides, (pz, py, px) = guide.tables, (max(sz, 2), sy, sx), guide.counts
    start, ends, n, n_parts = guide.start, guide.ends, 0, pz * py * px
    firsts, lengths = (box.z0, box.y0, box.x0), (box.nz, box.ny, box.nx)
    (tz, ty, tx), is_whole = guide.template, lengths == guide.template
    whole = tz * ty * tx - (tz - box.oz) * (ty - box.oy) * (tx - box.ox)
    inside = (box.nz - box.oz) * (box.ny - box.oy) * (box.nx - box.ox)
    share = (box.nz * box.ny * box.nx - inside) / whole if whole else 1.0
    for plane in range(len(guide.weights)):
        table, factor = guide.tables_of[plane], guide.weights[plane]
        if (table == WHOLE_PATCHES and not is_whole) or (table == SMALLER_PATCHES and is_whole):
            continue
        for part in range(n_parts if table >= SMALLER_PATCHES and table != WHOLE_PATCHES else 1):
            numbers, n_cells = (part // (py * px), part // px % py, part % px), 1
            for axis in range(3):
                block, scale, most = guide.block[axis], guide.cell_size[axis], sides[axis] - 1
                n_blocks, wide = lengths[axis] // block, guide.part[axis]
                start[axis] = min(numbers[axis] * wide, max(n_blocks - wide, 0))
                low = firsts[axis] + start[axis] * block
                high = (low + min(wide, n_blocks) * block) * scale - guide.offset[axis]
                low = min(max(low * scale - guide.offset[axis], 0), most - 1)
                high = max(min(max(high, 1), most), low + 1)
                ends[axis, 0], ends[axis, 1] = low, high
                n_cells *= high - low
            if table >= 0:
                total = 0.0
                for corner in range(4 if sz == 1 else 0, 8):
                    z, y, x = corner >> 2, corner >> 1 & 1, corner & 1
                    layer = 0 if sz == 1 else ends[0, z]
                    value = tables[table, layer, ends[1, y], ends[2, x]]
                    total += value if (z + y + x) % 2 else -value
                factor = guide.weights[plane] * (total / n_cells / n_parts)
            elif table <= POSITION:
                axis = (POSITION - table) % 3
                scale, offset = guide.cell_size[axis], guide.offset[axis]
                room = max(sides[axis] - 1 - guide.template[axis] * scale, 1)
                position = (firsts[axis] * scale - offset) / room
                position = min(max(position, LIMITS[0]), LIMITS[1])
                factor = guide.weights[plane]
                factor *= 1 - position if table <= POSITION - 3 else position
            term = np.float32(factor * (share * share if plane < guide.n_soft else share))
            if term != 0:
                guide.offsets[n] = ((plane * mz + start[0]) * my + start[1]) * mx + start[2]
                guide.terms[n] = term
                n += 1
    while n % TERMS_AT_ONCE:
        guide.offsets[n], guide.terms[n] = 0, np.float32(0)
        n += 1
    return n, share


@part_of_kernel
def guided_energies(guide, box, illegal, layer, energies, guided, rng):
    """Return the energies plus the costs of the locations for the patch in `box`, in `guided`.

    Without a guide, return `energies`. Both arrays have the shape (nz, ny, nx) of locations, of
    which the first is in `layer`. An `illegal` location gets the largest score.
    """
    if guide is None:
        return energies
    n, share = guide_terms(guide, box)
    offsets, terms, costs, flat = guide.offsets, guide.terms, guide.costs, guide.values.reshape(-1)
    spread = np.float32(0)
    for k in range(n):
        spread += abs(terms[k])
    spread = min(spread, np.float32(guide.spread * share * share))
    my, mx = guide.values.shape[2], guide.values.shape[3]
    nz, ny, nx = energies.shape
    kind, length = guided.dtype.type, np.uint64((ny - 1) * mx + nx)
    out, old = guided.reshape(-1), energies.reshape(-1)
    for z in range(nz):
        base = (layer + z) * my * mx
        for k in range(0, n, TERMS_AT_ONCE):
            a, b = np.uint64(base + offsets[k]), np.uint64(base + offsets[k + 1])
            c, d = np.uint64(base + offsets[k + 2]), np.uint64(base + offsets[k + 3])
            fa, fb, fc, fd = terms[k], terms[k + 1], terms[k + 2], terms[k + 3]
            for x in range(length if k == 0 else np.uint64(0)):
                costs[x] = (fa * flat[a + x] + fb * flat[b + x]) + (
                    fc * flat[c + x] + fd * flat[d + x]
                )
            for x in range(length if k > 0 else np.uint64(0)):
                costs[x] += (fa * flat[a + x] + fb * flat[b + x]) + (
                    fc * flat[c + x] + fd * flat[d + x]
                )
        if spread > 0:
            shift = np.uint64(draw_index(rng, N_SHIFTS))
            for x in range(length):
                costs[x] += spread * guide.random[shift + x]
        for y in range(ny):
            first, of_run = np.uint64((z * ny + y) * nx), np.uint64(y * mx)
            for x in range(np.uint64(nx)):
                cost = kind(costs[of_run + x]) if n > 0 else kind(0)
                out[first + x] = old[first + x] + cost
    exclude_illegal(illegal, layer, guided, 2 * excluded_from(guided) - 1)
    return guided
