"""The wavelet pyramid of the training image (sections 3.1 and 4.2; Algorithm 1, lines 2 and 13).

The Haar approximation at level J is 2^J times the mean of each block of 2^J × 2^J cells. The
approximation is thus proportional to the *sum* of the block. The search uses block sums, because
sums are small integers and give exact scores. A volume has one level for each axis.

MS-CCSIM (Tahmasebi, Sahimi and Caers 2014) searches up-gridded images instead, in which each block
becomes one cell with the majority facies of the block.
"""

from collections.abc import Sequence
from math import prod
from typing import Any, NamedTuple

import numpy as np
import pywt

from ccwsim.engine.kernels import allocating_kernel
from ccwsim.engine.stages.bits import to_square_bits
from ccwsim.engine.stages.path import Triple
from ccwsim.model import Array, Bytes, CCWSIMError, Floats, Integers, Ints, UInt64s


class Pyramid(NamedTuple):
    """The training image in path coordinates, at full resolution and at level J."""

    image: Bytes  # shape (nz, ny, nx): facies indices
    square_bits: UInt64s  # shape (n, nz, ny, n_words): made by `to_square_bits`
    # shape (n_planes, nz / 2^J, ny / 2^J, nx / 2^J): number of cells of each facies in each block,
    # proportional to cA_J. Two facies need only one plane.
    sums: Integers
    # shape (2^J, 2^J, 2^J, nz / 2^J, ny / 2^J, nx / 2^J): `phases[a, b, c, i, j, k]` is cell [a, b,
    # c] of block [i, j, k]. The cells [a, b, c] of all blocks are thus contiguous
    phases: Bytes


def decompose(image: Array, level: int, wavelet: str = "haar") -> list[Any]:
    """Return the DWT of an image like `pywt.wavedec2`: [cA_J, details_J, …, details_1].

    Rows and columns that do not fill a block of 2^level cells are omitted.
    """
    block = 2**level
    ny, nx = (length - length % block for length in image.shape)
    if min(ny, nx) == 0:
        raise CCWSIMError(
            f"level {level} needs an image of at least {block} × {block} cells, "
            f"not {image.shape[0]} × {image.shape[1]}; choose a lower level"
        )
    return pywt.wavedec2(image[:ny, :nx].astype(float), wavelet, "periodization", level)


def reconstruct(coefficients: list[Any], place: tuple[int, int], size: int) -> Floats:
    """Return the patch at a location by the inverse DWT of its coefficients.

    This function implements section 4.4 and Algorithm 1, line 13. For the Haar wavelet the result
    equals the slice of the image, so the simulation loop copies the slice. `place` is in
    coefficients; the size of the patch, in cells, is a multiple of 2^J.
    """
    level = len(coefficients) - 1

    def crop(band: Array, scale: int) -> Array:
        first = [index * 2 ** (level - scale) for index in place]
        side = size >> scale
        return band[first[0] : first[0] + side, first[1] : first[1] + side]

    cropped = [crop(coefficients[0], level)]
    cropped += [
        tuple(crop(band, level - k) for band in bands) for k, bands in enumerate(coefficients[1:])
    ]
    return pywt.waverec2(cropped, "haar", "periodization")


def build_pyramid(indices: Bytes, level: Triple, n_planes: int, n_facies: int = 0) -> Pyramid:
    """Return the pyramid of a training image in path coordinates.

    With two facies, one plane that counts facies 1 is enough; otherwise each facies has a plane.
    `to_square_bits` explains `n_facies`.

    Raises
    ------
    CCWSIMError
        If the image is smaller than one block.
    """
    image = np.ascontiguousarray(indices)
    block = tuple(2**n for n in level)
    if any(length < size for length, size in zip(image.shape, block, strict=True)):
        raise CCWSIMError(
            f"level {' × '.join(map(str, level))} (z, y, x) needs an image of at least "
            f"{' × '.join(map(str, block))} cells, not {' × '.join(map(str, image.shape))}; choose "
            "a lower level"
        )
    phases = cells_of_blocks(image, block)  # type: ignore[arg-type]
    return Pyramid(image, to_square_bits(image, n_facies), block_sums(phases, n_planes), phases)


def cells_of_blocks(image: Bytes, block: Triple) -> Bytes:
    """Return the cells of all complete blocks of an image, in the order of `Pyramid.phases`."""
    (uz, uy, ux), (nz, ny, nx) = block, (n // u for n, u in zip(image.shape, block, strict=True))
    blocks = image[: nz * uz, : ny * uy, : nx * ux].reshape(nz, uz, ny, uy, nx, ux)
    return np.ascontiguousarray(blocks.transpose(1, 3, 5, 0, 2, 4))


def block_sum_type(block: Sequence[int]) -> np.dtype[Any]:
    """Return the smallest integer type for the number of cells of a facies in a block."""
    return np.min_scalar_type(prod(block))


def block_sums(phases: Bytes, n_planes: int) -> Integers:
    """Return the number of cells of each facies in each block, in the order of `Pyramid.sums`."""
    kind = block_sum_type(phases.shape[:3])
    facies = [1] if n_planes == 1 else range(n_planes)
    return np.stack([(phases == f).sum(axis=(0, 1, 2), dtype=kind) for f in facies])


@allocating_kernel
def upgrid(image, block_size):
    """Return the majority facies of each block of `block_size` cells along z, y and x.

    In a tie, the result is the tied facies that occurs first in the block, by layer, row and
    column. A boundary along the middle of blocks thus stays straight. Cells that do not fill a
    block are omitted.
    """
    uz, uy, ux = block_size
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
    cells: Ints, facies: Bytes, block_size: Triple, largest: bool = False
) -> tuple[Ints, Bytes]:
    """Return the blocks of `block_size` cells with data, and the majority facies of their data.

    In a tie, the result is the tied facies whose first datum is first by layer, row and column. If
    `largest`, as in the authors' code, the result is the largest facies instead.
    """
    if max(block_size) == 1 or not len(cells):
        return cells, facies.astype(np.uint8)
    order = np.lexsort(cells.T[::-1])
    blocks, block_of = np.unique(cells[order] // np.array(block_size), axis=0, return_inverse=True)
    block_of, facies = block_of.ravel(), facies[order].astype(np.uint8)
    _, pair_of, counts = np.unique(block_of * 256 + facies, return_inverse=True, return_counts=True)
    rank = facies.astype(np.int64) if largest else counts[pair_of]
    ranked = np.lexsort((np.arange(len(facies)), -rank, block_of))
    first = np.searchsorted(block_of[ranked], np.arange(len(blocks)))
    return blocks, facies[ranked[first]]
