"""Codes and counts of the patterns of cells in an image."""

from collections.abc import Iterator

import numpy as np

from ccwsim.engine.kernels import allocating_kernel, kernel, part_of_kernel
from ccwsim.engine.stages.similarity import box_sums, summed_up
from ccwsim.jobs.workers import check_stop
from ccwsim.model import UNKNOWN, Bytes, Ints, Mask, UInt64s

CELLS_OF_STRIP = 4_000_000  # number of cells whose patterns are counted at a time
MAX_TABLE = 2**20  # possible patterns that are counted in a table; otherwise codes are sorted


def count_patterns(volume: Bytes, n_facies: int, height: int, size: int) -> tuple[UInt64s, Ints]:
    """Return the sorted codes of patterns (see `PatternHistogram`) and their counts."""
    n_cells = height * size * size
    if n_cells * np.log2(max(n_facies, 2)) < 64 and n_facies**n_cells <= MAX_TABLE:
        table = np.zeros(n_facies**n_cells, np.int64)
        for codes in codes_in(volume, n_facies, height, size):
            table += np.bincount(codes.ravel().view(np.int64), minlength=len(table))
        present = np.flatnonzero(table)
        return present.astype(np.uint64), table[present]
    strips = [np.unique(c, return_counts=True) for c in codes_in(volume, n_facies, height, size)]
    if len(strips) == 1:
        return strips[0]
    distinct, index = np.unique(np.concatenate([s[0] for s in strips]), return_inverse=True)
    counts = np.zeros(len(distinct), np.int64)
    np.add.at(counts, index, np.concatenate([s[1] for s in strips]))
    return distinct, counts


def codes_in(volume: Bytes, n_facies: int, height: int, size: int) -> Iterator[UInt64s]:
    """Yield the codes of patterns of known cells, for some layers and rows at a time."""
    fits = height * size * size * np.log2(max(n_facies, 2)) < 64
    nz, ny, nx = volume.shape
    n_layers = max(CELLS_OF_STRIP // (ny * nx), 1)
    n_rows = max(CELLS_OF_STRIP // (n_layers * nx), 1)
    for bottom in range(0, nz - height + 1, n_layers):
        layers = volume[bottom : bottom + n_layers + height - 1]
        for first in range(0, ny - size + 1, n_rows):
            check_stop()
            strip = np.ascontiguousarray(layers[:, first : first + n_rows + size - 1])
            codes = _pattern_codes(strip, height, size, n_facies if fits else 0)
            if not (strip == UNKNOWN).any():
                yield codes
                continue
            is_unknown = summed_up((strip == UNKNOWN).astype(int))
            n_unknown = box_sums(is_unknown, (height, size, size))
            yield codes[n_unknown == 0]


@part_of_kernel
def _mixed(value):
    """Return a 64-bit hash of a number (splitmix64)."""
    value = value + np.uint64(0x9E3779B97F4A7C15)
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return value ^ (value >> np.uint64(31))


@allocating_kernel
def _pattern_codes(image, height, size, base):
    """Return the code of each location's pattern: cells as digits, or a hash if `base` is 0."""
    nz, ny, nx = image.shape
    digit = np.uint64(base) if base else np.uint64(0x9E3779B97F4A7C15)
    row_weight = np.uint64(1)
    for _ in range(size):
        row_weight *= digit
    layer_weight = np.uint64(1)
    for _ in range(size):
        layer_weight *= row_weight
    shape = ny - size + 1, nx - size + 1
    codes = np.zeros((nz - height + 1, shape[0], shape[1]), np.uint64)
    buffer = np.empty(shape, np.uint64)
    values, line = np.empty(nx, np.uint64), np.empty(shape[1], np.uint64)
    for k in range(nz):
        plane = codes[k] if height == 1 else buffer
        plane[:] = np.uint64(0)
        for i in range(ny):
            for j in range(nx):
                values[j] = image[k, i, j]
            if not base:
                for j in range(nx):
                    values[j] = _mixed(values[j])
            line[:] = np.uint64(0)
            for t in range(size):
                for j in range(len(line)):
                    line[j] = line[j] * digit + values[j + t]
            if not base:
                for j in range(len(line)):
                    line[j] = _mixed(line[j])
            for t in range(size):  # this row is row t of the pattern that begins t rows below
                if 0 <= i - t < shape[0]:
                    _add_to(plane[i - t], line, _power(row_weight, size - 1 - t))
        if height == 1:
            continue
        if not base:
            for i in range(shape[0]):
                for j in range(shape[1]):
                    plane[i, j] = _mixed(plane[i, j])
        for t in range(height):
            if 0 <= k - t < len(codes):
                weight = _power(layer_weight, height - 1 - t)
                for i in range(shape[0]):
                    _add_to(codes[k - t, i], plane[i], weight)
    return codes


@part_of_kernel
def _power(base, exponent):
    power = np.uint64(1)
    for _ in range(exponent):
        power *= base
    return power


@part_of_kernel
def _add_to(sums, values, weight):
    for j in range(len(sums)):
        sums[j] += weight * values[j]


def make_hash_table(codes: UInt64s) -> tuple[UInt64s, Mask]:
    """Return a hash table of distinct codes for `are_unknown`, and the mask of the used slots."""
    n_places = 2 ** (4 * len(codes)).bit_length()
    keys, full = np.zeros(n_places, np.uint64), np.zeros(n_places, bool)
    _fill(codes, keys, full)
    return keys, full


@part_of_kernel
def _place(code, keys, full):
    """Return the slot of a code, or a free slot; the size of the table is a power of two."""
    last = np.uint64(len(keys) - 1)
    place = _mixed(code) & last
    while full[place] and keys[place] != code:
        place = (place + np.uint64(1)) & last
    return place


@kernel
def _fill(codes, keys, full):
    for code in codes:
        place = _place(code, keys, full)
        keys[place], full[place] = code, True


@allocating_kernel
def are_unknown(codes, keys, full):
    """Return the mask of the codes that are not in a table."""
    unknown = np.empty(len(codes), np.bool_)
    for k in range(len(codes)):
        if k and codes[k] == codes[k - 1]:
            unknown[k] = unknown[k - 1]
        else:
            unknown[k] = not full[_place(codes[k], keys, full)]
    return unknown
