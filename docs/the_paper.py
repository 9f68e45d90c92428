"""The method of the paper in 170 lines: NumPy, PyWavelets and loops, without the program.

Lines of Algorithm 1, sections and equations are those of Bavandsavadkoohi et al. (2024).
Everything random is given: the direction of the path, 0 to 7, and a function `draw` that returns
the next random number from 0 to 1.
"""

import math

import numpy as np
import pywt

UNKNOWN = -1
SMALLEST = 4  # side of the smallest part of a template, in cells


def simulate(image, shape, template, overlap, level, n_candidates, direction, draw, data=(),
             search_fraction=0.1, co_template=2):  # fmt: skip
    """Return one realization of a facies image; `data` are (row, column, facies)."""
    known = np.full(shape, UNKNOWN)
    for row, column, facies in data:
        known[row, column] = facies
    image, known = turned(image, direction), turned(known, direction)
    bands = decomposed(image, level)  # line 2
    step = template - overlap
    tiles = [max(1, math.ceil((n - overlap) / step)) for n in known.shape]
    full = [n * step + overlap for n in tiles]
    grid, wanted = np.full(full, UNKNOWN), np.full(full, UNKNOWN)
    wanted[: known.shape[0], : known.shape[1]] = known
    limits = n_candidates, search_fraction, co_template

    def fill(tile_row, tile_column, row, column, size):
        """Simulate a part of a tile; `row` and `column` are those of the part in the tile."""
        top = overlap if tile_row else 0
        left = overlap if tile_column else 0
        first_row = row - (min(overlap, size) if row else 0)  # a part overlaps earlier parts
        first_column = column - (min(overlap, size) if column else 0)
        window = (slice(tile_row + first_row, tile_row + row + size),
                  slice(tile_column + first_column, tile_column + column + size))  # fmt: skip
        old = grid[window]
        n_rows = min(max(top, row) - first_row, len(old))  # old rows and columns: the overlap
        n_columns = min(max(left, column) - first_column, len(old[0]))
        half = size // 2
        may_split = size % 2 == 0 and half >= SMALLEST and half % 2**level == 0
        places = [(n >> level) - (template >> level) + 1 for n in image.shape]
        scores = ccw(bands, old, n_rows, n_columns, level, places)
        misses = missed(image, wanted, window, places, level, co_template)
        place = chosen(scores, *misses, *limits[:2], may_split, draw)
        if place is None:
            for down, along in ((0, 0), (0, half), (half, 0), (half, half)):
                fill(tile_row, tile_column, row + down, column + along, half)
            return
        new = reconstructed(bands, divmod(place, places[1]), old.shape, level)
        keep = kept(old, new, n_rows, n_columns)
        grid[window] = np.where(keep, old, new)  # line 14

    for i in range(tiles[0]):  # line 4: row after row, from the corner
        for j in range(tiles[1]):
            fill(i * step, j * step, 0, 0, template)
    return turned_back(grid[: known.shape[0], : known.shape[1]], direction)


def turned(cells, direction):
    """Section 4.1: turn cells so that the path begins at the first cell and follows the rows."""
    cells = cells.T if direction & 4 else cells
    cells = cells[::-1] if direction & 1 else cells
    return cells[:, ::-1] if direction & 2 else cells


def turned_back(cells, direction):
    cells = cells[:, ::-1] if direction & 2 else cells
    cells = cells[::-1] if direction & 1 else cells
    return cells.T if direction & 4 else cells


def decomposed(cells, level):
    """Sections 3.1 and 4.2: the approximation at the last level, then the details of each level."""
    rows, columns = (n >> level << level for n in cells.shape)
    bands = [cells[:rows, :columns].astype(float)]
    for _ in range(level):
        approximation, details = pywt.dwt2(bands[0], "haar", "periodization")
        bands = [approximation, details, *bands[1:]]
    return bands


