"""The CCW score map: how well the overlap fits every place of the TI (sections 3.2 and 4.2).

The sum of squared differences between overlap B and TI A, over the coefficients of the overlap, is
ΣA² − 2·ΣA·B + ΣB². ΣA² (the *energy*) is known beforehand for the three shapes of overlap, ΣB² is
the same for every place, and only coefficients that are not zero add to ΣA·B, the
cross-correlation. With block sums everything is an exact integer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import kernel

LEFT, TOP, L_SHAPE = 1, 2, 3
"""The three shapes of the overlap (bits: 1 is the strip on the left, 2 the one at the top)."""
ROWS_AT_ONCE = 16
"""Rows of places that are scored together: enough for long loops, few enough for the cache."""


def score_type(level: int, template_size: int, overlap_size: int) -> type[np.signedinteger]:
    """Return the smallest integer type that no score can leave.

    Examples
    --------
    >>> score_type(2, 32, 8).__name__, score_type(3, 32, 8).__name__
    ('int16', 'int32')
    """
    cells = 2 * template_size * overlap_size
    bound = 2 * 4**level * cells
    return next(t for t in (np.int16, np.int32, np.int64) if bound <= np.iinfo(t).max)


def overlap_energies(
    sums: NDArray[np.integer], template: int, overlap: int, kind: type[np.signedinteger]
) -> NDArray[np.signedinteger]:
    """Return ΣA² of each shape of overlap at each place.

    Parameters
    ----------
    sums : ndarray, shape (n_planes, my, mx)
        Block sums of the training image.
    template, overlap : int
        T and OR in blocks.
    kind : type
        Integer type of the scores.

    Returns
    -------
    ndarray, shape (4, my − template + 1, mx − template + 1)
        By shape of overlap; 0 is the first patch, which has none.
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


@kernel
def overlap_terms(grid, y0, x0, template, overlap, unit, shape, n_planes, terms):
    """Fill `terms` with the block sums of the overlap that are not zero; return how many.

    Parameters
    ----------
    grid : ndarray of uint8, shape (ny, nx)
        The simulation grid in the path frame.
    y0, x0, template, overlap, unit : int
        First cell of the tile, T and OR in cells, 2^J.
    shape : int
        Shape of the overlap.
    n_planes : int
        Facies planes of the pyramid.
    terms : ndarray of int64, shape (4, n)
        Plane, row, column (in blocks) and block sum of each.
    """
    counts = np.zeros(256, np.int64)
    n = 0
    for by in range(template // unit):
        in_top = shape & TOP and by * unit < overlap
        if not in_top and not shape & LEFT:
            break
        width = template if in_top else overlap
        for bx in range(width // unit):
            for y in range(y0 + by * unit, y0 + (by + 1) * unit):
                for x in range(x0 + bx * unit, x0 + (bx + 1) * unit):
                    counts[grid[y, x]] += 1
            first = 1 if n_planes == 1 else 0
            for plane in range(n_planes):
                if counts[plane + first] > 0:
                    terms[0, n] = plane
                    terms[1, n] = by
                    terms[2, n] = bx
                    terms[3, n] = counts[plane + first]
                    n += 1
            for facies in range(n_planes + first):
                counts[facies] = 0
    return n


@kernel
def score_places(sums, terms, n_terms, energy, scores):
    """Fill `scores` with SSD − ΣB² of every place (correlation: energy 0 gives −2·ΣA·B).

    Several rows are one run of numbers, as rows of places alone are short; what comes out at the
    columns between them, where no place is, is left behind.

    Parameters
    ----------
    sums : ndarray, shape (n_planes, my, mx)
        Block sums of the training image.
    terms, n_terms
        From `overlap_terms`.
    energy, scores : ndarray, shape (ny, nx)
        By place; the same integer type.
    """
    ny, nx = scores.shape
    n_planes, my, mx = sums.shape
    planes = sums.reshape(n_planes, my * mx)
    at_once = ROWS_AT_ONCE if 4 * nx >= 3 * mx else 1
    run = np.empty((at_once - 1) * mx + nx, scores.dtype)
    for first in range(0, ny, at_once):
        rows = min(at_once, ny - first)
        length = (rows - 1) * mx + nx
        for x in range(length):
            run[x] = 0
        n = 0
        while n + 4 <= n_terms:
            a = _run_of(planes, terms, n, first, mx, length)
            b = _run_of(planes, terms, n + 1, first, mx, length)
            c = _run_of(planes, terms, n + 2, first, mx, length)
            d = _run_of(planes, terms, n + 3, first, mx, length)
            wa, wb, wc, wd = terms[3, n], terms[3, n + 1], terms[3, n + 2], terms[3, n + 3]
            for x in range(length):
                run[x] += wa * a[x] + wb * b[x] + wc * c[x] + wd * d[x]
            n += 4
        while n < n_terms:
            a = _run_of(planes, terms, n, first, mx, length)
            wa = terms[3, n]
            for x in range(length):
                run[x] += wa * a[x]
            n += 1
        for y in range(rows):
            for x in range(nx):
                scores[first + y, x] = energy[first + y, x] - 2 * run[y * mx + x]


@kernel
def _run_of(planes, terms, n, first, mx, length):
    """Return the block sums that a term meets at the places of row `first` on."""
    start = (first + terms[1, n]) * mx + terms[2, n]
    return planes[terms[0, n], start : start + length]
