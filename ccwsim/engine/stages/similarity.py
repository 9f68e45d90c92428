"""The CCW score map: how well the overlap fits every location of the training image.

Sections 3.2 and 4.3; Algorithm 1, line 10. The paper's CCW is the plain cross-correlation ΣA·B, the
largest best (similarity "correlation"). The authors' code takes the sum of squared differences, the
smallest best, and so does the default here.

The sum of squared differences between overlap B and TI A, over the coefficients of the overlap, is
ΣA² − 2·ΣA·B + ΣB². ΣA² (the *energy*) is known beforehand for the three shapes of overlap, ΣB² is
the same for every location, and only coefficients that are not zero add to ΣA·B, the
cross-correlation. With block sums everything is an exact integer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.box import LEFT, TOP

ROWS_AT_ONCE = 16
"""Rows of locations that are scored together: enough for long loops, few enough for the cache."""


def score_type(level: int, template_size: int, overlap_size: int) -> type[np.signedinteger]:
    """Return the smallest integer type that no score can leave."""
    cells = 2 * template_size * overlap_size
    bound = 2 * 4**level * cells
    return next(t for t in (np.int16, np.int32, np.int64) if bound <= np.iinfo(t).max)


def overlap_energies(
    sums: NDArray[np.integer], template: int, overlap: int, kind: type[np.signedinteger]
) -> NDArray[np.signedinteger]:
    """Return ΣA² of each shape of overlap at each location, shape (4, ny, nx).

    Shape 0 is the first patch, which has no overlap; T and OR are in blocks.
    """
    squares = np.square(sums.astype(np.int64)).sum(axis=0)
    table = np.pad(squares.cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    my, mx = squares.shape
    ny, nx = my - template + 1, mx - template + 1

    def box(height: int, width: int) -> NDArray[np.int64]:
        return (
            table[height : height + ny, width : width + nx]
            - table[:ny, width : width + nx]
            - table[height : height + ny, :nx]
            + table[:ny, :nx]
        )

    left, top, corner = box(template, overlap), box(overlap, template), box(overlap, overlap)
    return np.stack([np.zeros_like(left), left, top, left + top - corner]).astype(kind)


@part_of_kernel
def overlap_terms(grid, box, block_size, n_planes, terms):
    """Fill `terms` with the block sums of the overlap that are not zero; return how many.

    Rows of `terms`, shape (4, n): plane, row and column in blocks, and block sum.
    """
    n = 0
    first = 1 if n_planes == 1 else 0
    for by in range(box.size // block_size):
        in_top = box.sides & TOP and by * block_size < box.overlap
        if not in_top and not box.sides & LEFT:
            break
        width = box.size if in_top else box.overlap
        for bx in range(width // block_size):
            y0, x0 = box.y0 + by * block_size, box.x0 + bx * block_size
            for plane in range(n_planes):
                total = 0
                for y in range(y0, y0 + block_size):
                    for x in range(x0, x0 + block_size):
                        total += grid[y, x] == plane + first
                if total > 0:
                    terms[0, n] = plane
                    terms[1, n] = by
                    terms[2, n] = bx
                    terms[3, n] = total
                    n += 1
    return n


def n_run(sums: NDArray[np.integer], n_columns: int) -> int:
    """Return how long the `run` of `score_places` is, for `n_columns` locations a row."""
    return ROWS_AT_ONCE * sums.shape[2] + n_columns


@part_of_kernel
def score_places(sums, terms, n_terms, energy, weights, run, scores):
    """Fill `scores` with SSD − ΣB² of every location (correlation: energy 0 gives −2·ΣA·B).

    Several rows are one run of numbers, as rows of locations alone are short; what comes out at
    the columns between them, where no location is, is left behind. `weights`, as many as `terms`,
    and `run` are workspace of the type of the scores.
    """
    ny, nx = scores.shape
    mx = sums.shape[2]
    flat = sums.ravel()
    for n in range(n_terms):  # of a wider type, they would keep the loops below from vectors
        weights[n] = terms[3, n]
    at_once = _rows_at_once(nx, mx)
    for first in range(0, ny, at_once):
        rows = min(at_once, ny - first)
        length = (rows - 1) * mx + nx
        for x in range(length):
            run[x] = 0
        whole = n_terms - n_terms % 4
        for n in range(0, whole, 4):
            a = _run_of(flat, sums.shape, terms, n, first, length)
            b = _run_of(flat, sums.shape, terms, n + 1, first, length)
            c = _run_of(flat, sums.shape, terms, n + 2, first, length)
            d = _run_of(flat, sums.shape, terms, n + 3, first, length)
            wa, wb, wc, wd = weights[n], weights[n + 1], weights[n + 2], weights[n + 3]
            for x in range(length):
                run[x] += wa * a[x] + wb * b[x] + wc * c[x] + wd * d[x]
        for n in range(whole, n_terms):
            a = _run_of(flat, sums.shape, terms, n, first, length)
            wa = weights[n]
            for x in range(length):
                run[x] += wa * a[x]
        for y in range(rows):
            for x in range(nx):
                scores[first + y, x] = energy[first + y, x] - 2 * run[y * mx + x]


@part_of_kernel
def _rows_at_once(nx, mx):
    """Return how many rows are one run: one where most of it would be left behind."""
    return ROWS_AT_ONCE if 4 * nx >= 3 * mx else 1


@part_of_kernel
def _run_of(flat, shape, terms, n, first, length):
    """Return the block sums that a term meets at the locations of row `first` on.

    They are a slice of all sums in one row: one of two dimensions has a stride that is not known
    when the kernel is compiled.
    """
    start = ((terms[0, n] * shape[1]) + first + terms[1, n]) * shape[2] + terms[2, n]
    return flat[start : start + length]
