"""The wavelet pyramid of the training image (sections 3.1 and 4.2; Algorithm 1, line 2).

The Haar approximation at level J is 2^J times the mean of each block of 2^J × 2^J cells. The search
uses it as block *sums*, small integers, so that scores are exact. A volume has a level along each
axis.

MS-CCSIM (Tahmasebi, Sahimi and Caers 2014) searches images that are up-gridded instead: the facies
of most cells stands for a block, so that the facies may have any codes.
"""

from __future__ import annotations

from math import prod
from typing import Any, NamedTuple

import numpy as np
import pywt
from numpy.typing import NDArray

from ccwsim.engine.kernels import allocating_kernel
from ccwsim.engine.stages.bits import to_square_bits
from ccwsim.engine.stages.path import Triple
from ccwsim.model.errors import CCWSIMError


class Pyramid(NamedTuple):
    """The training image in path coordinates, as the kernels need it."""

    image: NDArray[np.uint8]  # shape (nz, ny, nx): facies indices
    # shape (n, nz, ny, n_words): the same as `to_square_bits` gives it
    square_bits: NDArray[np.uint64]
    # shape (n_planes, nz / 2^J, ny / 2^J, nx / 2^J): how many cells of each block have each facies.
    # Two facies need one plane.
    sums: NDArray[np.unsignedinteger[Any]]
    # shape (2^J, 2^J, 2^J, nz / 2^J, ny / 2^J, nx / 2^J): `phases[a, b, c, i, j, k]` is the cell
    # [a, b, c] of block [i, j, k], so that the cell at a fixed offset from all locations is in one
    # contiguous part
    phases: NDArray[np.uint8]


def decompose(image: NDArray, level: int, wavelet: str = "haar") -> list[Any]:
    """Return the DWT of an image as `pywt.wavedec2` gives it: [cA_J, details_J, …, details_1].

    Rows and columns that do not fill a block of 2^level are left out.
    """
    unit = 2**level
    ny, nx = (length - length % unit for length in image.shape)
    if min(ny, nx) == 0:
        raise CCWSIMError(
            f"level {level} needs an image of at least {unit} × {unit} cells, "
            f"not {image.shape[0]} × {image.shape[1]}; choose a lower level"
        )
    return pywt.wavedec2(image[:ny, :nx].astype(float), wavelet, "periodization", level)


def reconstruct(coefficients: list[Any], place: tuple[int, int], size: int) -> NDArray[np.float64]:
    """Return the patch at a location by the inverse DWT of its coefficients.

    Section 4.4; Algorithm 1, line 13. For Haar this is the slice of the image itself, which is what
    the simulation loop uses; this function shows, and the tests prove, that it may. The place is in
    the approximation; the size of the patch in cells is a multiple of 2^J.

    Examples
    --------
    >>> image = np.arange(64.0).reshape(8, 8)
    >>> np.allclose(reconstruct(decompose(image, 2), (1, 0), 4), image[4:8, 0:4])
    True
    """
    level = len(coefficients) - 1

    def crop(band: NDArray, scale: int) -> NDArray:
        first = [index * 2 ** (level - scale) for index in place]
        side = size >> scale
        return band[first[0] : first[0] + side, first[1] : first[1] + side]

    own = [crop(coefficients[0], level)]
    own += [
        tuple(crop(band, level - k) for band in bands) for k, bands in enumerate(coefficients[1:])
    ]
    return pywt.waverec2(own, "haar", "periodization")


