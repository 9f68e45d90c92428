"""The compiled simulation loop: score, draw, refine, cut and paste, patch after patch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.engine.prepared_image import OrientedImage
from ccwsim.engine.stages.bits import Strips, make_strips
from ccwsim.engine.stages.box import LEFT, TOP, Box
from ccwsim.engine.stages.candidates import (
    add_location,
    best_places,
    closest_to_target,
    draw_index,
    keep_within,
)
from ccwsim.engine.stages.conditioning import (
    DENSE,
    SPARSE,
    Misses,
    PlacedData,
    add_missed,
    data_ahead,
    make_misses,
    start_totals,
)
from ccwsim.engine.stages.cut import CutWorkspace, keep_old, make_cut, paste
from ccwsim.engine.stages.path import RasterPath
from ccwsim.engine.stages.refinement import refine_place
from ccwsim.engine.stages.similarity import n_run, overlap_terms, score_places

REACH = 2
"""ms-ccsim compares locations up to REACH − 1 cells from the coarser scale's, on each axis."""


class Search(NamedTuple):
    """The parameters as the simulation loop needs them, lengths in cells of the searched grid.

    `cell_cost` is the score of one wrong cell of overlap, `datum_cost` what the weights of missed
    data are multiplied by. Where data are not `exact` they were only compared by blocks, so that a
    location chosen for them must not be shifted. `location_cost` is that of one at the other end.
    """

    template: int
    overlap: int
    block_size: int
    n_candidates: int
    co_template: int
    share: float
    refine: bool
    match: bool
    cell_cost: float
    datum_cost: float
    location_cost: float
    exact: bool


class Workspace(NamedTuple):
    """Arrays for one patch after another; what the latest left tells how it was chosen.

    `choice` has how many terms the overlap had, how many of the `places` were candidates, and
    which of them was drawn. They are made in Python: kernels that allocate compile longer.
    """

    scores: NDArray[np.signedinteger]
    run: NDArray[np.signedinteger]
    totals: NDArray[np.int64]
    row_best: NDArray[np.int64]
    places: NDArray[np.int64]
    terms: NDArray[np.int64]
    weights: NDArray[np.signedinteger]
    choice: NDArray[np.int64]
    after: NDArray[np.int64]
    at_stake: NDArray[np.int64]
    misses: Misses
    strips: Strips
    cut: CutWorkspace


class Simulated(NamedTuple):
    """What the simulation loop fills, in path coordinates."""

    # shape (ny, nx): facies indices, UNKNOWN where not simulated; large enough for whole tiles
    grid: NDArray[np.uint8]
    # shape (ny, nx) or (0, 0): flat index in the oriented TI of each cell; not kept where it is
    # empty
    sources: NDArray[np.int32]
    # shape (n_facies,) or (0,): simulated cells by facies; not kept where it is empty
    counts: NDArray[np.int64]
    # shape (n_patches, 2): first cell in the oriented TI of each patch
    locations: NDArray[np.int32]


