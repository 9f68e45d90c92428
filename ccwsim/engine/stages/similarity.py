"""The CCW score map: how well the overlap fits every location of the training image.

Sections 3.2 and 4.3; Algorithm 1, line 10. The paper's CCW is the plain cross-correlation ΣA·B, the
largest best (similarity "correlation"). The authors' code takes the sum of squared differences, the
smallest best, and so does the default here.

The sum of squared differences between overlap B and TI A, over the coefficients of the overlap, is
ΣA² − 2·ΣA·B + ΣB². ΣA² (the *energy*) is known beforehand for each shape of overlap, ΣB² is the
same for every location, and only coefficients that are not zero add to ΣA·B, the cross-correlation.
With block sums everything is an exact integer.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.box import BELOW, LEFT, TOP, inside_overlap
from ccwsim.engine.stages.path import Triple, overlap_cells

ROWS_AT_ONCE = 16
"""Rows of locations that are scored together: enough for long loops, few enough for the cache."""
EXACT = ((np.int16, 2**15 - 1), (np.float32, 2**24), (np.int32, 2**31 - 1), (np.int64, 2**63 - 1))
"""Types of scores, the fastest first, and up to where each holds every whole number."""


def score_type(
    level: Triple, template: Triple, overlap: Triple, correlation: bool = False
) -> type[np.number[Any]]:
    """Return the fastest type that holds every score.

    No score is further from 0 than the sum of squares over the largest overlap, of the image or of
    what is simulated; a correlation is counted twice.
    """
    bound = overlap_cells(template, overlap) * 2 ** sum(level) * (2 if correlation else 1)
    return next(kind for kind, largest in EXACT if bound <= largest)


def overlap_energies(
    sums: NDArray[np.number[Any]], template: Triple, overlap: Triple, kind: type[np.number[Any]]
) -> NDArray[np.number[Any]]:
    """Return ΣA² of each shape of overlap at each location, shape (n_shapes, nz, ny, nx).

    Shapes are sums of LEFT, TOP and BELOW, as far as there is such an overlap: shape 0 is the first
    patch, which has none. T and OR are in blocks.
    """
    squares = np.square(sums.astype(np.int64)).sum(axis=0)
    table = np.pad(squares.cumsum(0).cumsum(1).cumsum(2), ((1, 0),) * 3)
    shape = tuple(m - t + 1 for m, t in zip(squares.shape, template, strict=True))

    def box(first: Triple) -> NDArray[np.int64]:
        """Sum from `first` in the template to its far corner."""
        found = table
        for axis, (start, end, n) in enumerate(zip(first, template, shape, strict=True)):
            lines = np.moveaxis(found, axis, 0)
            found = np.moveaxis(lines[end : end + n] - lines[start : start + n], 0, axis)
        return found

    whole, (oz, oy, ox) = box((0, 0, 0)), overlap
    energies = np.empty((8 if oz else 4, *shape), kind)
    for sides in range(len(energies)):
        own = oz if sides & BELOW else 0, oy if sides & TOP else 0, ox if sides & LEFT else 0
        energies[sides] = whole - box(own)
    return energies


@part_of_kernel
def overlap_terms(grid, box, block, sums, counts, offsets, weights):
    """Find the block sums of the overlap that are not zero; return how many.

    `offsets` gets where in `sums`, raveled, the first location meets each, `weights` the block sum;
    `counts` is workspace by facies.
    """
    n = 0
    n_planes, mz, my, mx = sums.shape
    first = 1 if n_planes == 1 else 0
    uz, uy, ux = block
    low_z, _, low_y, _, low_x, _ = inside_overlap(box)
    for bz in range(box.nz // uz):
        for by in range(box.ny // uy):
            across = bz * uz < low_z or by * uy < low_y
            width = box.nx if across else low_x
            for bx in range(width // ux):
                z0, y0, x0 = box.z0 + bz * uz, box.y0 + by * uy, box.x0 + bx * ux
                for z in range(z0, z0 + uz):
                    for y in range(y0, y0 + uy):
                        for x in range(x0, x0 + ux):
                            counts[grid[z, y, x]] += 1
                for plane in range(n_planes):
                    total = counts[plane + first]
                    if total > 0:
                        offsets[n] = ((plane * mz + bz) * my + by) * mx + bx
                        weights[n] = total
                        n += 1
                for facies in range(len(counts)):
                    counts[facies] = 0
    return n


def n_run(sums: NDArray[np.number[Any]], n_columns: int) -> int:
    """Return how long the `run` of `score_places` is, for `n_columns` locations a row."""
    return ROWS_AT_ONCE * sums.shape[3] + n_columns


@part_of_kernel
def score_places(sums, offsets, weights, n_terms, energy, run, scores):
    """Fill `scores` with SSD − ΣB² of every location (correlation: energy 0 gives −2·ΣA·B).

    Several rows are one run of numbers, as rows of locations alone are short; what comes out at
    the columns between them, where no location is, is left behind. `weights` and `run` are of the
    type of the scores: a wider one would keep the loops from vectors.
    """
    nz, ny, nx = scores.shape
    my, mx = sums.shape[2], sums.shape[3]
    flat = sums.ravel()
    at_once = _rows_at_once(nx, mx)
    whole, two = n_terms - n_terms % 4, run.dtype.type(2)
    for z in range(nz):
        for first in range(0, ny, at_once):
            rows = min(at_once, ny - first)
            length = (rows - 1) * mx + nx
            base = (z * my + first) * mx
            for x in range(length):
                run[x] = 0
            for n in range(0, whole, 4):
                a, b = flat[base + offsets[n] :][:length], flat[base + offsets[n + 1] :][:length]
                c, d = (
                    flat[base + offsets[n + 2] :][:length],
                    flat[base + offsets[n + 3] :][:length],
                )
                wa, wb, wc, wd = weights[n], weights[n + 1], weights[n + 2], weights[n + 3]
                for x in range(length):
                    run[x] += wa * a[x] + wb * b[x] + wc * c[x] + wd * d[x]
            for n in range(whole, n_terms):
                a, wa = _run_from(flat, base, offsets[n]), weights[n]
                for x in range(length):
                    run[x] += wa * a[x]
            for y in range(rows):
                for x in range(nx):
                    scores[z, first + y, x] = energy[z, first + y, x] - two * run[y * mx + x]


@part_of_kernel
def _run_from(flat, base, offset):
    """Return the block sums that a term meets at a row of locations that starts at `base`.

    They are a slice of all sums in one row: one of more dimensions has strides that are not known
    when the kernel is compiled.
    """
    return flat[base + offset :]


@part_of_kernel
def _rows_at_once(nx, mx):
    """Return how many rows are one run: one where most of it would be left behind."""
    return ROWS_AT_ONCE if 4 * nx >= 3 * mx else 1
