"""Up-grid the training image and the hard data: the facies of most cells stands for a block.

MS-CCSIM (Tahmasebi, Sahimi and Caers 2014) searches images that are coarsened so, by facies and not
by value, so that the facies may have any codes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import kernel


@kernel
def upgrid(image, unit):
    """Return the facies of most cells of each block of `unit` × `unit` cells.

    Of facies with equally many cells the one that comes first in the block, by row and column, is
    taken: no facies is favoured, and a boundary along the middle of blocks stays straight. Rows and
    columns that do not fill a block are left out.

    Examples
    --------
    >>> upgrid(np.array([[1, 0, 2, 2, 1], [1, 1, 0, 0, 1]], np.uint8), 2)
    array([[1, 2]], dtype=uint8)
    """
    ny, nx = image.shape[0] // unit, image.shape[1] // unit
    coarse = np.empty((ny, nx), np.uint8)
    counts = np.zeros(256, np.int64)
    for i in range(ny):
        for j in range(nx):
            for y in range(i * unit, (i + 1) * unit):
                for x in range(j * unit, (j + 1) * unit):
                    counts[image[y, x]] += 1
            most = 0
            for y in range(i * unit, (i + 1) * unit):
                for x in range(j * unit, (j + 1) * unit):
                    if counts[image[y, x]] > most:
                        most = counts[image[y, x]]
                        coarse[i, j] = image[y, x]
            for y in range(i * unit, (i + 1) * unit):
                for x in range(j * unit, (j + 1) * unit):
                    counts[image[y, x]] = 0
    return coarse


def upgrid_data(
    cells: NDArray[np.int64], facies: NDArray[np.uint8], unit: int
) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return the blocks of `unit` × `unit` cells that have data, and the facies of most of them.

    Data that fall into one block with different facies cannot all be told there: the facies of most
    of them is taken, and of equally many that of the datum that comes first by row and column.

    Examples
    --------
    >>> upgrid_data(np.array([[0, 0], [0, 1], [1, 1], [5, 2]]), np.array([0, 1, 1, 2]), 2)
    (array([[0, 0],
           [2, 1]]), array([1, 2], dtype=uint8))
    """
    if unit == 1 or not len(cells):
        return cells, facies.astype(np.uint8)
    order = np.lexsort((cells[:, 1], cells[:, 0]))
    blocks, block_of = np.unique(cells[order] // unit, axis=0, return_inverse=True)
    block_of, own = block_of.ravel(), facies[order].astype(np.uint8)
    _, pair_of, counts = np.unique(block_of * 256 + own, return_inverse=True, return_counts=True)
    ranked = np.lexsort((np.arange(len(own)), -counts[pair_of], block_of))
    first = np.searchsorted(block_of[ranked], np.arange(len(blocks)))
    return blocks, own[ranked[first]]