def make_patches(
    path: RasterPath,
    step: int,
    overlap: int,
    splits: NDArray[np.int64],
    split_of: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Return the patches in the order of the path, shape (n, 7).

    Columns: first row and column, side, sides of the overlap (0 for the first patch), index of the
    split of its tile, the tile, and the part of the tile.
    """
    parts_of = splits[split_of]
    tile = np.repeat(np.arange(len(split_of)), parts_of**2)
    parts = parts_of[tile]
    part = np.arange(len(tile)) - np.repeat(np.cumsum(parts_of**2) - parts_of**2, parts_of**2)
    (row, column), (down, along) = divmod(tile, path.n_columns), divmod(part, parts)
    sides = np.where(column + along > 0, LEFT, 0) | np.where(row + down > 0, TOP, 0)
    y0, x0 = row * step + down * (step // parts), column * step + along * (step // parts)
    columns = y0, x0, step // parts + overlap, sides, split_of[tile], tile, part
    return np.stack(columns, axis=1).astype(np.int64)


def make_workspace(oriented: OrientedImage, search: Search, data: PlacedData) -> Workspace:
    """Return the arrays that patches of a study need."""
    energies, template = oriented.energies, search.template
    ny, nx = energies.shape[2:]
    sums = oriented.pyramid.sums
    n_terms = 2 * len(sums) * template * search.overlap // search.block_size**2
    return Workspace(
        scores=np.zeros((ny, nx), energies.dtype),
        run=np.zeros(n_run(sums, nx), energies.dtype),
        totals=np.zeros((ny, nx), np.int64),
        row_best=np.zeros(ny, np.int64),
        places=np.zeros((search.n_candidates, 2), np.int64),
        terms=np.zeros((4, n_terms), np.int64),
        weights=np.zeros(n_terms, energies.dtype),
        choice=np.zeros(3, np.int64),
        after=np.zeros(len(oriented.proportions), np.int64),
        at_stake=np.zeros((min(len(data.columns), template**2), 3), np.int64),
        misses=make_misses(len(data.columns), sums.shape[2], (ny, nx)),
        strips=make_strips(oriented.pyramid.bits, template),
        cut=make_cut(template, search.overlap),
    )


@kernel
def simulate_patches(first, last, patches, oriented, data, search, rng, work, simulated):
    """Simulate patches `first` to `last` − 1 of the raster path (Algorithm 1, lines 4 to 14).

    `patches` come from `make_patches`; `simulated` is changed in place.
    """
    image, bits, sums, phases = oriented.pyramid
    grid, sources, counts, locations = simulated
    block_size = search.block_size
    scores, totals, places = work.scores, work.totals, work.places
    for number in range(first, last):
        patch = patches[number]
        box = Box(patch[0], patch[1], patch[2], patch[3], search.overlap)
        n_terms = overlap_terms(grid, box, block_size, len(sums), work.terms)
        energy = oriented.energies[patch[4], box.sides]
        score_places(sums, work.terms, n_terms, energy, work.weights, work.run, scores)
        ahead = search.co_template * box.size
        has_data = data_ahead(data, box.y0, box.x0, ahead)
        n = len(places)
        if has_data or search.location_cost > 0:
            weights = SPARSE if box.size == search.template else DENSE
            everywhere = weights.everywhere or not has_data
            start_totals(scores, 1.0 if everywhere else search.share, totals)
            if search.location_cost > 0:
                add_location(box, grid.shape, search.location_cost, totals)
            cost = search.datum_cost
            add_missed(
                phases,
                grid,
                data,
                box,
                ahead,
                oriented.proportions,
                weights,
                cost,
                work.misses,
                totals,
            )
            best_places(totals, n, rng, work.row_best, places)
            if has_data:
                n = keep_within(totals, places, np.int64(weights.slack * search.cell_cost))
        else:
            best_places(scores, n, rng, work.row_best, places)
        if search.match:
            drawn = closest_to_target(
                image,
                places[:n],
                block_size,
                box.size,
                oriented.proportions,
                counts,
                work.after,
                rng,
            )
        else:
            drawn = draw_index(rng, n)
        work.choice[0], work.choice[1], work.choice[2] = n_terms, n, drawn
        ty, tx = places[drawn, 0] * block_size, places[drawn, 1] * block_size
        free = search.exact or not data_ahead(data, box.y0, box.x0, box.size)
        if search.refine and block_size > 1 and free:
            ty, tx = refine_place(
                image, bits, grid, data, box, block_size, ty, tx, work.strips, work.at_stake
            )
        keep_old(grid, data.required, image, ty, tx, box, work.cut)
        paste(image, ty, tx, box, work.cut.keep_mask, counts, grid, sources)
        locations[number, 0], locations[number, 1] = ty, tx


@kernel
def refine_patches(first, last, patches, image, bits, data, refine, work, simulated):
    """Place patches `first` to `last` − 1 of ms-ccsim near their locations at the coarser scale.

    `simulated.locations` are those of the coarser scale on entry, and stay without `refine`.
    """
    grid, sources, counts, locations = simulated
    for number in range(first, last):
        patch = patches[number]
        box = Box(patch[0], patch[1], patch[2], patch[3], work.cut.error.shape[1])
        ty, tx = 2 * np.int64(locations[number, 0]), 2 * np.int64(locations[number, 1])
        if refine:
            ty, tx = refine_place(
                image, bits, grid, data, box, REACH, ty, tx, work.strips, work.at_stake
            )
        keep_old(grid, data.required, image, ty, tx, box, work.cut)
        paste(image, ty, tx, box, work.cut.keep_mask, counts, grid, sources)
        locations[number, 0], locations[number, 1] = ty, tx
