"""The CCW score map: how well the overlap fits each location of the training image (TI).

This file implements sections 3.2 and 4.3, and Algorithm 1, lines 8 to 10. The paper compares the
approximation coefficients cA_J of the overlap (OR) with the coefficients of the TI. A Haar
coefficient is a block sum times a constant, 2^−J in a map. In this file, A are the block sums of
the TI and B the block sums of the overlap. All scores are exact, because block sums are small
integers. The paper's CCW is the cross-correlation ΣA·B, with the best fit at the maximum
(similarity "correlation"). The authors' code and our default use the sum of squared differences
(SSD), with the best fit at the minimum.

The SSD over the coefficients of the overlap is ΣA² − 2·ΣA·B + ΣB². ΣA² (the *energy*) is computed
from running sums; ΣB² is equal for all locations. ΣA·B is computed by summation by parts: each
change of B along a line of the overlap is multiplied by a running sum of A. There are few changes
of B, because facies form bodies. Unsigned overflow is harmless if the result fits its type. Small
types are used, because vector instructions process more small numbers at once.
"""

from math import prod
from typing import Any, NamedTuple

import numpy as np

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.path import Triple, inside_overlap, overlap_cells
from ccwsim.model import Array, Bytes, Integers, Ints

LOCATION_ROWS_AT_ONCE = 16
"""Number of rows of locations scored in one loop; their data fit into the processor's cache."""
TERMS_AT_ONCE = 4  # number of terms that are added in one loop over locations
SCORE_TYPES = np.int16, np.int32, np.int64
SUM_TYPES = np.uint16, np.uint32, np.uint64


def score_type(
    level: Triple,
    template: Triple,
    overlap: Triple,
    correlation: bool = False,
    guided: float = 0.0,
    excludes: bool = False,
    largest_code: int = 1,
) -> type[np.signedinteger[Any]]:
    """Return the smallest type into which every score fits; the largest type for codes above 1.

    The largest score is the sum of squares over the largest overlap, doubled for a correlation,
    plus the maximum cost of a location by secondary information, `guided`. If locations are
    excluded, all other scores are below `excluded_from` of the type.
    """
    bound = overlap_cells(template, overlap) * 2 ** sum(level) * (2 if correlation else 1)
    bound = max(4 * bound, 2 * (bound + guided)) if excludes else bound + guided
    if largest_code > 1:
        return SCORE_TYPES[-1]
    return next(kind for kind in SCORE_TYPES if bound <= np.iinfo(kind).max)


def sum_type(
    level: Triple, template: Triple, largest_code: int = 1
) -> type[np.unsignedinteger[Any]]:
    """Return the smallest type into which ΣA·B along one line of a template fits.

    It is the largest type if A are sums of codes above 1; then ΣA·B over a whole overlap fits too.
    """
    if largest_code > 1:
        return SUM_TYPES[-1]
    largest = max(t >> n for t, n in zip(template[1:], level[1:], strict=True)) * 4 ** sum(level)
    return next(kind for kind in SUM_TYPES if largest <= np.iinfo(kind).max)


def running_sums(
    sums: Integers, level: Triple, template: Triple, largest_code: int = 1
) -> Integers:
    """Return block sums, their running sums along x, and their running sums along y.

    The shape is (3, n_planes, nz, ny + 1, nx + 1) for block sums of shape (n_planes, nz, ny, nx).
    Running sums may overflow, but differences are exact if they fit the type `sum_type`.
    """
    kind, (n_planes, nz, ny, nx) = sum_type(level, template, largest_code), sums.shape
    running = np.zeros((3, n_planes, nz, ny + 1, nx + 1), kind)
    running[0, :, :, :ny, :nx] = sums
    np.cumsum(sums, axis=3, dtype=kind, out=running[1, :, :, :ny, 1:])
    np.cumsum(sums, axis=2, dtype=kind, out=running[2, :, :, 1:, :nx])
    return running


def running_squares(sums: Array, kind: type[np.number[Any]]) -> Array:
    """Return the running sums of A² along three axes (see `summed_up`), in the type of the scores.

    Running sums may overflow, but sums over boxes of blocks are exact if they fit the type.
    """
    return summed_squares(sums).astype(kind)


def summed_squares(sums: Array) -> Ints:
    """Return the running sums of A² along three axes; many planes need no copy of all planes."""
    squares = np.zeros(sums.shape[1:], np.int64)
    for plane in sums:
        squares += np.square(plane, dtype=np.int64)
    return summed_up(squares)


