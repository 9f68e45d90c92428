"""The CCW score map: how well the overlap fits every location of the training image.

Sections 3.2 and 4.3; Algorithm 1, line 10. The paper's CCW is the plain cross-correlation ΣA·B, the
largest best (similarity "correlation"). The authors' code takes the sum of squared differences, the
smallest best, and so does the default here.

The sum of squared differences between overlap B and TI A, over the coefficients of the overlap, is
ΣA² − 2·ΣA·B + ΣB². ΣA² (the *energy*) follows from running sums for each overlap, ΣB² is the
same for every location, and only coefficients that are not zero add to ΣA·B, the cross-correlation.
With block sums everything is an exact whole number. Vectors take the more numbers at once the
smaller their type is, so ΣA·B is summed up in parts: in the type of the block sums, as long as that
holds them.
"""

from __future__ import annotations

from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.box import inside_overlap
from ccwsim.engine.stages.path import Triple, overlap_cells

ROWS_AT_ONCE = 16
"""Rows of locations that are scored together: enough for long loops, few enough for the cache."""
SCORE_TYPES = np.int16, np.int32, np.int64


def score_type(
    level: Triple, template: Triple, overlap: Triple, correlation: bool = False
) -> type[np.number[Any]]:
    """Return the smallest type that holds every score.

    No score is further from 0 than the sum of squares over the largest overlap, of the image or of
    what is simulated; a correlation is counted twice.
    """
    bound = overlap_cells(template, overlap) * 2 ** sum(level) * (2 if correlation else 1)
    return next(kind for kind in SCORE_TYPES if bound <= np.iinfo(kind).max)


def running_squares(
    sums: NDArray[np.number[Any]], kind: type[np.number[Any]]
) -> NDArray[np.number[Any]]:
    """Return ΣA² of all block sums before each, along three axes, with a margin of zeros.

    In the type of the scores, where the numbers wrap around: that of a box of blocks, a difference
    of them, is exact all the same if the type holds it.
    """
    return summed_up(np.square(sums.astype(np.int64)).sum(axis=0)).astype(kind)


