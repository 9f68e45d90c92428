"""The simulation loop of the paper to the letter, and of its authors' code (Algorithm 1).

The loop has none of our additions: no refinement, steering, random offset or correction. The stages
are those of our loop in `tiles`; only the choice of locations (`stages.sequential`) and, in the
authors' code, the cut are different. In the paper's method, a tile whose data no patch honours is
split in four; the quarters are simulated in the order of their rows, and may be split again.
"""

from typing import NamedTuple

import numpy as np

from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.engine.prepared_image import OrientedImage, planes_of_codes
from ccwsim.engine.stages.candidates import draw_index, location_of_number
from ccwsim.engine.stages.conditioning import data_ahead
from ccwsim.engine.stages.cut import keep_old, paste
from ccwsim.engine.stages.path import LEFT, TOP, Box
from ccwsim.engine.stages.sequential import (
    Rules,
    best_near,
    codes_read_back,
    count_misses,
    first_candidates,
    next_candidates,
)
from ccwsim.engine.stages.similarity import (
    cached_overlap_energies,
    excluded_from,
    overlap_terms,
    score_places,
)
from ccwsim.engine.tiles import patch_box
from ccwsim.model import MIN_TEMPLATE, Ints, Study


class Published(NamedTuple):
    """Rules and workspace of a published variant."""

    rules: Rules
    misses: Ints  # shape (1, ny, nx) of locations: see `count_misses`


def rules_of(study: Study, oriented: OrientedImage) -> Rules:
    """Return the rules of the variant of a study, for one orientation of the image."""
    codes, p = study.training_image.codes.astype(np.int64), study.parameters
    splits = p.variant == "paper" and p.scale == 0  # the finer scales of MS-CCSIM have whole tiles
    has_gaps = oriented.illegal.size > 0
    image, (_, uy, ux) = oriented.pyramid.image[0], oriented.pyramid.phases.shape[:3]
    if p.variant == "paper" or uy * ux == 1:
        compared = np.append(codes, -1)[image].astype(np.int16)
        cell_size = 1, 1
    else:
        sums, _ = planes_of_codes(oriented.pyramid.sums, study.training_image.codes)
        compared, cell_size = codes_read_back(sums[0], uy.bit_length() - 1), (uy, ux)
    return Rules(
        is_code=p.variant == "code",
        compared=compared,
        cell_size=cell_size,
        codes=codes,
        splits=splits,
        has_gaps=has_gaps,
    )


@kernel
def simulate_published(first, last, published, inputs, work, simulated, rng):
    """Simulate tiles `first` to `last` − 1 of the raster path; `simulated` changes in place."""
    oriented, data, search = inputs.oriented, inputs.data, inputs.search
    rules, misses = published
    grid = simulated.grid
    image, block, places = oriented.pyramid.image, search.block, work.ranking.places
    scores, cut = work.scores, work.placing.cut
    n_places, flat, missed = scores.shape[1:], scores.reshape(-1), misses.reshape(-1)
    illegal, energies = oriented.illegal, work.energies
    legal = (1 if illegal.size else 2) * excluded_from(scores) - 1  # largest score of a location
    for number in range(first, last):  # line 4: tiles in the order of the path
        tile = patch_box(inputs.patches[number], search.overlap)
        depth = part = 0  # number `part` of the 4^depth quarters of the tile
        while True:
            box = quarter(tile, depth, part)
            # Lines 8 to 10: overlap, its coefficients and the scores
            n_groups = overlap_terms(grid, box, block, oriented.running, work.terms)
            cached_overlap_energies(
                oriented.squares, illegal, 0, box, block, energies, work.energies_of
            )
            score_places(
                oriented.running, 0, oriented.spans, work.terms, n_groups, energies, scores
            )
            # Lines 5, 6, 11 and 12: candidates and the random draw
            has_data = count_misses(data, box, search.co_template, block, rules, misses)
            half = (tile.ny >> depth) // 2
            whole = half % block[1] == 0 and half % block[2] == 0 and tile.ny == half << depth + 1
            may_split = whole and half >= MIN_TEMPLATE and rules.splits
            if box.sides == 0:
                n = first_candidates(flat, missed, legal, may_split, rules, rng, places)
            else:
                share = search.share
                n = next_candidates(flat, missed, has_data, share, legal, may_split, rules, places)
            if n == 0:
                depth, part = depth + 1, 4 * part
                continue
            drawn = draw_index(rng, n) if box.sides else 0
            work.choice[:] = n, 1, drawn
            place = location_of_number(places[drawn], n_places, block)
            # Lines 13, 14: the inverse DWT is the slice at the location; it is cut and pasted
            cut_and_paste_as_published(number, box, place, image, data, rules, cut, simulated)
            part += 1
            while depth > 0 and part % 4 == 0:
                depth, part = depth - 1, part // 4
            if depth == 0:
                break


