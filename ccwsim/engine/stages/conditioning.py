"""Condition the choice of locations on data in template and co-template (section 4.4, at its end).

The paper searches the locations one after another, sorted by score. Weights of data relative to the
overlap, a limit on the scores of candidates, and smaller patches for dense data are not in the
paper.

Data are compared with single cells of the training image at full resolution, because coefficients
of a coarse level contain little information on single cells.
"""

from math import prod
from typing import NamedTuple

import numpy as np

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.candidates import n_up_to
from ccwsim.engine.stages.path import UNKNOWN, RasterPath, Triple
from ccwsim.engine.stages.similarity import excluded_from
from ccwsim.model import N_RANKS, Bytes, Ints, Mask, Shape


class Weights(NamedTuple):
    """Costs of missed data in the choice of a location, in wrong cells of the overlap."""

    missed: int  # cost of a datum in the template that the patch does not honour
    held: int  # cost of a datum that the overlap, but not the patch, honours
    ahead: int  # cost of a datum in the co-template that the image does not honour
    slack: int  # largest difference in score between a candidate and the best location
    everywhere: bool  # if False, search only the share with the best overlaps


SPARSE = Weights(missed=40, held=8, ahead=4, slack=6, everywhere=False)
"""Weights for tiles that are not split, with more weight on the overlap to preserve shapes."""
DENSE_WEIGHTS = Weights(missed=100, held=20, ahead=4, slack=2, everywhere=True)
"""Weights for split tiles: dense data determine the shapes, and few locations fit the data."""
KEEP_OLD, TAKE_NEW = 1, 2
"""The side of a cut on which a cell must be: the cell stays old or gets the facies of the patch."""
MAX_PATCH_DATA = 10
"""Maximum number of data per patch; a tile with more data is split into smaller patches. The limit
of `ScaledLengths.max_data` is higher for maps with a large overlap."""
MAX_DATA_AT_ONCE = 1024  # maximum number of data that are compared with locations in one pass
MAX_BYTE = 255  # maximum number that a byte can count
N_CLASSES = 256
MISSED_RANKS = 64  # difference of ranks that costs as much as a datum of another facies
CLOSE_RANKS = 8  # largest difference of ranks for which the overlap honours a datum


class PlacedData(NamedTuple):
    """Hard data in path coordinates."""

    facies: Bytes  # shape (nz, ny, nx): made by `data_grid`
    columns: Ints  # shape (n,): column of each datum, sorted by layer and row
    first: Ints  # shape (nz * ny + 1,): index in `columns` of the first datum of a row
    # shape (nz, ny, nx): data that refinement and cut must honour, equal to `facies`, or ranks of
    # values; UNKNOWN everywhere if data only condition the search
    required: Bytes


def data_grid(cells: Ints, facies: Bytes, shape: Shape) -> Bytes:
    """Return a grid of `shape` with the facies index of each datum; other cells are UNKNOWN."""
    data = np.full(shape, UNKNOWN, np.uint8)
    data[tuple(cells.T)] = facies
    return data


def place_data(
    cells: Ints, facies: Bytes, shape: Triple, keep: bool = True, ranks: Bytes | None = None
) -> PlacedData:
    """Return data on a grid of `shape`; `cells` has shape (n, 3), `facies` (indices) shape (n,).

    If `keep` is false, the data only condition the search. Of a continuous variable, refinement
    and cut honour the `ranks`, shape (n,).
    """
    grid = data_grid(cells, facies, shape)
    layers, rows, columns = cells.T
    order = np.lexsort((columns, rows, layers))
    row_of_datum = layers * shape[1] + rows
    first = np.searchsorted(row_of_datum[order], np.arange(shape[0] * shape[1] + 1))
    required = grid if keep else np.full(shape, UNKNOWN, np.uint8)
    required = required if ranks is None else data_grid(cells, ranks, shape)
    return PlacedData(grid, np.ascontiguousarray(columns[order]), first, required)


