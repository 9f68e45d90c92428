"""The compiled conductor: score, draw, refine, cut and paste, tile after tile."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.engine.stages.bits import Strips, make_strips
from ccwsim.engine.stages.candidates import best_places, draw_index, keep_within
from ccwsim.engine.stages.conditioning import (
    DENSE,
    SPARSE,
    add_missed,
    choose_split,
    data_ahead,
    start_totals,
)
from ccwsim.engine.stages.cut import keep_old, paste, paste_sources
from ccwsim.engine.stages.location import add_location
from ccwsim.engine.stages.proportions import closest_to_target
from ccwsim.engine.stages.refinement import refine_place
from ccwsim.engine.stages.similarity import LEFT, TOP, overlap_terms, score_places


class Search(NamedTuple):
    """The parameters as the compiled conductor needs them, lengths in cells of the grid.

    `cell_cost` is the score of one wrong cell of overlap, `datum_cost` what the weights of missed
    data are multiplied by. Where data are not `exact` they were only compared by blocks, so that a
    place chosen for them must not be shifted. `location_cost` is that of a place at the other end.
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
    """Arrays to work in, made once a call; what a patch leaves in them is how it was chosen.

    `choice` says how many terms the overlap had, how many of the `places` were candidates, and
    which of them was drawn.
    """

    scores: NDArray[np.signedinteger]
    totals: NDArray[np.int64]
    row_best: NDArray[np.int64]
    places: NDArray[np.int64]
    terms: NDArray[np.int64]
    kept: NDArray[np.bool_]
    strips: Strips
    choice: NDArray[np.int64]


@kernel
def split_tiles(n_rows, n_columns, splits, data, template, overlap):
    """Return the index of the split of each tile; one with much data is simulated in parts."""
    step = template - overlap
    split_of = np.zeros(n_rows * n_columns, np.int64)
    for tile in range(len(split_of)):
        row, column = divmod(tile, n_columns)
        split_of[tile] = choose_split(splits, data, row * step, column * step, template, overlap)
    return split_of


@kernel
def simulate_tiles(
    first, last, n_columns, split_of, oriented, data, proportions, search, rng, counts, grid,
    sources, places,
):  # fmt: skip
    """Simulate tiles `first` to `last` − 1 of the raster path (Algorithm 1, lines 3 to 11).

    Parameters
    ----------
    first, last, n_columns : int
        Tiles in the order of the path, and how many a row has.
    split_of : ndarray of int64, shape (n_tiles,)
        From `split_tiles`.
    turned : OrientedImage
    data : PlacedData
    proportions : ndarray, shape (n_facies,)
        Of the training image.
    search : Search
    rng : numpy.random.Generator
    counts : ndarray of int64, shape (n_facies,)
        Cells simulated so far by facies; kept up to date.
    grid : ndarray of uint8, shape (ny, nx)
        The simulation grid in the path frame, large enough for whole tiles.
    sources : ndarray of int32, shape (ny, nx) or (0, 0)
        Filled with the flat index in the turned TI of each cell; not kept where it is empty.
    places : ndarray of int32, shape (n_tiles, n_parts, 2) or (0, 0, 0)
        Filled with the place in the turned TI of each patch; not kept where it is empty.
    """
    room = make_workspace(oriented, search)
    for tile in range(first, last):
        split = split_of[tile]
        parts = oriented.splits[split]
        for part in range(parts * parts):
            y0, x0, size, shape = patch_geometry(tile, part, parts, n_columns, search)
            ty, tx = simulate_patch(
                y0, x0, size, shape, oriented.energies[split, shape],
                oriented.pyramid, data, proportions, search, rng, room, counts, grid, sources,
            )  # fmt: skip
            if places.size:
                places[tile, part, 0], places[tile, part, 1] = ty, tx