def summed_up(values: Array, kind: type[np.number[Any]] = np.int64) -> Array:
    """Return running sums, shape (nz + 1, ny + 1, nx + 1), in the type `kind` or a wider one."""
    table = np.zeros([n + 1 for n in values.shape], np.result_type(values, kind))
    inner = table[1:, 1:, 1:]
    inner[...] = values
    for axis, n in enumerate(values.shape):
        if n > 1:  # NumPy is slow along an axis of length 1
            np.cumsum(inner, axis, out=inner)
    return table


def box_sums(
    table: Ints, size: Triple, first: Triple = (0, 0, 0), last: Triple | None = None
) -> Ints:
    """Return the sum of values `first` to `last` − 1 of each window of `size` values, or of all.

    `table` comes from `summed_up`.
    """
    sums = table
    for axis, (start, end, t) in enumerate(zip(first, last or size, size, strict=True)):
        lines, n = np.moveaxis(sums, axis, 0), table.shape[axis] - t
        sums = np.moveaxis(lines[end : end + n] - lines[start : start + n], 0, axis)
    return sums


@part_of_kernel
def overlap_energies(squares, box, block, energies):
    """Fill `energies`, shape (nz, ny, nx), with ΣA² over the overlap of a box at each location.

    `squares`, shape (nz + 1, ny + 1, nx + 1) of blocks, come from `running_squares`.
    """
    nz, ny, nx = energies.shape
    interior = inside_overlap(box)
    last_z, last_y, last_x = box.nz // block[0], box.ny // block[1], box.nx // block[2]
    sums, flat = squares.reshape(-1), energies.reshape(-1)
    for z in range(nz):
        for y in range(ny):
            to = np.uint64((z * ny + y) * nx)
            for x in range(np.uint64(nx)):
                flat[to + x] = 0
            for corner in range(8):  # sum over the box minus sum over the box without overlap
                inside = corner & 4 != 0
                first_z = interior.low_z // block[0] if inside else 0
                first_y = interior.low_y // block[1] if inside else 0
                first_x = interior.low_x // block[2] if inside else 0
                corner_z = z + (first_z if corner & 2 else last_z)
                corner_y = y + (first_y if corner & 1 else last_y)
                row = (corner_z * squares.shape[1] + corner_y) * squares.shape[2]
                first, last = np.uint64(row + first_x), np.uint64(row + last_x)
                if inside ^ (corner & 2 != 0) ^ (corner & 1 != 0):
                    first, last = last, first
                for x in range(np.uint64(nx)):
                    flat[to + x] += sums[last + x] - sums[first + x]


@part_of_kernel
def cached_overlap_energies(squares, illegal, layer, box, block, energies, energies_of):
    """Fill `energies` like `overlap_energies`, unless the previous box had an equal overlap.

    `energies` begin with layer `layer` of locations. An `illegal` location gets the largest score;
    `illegal` has the shape of all locations, or is empty. `energies_of`, shape (nz, 4), has
    for each first layer the numbers of layers, rows and columns of the previous box, and the sides
    of its overlap.
    """
    lengths = box.nz, box.ny, box.nx, box.sides
    is_equal = True
    for k in range(4):
        is_equal = is_equal and energies_of[layer, k] == lengths[k]
        energies_of[layer, k] = lengths[k]
    if not is_equal:
        overlap_energies(squares[layer:], box, block, energies)
        exclude_illegal(illegal, layer, energies, 2 * excluded_from(energies) - 1)


@part_of_kernel
def excluded_from(scores):
    """Return a score that only excluded locations reach: half of the range of the type.

    A score is the energy minus at most twice the largest energy of `score_type`, a quarter of the
    range. An excluded location, whose energy is the largest number, therefore remains excluded.
    """
    return 1 << (8 * scores.itemsize - 2)


@part_of_kernel
def exclude_illegal(illegal, layer, values, worst):
    """Set the values of illegal locations, from layer `layer` on, to `worst`.

    `illegal` has the shape of all locations, or is empty.
    """
    flat, excluded = values.reshape(-1), illegal[layer : layer + len(values)].reshape(-1)
    out = flat.dtype.type(worst)
    for x in range(np.uint64(len(excluded))):
        flat[x] = out if excluded[x] else flat[x]


