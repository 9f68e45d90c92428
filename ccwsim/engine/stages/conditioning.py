"""Hard data in the template and the co-template steer the choice (section 4.4).

Agreement is counted at full resolution, cell by cell, for every place of the training image: the
approximation of a datum says little about the cell it lies in.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.engine.stages.candidates import n_up_to
from ccwsim.engine.stages.cut import UNKNOWN


class Weights(NamedTuple):
    """How much data steer the choice of a place, in wrong cells of overlap.

    Attributes
    ----------
    missed : int
        What a datum counts that the patch would miss.
    held : int
        The same where the cell is in the overlap and right already: the cut can keep it.
    ahead : int
        The same for a datum in the co-template: the next patches can still mend it.
    slack : int
        A place is drawn only if it is at most so much worse than the best.
    everywhere : bool
        Whether every place is looked at, not the share with the best overlaps alone.
    """

    missed: int
    held: int
    ahead: int
    slack: int
    everywhere: bool


SPARSE = Weights(missed=40, held=8, ahead=4, slack=6, everywhere=False)
"""Few data a patch: the overlap keeps shapes whole, and mending brings what is left."""
DENSE = Weights(missed=100, held=20, ahead=4, slack=2, everywhere=True)
"""Tiles that are split: the data themselves say where the shapes run, and few places fit them."""
MAX_DATA = 10
"""A tile with more data than this a patch is split into smaller patches."""
RULED_OUT = 1 << 60
N_CLASSES = 256


class PlacedData(NamedTuple):
    """Hard data in the path frame, as the kernels need them.

    Attributes
    ----------
    facies : ndarray of uint8, shape (ny, nx)
        Facies index of the datum of each cell, UNKNOWN where there is none.
    columns : ndarray of int64, shape (n,)
        Column of each datum, by row.
    first : ndarray of int64, shape (ny + 1,)
        Where the data of each row begin in `columns`.
    kept : ndarray of uint8, shape (ny, nx)
        The data that refinement and cut must keep: `facies`, or none where the data only steer the
        choice of the place.
    """

    facies: NDArray[np.uint8]
    columns: NDArray[np.int64]
    first: NDArray[np.int64]
    kept: NDArray[np.uint8]


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

    Without `keep` they only steer the choice of places.
    """
    grid = data_grid(cells, facies, shape)
    order = np.lexsort((cells[:, 1], cells[:, 0]))
    first = np.searchsorted(cells[order, 0], np.arange(shape[0] + 1))
    kept = grid if keep else np.full(shape, UNKNOWN, np.uint8)
    return PlacedData(grid, np.ascontiguousarray(cells[order, 1]), first, kept)


def legal_splits(template: int, overlap: int) -> list[int]:
    """Return into how many parts, along each axis, a tile can be split.

    The parts keep the overlap: parts of (T − OR) / n + OR cells cover the tile of T cells. As for
    T itself, the overlap is at most half of a part.

    Examples
    --------
    >>> legal_splits(32, 8), legal_splits(32, 16)
    ([1, 2, 3], [1])
    """
    step = template - overlap
    return [n for n in range(1, step + 1) if step % n == 0 and step // n >= overlap]


@kernel
def choose_split(splits, data, y0, x0, template, overlap):
    """Return the index of the first split whose parts hold at most MAX_DATA data on average."""
    if len(splits) == 1:
        return 0
    n = 0
    for y in range(y0, y0 + template):
        for i in range(data.first[y], data.first[y + 1]):
            n += x0 <= data.columns[i] < x0 + template
    for k in range(len(splits)):
        size = (template - overlap) // splits[k] + overlap
        if n * size * size <= MAX_DATA * template * template:
            return k
    return len(splits) - 1


@kernel
def data_ahead(data, y0, x0, size):
    """Return whether any datum lies in the `size` × `size` cells from (y0, x0) on."""
    last = min(y0 + size, len(data.first) - 1)
    for i in range(data.first[y0], data.first[last]):
        if x0 <= data.columns[i] < x0 + size:
            return True
    return False


@kernel
def add_missed(
    phases, grid, data, y0, x0, template, ahead, proportions, weights, datum_cost, totals
):
    """Add what the missed data cost to the score of every place.

    Parameters
    ----------
    phases : ndarray of uint8, shape (2^J, 2^J, my, mx)
        The training image by offset, from `Pyramid`.
    grid : ndarray of uint8, shape (ny, nx)
        What is simulated so far.
    data : PlacedData
    y0, x0, template : int
        First cell and side of the tile.
    ahead : int
        Side of the co-template, from the same first cell.
    proportions : ndarray, shape (n_facies,)
        Of the training image: what to expect where it ends before the co-template does.
    weights : Weights
    datum_cost : float
        What the weights are multiplied by: the score of one wrong cell of overlap.
    totals : ndarray of int64, shape (ny_places, nx_places)
    """
    unit = phases.shape[0]
    for y in range(y0, min(y0 + ahead, len(data.first) - 1)):
        for i in range(data.first[y], data.first[y + 1]):
            x = data.columns[i]
            if x < x0 or x >= x0 + ahead:
                continue
            facies = data.facies[y, x]
            inside = y < y0 + template and x < x0 + template
            weight = weights.missed if inside else weights.ahead
            if inside and grid[y, x] == facies and data.kept[y, x] == facies:
                weight = weights.held
            phase = phases[(y - y0) % unit, (x - x0) % unit]
            cost = int(weight * datum_cost)
            expected = int(weight * datum_cost * (1.0 - proportions[facies]))
            _add_datum(
                phase, (y - y0) // unit, (x - x0) // unit, facies, cost, expected, totals
            )  # fmt: skip


@kernel
def _add_datum(phase, dy, dx, facies, cost, expected, totals):
    my, mx = phase.shape
    ny, nx = totals.shape
    seen = min(nx, max(mx - dx, 0))
    for py in range(ny):
        own = totals[py]
        if py + dy >= my:
            for px in range(nx):
                own[px] += expected
            continue
        row = phase[py + dy, dx : dx + seen]  # an index px + dx would keep the loop from vectors
        for px in range(seen):
            own[px] += cost if row[px] != facies else 0
        for px in range(seen, nx):
            own[px] += expected


@kernel
def start_totals(scores, share, totals):
    """Fill `totals` with the scores, ruling out places not among the best `share` of overlaps.

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
            own[px] = row[px] + (RULED_OUT if row[px] > worst else 0)