@kernel
def make_workspace(oriented, search):
    """Return the arrays to work in."""
    template = search.template
    scores = np.zeros_like(oriented.energies[0, 0])
    n_terms = 2 * len(oriented.pyramid.sums) * template * search.overlap // search.block_size**2
    return Workspace(
        scores,
        np.empty(scores.shape, np.int64),
        np.empty(len(scores), np.int64),
        np.empty((search.n_candidates, 2), np.int64),
        np.empty((4, n_terms), np.int64),
        np.empty((template, template), np.bool_),
        make_strips(oriented.pyramid.bits, template),
        np.zeros(3, np.int64),
    )


@part_of_kernel
def patch_geometry(tile, part, parts, n_columns, search):
    """Return first row and column, side and shape of the overlap of a part of a tile."""
    row, column = divmod(tile, n_columns)
    down, along = divmod(part, parts)
    step = search.template - search.overlap
    shape = (LEFT if column + along > 0 else 0) | (TOP if row + down > 0 else 0)
    y0, x0 = row * step + down * (step // parts), column * step + along * (step // parts)
    return y0, x0, step // parts + search.overlap, shape


@part_of_kernel
def simulate_patch(
    y0, x0, size, shape, energy, pyramid, data, proportions, search, rng, room, counts, grid,
    sources,
):  # fmt: skip
    """Simulate one patch (Algorithm 1, lines 4 to 10) and return its place in the TI.

    Parameters
    ----------
    y0, x0, size : int
        First cell and side of the patch.
    shape : int
        Shape of its overlap.
    energy : ndarray, shape (ny_places, nx_places)
        ΣA² of that overlap at each place.
    pyramid, data, proportions, search, rng, room, counts, grid, sources
        As in `simulate_tiles`.
    """
    image, bits, sums, phases = pyramid
    overlap, unit = search.overlap, search.block_size
    scores, totals, places = room.scores, room.totals, room.places
    n_terms = overlap_terms(grid, y0, x0, size, overlap, unit, shape, len(sums), room.terms)
    score_places(sums, room.terms, n_terms, energy, scores)
    ahead = search.co_template * size
    has_data = data_ahead(data, y0, x0, ahead)
    candidates = places
    if has_data or search.location_cost > 0:
        weights = SPARSE if size == search.template else DENSE
        everywhere = weights.everywhere or not has_data
        start_totals(scores, 1.0 if everywhere else search.share, totals)
        if search.location_cost > 0:
            add_location(y0, x0, size, grid.shape, search.location_cost, totals)
        cost = search.datum_cost
        add_missed(phases, grid, data, y0, x0, size, ahead, proportions, weights, cost, totals)
        best_places(totals, search.n_candidates, rng, room.row_best, places)
        if has_data:
            slack = int(weights.slack * search.cell_cost)
            candidates = places[: keep_within(totals, places, slack)]
    else:
        best_places(scores, search.n_candidates, rng, room.row_best, places)
    if search.match:
        drawn = closest_to_target(image, candidates, unit, size, counts, proportions, rng)
    else:
        drawn = draw_index(rng, len(candidates))
    room.choice[0], room.choice[1], room.choice[2] = n_terms, len(candidates), drawn
    ty, tx = candidates[drawn, 0] * unit, candidates[drawn, 1] * unit
    if search.refine and unit > 1 and (search.exact or not data_ahead(data, y0, x0, size)):
        ty, tx = refine_place(
            image, bits, grid, data, y0, x0, size, overlap, shape, unit, ty, tx, room.strips
        )
    place_patch(
        image, ty, tx, y0, x0, size, overlap, shape, data.kept, room.kept, counts, grid, sources
    )
    return ty, tx


@kernel
def place_patch(
    image, ty, tx, y0, x0, size, overlap, shape, data, room, counts, grid, sources
):  # fmt: skip
    """Cut and paste (Algorithm 1, line 10) the patch at (ty, tx) of the TI.

    `data` is the facies of the data that the cut must keep, `room` a place to mark cells in.
    """
    patch = image[ty : ty + size, tx : tx + size]
    kept = room[:size, :size]
    keep_old(grid, data, patch, y0, x0, overlap, shape, kept)
    paste(patch, kept, shape, overlap, counts, y0, x0, grid)
    if sources.size:
        paste_sources(ty, tx, image.shape[1], kept, y0, x0, sources)
