"""Facies as bits: 64 cells of a row are compared at once.

The facies index of a cell is written in binary; bit b of 64 neighbouring cells makes one word of
plane b. Two cells differ where any of their planes does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.box import BOTTOM, LEFT, RIGHT, TOP


class Strips(NamedTuple):
    """The cells in the overlap of a box that locations are compared with."""

    # shape (n_planes, size, n_words): their facies; cell x of a row is bit x % 64 of word x // 64
    words: NDArray[np.uint64]
    mask: NDArray[np.uint64]  # shape (size, n_words): which cells they are


def to_bits(image: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Return the bits of facies indices, shape (n_planes, ny, n_words).

    A row has one word more than it needs, so that 64 bits can be read from any cell on.
    """
    ny, nx = image.shape
    planes = max(int(image.max()).bit_length(), 1)
    bits = np.zeros((planes, ny, 64 * (nx // 64 + 2)), np.uint8)
    for plane in range(planes):
        bits[plane, :, :nx] = image >> plane & 1
    return np.packbits(bits, axis=2, bitorder="little").view("<u8").astype(np.uint64)


def make_strips(bits: NDArray[np.uint64], size: int) -> Strips:
    """Return empty strips for boxes of at most `size` cells."""
    n_words = (size + 63) // 64
    words = np.zeros((len(bits), size, n_words), np.uint64)
    return Strips(words, np.zeros((size, n_words), np.uint64))


@part_of_kernel
def take_strips(grid, box, strips):
    """Fill `strips` with the facies that `grid`, shape (ny, nx), has in the overlap of a box."""
    n_planes, n_words = strips.words.shape[0], (box.size + 63) // 64
    left = box.overlap if box.sides & LEFT else np.int64(0)
    right = box.size - box.overlap if box.sides & RIGHT else box.size
    top = box.overlap if box.sides & TOP else np.int64(0)
    bottom = box.size - box.overlap if box.sides & BOTTOM else box.size
    for y in range(box.size):
        across = y < top or y >= bottom
        for w in range(n_words):
            strips.mask[y, w] = np.uint64(0)
            for plane in range(n_planes):
                strips.words[plane, y, w] = np.uint64(0)
        for x in range(box.size):
            if not across and left <= x < right:
                continue
            w, bit = x >> 6, np.uint64(x & 63)
            strips.mask[y, w] |= np.uint64(1) << bit
            for plane in range(n_planes):
                digit = np.uint64(grid[box.y0 + y, box.x0 + x] >> plane & 1)
                strips.words[plane, y, w] |= digit << bit


@part_of_kernel
def n_bits(word):
    """Return how many bits of 64 are set; compilers know this way."""
    one, two = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
    n = word - (word >> np.uint64(1) & one)
    n = (n & two) + (n >> np.uint64(2) & two)
    n = n + (n >> np.uint64(4)) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64(n * np.uint64(0x0101010101010101) >> np.uint64(56))


@part_of_kernel
def n_different(bits, ty, tx, size, strips, limit):
    """Return in how many cells of its strips a box differs from a location of the image.

    Counting may end at `limit`; `bits` are the image's, shape (n_planes, ny, n_words).
    """
    first, shift = tx >> 6, np.uint64(tx & 63)
    back = np.uint64(63) - shift
    wrong = np.int64(0)
    for y in range(size):
        for w in range((size + 63) // 64):
            differ = np.uint64(0)
            for plane in range(strips.words.shape[0]):
                near = bits[plane, ty + y, first + w]
                far = bits[plane, ty + y, first + w + 1]
                differ |= (near >> shift | far << np.uint64(1) << back) ^ strips.words[plane, y, w]
            wrong += n_bits(differ & strips.mask[y, w])
        if wrong >= limit:
            break
    return wrong
