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
    """The cells in the overlap of a box that locations are compared with, word by word."""

    # shape (n,): where each word begins, from the word that a location begins in
    offsets: NDArray[np.uint64]
    # shape (n * n_planes,): their facies, the planes of a word side by side; cell x is bit x
    words: NDArray[np.uint64]
    mask: NDArray[np.uint64]  # shape (n,): which cells they are
    n: NDArray[np.int64]  # shape (1,): how many words there are


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
    n = nz * ny * ((nx + 63) // 64)
    words = np.zeros(n * len(bits), np.uint64)
    return Strips(np.zeros(n, np.uint64), words, np.zeros(n, np.uint64), np.zeros(1, np.int64))


@part_of_kernel
def take_strips(grid, box, bits, strips):
    """Fill `strips` with the facies that the grid has in the overlap of a box.

    `bits` are those of the image that they will be compared with.
    """
    low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
    cells, _, rows, columns = grid.ravel(), *grid.shape
    n_planes, _, my, mx = bits.shape
    n = 0
    for z in range(box.nz):
        for y in range(box.ny):
            across = z < low_z or z >= high_z or y < low_y or y >= high_y
            row = np.uint64(((box.z0 + z) * rows + box.y0 + y) * columns + box.x0)
            for start in range(0, box.nx, 64):
                stop = min(start + 64, box.nx)
                left = stop if across else max(min(low_x, stop), start)
                right = max(min(high_x, stop), left)
                mask = _ones(left - start) | (_ones(stop - start) & ~_ones(right - start))
                if not mask:
                    continue
                strips.offsets[n] = (z * my + y) * mx + start // 64
                strips.mask[n] = mask
                for plane in range(n_planes):
                    word = _word(cells, row, start, left, plane)
                    word |= _word(cells, row, right, stop, plane)
                    strips.words[n * n_planes + plane] = word
                n += 1
    strips.n[0] = n


@part_of_kernel
def _ones(n):
    """Return a word whose first n bits are set."""
    return ~np.uint64(0) >> np.uint64(64 - n) if n > 0 else np.uint64(0)


@part_of_kernel
def _word(cells, row, start, stop, plane):
    """Return a digit of the facies of some cells of a row, each at its own bit."""
    word, digit, one = np.uint64(0), np.uint64(plane), np.uint64(1)
    for x in range(np.uint64(start), np.uint64(stop)):
        word |= (np.uint64(cells[row + x]) >> digit & one) << (x & np.uint64(63))
    return word


@part_of_kernel
def n_bits(word):
    """Return how many bits of 64 are set; compilers know this way."""
    one, two = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
    n = word - (word >> np.uint64(1) & one)
    n = (n & two) + (n >> np.uint64(2) & two)
    n = n + (n >> np.uint64(4)) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64(n * np.uint64(0x0101010101010101) >> np.uint64(56))


@part_of_kernel
def n_different(cells, shape, place, strips, limit):
    """Return in how many cells of its strips a box differs from a location of the image.

    Counting may end at `limit`. `cells` are the bits of the image, raveled, and `shape` their
    shape: to ravel them for each location would take longer than to count.
    """
    tz, ty, tx = place
    n_planes, mz, my, mx = shape
    first, plane_size = np.uint64((tz * my + ty) * mx + (tx >> 6)), np.uint64(mz * my * mx)
    one, shift, back = np.uint64(1), np.uint64(tx & 63), np.uint64(63 - (tx & 63))
    wrong, own = np.int64(0), np.uint64(0)
    for k in range(np.uint64(strips.n[0])):
        at, differ = first + strips.offsets[k], np.uint64(0)
        for _ in range(n_planes):
            word = cells[at] >> shift | cells[at + one] << one << back
            differ |= word ^ strips.words[own]
            at, own = at + plane_size, own + one
        wrong += n_bits(differ & strips.mask[k])
        if wrong >= limit:
            return wrong
    return wrong