def legal_spans(illegal: Bytes) -> Ints:
    """Return first and last column (exclusive) of the legal locations in each row, shape (…, 2).

    Without legal locations, the first column is the number of columns, and the last one is 0.
    """
    legal, n = illegal == 0, illegal.shape[-1]
    if not illegal.size:
        return np.zeros((0, 0, 2), np.int64)
    ends = np.stack([legal.argmax(axis=-1), n - legal[..., ::-1].argmax(axis=-1)], axis=-1)
    return np.where(legal.any(axis=-1, keepdims=True), ends, (n, 0))


class Terms(NamedTuple):
    """The terms of ΣA·B over the overlap of a patch, in groups whose sums fit the type."""

    offsets: Ints  # index of each term in the raveled running sums, for location 0
    weights: Integers  # factor of each term
    ends: Ints  # end of each group
    sums: Integers  # sums of a group, for LOCATION_ROWS_AT_ONCE rows of locations
    largest: int  # largest sum that fits the type


def make_terms(running: Integers, template: Triple, overlap: Triple, block: Triple) -> Terms:
    """Return the arrays for the terms of patches; `overlap` is the maximum overlap."""
    n_blocks = running.shape[1] * (overlap_cells(template, overlap) // prod(block))
    # A line has at most one term per block, but workspace for two terms and for padding.
    n = (3 + TERMS_AT_ONCE) * n_blocks + 2
    return Terms(
        offsets=np.zeros(n, np.int64),
        weights=np.zeros(n, running.dtype),
        ends=np.zeros(n_blocks, np.int64),
        sums=np.zeros(LOCATION_ROWS_AT_ONCE * running.shape[4], running.dtype),
        largest=int(min(np.iinfo(running.dtype).max, np.iinfo(np.int64).max)),
    )


@part_of_kernel
def overlap_terms(grid, box, block, running, terms):
    """Fill `terms` with the terms of ΣA·B for the overlap of a box; return the number of groups.

    The block sums B are counted in `grid`, shape (nz, ny, nx); `running` comes from `running_sums`.
    Lines are as long as possible: along x in rows that consist only of overlap, otherwise along y.
    """
    n = n_groups = held = np.int64(0)
    _, n_planes, mz, my, mx = running.shape
    first_facies = 1 if n_planes == 1 else 0
    uz, uy, ux = block
    low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
    bottom, top = low_z // uz, high_z // uz
    front, back, n_rows = low_y // uy, high_y // uy, box.ny // uy
    west, east, n_columns = low_x // ux, high_x // ux, box.nx // ux
    columns, size = grid.shape[2], n_planes * mz * my * mx
    for plane in range(n_planes):
        for bz in range(box.nz // uz):
            corner = ((box.z0 + bz * uz) * grid.shape[1] + box.y0) * columns + box.x0
            layer_sum = (plane * mz + bz) * my * mx
            across = bz < bottom or bz >= top
            for line in range(n_rows + (0 if across else n_columns)):
                if line < n_rows:
                    if not across and front <= line < back:
                        continue
                    line_blocks = corner + line * uy * columns, ux, n_columns
                    sums = layer_sum + line * mx, size, 1
                else:
                    bx = line - n_rows
                    if west <= bx < east:
                        continue
                    line_blocks = (
                        corner + front * uy * columns + bx * ux,
                        uy * columns,
                        back - front,
                    )
                    sums = layer_sum + front * mx + bx, 2 * size, mx
                most = line_blocks[2] * np.int64(uz * uy * ux) ** 2
                if held > terms.largest - most:
                    n = fill_up(n, terms)
                    terms.ends[n_groups] = n
                    n_groups, held = n_groups + 1, np.int64(0)
                n, total = line_terms(
                    grid, line_blocks, block, plane + first_facies, sums, n, terms
                )
                held += total * uz * uy * ux
    if held > 0:  # if there are terms after the last complete group
        terms.ends[n_groups] = fill_up(n, terms)
        n_groups += 1
    return n_groups


@part_of_kernel
def fill_up(n, terms):
    """Add terms of weight 0 up to a multiple of `TERMS_AT_ONCE`; return the number of terms."""
    while n % TERMS_AT_ONCE:
        terms.offsets[n], terms.weights[n] = 0, 0
        n += 1
    return n


@part_of_kernel
def line_terms(grid, line_blocks, block, facies, sums, n, terms):
    """Add the terms of a line of blocks after the first `n` terms; return the new number of terms.

    There is a term for each nonzero block sum or for each change of B, whichever gives fewer terms.
    `line_blocks` is (first cell of the line, number of cells from block to block, number of
    blocks). `sums` is (index of the first block sum, distance to the running sum of this block,
    distance from block to block). Also return the number of cells of the facies in the line.
    """
    offsets, weights = terms.offsets, terms.weights
    (uz, uy, ux), (first, step, length), (start_sum, behind, stride) = block, line_blocks, sums
    values, rows, columns = grid.reshape(-1), grid.shape[1], grid.shape[2]
    before = total = np.int64(0)
    n_changed, start = n, n + length + 1
    n_nonzero = start
    for k in range(length + 1):
        block_sum = np.int64(0)
        for z in range(uz if k < length else 0):
            for y in range(uy):
                corner = np.uint64(first + k * step + (z * rows + y) * columns)
                for x in range(np.uint64(ux)):
                    block_sum += np.int64(values[corner + x] == facies)
        # the next term overwrites a zero term
        offsets[n_changed] = start_sum + behind + k * stride
        weights[n_changed] = before - block_sum
        offsets[n_nonzero], weights[n_nonzero] = start_sum + k * stride, block_sum
        n_changed += np.int64(block_sum != before)
        n_nonzero += np.int64(block_sum != 0)
        total += block_sum
        before = block_sum
    if n_changed - n <= n_nonzero - start:
        return n_changed, total
    for k in range(n_nonzero - start):
        offsets[n + k], weights[n + k] = offsets[start + k], weights[start + k]
    return n + n_nonzero - start, total


@part_of_kernel
def score_places(running, layer, spans, terms, n_groups, energy, scores):
    """Fill `scores` with SSD − ΣB² of every location, or −2·ΣA·B if `energy` is 0 (correlation).

    `energy` and `scores` have the shape (nz, ny, nx) of locations, from layer `layer` on. `spans`
    come from `legal_spans`; outside them, scores are `energy`. Several rows are summed in one
    loop, because single rows are short; sums beyond the last location of a row are discarded.
    Indices are unsigned, because a check for negative indices would prevent vectorization.
    """
    nz, ny, nx = scores.shape
    my, mx = running.shape[3], running.shape[4]
    energies, flat, values = energy.reshape(-1), scores.reshape(-1), running.reshape(-1)
    offsets, weights, sums = terms.offsets, terms.weights, terms.sums
    kind, two = scores.dtype.type, scores.dtype.type(2)
    at_once = LOCATION_ROWS_AT_ONCE if spans.size else _rows_at_once(nx, mx)
    if n_groups == 0 or spans.size:
        for x in range(np.uint64(len(flat))):
            flat[x] = energies[x]
    for z in range(nz):
        for first in range(0, ny, at_once):
            rows, low, high = min(at_once, ny - first), np.int64(0), np.int64(nx)
            if spans.size:
                low, high = high, low
                for y in range(first, first + rows):
                    low, high = min(low, spans[layer + z, y, 0]), max(high, spans[layer + z, y, 1])
            if high <= low:
                continue
            base, length = ((layer + z) * my + first) * mx + low, (rows - 1) * mx + high - low
            length, n_columns = np.uint64(length), np.uint64(high - low)
            for group in range(n_groups):
                start = terms.ends[group - 1] if group > 0 else 0
                for n in range(start, terms.ends[group], TERMS_AT_ONCE):
                    a, b = np.uint64(base + offsets[n]), np.uint64(base + offsets[n + 1])
                    c, d = np.uint64(base + offsets[n + 2]), np.uint64(base + offsets[n + 3])
                    wa, wb, wc, wd = weights[n], weights[n + 1], weights[n + 2], weights[n + 3]
                    if n == start:
                        for x in range(length):
                            sums[x] = (
                                wa * values[a + x] + wb * values[b + x]
                                + wc * values[c + x] + wd * values[d + x]
                            )  # fmt: skip
                    else:
                        for x in range(length):
                            sums[x] += (
                                wa * values[a + x] + wb * values[b + x]
                                + wc * values[c + x] + wd * values[d + x]
                            )  # fmt: skip
                for y in range(rows):
                    to, of_run = np.uint64((z * ny + first + y) * nx + low), np.uint64(y * mx)
                    if group == 0:
                        for x in range(n_columns):
                            flat[to + x] = energies[to + x] - two * kind(sums[of_run + x])
                    else:
                        for x in range(n_columns):
                            flat[to + x] -= two * kind(sums[of_run + x])


@part_of_kernel
def _rows_at_once(nx, mx):
    """Return the number of rows summed in one loop; 1 if many sums would be discarded."""
    return LOCATION_ROWS_AT_ONCE if 4 * nx >= 3 * mx else 1