def reconstructed(bands, place, shape, level):
    """Line 13: the inverse DWT of the coefficients of a patch at a place, in coefficients."""
    (row, column), (n_rows, n_columns) = place, (n >> level for n in shape)
    cells = bands[0][row : row + n_rows, column : column + n_columns]
    for details in bands[1:]:
        cut = [band[row : row + n_rows, column : column + n_columns] for band in details]
        cells = pywt.idwt2((cells, cut), "haar", "periodization")
        row, column, n_rows, n_columns = 2 * row, 2 * column, 2 * n_rows, 2 * n_columns
    return np.rint(cells).astype(int)


def ccw(bands, old, n_rows, n_columns, level, places):
    """Section 4.3, lines 8 to 10: Σ_t Σ_s cA_TI(x + s, y + t) · cA_OR(s, t) of each place."""
    if n_rows == 0 and n_columns == 0:
        return None  # lines 5 and 6: the first patch has no overlap
    in_overlap = np.zeros(old.shape, bool)
    in_overlap[:n_rows], in_overlap[:, :n_columns] = True, True
    of_overlap = decomposed(np.where(in_overlap, old, 0), level)[0]
    total = np.zeros(places)
    for t, s in np.ndindex(of_overlap.shape):
        total += bands[0][t : t + places[0], s : s + places[1]] * of_overlap[t, s]
    return np.rint(4**level * total)  # whole numbers, so that equal scores are equal


def missed(image, wanted, window, places, level, co_template):
    """Section 4.4: data of the template and of the co-template that a patch would not honour."""
    (rows, columns), block = window, 2**level
    n_rows, n_columns = rows.stop - rows.start, columns.stop - columns.start
    ahead = wanted[rows.start : rows.start + co_template * n_rows,
                   columns.start : columns.start + co_template * n_columns]  # fmt: skip
    counts, n_data = np.zeros((2, *places), int), 0
    for row, column in np.argwhere(ahead != UNKNOWN):
        n_data += 1
        of = 0 if row < n_rows and column < n_columns else 1
        cells = image[row::block, column::block][: places[0], : places[1]]  # one for each place
        counts[of, : cells.shape[0], : cells.shape[1]] += cells != ahead[row, column]
    return counts[0].ravel(), counts[1].ravel(), n_data


def chosen(scores, inside, ahead, n_data, n_candidates, search_fraction, may_split, draw):
    """Section 4.4, lines 11 and 12: walk down the sorted places, then draw one candidate."""
    n = n_best = len(inside)
    order = range(n)
    if scores is None:
        n_candidates = n
    else:
        order = np.argsort(-scores.ravel(), kind="stable").tolist()
        n_best = math.ceil(search_fraction * n) if n_data else n
    all_data = [place for place in order[:n_best] if inside[place] == ahead[place] == 0]
    candidates = all_data or [place for place in order if inside[place] == 0]
    if not candidates and may_split:
        return None
    if not candidates:
        candidates = [place for place in order if inside[place] == inside.min()]
        n_candidates = n if scores is None else 1
    candidates = candidates[:n_candidates]
    return candidates[min(int(draw() * len(candidates)), len(candidates) - 1)]


def kept(old, new, n_rows, n_columns):
    """Section 2: the cells that stay old, on the left and above the minimum error boundary."""
    keep = np.zeros(old.shape, bool)
    for n, mask in ((n_columns, keep), (n_rows, keep.T)):
        differ = (old != new) if mask is keep else (old != new).T
        for line, end in enumerate(boundary(differ[:, :n] & ~mask[:, :n]) if n else ()):
            mask[line, :end] = True
    return keep


def boundary(differ):
    """Return the number of old cells of each line: the path that passes the fewest differences."""
    n, m = differ.shape
    cost = np.zeros((n, m + 1), int)
    for i, c in np.ndindex(n, m + 1):  # a boundary passes between the cells c - 1 and c
        cost[i, c] = int(differ[i, max(c - 1, 0)]) + int(differ[i, min(c, m - 1)])
        if i:
            cost[i, c] += cost[i - 1, max(c - 1, 0) : c + 2].min()
    path = [int(cost[-1].argmin())]
    for line in cost[-2::-1]:
        c = path[-1]  # the nearest boundary of least cost, on the left if both sides are equal
        path.append(min((k for k in (c, c - 1, c + 1) if 0 <= k <= m), key=lambda k: line[k]))
    return path[::-1]
