"""Facies as bits: 64 cells of a row are compared at once.

The facies index of a cell is written in binary; bit b of 64 neighbouring cells makes one word of
plane b. Two cells differ where any of their planes does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import kernel


class Strips(NamedTuple):
    """The cells along the sides of a window that places are compared with.

    Attributes
    ----------
    words : ndarray of uint64, shape (n_planes, size, n_words)
        Their facies; cell x of a row is bit x % 64 of word x // 64.
    mask : ndarray of uint64, shape (size, n_words)
        Which cells they are.
    """

    words: NDArray[np.uint64]
    mask: NDArray[np.uint64]


def to_bits(image: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Return the bits of facies indices, shape (n_planes, ny, n_words).

    A row has one word more than it needs, so that 64 bits can be read from any cell on.

    Examples
    --------
    >>> bin(to_bits(np.array([[1, 0, 1, 1]], np.uint8))[0, 0, 0])
    '0b1101'
    """
    ny, nx = image.shape
    planes = max(int(image.max()).bit_length(), 1)
    bits = np.zeros((planes, ny, 64 * (nx // 64 + 2)), np.uint8)
    for plane in range(planes):
        bits[plane, :, :nx] = image >> plane & 1
    return np.packbits(bits, axis=2, bitorder="little").view("<u8").astype(np.uint64)


@kernel
def make_strips(bits, size):
    """Return room for the strips of windows of at most `size` cells."""
    n_words = (size + 63) // 64
    return Strips(
        np.zeros((bits.shape[0], size, n_words), np.uint64), np.zeros((size, n_words), np.uint64)
    )


@kernel
def take_strips(grid, y0, x0, size, left, top, right, bottom, strips):
    """Fill `strips` with what the grid has along the sides of a window.

    Parameters
    ----------
    grid : ndarray of uint8, shape (ny, nx)
        Facies indices.
    y0, x0, size : int
        First cell and side of the window.
    left, top, right, bottom : int
        Widths of the strips, 0 where there is none.
    strips : Strips
    """
    n_planes, n_words = strips.words.shape[0], (size + 63) // 64
    for y in range(size):
        for w in range(n_words):
            strips.mask[y, w] = np.uint64(0)
            for plane in range(n_planes):
                strips.words[plane, y, w] = np.uint64(0)
        across = y < top or y >= size - bottom
        _take_cells(grid, y0 + y, x0, y, np.int64(0), size if across else left, strips)
        if not across:
            _take_cells(grid, y0 + y, x0, y, max(left, size - right), size, strips)


@kernel
def _take_cells(grid, row, x0, y, first, last, strips):
    """Take cells `first` to `last` − 1 of a row of the window, which is row `row` of the grid."""
    if first >= last:
        return
    for w in range(first // 64, (last + 63) // 64):
        begin, end = max(first, 64 * w), min(last, 64 * w + 64)
        ones = np.uint64(0xFFFFFFFFFFFFFFFF) >> np.uint64(64 - (end - begin))
        strips.mask[y, w] |= ones << np.uint64(begin & 63)
        for plane in range(strips.words.shape[0]):
            word = np.uint64(0)
            for x in range(begin, end):
                digit = np.uint64(grid[row, x0 + x] >> plane & 1)
                word |= digit << np.uint64(x & 63)
            strips.words[plane, y, w] |= word


@kernel
def n_different(bits, ty, tx, size, strips, limit):
    """Return in how many cells of its strips a window differs from a place of the image.

    Parameters
    ----------
    bits : ndarray of uint64, shape (n_planes, ny, n_words)
        Of the image, from `to_bits`.
    ty, tx : int
        First cell of the place.
    size : int
        Side of the window.
    strips : Strips
        From `take_strips`.
    limit : int
        Where so many are found, counting may end.
    """
    first, shift = tx >> 6, np.uint64(tx & 63)
    back = np.uint64(63) - shift
    wrong = 0
    for y in range(size):
        for w in range((size + 63) // 64):
            differ = np.uint64(0)
            for plane in range(strips.words.shape[0]):
                near = bits[plane, ty + y, first + w]
                far = bits[plane, ty + y, first + w + 1]
                differ |= (near >> shift | far << np.uint64(1) << back) ^ strips.words[plane, y, w]
            wrong += _n_ones(differ & strips.mask[y, w])
        if wrong >= limit:
            break
    return wrong


@kernel
def _n_ones(word):
    """Count the bits that are set; compilers know this way and make one instruction of it."""
    word -= word >> np.uint64(1) & np.uint64(0x5555555555555555)
    two = np.uint64(0x3333333333333333)
    word = (word & two) + (word >> np.uint64(2) & two)
    word = word + (word >> np.uint64(4)) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64(word * np.uint64(0x0101010101010101) >> np.uint64(56))
