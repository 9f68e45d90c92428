"""The sequential search of the paper (section 4.4) and of its authors' code.

Locations are sorted by score, equal scores by the number of the location (layer, row and column).
The paper takes the first locations whose patches honour all data. A list of all locations need not
be sorted for this: one pass over the locations keeps the first K that qualify.
"""

from typing import NamedTuple

import numpy as np

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.candidates import draw_index, kth_smallest, n_up_to
from ccwsim.engine.stages.path import inside_overlap
from ccwsim.model import Int16s, Ints

IN_TEMPLATE = 1 << 32
"""Number of misses that a datum in the template adds; a datum in the co-template adds 1."""


class Rules(NamedTuple):
    """Rules of a published variant: codes compared with data, and the choice of locations."""

    is_code: bool  # whether the rules are those of the authors' code, otherwise of the paper
    # shape (ny, nx): codes that are compared with data: those of the image, or codes read back
    # from coefficients
    compared: Int16s
    cell_size: tuple[int, int]  # number of grid cells in a cell of `compared`, along y and x
    codes: Ints  # shape (n_facies,)
    splits: bool  # whether tiles may be split in four
    has_gaps: bool  # whether the image has unknown cells, which no patch may contain


def codes_read_back(sums: Ints, level: int) -> Int16s:
    """Return the facies codes that the authors' code reads from block sums of codes.

    The code rounds the coefficients, 2^level times the mean code of a block, and compares them with
    thresholds. The value half-way between the codes 0 and 1 is not changed to a code.
    """
    one = 2**level
    rounded = (2 * sums + one) // (2 * one)
    codes = np.where(2 * rounded < one, 0, rounded)
    codes = np.where((2 * rounded > one) & (rounded <= one), 1, codes)
    return np.where((rounded > one) & (rounded <= 2 * one), 2, codes).astype(np.int16)


@part_of_kernel
def count_misses(data, box, times, block, rules, misses):
    """Fill `misses`, shape (1, ny, nx) of locations, with the data that patches do not honour.

    Return whether the template or the co-template, whose lengths are `times` those of the box,
    contains data. Data beyond the end of the image are not compared. The authors' code adds the
    differences of the codes, the paper counts data.
    """
    _, ny, nx = misses.shape
    size_y, size_x = rules.cell_size
    step_y, step_x = block[1] // size_y, block[2] // size_x
    compared = rules.compared
    has_data, flat = False, misses.reshape(-1)
    for place in range(len(flat)):
        flat[place] = 0
    for y in range(box.y0, min(box.y0 + times * box.ny, data.facies.shape[1])):
        for i in range(data.first[y], data.first[y + 1]):
            x = data.columns[i]
            if x < box.x0 or x >= box.x0 + times * box.nx:
                continue
            has_data = True
            wanted = rules.codes[data.facies[0, y, x]]
            inside = y < box.y0 + box.ny and x < box.x0 + box.nx
            weight = np.int64(IN_TEMPLATE if inside else 1)
            down, along = (y - box.y0) // size_y, (x - box.x0) // size_x
            for py in range(ny):
                row = py * step_y + down
                if row >= compared.shape[0]:
                    break
                for px in range(nx):
                    column = px * step_x + along
                    if column >= compared.shape[1]:
                        break
                    off = abs(compared[row, column] - wanted)
                    misses[0, py, px] += weight * (off if rules.is_code else min(off, 1))
    return has_data


@part_of_kernel
def last_of_share(scores, share, legal):
    """Return the score of the last location of a share, and the number of places left for it.

    Locations with a score above `legal` are excluded.
    """
    n = np.int64(np.ceil(share * n_up_to(scores, legal)))
    last = kth_smallest(scores, len(scores), n)
    return last, n - n_up_to(scores, last - 1)


@part_of_kernel
def first_places(scores, misses, most, last, n_last, places):
    """Fill `places` with the first locations that have at most `most` misses; return their number.

    `last` and `n_last` come from `last_of_share`. `places` has the shape (K,).
    """
    n, n_equal = 0, 0
    for x in range(len(scores)):
        n_equal += np.int64(scores[x] == last)
        beyond = scores[x] > last or (scores[x] == last and n_equal > n_last)
        if beyond or misses[x] > most:
            continue
        if n == len(places):
            if scores[places[n - 1]] <= scores[x]:
                continue
            n -= 1
        rank = n
        while rank > 0 and scores[places[rank - 1]] > scores[x]:
            places[rank] = places[rank - 1]
            rank -= 1
        places[rank] = x
        n += 1
    return n


@part_of_kernel
def last_place(scores, misses, most, last, n_last, places):
    """Set `places[0]` to the last location that `first_places` would find; return 1."""
    n_equal, best = 0, -1
    for x in range(len(scores)):
        n_equal += np.int64(scores[x] == last)
        beyond = scores[x] > last or (scores[x] == last and n_equal > n_last)
        if not beyond and misses[x] <= most and (best < 0 or scores[x] >= scores[best]):
            best = x
    places[0] = best
    return 1