def summed_up(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the sums of all values before each, along three axes, with a margin of zeros."""
    found = np.zeros([n + 1 for n in values.shape], np.int64)
    inner = found[1:, 1:, 1:]
    inner[...] = values
    for axis, n in enumerate(values.shape):
        if n > 1:  # along a single one NumPy takes a call for each
            np.cumsum(inner, axis, out=inner)
    return found


def box_sums(
    table: NDArray[np.int64], size: Triple, first: Triple, last: Triple
) -> NDArray[np.int64]:
    """Return the sum of the part from `first` to `last` of each window of `size` values.

    `table` comes from `summed_up`.
    """
    found = table
    for axis, (start, end, t) in enumerate(zip(first, last, size, strict=True)):
        lines, n = np.moveaxis(found, axis, 0), table.shape[axis] - t
        found = np.moveaxis(lines[end : end + n] - lines[start : start + n], 0, axis)
    return found


@part_of_kernel
def overlap_energies(squares, box, block, energies):
    """Fill `energies`, shape (nz, ny, nx) of locations, with ΣA² of the overlap of a patch at each.

    `squares` come from `running_squares`.
    """
    nz, ny, nx = energies.shape
    low_z, _, low_y, _, low_x, _ = inside_overlap(box)
    last_z, last_y, last_x = box.nz // block[0], box.ny // block[1], box.nx // block[2]
    cells, flat = squares.reshape(-1), energies.reshape(-1)
    for z in range(nz):
        for y in range(ny):
            own = np.uint64((z * ny + y) * nx)
            for x in range(np.uint64(nx)):
                flat[own + x] = 0
            for corner in range(8):  # those of all blocks, and of those that are not in the overlap
                inside = corner & 4 != 0
                first_z = low_z // block[0] if inside else 0
                first_y = low_y // block[1] if inside else 0
                first_x = low_x // block[2] if inside else 0
                at_z = z + (first_z if corner & 2 else last_z)
                at_y = y + (first_y if corner & 1 else last_y)
                row = (at_z * squares.shape[1] + at_y) * squares.shape[2]
                first, last = np.uint64(row + first_x), np.uint64(row + last_x)
                if inside ^ (corner & 2 != 0) ^ (corner & 1 != 0):
                    first, last = last, first
                for x in range(np.uint64(nx)):
                    flat[own + x] += cells[last + x] - cells[first + x]


@part_of_kernel
def overlap_terms(grid, box, block, sums, offsets, weights):
    """Find the block sums of the overlap that are not zero; return how many.

    `offsets` gets where in `sums`, raveled, the first location meets each, `weights` the block sum.
    """
    n = 0
    n_planes, mz, my, mx = sums.shape
    first_facies = 1 if n_planes == 1 else 0
    uz, uy, ux = block
    low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
    cells, _, rows, columns = grid.reshape(-1), *grid.shape
    n_columns = box.nx // ux
    for bz in range(box.nz // uz):
        for by in range(box.ny // uy):
            across = bz * uz < low_z or by * uy < low_y
            across = across or bz * uz >= high_z or by * uy >= high_y
            inner = n_columns if across else low_x // ux
            outer = n_columns if across else max(high_x // ux, inner)
            for k in range(n_columns - outer + inner):
                bx = k if k < inner else outer + k - inner
                z0, y0, x0 = box.z0 + bz * uz, box.y0 + by * uy, box.x0 + bx * ux
                for plane in range(n_planes):
                    facies, total = plane + first_facies, 0
                    for z in range(z0, z0 + uz):
                        for y in range(y0, y0 + uy):
                            first = np.uint64((z * rows + y) * columns + x0)
                            for x in range(np.uint64(ux)):
                                total += np.int64(cells[first + x] == facies)
                    offsets[n] = ((plane * mz + bz) * my + by) * mx + bx
                    weights[n] = total
                    n += np.int64(total > 0)  # the next one takes the place of one that is zero
    return n


class Sums(NamedTuple):
    """Arrays in which ΣA·B of several rows of locations is summed up."""

    chosen: NDArray[np.uint64]  # shape (n_terms,): where the block sums begin that are added
    part: NDArray[np.number[Any]]  # of the type of the block sums
    total: NDArray[np.number[Any]]  # of the type of the scores
    at_once: int  # how many terms `part` holds


def make_sums(
    block_sums: NDArray[np.integer[Any]],
    block: Triple,
    n_columns: int,
    n_terms: int,
    kind: type[np.number[Any]],
) -> Sums:
    """Return the arrays for `n_columns` locations a row, and scores of a type."""
    n, one_type = ROWS_AT_ONCE * block_sums.shape[3] + n_columns, block_sums.dtype
    largest = prod(block) if one_type == np.uint8 else prod(block) ** 2
    at_once = int(np.iinfo(one_type).max) // largest
    return Sums(np.zeros(n_terms, np.uint64), np.zeros(n, one_type), np.zeros(n, kind), at_once)


@part_of_kernel
def score_places(block_sums, offsets, weights, n_terms, energy, sums, scores):
    """Fill `scores` with SSD − ΣB² of every location (correlation: energy 0 gives −2·ΣA·B).

    Several rows are one run of numbers, as rows of locations alone are short; what comes out at
    the columns between them, where no location is, is left behind. Runs are read by unsigned
    numbers, which need no look at whether they are negative: that would keep loops from vectors.
    """
    nz, ny, nx = scores.shape
    my, mx = block_sums.shape[2], block_sums.shape[3]
    cells, energies, flat = block_sums.reshape(-1), energy.reshape(-1), scores.reshape(-1)
    total, two = sums.total, sums.total.dtype.type(2)
    at_once = _rows_at_once(nx, mx)
    for z in range(nz):
        for first in range(0, ny, at_once):
            rows = min(at_once, ny - first)
            length, base = np.uint64((rows - 1) * mx + nx), (z * my + first) * mx
            for x in range(length):
                total[x] = 0
            if cells.itemsize == 1:
                _add_digits(cells, base, offsets, weights, n_terms, length, sums)
            else:
                _add_products(cells, base, offsets, weights, n_terms, length, sums)
            for y in range(rows):
                own, of_run = np.uint64((z * ny + first + y) * nx), np.uint64(y * mx)
                for x in range(np.uint64(nx)):
                    flat[own + x] = energies[own + x] - two * total[of_run + x]


@part_of_kernel
def _add_products(cells, base, offsets, weights, n_terms, length, sums):
    """Add each term times its weight to the totals of a run of locations that starts at `base`."""
    part, total = sums.part, sums.total
    for start in range(0, n_terms, sums.at_once):
        stop = min(start + sums.at_once, n_terms)
        whole = stop - (stop - start) % 4
        for x in range(length):
            part[x] = 0
        for n in range(start, whole, 4):
            a, b = np.uint64(base + offsets[n]), np.uint64(base + offsets[n + 1])
            c, d = np.uint64(base + offsets[n + 2]), np.uint64(base + offsets[n + 3])
            wa, wb, wc, wd = weights[n], weights[n + 1], weights[n + 2], weights[n + 3]
            for x in range(length):
                part[x] += (
                    wa * cells[a + x] + wb * cells[b + x] + wc * cells[c + x] + wd * cells[d + x]
                )
        for n in range(whole, stop):
            a, wa = np.uint64(base + offsets[n]), weights[n]
            for x in range(length):
                part[x] += wa * cells[a + x]
        for x in range(length):
            total[x] += part[x]


@part_of_kernel
def _add_digits(cells, base, offsets, weights, n_terms, length, sums):
    """Do the same in bytes, which vectors cannot multiply: by the binary digits of the weights."""
    chosen, part, total = sums.chosen, sums.part, sums.total
    largest = np.int64(0)
    for n in range(n_terms):
        largest = max(largest, np.int64(weights[n]))
    n_digits = 0
    while largest >> n_digits:
        n_digits += 1
    for digit in range(n_digits - 1, -1, -1):
        n = 0
        for k in range(n_terms):
            chosen[n] = base + offsets[k]
            n += weights[k] >> digit & 1
        for x in range(length):
            total[x] += total[x]
        for start in range(0, n, sums.at_once):
            stop = min(start + sums.at_once, n)
            whole = stop - (stop - start) % 4
            for x in range(length):
                part[x] = 0
            for k in range(start, whole, 4):
                a, b, c, d = chosen[k], chosen[k + 1], chosen[k + 2], chosen[k + 3]
                for x in range(length):
                    part[x] += cells[a + x] + cells[b + x] + cells[c + x] + cells[d + x]
            for k in range(whole, stop):
                a = chosen[k]
                for x in range(length):
                    part[x] += cells[a + x]
            for x in range(length):
                total[x] += part[x]


@part_of_kernel
def _rows_at_once(nx, mx):
    """Return how many rows are one run: one where most of it would be left behind."""
    return ROWS_AT_ONCE if 4 * nx >= 3 * mx else 1