def legal_splits(template: Triple, overlap: Triple, volume: bool = False) -> list[Triple]:
    """Return the numbers of parts, along each axis, into which a tile can be split.

    Parts have the overlap of tiles that are not split: n parts of (T − OR) / n + OR cells cover the
    T cells of a tile. The overlap is at most half of a part. A tile has equal numbers of parts
    along y and x and, up to this number, as many parts as possible along z. A tile of a volume may
    also be halved along only one axis, for data along a well.
    """
    steps = [(t - o, o) for t, o in zip(template, overlap, strict=True)]

    def legal(n: int, axis: int) -> bool:
        step, width = steps[axis]
        return n == 1 or (width > 0 and step % n == 0 and step // n >= width)

    sizes = [n for n in range(1, steps[1][0] + 1) if legal(n, 1) and legal(n, 2)]
    alike = [(max(m for m in range(1, n + 1) if legal(m, 0)), n, n) for n in sizes]
    halves = [(2, 1, 1), (1, 2, 1), (1, 1, 2)] if volume else []
    halves = [parts for parts in halves if legal(2, parts.index(2))]
    return alike[:1] + halves + alike[1:]


def split_tiles(
    splits: list[Triple],
    data: PlacedData,
    path: RasterPath,
    template: Triple,
    overlap: Triple,
    max_data: float = MAX_PATCH_DATA,
    volume: bool = False,
) -> Ints:
    """Return, for each tile, the index of the first split with at most `max_data` data per part.

    In a map, `max_data` limits the average number of data per part. In a volume, `max_data` limits
    the number of data in the fullest part, because all data of a well may be in one part.
    """
    split_of = np.full(prod(path.tiles), len(splits) - 1)
    if len(splits) == 1:
        return split_of
    n_data = _data_of_parts(data, path, template, overlap, (1, 1, 1))
    steps = [t - o for t, o in zip(template, overlap, strict=True)]
    for k in range(len(splits) - 2, -1, -1):
        if volume:
            n = _data_of_parts(data, path, template, overlap, splits[k])
        else:
            part = prod(s // n + o for s, n, o in zip(steps, splits[k], overlap, strict=True))
            n = n_data * part / prod(template)
        split_of[n <= max_data] = k
    return split_of


def _data_of_parts(
    data: PlacedData, path: RasterPath, template: Triple, overlap: Triple, parts: Triple
) -> Ints:
    """Count the data in the fullest part of each tile for tiles that are split into `parts`."""
    z, y = np.divmod(
        np.repeat(np.arange(len(data.first) - 1), np.diff(data.first)), len(data.facies[0])
    )
    places = np.column_stack([z, y, data.columns])
    width = np.array(overlap)
    step = (np.array(template) - width) // parts
    n_parts = np.multiply(path.tiles, parts)
    counts = np.zeros(n_parts, np.int64)
    for back in np.ndindex(2, 2, 2):  # a cell is in at most two parts along each axis
        part = places // step - back
        inside = (part >= 0) & (part < n_parts) & (places - part * step < step + width)
        np.add.at(counts, tuple(part[inside.all(axis=1)].T), 1)
    of_tile = counts.reshape([n for pair in zip(path.tiles, parts, strict=True) for n in pair])
    return of_tile.max(axis=(1, 3, 5)).ravel()


class Misses(NamedTuple):
    """Workspace to count, for each location, the data that the patch would not honour."""

    # shape (6, n), with a column for each datum: index of the image cell that is compared with the
    # datum at location 0; numbers of layers, rows and columns of locations at which the compared
    # cell is in the image; facies of the datum; cost of the datum
    terms: Ints
    counts: Bytes  # number of data not honoured, in rows of the image
    # column of each entry of `counts`, to mask columns beyond the end of the image without a loop
    # over rows; empty if column numbers do not fit into a byte
    column_of: Bytes
    # shape (nz, ny, nx) of locations, reset to 0 after each patch: cost of data beyond the end of
    # the image, as differences between successive layers, rows and columns of locations
    beyond: Ints
    changes: Mask  # shape (nz, ny): rows with nonzero `beyond`
    steps: Ints  # shape (nx,): changes of the cost along a row
    row: Ints  # shape (nx,): costs along a row


def make_misses(n_data: int, blocks: Triple, places: Triple) -> Misses:
    """Return the workspace for locations of shape `places` in an image of `blocks`."""
    nz, ny, nx = places if n_data else (0, 0, 0)
    n, short = nz * blocks[1] * blocks[2], blocks[2] <= N_CLASSES
    return Misses(
        terms=np.zeros((6, min(n_data, MAX_DATA_AT_ONCE)), np.int64),
        counts=np.zeros(n, np.uint8),
        column_of=np.resize(np.arange(blocks[2], dtype=np.uint8), n if short else 0),
        beyond=np.zeros((nz, ny, nx), np.int64),
        changes=np.zeros((nz, ny), np.bool_),
        steps=np.zeros(nx, np.int64),
        row=np.zeros(nx, np.int64),
    )


@part_of_kernel
def data_ahead(data, box, times):
    """Return whether any datum is in a box whose lengths are multiplied by `times`."""
    shape = data.facies.shape
    if len(data.columns) == 0:
        return False
    for z in range(box.z0, min(box.z0 + times * box.nz, shape[0])):
        for y in range(box.y0, min(box.y0 + times * box.ny, shape[1])):
            row = z * shape[1] + y
            for i in range(data.first[row], data.first[row + 1]):
                if box.x0 <= data.columns[i] < box.x0 + times * box.nx:
                    return True
    return False


@part_of_kernel
def forced_side(old, new, datum):
    """Return KEEP_OLD or TAKE_NEW if only the old or only the new facies of a cell honours a datum.

    Return 0 if the cell has no datum, or if both or neither of the facies honour the datum.
    """
    if datum == UNKNOWN or (old == datum) == (new == datum):
        return 0
    return KEEP_OLD if old == datum else TAKE_NEW


@part_of_kernel
def add_missed(
    phases, layers, grid, data, box, times, proportions, weights, datum_cost, work, totals
):
    """Add the cost of data that the patch would not honour to the score of every location.

    The co-template begins at the first cell of the box; its lengths are `times` the lengths of the
    box. Beyond the end of the training image, the cost of a datum is multiplied by 1 minus the
    proportion of its facies; `proportions` has the shape (n_facies,). `weights` are multiplied by
    `datum_cost`, the score of one wrong cell of overlap. `phases` is a field of `Pyramid`;
    `make_misses` creates `work`. `grid` has the shape (nz, ny, nx), and `totals` has one value per
    location. `layers` are the first layer of these locations, and the number of layers of blocks
    of the image from the first layer to the last.
    """
    uz, uy, ux, mz, my, mx = phases.shape
    nz, ny, nx = totals.shape
    layer, end = layers
    shape = data.facies.shape
    of_image, terms, n, beyond = phases.reshape(-1), work.terms, 0, False
    for z in range(box.z0, min(box.z0 + times * box.nz, shape[0])):
        for y in range(box.y0, min(box.y0 + times * box.ny, shape[1])):
            row = z * shape[1] + y
            for i in range(data.first[row], data.first[row + 1]):
                x = data.columns[i]
                if x < box.x0 or x >= box.x0 + times * box.nx:
                    continue
                facies = data.facies[z, y, x]
                inside = z < box.z0 + box.nz and y < box.y0 + box.ny and x < box.x0 + box.nx
                weight = weights.missed if inside else weights.ahead
                if inside and grid[z, y, x] == facies and data.required[z, y, x] == facies:
                    weight = weights.held
                (dz, up), (dy, down) = divmod(z - box.z0, uz), divmod(y - box.y0, uy)
                dx, along = divmod(x - box.x0, ux)
                n_layers, n_rows = min(nz, max(end - dz, 0)), min(ny, max(my - dy, 0))
                n_columns = min(nx, max(mx - dx, 0))
                if n_layers < nz or n_rows < ny or n_columns < nx:
                    expected = np.int64(weight * datum_cost * (1.0 - proportions[facies]))
                    _expect(work, nz, n_layers, n_rows, n_columns, expected)
                    beyond = True
                cost = np.int64(weight * datum_cost)
                if cost == 0 or n_layers == 0 or n_rows == 0 or n_columns == 0:
                    continue
                phase = (up * uy + down) * ux + along
                first = ((phase * mz + layer + dz) * my + dy) * mx + dx
                terms[:, n] = first, n_layers, n_rows, n_columns, np.int64(facies), cost
                n += 1
                if n == terms.shape[1]:
                    _count_misses(of_image, my, mx, terms, n, work, totals)
                    n = 0
    _count_misses(of_image, my, mx, terms, n, work, totals)
    if beyond:
        _add_beyond(work, totals)


@part_of_kernel
def add_off_ranks(phases, layers, grid_ranks, data, box, times, weights, datum_cost, totals):
    """Add the cost of the ranks of data that patches of a map would miss, like `add_missed`.

    `phases` has the ranks of the image. Beyond its end, the cost is the mean cost of all ranks,
    which are equally common.
    """
    _, uy, ux, _, my, mx = phases.shape
    (_, ny, nx), flat, of_image = totals.shape, totals.reshape(-1), phases.reshape(-1)
    (layer, _), kind, (_, high, wide) = layers, totals.dtype.type, data.facies.shape
    for y in range(box.y0, min(box.y0 + times * box.ny, high)):
        for i in range(data.first[y], data.first[y + 1]):
            x = data.columns[i]
            if x < box.x0 or x >= min(box.x0 + times * box.nx, wide):
                continue
            rank = np.int32(data.required[0, y, x])
            weight = weights.ahead
            if y < box.y0 + box.ny and x < box.x0 + box.nx:
                is_close = abs(np.int32(grid_ranks[0, y, x]) - rank) <= CLOSE_RANKS
                weight = weights.held if is_close else weights.missed
            each = weight * datum_cost / MISSED_RANKS
            mean = kind(each * (rank**2 + (N_RANKS - rank) ** 2) / (2 * N_RANKS))
            (dy, down), (dx, along) = divmod(y - box.y0, uy), divmod(x - box.x0, ux)
            n_columns = max(min(nx, mx - dx), 0)
            for place in range(len(totals) * ny):
                pz, py = divmod(place, ny)
                n, to = np.uint64(n_columns if py + dy < my else 0), np.uint64(place * nx)
                first = (((down * ux + along) * phases.shape[3] + layer + pz) * my + py + dy) * mx
                at = np.uint64(first + dx)
                for px in range(n):
                    off = abs(np.int32(of_image[at + px]) - rank)
                    flat[to + px] += kind(np.float32(each) * np.float32(off))
                for px in range(n, np.uint64(nx)):
                    flat[to + px] += mean


@part_of_kernel
def _expect(work, nz, layers, rows, columns, cost):
    """Add a cost to all of `nz` layers of locations outside the first layers, rows and columns."""
    beyond, changes = work.beyond, work.changes
    for corner in range(1, 8):
        z = layers if corner & 4 else 0
        y = rows if corner & 2 else 0
        x = columns if corner & 1 else 0
        odd = (corner ^ corner >> 1 ^ corner >> 2) & 1
        if z < nz and y < beyond.shape[1] and x < beyond.shape[2]:
            beyond[z, y, x] += cost if odd else -cost
            changes[z, y] = True


@part_of_kernel
def _count_misses(of_image, my, mx, terms, n, work, totals):
    """Add the costs of `n` data to the totals of locations that do not honour the data.

    Finally, reset the costs to 0. Data are counted in bytes, for 32 locations at once. If all costs
    are multiples of the smallest cost and the sum fits into a byte, all data are counted together.
    If not, data with the smallest cost are counted first, then the remaining data. All rows of a
    layer are scanned in one loop over `of_image`, because single rows are short.
    """
    (nz, ny, nx), flat = totals.shape, totals.reshape(-1)
    counts, column_of = work.counts, work.column_of
    while True:
        least, total, together = np.int64(0), np.int64(0), True
        for k in range(n):
            cost = terms[5, k]
            if cost > 0 and (least == 0 or cost < least):
                least = cost
        if least == 0:
            return
        for k in range(n):
            together = together and terms[5, k] % least == 0
            total += terms[5, k] // least
        together = together and total <= MAX_BYTE
        counted = 0
        counts[: nz * my * mx] = 0
        for k in range(n):
            cost = terms[5, k]
            if cost == 0 or (cost != least and not together):
                continue
            rows, columns, facies = terms[2, k], terms[3, k], np.uint8(terms[4, k])
            ends, times, no = columns < nx, np.uint8(cost // least), np.uint8(0)
            masked = ends and len(column_of) > 0
            at_once, last = 1 if ends and not masked else rows, np.uint8(columns - 1)
            length = np.uint64((at_once - 1) * mx + columns)
            for pz in range(terms[1, k]):
                for py in range(0, rows, at_once):
                    first = np.uint64((pz * my + py) * mx)
                    compared = np.uint64(terms[0, k]) + first
                    if masked:
                        for place in range(length):
                            missed = of_image[compared + place] != facies
                            missed &= column_of[place] <= last
                            counts[first + place] += times if missed else no
                    else:
                        for place in range(length):
                            missed = of_image[compared + place] != facies
                            counts[first + place] += times if missed else no
            terms[5, k] = 0
            counted += 1
            if counted == MAX_BYTE:
                break
        cost = totals.dtype.type(least)
        for pz in range(nz):
            for py in range(ny):
                to, row = np.uint64((pz * ny + py) * nx), np.uint64((pz * my + py) * mx)
                for px in range(np.uint64(nx)):
                    flat[to + px] += cost * counts[row + px]


@part_of_kernel
def _add_beyond(work, totals):
    """Add the running sums of `beyond` to the scores of all locations, and reset `beyond` to 0.

    The cost changes in few rows of locations; other rows have the cost of the previous row.
    """
    beyond, changes, steps, row = work.beyond, work.changes, work.steps, work.row
    (nz, ny, nx), flat = totals.shape, totals.reshape(-1)
    for pz in range(1, nz):
        for py in range(ny):
            if changes[pz - 1, py]:
                changes[pz, py] = True
                for px in range(nx):
                    beyond[pz, py, px] += beyond[pz - 1, py, px]
    for pz in range(nz):
        has_cost = False
        for py in range(ny):
            if changes[pz, py]:
                cost = np.int64(0)
                for px in range(nx):
                    steps[px] = beyond[pz, py, px] + (steps[px] if has_cost else 0)
                    cost += steps[px]
                    row[px] = cost
                    beyond[pz, py, px] = 0
                changes[pz, py], has_cost = False, True
            if has_cost:
                to = np.uint64((pz * ny + py) * nx)
                for px in range(np.uint64(nx)):
                    flat[to + px] += row[px]


@part_of_kernel
def start_totals(scores, share, excludes, totals):
    """Copy scores to `totals`; rule out all locations except the share with the best overlaps.

    Both arrays have the shape (n,). The limit is computed from a histogram of 256 classes, because
    sorting all scores would take longer than the search. If `excludes` is true, scores from
    `excluded_from` on do not count.
    """
    least = most = scores[0]
    for x in range(len(scores)):
        if scores[x] < least:
            least = scores[x]
        if scores[x] > most:
            most = scores[x]
    low, high, n_all = np.int64(least), np.int64(most), len(scores)
    if excludes and share < 1:
        end, high = excluded_from(scores), low
        n_all = n_up_to(scores, end - 1)
        for x in range(len(scores)):
            high = max(high, np.int64(scores[x]) if scores[x] < end else low)
    worst = high
    if share < 1:
        width = (high - low) // N_CLASSES + 1
        first, last = 1, N_CLASSES
        while first < last:
            middle = (first + last) // 2
            n = n_up_to(scores, min(low + middle * width - 1, high))
            if n < share * n_all:
                first = middle + 1
            else:
                last = middle
        worst = min(low + first * width - 1, high)
    limit, out = scores.dtype.type(worst), totals.dtype.type(ruled_out(totals))
    for x in range(len(scores)):
        total = totals.dtype.type(scores[x])
        totals[x] = total + out if scores[x] > limit else total


@part_of_kernel
def ruled_out(totals):
    """Return the cost of a ruled-out location, which is higher than any other cost."""
    return 1 << (15 * totals.itemsize // 2)


def total_type(bound: float) -> type[np.signedinteger]:
    """Return the smallest type for totals up to `bound` and for the cost of ruled-out locations."""
    return np.int32 if bound < 2**29 else np.int64
