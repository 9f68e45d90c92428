"""Hard data in the template and the co-template condition the choice (section 4.4, Fig. 5).

The paper searches the sorted scores one after another. Not in the paper: the weights of data
against the overlap, the limit on how much worse than the best a candidate may be, and smaller
patches where data are dense.

Agreement is counted at full resolution, cell by cell, for every location of the training image: the
approximation of a datum says little about the cell it lies in.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.candidates import n_up_to
from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.stages.path import RasterPath


class Weights(NamedTuple):
    """How much data count in the choice of a location, in wrong cells of overlap."""

    missed: int  # what a datum counts that the patch would miss
    held: int  # the same where the cell is in the overlap and right already: the cut can keep it
    ahead: int  # the same for a datum in the co-template: the next patches can still honour it
    slack: int  # a location is drawn only if it is at most so much worse than the best
    # whether every location is looked at, not the share with the best overlaps alone
    everywhere: bool


SPARSE = Weights(missed=40, held=8, ahead=4, slack=6, everywhere=False)
"""Few data a patch: the overlap keeps shapes whole; local re-simulation honours what is left."""
DENSE = Weights(missed=100, held=20, ahead=4, slack=2, everywhere=True)
"""Tiles that are split: the data themselves say where the shapes run; few locations fit them."""
MAX_DATA = 10
"""A tile with more data than this a patch is split into smaller patches."""
MAX_TERMS = 1024
"""Data that are counted together: more are counted a part after the other."""
MAX_COUNTED = 255
"""Misses that a byte holds."""
RULED_OUT = 1 << 60
N_CLASSES = 256


class PlacedData(NamedTuple):
    """Hard data in path coordinates, as the kernels need them."""

    # shape (ny, nx): facies index of the datum of each cell, UNKNOWN where there is none
    facies: NDArray[np.uint8]
    columns: NDArray[np.int64]  # shape (n,): column of each datum, by row
    first: NDArray[np.int64]  # shape (ny + 1,): where the data of each row begin in `columns`
    # shape (ny, nx): the data that refinement and cut must keep: `facies`, or none where the data
    # only condition the choice of the location
    required: NDArray[np.uint8]


def data_grid(
    cells: NDArray[np.int64], facies: NDArray[np.uint8], shape: tuple[int, int]
) -> NDArray[np.uint8]:
    """Return the facies index of the datum of each cell, UNKNOWN where there is none."""
    data = np.full(shape, UNKNOWN, np.uint8)
    data[cells[:, 0], cells[:, 1]] = facies
    return data


def place_data(
    cells: NDArray[np.int64], facies: NDArray[np.uint8], shape: tuple[int, int], keep: bool = True
) -> PlacedData:
    """Return data on a grid of `shape`; `cells` (row, col) and `facies` (indices) have n rows.

    Without `keep` they only condition the choice of locations.
    """
    grid = data_grid(cells, facies, shape)
    order = np.lexsort((cells[:, 1], cells[:, 0]))
    first = np.searchsorted(cells[order, 0], np.arange(shape[0] + 1))
    required = grid if keep else np.full(shape, UNKNOWN, np.uint8)
    return PlacedData(grid, np.ascontiguousarray(cells[order, 1]), first, required)


def legal_splits(template: int, overlap: int) -> list[int]:
    """Return into how many parts, along each axis, a tile can be split.

    The parts keep the overlap: parts of (T − OR) / n + OR cells cover the tile of T cells. As for
    T itself, the overlap is at most half of a part.
    """
    step = template - overlap
    return [n for n in range(1, step + 1) if step % n == 0 and step // n >= overlap]


def split_tiles(
    splits: list[int], data: PlacedData, path: RasterPath, template: int, overlap: int
) -> NDArray[np.int64]:
    """Return which of `splits` each tile takes: the first with at most MAX_DATA data a part."""
    n_tiles = path.n_rows * path.n_columns
    if len(splits) == 1:
        return np.zeros(n_tiles, np.int64)
    step = template - overlap
    rows, columns = np.repeat(np.arange(len(data.first) - 1), np.diff(data.first)), data.columns
    n_data = np.zeros(n_tiles, np.int64)
    for down, along in np.ndindex(2, 2):  # a cell is in at most two tiles along each axis
        row, column = rows // step - down, columns // step - along
        inside = (row >= 0) & (row < path.n_rows) & (column >= 0) & (column < path.n_columns)
        inside &= (rows - row * step < template) & (columns - column * step < template)
        tiles = (row * path.n_columns + column)[inside]
        n_data += np.bincount(tiles, minlength=n_tiles)
    split_of = np.full(n_tiles, len(splits) - 1)
    for k in range(len(splits) - 2, -1, -1):
        size = step // splits[k] + overlap
        split_of[n_data * size * size <= MAX_DATA * template * template] = k
    return split_of


class Misses(NamedTuple):
    """Arrays in which the data that locations miss are counted."""

    # shape (5, n): of each datum, the first cell it meets, how many rows and columns of locations
    # meet one, its facies, and what missing it costs
    terms: NDArray[np.int64]
    counts: NDArray[np.uint8]  # how many data each location misses, rows of the image apart
    # shape (ny_places + 1, nx_places + 1): the cost of data beyond the end of the image, as changes
    # from one row and column of locations to the next
    beyond: NDArray[np.int64]


def make_misses(n_data: int, n_columns: int, shape: tuple[int, int]) -> Misses:
    """Return the arrays for `shape` locations in an image of `n_columns` blocks."""
    ny, nx = shape if n_data else (0, 0)
    return Misses(
        np.zeros((5, min(n_data, MAX_TERMS)), np.int64),
        np.zeros(ny * n_columns, np.uint8),
        np.zeros((ny + 1, nx + 1), np.int64),
    )


@part_of_kernel
def data_ahead(data, y0, x0, size):
    """Return whether any datum lies in the `size` × `size` cells from (y0, x0) on."""
    last = min(y0 + size, len(data.first) - 1)
    for i in range(data.first[y0], data.first[last]):
        if x0 <= data.columns[i] < x0 + size:
            return True
    return False


@part_of_kernel
def add_missed(phases, grid, data, box, ahead, proportions, weights, datum_cost, work, totals):
    """Add what the missed data cost to the score of every location.

    `ahead` is the side of the co-template, from the first cell of the patch. Where the training
    image ends before it does, `proportions` say what to expect. The weights are multiplied by
    `datum_cost`, the score of one wrong cell of overlap. `work` comes from `make_misses`.
    """
    block_size, _, my, mx = phases.shape
    ny, nx = totals.shape
    cells, terms, n, some_beyond = phases.reshape(phases.size), work.terms, 0, False
    for y in range(box.y0, min(box.y0 + ahead, len(data.first) - 1)):
        for i in range(data.first[y], data.first[y + 1]):
            x = data.columns[i]
            if x < box.x0 or x >= box.x0 + ahead:
                continue
            facies = data.facies[y, x]
            inside = y < box.y0 + box.size and x < box.x0 + box.size
            weight = weights.missed if inside else weights.ahead
            if inside and grid[y, x] == facies and data.required[y, x] == facies:
                weight = weights.held
            (dy, down), (dx, along) = divmod(y - box.y0, block_size), divmod(x - box.x0, block_size)
            rows, columns = min(ny, max(my - dy, 0)), min(nx, max(mx - dx, 0))
            if rows < ny or columns < nx:
                expected = np.int64(weight * datum_cost * (1.0 - proportions[facies]))
                if not some_beyond:
                    work.beyond[:] = 0
                    some_beyond = True
                work.beyond[0, columns] += expected
                work.beyond[rows, 0] += expected
                work.beyond[rows, columns] -= expected
            cost = np.int64(weight * datum_cost)
            if cost == 0 or rows == 0 or columns == 0:
                continue
            terms[0, n] = ((down * block_size + along) * my + dy) * mx + dx
            terms[1, n], terms[2, n], terms[3, n], terms[4, n] = rows, columns, facies, cost
            n += 1
            if n == terms.shape[1]:
                _count_misses(cells, mx, terms, n, work.counts, totals)
                n = 0
    _count_misses(cells, mx, terms, n, work.counts, totals)
    if some_beyond:
        _add_beyond(work.beyond, totals)


@part_of_kernel
def _count_misses(cells, mx, terms, n, counts, totals):
    """Add the costs of `n` terms to the locations that miss them; the costs become 0.

    Terms of equal cost are counted together, in bytes: 32 locations at once, where totals would be
    4. All rows of locations are one run of `cells`, as each alone is short.
    """
    for i in range(n):
        columns, cost, counted = terms[2, i], terms[4, i], 0
        if cost == 0:
            continue
        counts[:] = 0
        for k in range(i, n):
            if terms[4, k] != cost or terms[2, k] != columns:
                continue
            length, facies = (terms[1, k] - 1) * mx + columns, np.uint8(terms[3, k])
            run = cells[terms[0, k] : terms[0, k] + length]
            for place in range(length):
                counts[place] += run[place] != facies
            terms[4, k] = 0
            counted += 1
            if counted == MAX_COUNTED:
                break
        for py in range(len(totals)):
            own, row = totals[py], counts[py * mx : py * mx + columns]
            for px in range(columns):
                own[px] += cost * row[px]


@part_of_kernel
def _add_beyond(beyond, totals):
    """Add to the score of every location the sum of `beyond` over all rows and columns up to it."""
    ny, nx = totals.shape
    for py in range(ny):
        own, cost = beyond[py], np.int64(0)
        if py > 0:
            above = beyond[py - 1]
            for px in range(nx):
                own[px] += above[px]
        for px in range(nx):
            cost += own[px]
            totals[py, px] += cost


@part_of_kernel
def start_totals(scores, share, totals):
    """Fill `totals` with the scores, ruling out locations not among the best `share` of overlaps.

    The limit is a multiple of a 256th of their range, found by counting: sorting all scores would
    take longer than the search.
    """
    low = high = np.int64(scores[0, 0])
    for py in range(scores.shape[0]):
        row = scores[py]
        least = most = row[0]
        for px in range(1, len(row)):
            least, most = min(least, row[px]), max(most, row[px])
        low, high = min(low, np.int64(least)), max(high, np.int64(most))
    worst = high
    if share < 1:
        width = (high - low) // N_CLASSES + 1
        first, last = 1, N_CLASSES
        while first < last:
            middle = (first + last) // 2
            limit, n = min(low + middle * width - 1, high), 0
            for py in range(scores.shape[0]):
                n += n_up_to(scores[py], limit)
            if n < share * scores.size:
                first = middle + 1
            else:
                last = middle
        worst = low + first * width - 1
    for py in range(scores.shape[0]):
        row, own = scores[py], totals[py]
        for px in range(len(row)):
            own[px] = int(row[px]) + (RULED_OUT if row[px] > worst else 0)
