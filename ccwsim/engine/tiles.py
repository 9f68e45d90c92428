"""The compiled simulation loop: score, draw, refine, cut and paste, patch after patch."""

from __future__ import annotations

from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.corrections.proportions import closest_to_target, draw_towards
from ccwsim.engine.corrections.refinement import refine_place
from ccwsim.engine.kernels import kernel, part_of_kernel
from ccwsim.engine.lengths import ScaledLengths
from ccwsim.engine.prepared_image import OrientedImage
from ccwsim.engine.stages.bits import Strips, make_strips
from ccwsim.engine.stages.box import BELOW, LEFT, TOP, Box
from ccwsim.engine.stages.candidates import (
    add_location,
    best_places,
    draw_index,
    keep_within,
    n_segments,
    place_of,
    rule_out_continuations,
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
from ccwsim.engine.stages.path import RasterPath, Triple, in_order
from ccwsim.engine.stages.similarity import (
    Terms,
    make_terms,
    overlap_energies,
    overlap_terms,
    score_places,
)


class Search(NamedTuple):
    """The parameters as the simulation loop needs them, lengths in cells of the searched grid.

    `cell_cost` is the score of one wrong cell of overlap, `datum_cost` what the weights of missed
    data are multiplied by, `slack_cost` what slack is, and `slack` how much worse than the best a
    location without data may be, −1 for any; `n_drawn` is how many of these are drawn and shifted,
    to take the one that fits best. `missed` is what a datum counts in refinement, in wrong cells.
    Where data are not `exact` they were only compared by blocks, so that a location chosen for them
    must not be shifted. `location_cost` is that of one at the other end, along the axes of
    `location_axes`. `reach` says which locations are too near to the continuation of other patches,
    in blocks.
    """

    template: Triple
    overlap: Triple
    block: Triple
    n_candidates: int
    co_template: int
    share: float
    refine: bool
    match: bool
    cell_cost: float
    datum_cost: float
    slack_cost: float
    missed: int
    location_cost: float
    location_axes: tuple[float, float, float]
    exact: bool
    slack: int
    n_drawn: int
    reach: Triple


class Workspace(NamedTuple):
    """Arrays for one patch after another; what the latest left tells how it was chosen.

    `choice` has how many of the `places` were candidates, how many of them were drawn, and which
    was taken. They are made in Python, as kernels make no arrays.
    """

    scores: NDArray[np.number[Any]]  # shape (nz, ny, nx) of locations
    totals: NDArray[np.signedinteger]  # the same with the costs of data and location
    energies: NDArray[np.number[Any]]  # ΣA² of the overlap at the same locations
    energies_of: NDArray[
        np.int64
    ]  # shape (4,): the layers, rows, columns and sides of that overlap
    terms: Terms
    minima: NDArray[np.number[Any]]  # of the scores, and of the totals
    total_minima: NDArray[np.signedinteger]
    segments: NDArray[np.int64]  # those with good scores
    # locations with good scores, their scores, and their totals
    found: NDArray[np.int64]
    found_scores: NDArray[np.number[Any]]
    found_totals: NDArray[np.signedinteger]
    places: NDArray[np.int64]  # numbers of locations
    choice: NDArray[np.int64]
    after: NDArray[np.int64]
    tilt: NDArray[np.float64]
    chances: NDArray[np.float64]
    at_stake: NDArray[np.int64]
    misses: Misses
    strips: Strips
    cut: CutWorkspace


class Simulated(NamedTuple):
    """What the simulation loop fills, in path coordinates."""

    # shape (nz, ny, nx): facies indices, UNKNOWN where not simulated; large enough for whole tiles
    grid: NDArray[np.uint8]
    # shape (nz, ny, nx) or (0, 0, 0): flat index in the oriented TI of each cell; not kept where it
    # is empty
    sources: NDArray[np.int32]
    # shape (n_facies,) or (0,): simulated cells by facies; not kept where it is empty
    counts: NDArray[np.int64]
    # shape (n_patches, 3): first cell in the oriented TI of each patch
    locations: NDArray[np.int32]


def make_patches(
    path: RasterPath, lengths: ScaledLengths, splits: NDArray[np.int64], split_of: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the patches in the order of the path, shape (n, 10).

    Columns: first layer, row and column, lengths along these, sides of the overlap (0 for the first
    patch), index of the split of its tile, the tile, and the part of the tile. `lengths` are along
    the path.
    """
    tiles = in_order(path)
    n_parts = splits.prod(axis=1)[split_of[tiles]]
    tile = np.repeat(tiles, n_parts)
    part = np.arange(len(tile)) - np.repeat(np.cumsum(n_parts) - n_parts, n_parts)
    parts = splits[split_of[tile]]
    at = np.stack(np.unravel_index(tile, path.tiles), axis=1)
    within = np.stack(
        [part // (parts[:, 1] * parts[:, 2]), part // parts[:, 2] % parts[:, 1],
         part % parts[:, 2]], axis=1,
    )  # fmt: skip
    step, overlap = np.array(lengths.step), np.array(lengths.overlap)
    first = at * step + within * (step // parts)
    size = step // parts + overlap
    bits = np.array([BELOW, TOP, LEFT]) * (overlap > 0)
    sides = ((at + within > 0) * bits).sum(axis=1)
    return np.column_stack([first, size, sides, split_of[tile], tile, part]).astype(np.int64)


def clipped(
    patches: NDArray[np.int64], path: RasterPath, lengths: ScaledLengths
) -> NDArray[np.int64]:
    """Return the patches with whole blocks of the grid alone, where the path begins before it.

    Cells outside the grid are cropped in the end: in a volume of few tiles they are a third and
    more of all. A patch that the next ones replace wholly is left out.
    """
    unit = np.multiply(lengths.block, lengths.unit)
    low = np.array(path.offset) // unit * lengths.block
    high = -(-np.add(path.offset, path.shape) // unit) * lengths.block
    first, overlap = patches[:, :3], np.array(lengths.overlap)
    end = first + patches[:, 3:6]
    needed = (end - overlap > low) & ((first + overlap < high) | (first <= low))
    bits = np.array([BELOW, TOP, LEFT]) * (overlap > 0)
    sides = ((first > low) * bits).sum(axis=1)
    first, end = np.maximum(first, low), np.minimum(end, high)
    return np.column_stack([first, end - first, sides, patches[:, 7:]])[needed.all(axis=1)]


def patches_before(patches: NDArray[np.int64], path: RasterPath) -> NDArray[np.int64]:
    """Return which patches of a map lie beside each and are simulated before it, shape (n, 4).

    On the left, at the top and at two corners, of tiles that are not split; −1 where there is none.
    """
    whole = patches[:, 7] == 0
    number_of = np.full(np.add(path.tiles[1:], 2), -1)  # with a margin
    at = np.stack(np.unravel_index(patches[:, 8], path.tiles[1:]), axis=1) + 1
    number_of[tuple(at[whole].T)] = np.flatnonzero(whole)
    moves = (-1, -1), (-1, 0), (-1, 1), (0, -1)
    found = [np.where(whole, number_of[tuple((at + move).T)], -1) for move in moves]
    return np.stack(found, axis=1)


def make_workspace(
    oriented: OrientedImage, search: Search, data: PlacedData, totals: type[np.signedinteger]
) -> Workspace:
    """Return the arrays that patches of a study need; `totals` is the type of scores with costs."""
    kind, shape, n = oriented.squares.dtype, oriented.places, oriented.n_places
    template = search.template
    n_data = min(len(data.columns), prod(template))
    return Workspace(
        scores=np.zeros(shape, kind),
        totals=np.zeros(shape, totals),
        energies=np.zeros(shape, kind),
        energies_of=np.zeros(4, np.int64),
        terms=make_terms(oriented.running, template, search.overlap, search.block),
        minima=np.zeros(n_segments(n), kind),
        segments=np.zeros(n_segments(n), np.int64),
        total_minima=np.zeros(n_segments(n), totals),
        found=np.zeros(n, np.int64),
        found_scores=np.zeros(n, kind),
        found_totals=np.zeros(n, totals),
        places=np.zeros(search.n_candidates, np.int64),
        choice=np.zeros(3, np.int64),
        after=np.zeros(len(oriented.proportions), np.int64),
        tilt=np.zeros(len(oriented.proportions)),
        chances=np.zeros(search.n_candidates),
        at_stake=np.zeros((n_data, 4), np.int64),
        misses=make_misses(len(data.columns), oriented.pyramid.sums.shape[1:], shape),
        strips=make_strips(oriented.pyramid.square_bits, template),
        cut=make_cut(template, search.overlap),
    )


@part_of_kernel
def box_of(p, overlap):
    """Return the place of a patch, a row of `make_patches`."""
    return Box(p[0], p[1], p[2], p[3], p[4], p[5], p[6], overlap[0], overlap[1], overlap[2])


@part_of_kernel
def own_energies(squares, box, block, energies, energies_of):
    """Fill `energies` for a patch, unless the patch before it had the same overlap."""
    own = box.nz, box.ny, box.nx, box.sides
    same = True
    for k in range(4):
        same = same and energies_of[k] == own[k]
        energies_of[k] = own[k]
    if not same:
        overlap_energies(squares, box, block, energies)


@part_of_kernel
def draw(candidates, box, oriented, search, steering, counts, work, rng):
    """Return the index of one of the candidates, steered where realizations are."""
    n_places, block = work.scores.shape[1:], search.block
    if steering.gain > 0:
        return draw_towards(
            oriented.running,
            candidates,
            box,
            block,
            n_places,
            steering,
            counts,
            work.tilt,
            work.chances,
            rng,
        )
    if search.match:
        image, wanted = oriented.pyramid.image, oriented.proportions
        return closest_to_target(
            image, candidates, box, block, n_places, wanted, counts, work.after, rng
        )
    return draw_index(rng, len(candidates))


@kernel
def simulate_patches(
    first, last, patches, before, oriented, data, search, steering, rng, work, simulated
):
    """Simulate patches `first` to `last` − 1 of the raster path (Algorithm 1, lines 4 to 14).

    `patches` come from `make_patches`, `before` from `patches_before`, or has no columns where
    locations beside those of other patches may be drawn; `simulated` is changed in place.
    """
    image, square_bits, _, phases = oriented.pyramid
    running = oriented.running
    grid, sources, counts, locations = simulated
    scores, totals, places = work.scores, work.totals, work.places
    segments, found = work.segments, work.found
    n_places = scores.shape[1], scores.shape[2]
    block = search.block
    for number in range(first, last):
        patch = patches[number]
        box = box_of(patch, search.overlap)
        n_groups = overlap_terms(grid, box, block, running, work.terms)
        own_energies(oriented.squares, box, block, work.energies, work.energies_of)
        score_places(running, work.terms, n_groups, work.energies, scores)
        has_data = data_ahead(data, box, search.co_template)
        n = len(places)
        free = not has_data and box.sides > 0
        if free and before.shape[1] > 0:
            corner = box.z0, box.y0, box.x0
            rule_out_continuations(
                corner, before[number], patches, locations, block, search.reach, scores
            )
        if has_data or search.location_cost > 0:
            weights = SPARSE if patch[7] == 0 else DENSE
            everywhere = weights.everywhere or not has_data
            start_totals(
                scores.reshape(-1), 1.0 if everywhere else search.share, totals.reshape(-1)
            )
            if search.location_cost > 0:
                add_location(box, grid.shape, search.location_cost, search.location_axes, totals)
            add_missed(
                phases,
                grid,
                data,
                box,
                search.co_template,
                oriented.proportions,
                weights,
                search.datum_cost,
                work.misses,
                totals,
            )
            flat = totals.reshape(-1)
            best_places(flat, n, rng, work.total_minima, segments, found, work.found_totals, places)
            if has_data:
                n = keep_within(flat, places, np.int64(weights.slack * search.slack_cost))
            elif free and search.slack >= 0:
                n = keep_within(flat, places, search.slack)
        else:
            raveled = scores.reshape(-1)
            best_places(raveled, n, rng, work.minima, segments, found, work.found_scores, places)
            if free and search.slack >= 0:
                n = keep_within(raveled, places, search.slack)
        coarse = block[0] > 1 or block[1] > 1 or block[2] > 1
        refine = search.refine and coarse and (search.exact or not data_ahead(data, box, 1))
        least, place = np.int64(1 << 60), (np.int64(0), np.int64(0), np.int64(0))
        n_drawn = search.n_drawn if free and refine else 1
        for _ in range(n_drawn):
            drawn = draw(places[:n], box, oriented, search, steering, counts, work, rng)
            wrong, near = np.int64(0), place_of(places[drawn], n_places, block)
            if refine:
                wrong, z, y, x = refine_place(
                    image,
                    square_bits,
                    grid,
                    data,
                    search.missed,
                    box,
                    block,
                    near,
                    work.strips,
                    work.at_stake,
                )
                near = z, y, x
            if wrong < least:
                least, place = wrong, near
                work.choice[0], work.choice[1], work.choice[2] = n, n_drawn, drawn
        keep_old(grid, data.required, image, place, box, work.cut)
        paste(image, place, box, work.cut.keep_mask, counts, grid, sources)
        locations[number, 0], locations[number, 1], locations[number, 2] = place


@kernel
def refine_patches(
    first, last, patches, image, square_bits, data, missed, overlap, finer, refine, work, simulated
):
    """Place patches `first` to `last` − 1 of ms-ccsim near their locations at the coarser scale.

    `finer` is how many cells of this scale a coarser one is, along each axis. `simulated.locations`
    are those of the coarser scale on entry, and stay without `refine`.
    """
    grid, sources, counts, locations = simulated
    for number in range(first, last):
        box = box_of(patches[number], overlap)
        place = (
            finer[0] * np.int64(locations[number, 0]),
            finer[1] * np.int64(locations[number, 1]),
            finer[2] * np.int64(locations[number, 2]),
        )
        if refine:
            _, z, y, x = refine_place(
                image,
                square_bits,
                grid,
                data,
                missed,
                box,
                finer,
                place,
                work.strips,
                work.at_stake,
            )
            place = z, y, x
        keep_old(grid, data.required, image, place, box, work.cut)
        paste(image, place, box, work.cut.keep_mask, counts, grid, sources)
        locations[number, 0], locations[number, 1], locations[number, 2] = place