@part_of_kernel
def fewest_misses(scores, misses, last, n_last):
    """Return the limit for `misses` of locations with the fewest misses in the template."""
    n_equal, fewest = 0, np.int64(1) << np.int64(62)
    for x in range(len(scores)):
        n_equal += np.int64(scores[x] == last)
        beyond = scores[x] > last or (scores[x] == last and n_equal > n_last)
        fewest = fewest if beyond else min(fewest, misses[x])
    return fewest | (IN_TEMPLATE - 1)


@part_of_kernel
def any_place(scores, misses, most, legal, rng, places):
    """Set `places[0]` to a random location with at most `most` misses; return 1, or 0 for none."""
    n = 0
    for x in range(len(scores)):
        n += np.int64(misses[x] <= most and scores[x] <= legal)
    if n == 0:
        return 0
    drawn, k = draw_index(rng, n), 0
    for x in range(len(scores)):
        if misses[x] <= most and scores[x] <= legal:
            if k == drawn:
                places[0] = x
            k += 1
    return 1


@part_of_kernel
def first_candidates(scores, misses, legal, may_split, rules, rng, places):
    """Draw `places[0]`, a patch without overlap, from all locations that qualify; return 1.

    The result is 0 if no patch honours the data of the template and the tile may be split.
    """
    n = any_place(scores, misses, 0, legal, rng, places)
    if n == 0 and not rules.is_code:
        n = any_place(scores, misses, IN_TEMPLATE - 1, legal, rng, places)
    if n == 0 and not may_split:
        most = fewest_misses(scores, misses, legal, len(scores))
        n = any_place(scores, misses, most, legal, rng, places)
    return n


@part_of_kernel
def next_candidates(scores, misses, has_data, share, legal, may_split, rules, places):
    """Fill `places` with the candidates of a patch with an overlap; return their number.

    `scores` and `misses` have one value for each location. The result is 0 if no patch honours the
    data of the template and the tile may be split.
    """
    n_all = len(scores)
    if not has_data:
        return first_places(scores, misses, 0, legal, n_all, places)
    last, n_last = last_of_share(scores, share, legal)
    n = first_places(scores, misses, 0, last, n_last, places[:1] if rules.is_code else places)
    if n == 0 and rules.is_code:
        most = fewest_misses(scores, misses, last, n_last)
        return last_place(scores, misses, most, last, n_last, places)
    if n == 0:
        n = first_places(scores, misses, IN_TEMPLATE - 1, legal, n_all, places)
    if n == 0 and not may_split:
        most = fewest_misses(scores, misses, legal, n_all)
        n = first_places(scores, misses, most, legal, n_all, places[:1])
    return n


@part_of_kernel
def best_near(grid, image, data, box, y, x, rules):
    """Return row and column of the best location near row `y` and column `x` (MS-CCSIM).

    Patches are inside the square of 2 T cells around the location. The best location honours the
    most data of the box; ties are broken by the score of cells, then by the number of the location.
    """
    inside = inside_overlap(box)
    codes, fewest, best, best_y, best_x = rules.codes, np.int64(1) << 60, np.int64(0), y, x
    for py in range(max(y - box.ny, 0), min(y + box.ny, image.shape[1] - 1) - box.ny + 2):
        for px in range(max(x - box.nx, 0), min(x + box.nx, image.shape[2] - 1) - box.nx + 2):
            if rules.has_gaps and not is_known_patch(image, py, px, box, len(codes)):
                continue
            misses = np.int64(0)
            for row in range(box.y0, min(box.y0 + box.ny, data.facies.shape[1])):
                for i in range(data.first[row], data.first[row + 1]):
                    column = data.columns[i]
                    if box.x0 <= column < box.x0 + box.nx:
                        new = image[0, py + row - box.y0, px + column - box.x0]
                        misses += abs(codes[data.facies[0, row, column]] - codes[new])
            if misses > fewest:
                continue
            score = np.int64(0)
            for row in range(box.ny):
                for column in range(box.nx if row < inside.low_y else inside.low_x):
                    old = codes[grid[box.z0, box.y0 + row, box.x0 + column]]
                    new = codes[image[0, py + row, px + column]]
                    score += (old - new) ** 2 if rules.is_code else -old * new
            if misses < fewest or score < best:
                fewest, best, best_y, best_x = misses, score, py, px
    return best_y, best_x


@part_of_kernel
def is_known_patch(image, y, x, box, n_facies):
    """Return whether a patch at row `y` and column `x` has no unknown cell."""
    for row in range(y, y + box.ny):
        for column in range(x, x + box.nx):
            if image[0, row, column] >= n_facies:
                return False
    return True