def build_pyramid(indices: NDArray[np.uint8], level: Triple, n_planes: int) -> Pyramid:
    """Return the pyramid of a training image that is already in path coordinates.

    One plane compares facies 1 with the rest (enough for two facies), else each facies has one.

    Raises
    ------
    CCWSIMError
        For an image smaller than one block.
    """
    image = np.ascontiguousarray(indices)
    unit = tuple(2**n for n in level)
    counts = tuple(length // u for length, u in zip(image.shape, unit, strict=True))
    if min(counts) == 0:
        raise CCWSIMError(
            f"level {' × '.join(map(str, level))} (z, y, x) needs an image of at least "
            f"{' × '.join(map(str, unit))} cells, not {' × '.join(map(str, image.shape))}; choose "
            "a lower level"
        )
    phases = cells_of_blocks(image, unit)  # type: ignore[arg-type]
    return Pyramid(image, to_square_bits(image), block_sums(phases, n_planes), phases)


def cells_of_blocks(image: NDArray[np.uint8], block: Triple) -> NDArray[np.uint8]:
    """Return the cells of all whole blocks of an image, as `Pyramid.phases` has them."""
    (uz, uy, ux), (nz, ny, nx) = block, (n // u for n, u in zip(image.shape, block, strict=True))
    blocks = image[: nz * uz, : ny * uy, : nx * ux].reshape(nz, uz, ny, uy, nx, ux)
    return np.ascontiguousarray(blocks.transpose(1, 3, 5, 0, 2, 4))


def block_sums(phases: NDArray[np.uint8], n_planes: int) -> NDArray[np.unsignedinteger[Any]]:
    """Return how many cells of each block have each facies, as `Pyramid.sums` has them."""
    kind = np.min_scalar_type(prod(phases.shape[:3]))
    facies = [1] if n_planes == 1 else range(n_planes)
    return np.stack([(phases == f).sum(axis=(0, 1, 2), dtype=kind) for f in facies])


@allocating_kernel
def upgrid(image, unit):
    """Return the facies of most cells of each block of `unit` cells along z, y and x.

    Of facies with equally many cells the one that comes first in the block, by layer, row and
    column, is taken: no facies is favoured, and a boundary along the middle of blocks stays
    straight. What does not fill a block is left out.

    Examples
    --------
    >>> upgrid(np.array([[[1, 0, 2, 2, 1], [1, 1, 0, 0, 1]]], np.uint8), (1, 2, 2))
    array([[[1, 2]]], dtype=uint8)
    """
    uz, uy, ux = unit
    nz, ny, nx = image.shape[0] // uz, image.shape[1] // uy, image.shape[2] // ux
    coarse = np.empty((nz, ny, nx), np.uint8)
    counts = np.zeros(256, np.int64)
    for i in range(nz):
        for j in range(ny):
            for k in range(nx):
                block = image[i * uz : (i + 1) * uz, j * uy : (j + 1) * uy, k * ux : (k + 1) * ux]
                for facies in block.flat:
                    counts[facies] += 1
                most = 0
                for facies in block.flat:
                    if counts[facies] > most:
                        most = counts[facies]
                        coarse[i, j, k] = facies
                for facies in block.flat:
                    counts[facies] = 0
    return coarse


def upgrid_data(
    cells: NDArray[np.int64], facies: NDArray[np.uint8], unit: Triple
) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return the blocks of `unit` cells that have data, and the facies of most of them.

    Data that fall into one block with different facies cannot all be told there: the facies of most
    of them is taken, and of equally many that of the datum that comes first by layer, row, column.

    Examples
    --------
    >>> cells = np.array([[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 5, 2]])
    >>> upgrid_data(cells, np.array([0, 1, 1, 2]), (1, 2, 2))
    (array([[0, 0, 0],
           [0, 2, 1]]), array([1, 2], dtype=uint8))
    """
    if max(unit) == 1 or not len(cells):
        return cells, facies.astype(np.uint8)
    order = np.lexsort(cells.T[::-1])
    blocks, block_of = np.unique(cells[order] // np.array(unit), axis=0, return_inverse=True)
    block_of, own = block_of.ravel(), facies[order].astype(np.uint8)
    _, pair_of, counts = np.unique(block_of * 256 + own, return_inverse=True, return_counts=True)
    ranked = np.lexsort((np.arange(len(own)), -counts[pair_of], block_of))
    first = np.searchsorted(block_of[ranked], np.arange(len(blocks)))
    return blocks, own[ranked[first]]
