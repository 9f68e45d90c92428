"""Facies as bits: 64 cells of a row are compared at once.

The facies index of a cell is written in binary; bit b of 64 neighbouring cells makes one word of
plane b. Two cells differ where any of their planes does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.box import inside_overlap
from ccwsim.engine.stages.path import Triple


class Strips(NamedTuple):
    """The cells in the overlap of a box that locations are compared with."""

    # shape (n_planes, nz, ny, n_words): their facies; cell x of a row is bit x % 64 of word x // 64
    words: NDArray[np.uint64]
    mask: NDArray[np.uint64]  # shape (nz, ny, n_words): which cells they are


def to_bits(image: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Return the bits of facies indices, shape (n_planes, nz, ny, n_words).

    A row has one word more than it needs, so that 64 bits can be read from any cell on.
    """
    nz, ny, nx = image.shape
    planes = max(int(image.max()).bit_length(), 1)
    bits = np.zeros((planes, nz, ny, 64 * (nx // 64 + 2)), np.uint8)
    for plane in range(planes):
        bits[plane, :, :, :nx] = image >> plane & 1
    return np.packbits(bits, axis=3, bitorder="little").view("<u8").astype(np.uint64)


def make_strips(bits: NDArray[np.uint64], size: Triple) -> Strips:
    """Return empty strips for boxes of at most `size` cells."""
    nz, ny, nx = size
    n_words = (nx + 63) // 64
    words = np.zeros((len(bits), nz, ny, n_words), np.uint64)
    return Strips(words, np.zeros((nz, ny, n_words), np.uint64))


@part_of_kernel
def take_strips(grid, box, strips):
    """Fill `strips` with the facies that the grid has in the overlap of a box."""
    n_planes, n_words = strips.words.shape[0], (box.nx + 63) // 64
    low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
    for z in range(box.nz):
        for y in range(box.ny):
            across = z < low_z or z >= high_z or y < low_y or y >= high_y
            row = grid[box.z0 + z, box.y0 + y, box.x0 : box.x0 + box.nx]
            for w in range(n_words):
                mask = np.uint64(0)
                for x in range(64 * w, min(64 * w + 64, box.nx)):
                    if across or x < low_x or x >= high_x:
                        mask |= np.uint64(1) << np.uint64(x & 63)
                strips.mask[z, y, w] = mask
                for plane in range(n_planes):
                    word, digit = np.uint64(0), np.uint64(plane)
                    for x in range(64 * w, min(64 * w + 64, box.nx)):
                        word |= (np.uint64(row[x]) >> digit & np.uint64(1)) << np.uint64(x & 63)
                    strips.words[plane, z, y, w] = word & mask


@part_of_kernel
def n_bits(word):
    """Return how many bits of 64 are set; compilers know this way."""
    one, two = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
    n = word - (word >> np.uint64(1) & one)
    n = (n & two) + (n >> np.uint64(2) & two)
    n = n + (n >> np.uint64(4)) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64(n * np.uint64(0x0101010101010101) >> np.uint64(56))


@part_of_kernel
def n_different(bits, place, box, strips, limit):
    """Return in how many cells of its strips a box differs from a location of the image.

    Counting may end at `limit`; `bits` are the image's, shape (n_planes, nz, ny, n_words).
    """
    tz, ty, tx = place
    first, shift = tx >> 6, np.uint64(tx & 63)
    back = np.uint64(63) - shift
    wrong = np.int64(0)
    for z in range(box.nz):
        for y in range(box.ny):
            for w in range((box.nx + 63) // 64):
                mask = strips.mask[z, y, w]
                if not mask:
                    continue
                differ = np.uint64(0)
                for plane in range(strips.words.shape[0]):
                    near = bits[plane, tz + z, ty + y, first + w]
                    far = bits[plane, tz + z, ty + y, first + w + 1]
                    own = strips.words[plane, z, y, w]
                    differ |= (near >> shift | far << np.uint64(1) << back) ^ own
                wrong += n_bits(differ & mask)
            if wrong >= limit:
                return wrong
    return wrong
