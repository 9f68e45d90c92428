"""The CCW score map: how well the overlap fits every place of the TI (sections 3.2 and 4.2).

The sum of squared differences between overlap B and TI A, over the coefficients of the overlap, is
ΣA² − 2·ΣA·B + ΣB². ΣA² (the *energy*) is known beforehand for the three shapes of overlap, ΣB² is
the same for every place, and only coefficients that are not zero add to ΣA·B, the
cross-correlation. With block sums everything is an exact integer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim.kernels import kernel

LEFT, TOP, L_SHAPE = 1, 2, 3
"""The three shapes of the overlap (bits: 1 is the strip on the left, 2 the one at the top)."""


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
            counts[:] = 0
    return n


@kernel
def score_places(sums, terms, n_terms, energy, scores):
    """Fill `scores` with SSD − ΣB² of every place (correlation: energy 0 gives −2·ΣA·B).

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
    for py in range(ny):
        row = scores[py]
        for x in range(nx):  # a slice would compile seconds of error messages
            row[x] = energy[py, x]
        n = 0
        while n + 4 <= n_terms:
            a = sums[terms[0, n], py + terms[1, n], terms[2, n] : terms[2, n] + nx]
            b = sums[terms[0, n + 1], py + terms[1, n + 1], terms[2, n + 1] : terms[2, n + 1] + nx]
            c = sums[terms[0, n + 2], py + terms[1, n + 2], terms[2, n + 2] : terms[2, n + 2] + nx]
            d = sums[terms[0, n + 3], py + terms[1, n + 3], terms[2, n + 3] : terms[2, n + 3] + nx]
            wa, wb = 2 * terms[3, n], 2 * terms[3, n + 1]
            wc, wd = 2 * terms[3, n + 2], 2 * terms[3, n + 3]
            for x in range(nx):
                row[x] -= wa * a[x] + wb * b[x] + wc * c[x] + wd * d[x]
            n += 4
        while n < n_terms:
            a = sums[terms[0, n], py + terms[1, n], terms[2, n] : terms[2, n] + nx]
            wa = 2 * terms[3, n]
            for x in range(nx):
                row[x] -= wa * a[x]
            n += 1