@kernel
def place_near(first, last, rules, inputs, placing, simulated):
    """Place patches `first` to `last` − 1 at a finer scale of MS-CCSIM.

    Patches without data stay at the location of the coarser scale, as in the code of MS-CCSIM.
    For patches with data, the locations around it are searched. `inputs` are
    `multiscale.ScaleInputs`.
    """
    image, data, block, locations = inputs.image, inputs.data, inputs.block, simulated.locations
    for number in range(first, last):
        box = patch_box(inputs.patches[number], inputs.overlap)
        y = block[1] * np.int64(locations[number, 1])
        x = block[2] * np.int64(locations[number, 2])
        if data_ahead(data, box, 1):
            y, x = best_near(simulated.grid, image, data, box, y, x, rules)
        place = np.int64(0), y, x
        cut_and_paste_as_published(number, box, place, image, data, rules, placing.cut, simulated)


@part_of_kernel
def cut_and_paste_as_published(number, box, place, image, data, rules, cut, simulated):
    """Paste a patch along the cut of the paper or of the authors' code; record its location."""
    grid = simulated.grid
    if rules.is_code:
        keep_as_in_code(grid, image, place, box, rules.codes, cut)
    else:
        keep_old(grid, data.required, image, place, box, cut)
    paste(image, place, box, cut.keep_mask, simulated.counts, grid, simulated.sources)
    simulated.locations[number] = place


@part_of_kernel
def quarter(tile, depth, part):
    """Return the box of a quarter: number `part` of the 4^depth quarters of a tile.

    The box begins OR cells (at most the side of the quarter) before the quarter, unless the quarter
    is at the first side of the tile. The overlap of the box consists of its simulated cells.
    """
    size, row, column = tile.ny >> depth, 0, 0
    for bit in range(depth):
        column |= (part >> (2 * bit) & 1) << bit
        row |= (part >> (2 * bit + 1) & 1) << bit
    first_y = row * size - (min(tile.oy, size) if row > 0 else 0)
    first_x = column * size - (min(tile.ox, size) if column > 0 else 0)
    ny, nx = (row + 1) * size - first_y, (column + 1) * size - first_x
    # overlap of the tile, or the earlier quarters
    oy = min(max(tile.oy if tile.sides & TOP else 0, row * size) - first_y, ny)
    ox = min(max(tile.ox if tile.sides & LEFT else 0, column * size) - first_x, nx)
    sides = (TOP if oy > 0 else 0) | (LEFT if ox > 0 else 0)
    y0, x0 = tile.y0 + first_y, tile.x0 + first_x
    return Box(tile.z0, y0, x0, tile.nz, ny, nx, sides, tile.oz, oy, ox)


@part_of_kernel
def keep_as_in_code(grid, image, place, box, codes, cut):
    """Mark in `cut.keep_mask` the cells of a box that stay old, as the authors' code does.

    The cost of each cell is the minimum cost of a path up to the cell. On the way back from its
    end, however, the path moves up to m times towards smaller costs in each line. It therefore
    reaches a local minimum of the line, which need not be a neighbour of the path. Both strips are
    compared with the grid before the patch.
    """
    _, ty, tx = place
    cost, keep = cut.cost, cut.keep_mask[0]
    for y in range(box.ny):
        for x in range(box.nx):
            keep[y, x] = False
    for side in (LEFT, TOP):
        if not box.sides & side:
            continue
        n, m = (box.ny, box.ox) if side == LEFT else (box.nx, box.oy)
        for i in range(n):
            for c in range(m):
                y, x = (i, c) if side == LEFT else (c, i)
                old, new = grid[box.z0, box.y0 + y, box.x0 + x], image[0, ty + y, tx + x]
                cost[i, c] = (codes[old] - codes[new]) ** 2
                if i > 0:
                    least = cost[i - 1, c]
                    for near in range(max(c - 1, 0), min(c + 2, m)):
                        least = min(least, cost[i - 1, near])
                    cost[i, c] += least
        end = 0  # cells of the line before the path
        for c in range(1, m):
            end = c if cost[n - 1, c] < cost[n - 1, end] else end
        for i in range(n - 1, -1, -1):
            for _ in range(m if i < n - 1 else 0):
                before = cost[i, end - 1] if end > 0 else cost[i, end] + 1
                after = cost[i, end + 1] if end < m - 1 else cost[i, end] + 1
                if before <= min(cost[i, end], after):
                    end -= 1
                elif after <= min(cost[i, end], before):
                    end += 1
            for c in range(end):
                y, x = (i, c) if side == LEFT else (c, i)
                keep[y, x] = True
