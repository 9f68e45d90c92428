"""Facies indices stored as bits, to compare 64 cells at once.

A word of plane b contains bit b of the facies indices of 64 cells. Two cells differ if their bits
differ in any plane. A word with 64 cells of a row is used to compare one cell with 64 adjacent
locations. A word with a square of 8 × 8 cells is used to compare the square with one location.
"""

from typing import NamedTuple

import numpy as np

from ccwsim.engine.kernels import inlined_part_of_kernel, part_of_kernel
from ccwsim.engine.stages.path import Triple, inside_overlap
from ccwsim.model import Bytes, Ints, UInt64s

SQUARE_SIDE = 8  # side, in cells, of a square whose bits fill a word
FIRST_ROW = 0x0101010101010101  # word in which the bits of the first row of a square are set


class Strips(NamedTuple):
    """The overlap of a box in squares of cells, to compare the overlap with locations."""

    # shape (n,): index of the first word of each square, relative to the first word of a location
    offsets: UInt64s
    # shape (n * n_planes,): facies of the cells, all planes of one square after another
    words: UInt64s
    mask: UInt64s  # shape (n,): bits of the cells in the overlap
    n: Ints  # shape (1,): number of squares


def to_bits(image: Bytes) -> UInt64s:
    """Return the bits of facies indices by rows, shape (n_planes, nz, ny, n_words).

    A row has one extra word, so that 64 bits can be read starting at any cell.
    """
    nz, ny, nx = image.shape
    planes = _n_planes(image)
    bits = np.zeros((planes, nz, ny, 64 * (nx // 64 + 2)), np.uint8)
    for plane in range(planes):
        bits[plane, :, :, :nx] = image >> plane & 1
    return np.packbits(bits, axis=3, bitorder="little").view("<u8").astype(np.uint64)


def to_square_bits(image: Bytes, n_facies: int = 0) -> UInt64s:
    """Return the bits of facies indices by squares, shape (n_planes, nz, ny, n_words).

    Byte x of row y contains the cells (y, x) to (y + 7, x). The eight bytes from byte x on contain
    a square, in which cell (y + i, x + j) is bit 8 j + i. A row has one extra word, so that a
    square can be read starting at any cell. If `n_facies` is given, unknown cells, with this index,
    count as any facies, because no patch contains them; fewer planes are then compared.
    """
    nz, ny, nx = image.shape
    planes = _n_planes(image, n_facies)
    columns = np.zeros(
        (planes, nz, ny + SQUARE_SIDE, SQUARE_SIDE * (nx // SQUARE_SIDE + 2)), np.uint8
    )
    for plane in range(planes):
        columns[plane, :, :ny, :nx] = image >> plane & 1
    words = columns.view("<u8").astype(np.uint64, copy=False)
    flat, width = words.ravel(), words.shape[3]
    for n in (1, 2, 4):  # from columns of n cells to columns of 2 n
        flat[: -n * width] |= flat[n * width :] << np.uint64(n)
    return np.ascontiguousarray(words[:, :, :ny])


def _n_planes(image: Bytes, n_facies: int = 0) -> int:
    """Return the number of binary digits of the facies indices of an image, or below `n_facies`."""
    return max((n_facies - 1 if n_facies else int(image.max())).bit_length(), 1)


def make_strips(square_bits: UInt64s, size: Triple) -> Strips:
    """Return uninitialized `Strips` for boxes of at most `size` cells."""
    nz, ny, nx = size
    n = nz * -(-ny // SQUARE_SIDE) * -(-nx // SQUARE_SIDE)
    words = np.zeros(n * len(square_bits), np.uint64)
    return Strips(np.zeros(n, np.uint64), words, np.zeros(n, np.uint64), np.zeros(1, np.int64))


@part_of_kernel
def take_strips(grid, box, square_bits, strips):
    """Fill `strips` with the facies of `grid`, shape (nz, ny, nx), in the overlap of a box.

    `square_bits`, shape (n_planes, mz, my, n_words), are the bits of the image to compare with.
    """
    low_z, high_z, low_y, high_y, low_x, high_x = inside_overlap(box)
    of_grid, _, rows, columns = grid.reshape(-1), *grid.shape
    n_planes, _, my, mx = square_bits.shape
    words, n = strips.words, 0
    for z in range(box.nz):
        for y0 in range(0, box.ny, SQUARE_SIDE):
            for x0 in range(0, box.nx, SQUARE_SIDE):
                width, height = min(SQUARE_SIDE, box.nx - x0), min(SQUARE_SIDE, box.ny - y0)
                inside = low_x <= x0 and x0 + width <= high_x
                if inside and low_z <= z < high_z and low_y <= y0 and y0 + height <= high_y:
                    continue
                mask, first = np.uint64(0), n * n_planes
                for plane in range(n_planes):
                    words[first + plane] = 0
                for y in range(y0, y0 + height):
                    across = z < low_z or z >= high_z or y < low_y or y >= high_y
                    start = width if across else max(min(low_x - x0, width), 0)
                    end = max(min(high_x - x0, width), start)  # overlap: before start, from end
                    row = _bytes(start) | (_bytes(width) & ~_bytes(end))
                    row &= np.uint64(FIRST_ROW)
                    if not row:
                        continue
                    corner = np.uint64(((box.z0 + z) * rows + box.y0 + y) * columns + box.x0 + x0)
                    facies = np.uint64(0)
                    if width == SQUARE_SIDE:  # the compiler unrolls a loop of constant length
                        for x in range(np.uint64(SQUARE_SIDE)):
                            facies |= np.uint64(of_grid[corner + x]) << (x << np.uint64(3))
                    else:
                        for x in range(np.uint64(width)):
                            facies |= np.uint64(of_grid[corner + x]) << (x << np.uint64(3))
                    down = np.uint64(y - y0)
                    row &= ~_unknown_bytes(facies)
                    mask |= row << down
                    for plane in range(n_planes):
                        words[first + plane] |= (facies >> np.uint64(plane) & row) << down
                strips.offsets[n] = (z * my + y0) * mx + x0 // SQUARE_SIDE
                strips.mask[n] = mask
                n += 1
    strips.n[0] = n


@part_of_kernel
def _unknown_bytes(word):
    """Return the first bit of each byte that is UNKNOWN, because such cells are not compared."""
    word &= word >> np.uint64(4)
    word &= word >> np.uint64(2)
    return word & word >> np.uint64(1) & np.uint64(FIRST_ROW)


@part_of_kernel
def _bytes(n):
    """Return a word whose first n bytes are set."""
    return ~np.uint64(0) >> np.uint64(64 - 8 * n) if n > 0 else np.uint64(0)


@part_of_kernel
def n_bits(word):
    """Return the number of bits set in a word, in a form that compilers recognize."""
    one, two = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
    n = word - (word >> np.uint64(1) & one)
    n = (n & two) + (n >> np.uint64(2) & two)
    n = n + (n >> np.uint64(4)) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64(n * np.uint64(0x0101010101010101) >> np.uint64(56))


@part_of_kernel
def nth_bit(word, n):
    """Return the position of the n-th set bit of a word, with n = 0 for the lowest set bit.

    Running sums of the numbers of set bits per byte determine the byte that contains this bit.
    Running sums within the byte determine the bit. The code has no branches, because a processor
    could not predict them.
    """
    ones, high = np.uint64(FIRST_ROW), np.uint64(0x8080808080808080)
    before, one = np.uint64(n), np.uint64(1)
    up_to = word - (word >> one & np.uint64(0x5555555555555555))
    two = np.uint64(0x3333333333333333)
    up_to = (up_to & two) + (up_to >> np.uint64(2) & two)
    up_to = (up_to + (up_to >> np.uint64(4)) & np.uint64(0x0F0F0F0F0F0F0F0F)) * ones
    byte = _n_bytes((before * ones | high) - up_to & high)
    before -= up_to << np.uint64(8) >> byte & np.uint64(255)
    spread = (word >> byte & np.uint64(255)) * ones & np.uint64(0x8040201008040201)
    up_to = ((spread | (spread | high) - ones) & high) >> np.uint64(7)
    up_to *= ones
    return np.int64(byte + (_n_bytes((before * ones | high) - up_to & high) >> np.uint64(3)))


@part_of_kernel
def _n_bytes(high):
    """Return 8 times the number of bytes whose highest bit is set; all other bits must be 0."""
    return (high >> np.uint64(7)) * np.uint64(FIRST_ROW) >> np.uint64(56) << np.uint64(3)


@inlined_part_of_kernel
def n_different(words, shape, place, strips, limit):
    """Return the number of cells in which `strips` and a location of the image differ.

    Counting may end at `limit`. `words` is the raveled array `square_bits` of the image, because
    raveling takes longer than counting; `shape` is the shape of `square_bits`.
    """
    tz, ty, tx = place
    n_planes, mz, my, mx = shape
    first, plane_size = np.uint64((tz * my + ty) * mx + (tx >> 3)), np.uint64(mz * my * mx)
    one, shift, back = np.uint64(1), np.uint64((tx & 7) << 3), np.uint64(63 - ((tx & 7) << 3))
    wrong, i = np.int64(0), np.uint64(0)
    for k in range(np.uint64(strips.n[0])):
        u, differ = first + strips.offsets[k], np.uint64(0)
        for _ in range(n_planes):
            word = words[u] >> shift | words[u + one] << one << back
            differ |= word ^ strips.words[i]
            u, i = u + plane_size, i + one
        wrong += n_bits(differ & strips.mask[k])
        if wrong >= limit:
            return wrong
    return wrong
