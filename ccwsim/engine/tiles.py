"""The compiled simulation loop: patch after patch along the path (Algorithm 1, lines 4 to 14).

Template and overlap are T and OR of the paper. Refinement of locations and steering towards target
proportions are not in the paper.
"""

from math import prod
from typing import NamedTuple

import numpy as np

from ccwsim.engine.corrections.guidance import Guide, guided_energies
from ccwsim.engine.corrections.proportions import Steering, closest_to_target, draw_towards
from ccwsim.engine.corrections.refinement import NO_RANKS, data_at_stake, refine_place
from ccwsim.engine.corrections.unseen_patterns import (
    PasteWorkspace,
    Patterns,
    make_trial,
    n_unseen_with,
    simulated_within_reach,
)
from ccwsim.engine.kernels import inlined_part_of_kernel, kernel, part_of_kernel
from ccwsim.engine.prepared_image import OrientedImage
from ccwsim.engine.stages.bits import Strips, make_strips, take_strips
from ccwsim.engine.stages.candidates import (
    Ranking,
    best_places,
    draw_index,
    keep_within,
    location_of_number,
    make_ranking,
    rule_out_continuations,
)
from ccwsim.engine.stages.conditioning import (
    DENSE_WEIGHTS,
    SPARSE,
    Misses,
    PlacedData,
    add_missed,
    add_off_ranks,
    data_ahead,
    make_misses,
    ruled_out,
    start_totals,
)
from ccwsim.engine.stages.cut import CutWorkspace, keep_old, make_cut, paste
from ccwsim.engine.stages.path import Box, Triple
from ccwsim.engine.stages.similarity import (
    Terms,
    cached_overlap_energies,
    exclude_illegal,
    make_terms,
    overlap_terms,
    score_places,
)
from ccwsim.model import Array, Bytes, Floats, Int32s, Integers, Ints, UInt64s

UNSEEN = 64
"""Misfit of an unseen pattern, in wrong cells of overlap, if several locations are compared."""


class Search(NamedTuple):
    """The parameters of the simulation loop, with lengths in cells of the coarsest grid."""

    template: Triple  # T
    overlap: Triple  # OR
    block: Triple  # number of cells of a coefficient, 2^J, along each axis
    n_candidates: int  # K
    co_template: int  # CT, as a number of templates
    share: float  # share of locations (with the best overlaps) that are searched near data
    refine: bool
    match: bool  # whether proportions are matched to the training image
    cell_cost: float  # score of one wrong cell of overlap
    datum_cost: float  # factor of the weights of data that are not honoured
    slack_cost: float  # factor of the slack near data
    missed: int  # cost, in refinement, of a datum not honoured, in wrong cells
    # if False, data only condition the search by blocks, and locations of patches with data are not
    # refined
    exact: bool
    slack: int  # maximum difference in score from the best location without data; −1: no limit
    n_drawn: int  # number of random locations without data, of which the best is used
    by_unseen: bool  # whether the best location is the one that leaves the fewest unseen patterns
    reach: Triple  # number of blocks around the continuation of a patch that are excluded


class PatchInputs(NamedTuple):
    """Inputs of the simulation loop, shared by all patches of a realization."""

    patches: Ints  # shape (n, 10): made by `make_patches`
    # shape (n, 4): made by `patches_before`; shape (n, 0) if continuations are not excluded
    before: Ints
    oriented: OrientedImage
    data: PlacedData
    search: Search
    steering: Steering
    patterns: Patterns  # patterns of the oriented image, for `by_unseen`
    # shape (1 or n, 2): first layer and number of layers of the locations that a patch may have
    layers: Ints
    guide: Guide | None  # costs of locations; None to omit the code without secondary information


class PlacingWorkspace(NamedTuple):
    """Workspace to refine the location of a patch, cut the patch and paste it."""

    strips: Strips
    at_stake: Ints  # shape (n, 4): made by `data_at_stake`
    cut: CutWorkspace


class PatchWorkspace(NamedTuple):
    """Workspace of the simulation loop, which also shows how the last patch was chosen.

    Python code allocates this workspace, because kernels allocate no arrays.
    """

    scores: Array  # shape (nz, ny, nx) of the locations of a patch
    totals: Integers  # shape of `scores`: scores plus costs of data and location
    energies: Array  # shape (nz, ny, nx) of all locations: ΣA² over the overlap
    energies_of: Ints  # shape (nz, 4): boxes of `energies`, see `similarity`
    guided: Array  # energies plus costs by the guide; empty without a guide
    terms: Terms
    ranking: Ranking  # ranking of the scores
    total_ranking: Ranking  # ranking of the totals; shares `places` with `ranking`
    # shape (3,): number of candidates, number of random locations, index of the used location
    choice: Ints
    after: Ints  # shape (n_facies,), for `closest_to_target`
    tilt: Floats  # shape (n_facies,), for `draw_towards`
    chances: Floats  # shape (K,), for `draw_towards`
    misses: Misses
    placing: PlacingWorkspace
    trial: PasteWorkspace


class Simulated(NamedTuple):
    """Results of the simulation loop, in path coordinates."""

    # shape (nz, ny, nx), all tiles: facies indices, UNKNOWN in cells that are not simulated yet
    grid: Bytes
    sources: Int32s  # shape of `grid`: flat index in the TI; empty if not recorded
    counts: Ints  # shape (n_facies,): cells of each facies; empty if not counted
    locations: Int32s  # shape (n_patches, 3): locations in the oriented TI
    ranks: Bytes  # shape of `grid`: ranks of a continuous variable; empty for facies


def make_tile_workspace(inputs: PatchInputs, totals: type[np.signedinteger]) -> PatchWorkspace:
    """Return the workspace for patches; `totals` is the type for scores plus costs."""
    oriented, data, search = inputs.oriented, inputs.data, inputs.search
    n_layers = int(inputs.layers[:, 1].max(initial=1))
    kind, shape = oriented.squares.dtype, (n_layers, *oriented.places[1:])
    n = prod(shape)
    template, n_facies = search.template, len(oriented.proportions)
    ranking, of_totals = (make_ranking(n, search.n_candidates, t) for t in (kind, totals))
    return PatchWorkspace(
        scores=np.zeros(shape, kind),
        totals=np.zeros(shape, totals),
        energies=np.zeros(oriented.places, kind),
        energies_of=np.zeros((oriented.places[0], 4), np.int64),
        guided=np.zeros(shape if inputs.guide else (0, 0, 0), kind),
        terms=make_terms(oriented.running, template, search.overlap, search.block),
        ranking=ranking,
        total_ranking=ranking._replace(minima=of_totals.minima, values=of_totals.values),
        choice=np.zeros(3, np.int64),
        after=np.zeros(n_facies, np.int64),
        tilt=np.zeros(n_facies),
        chances=np.zeros(search.n_candidates),
        misses=make_misses(len(data.columns), oriented.pyramid.sums.shape[1:], shape),
        placing=make_placing(oriented.pyramid.square_bits, template, search.overlap, data),
        trial=make_trial(template, inputs.patterns, 0),
    )


def make_placing(
    square_bits: UInt64s, template: Triple, overlap: Triple, data: PlacedData
) -> PlacingWorkspace:
    """Return the workspace to place patches of at most `template` cells."""
    at_stake = np.zeros((min(len(data.columns), prod(template)), 4), np.int64)
    return PlacingWorkspace(
        make_strips(square_bits, template), at_stake, make_cut(template, overlap)
    )


@part_of_kernel
def patch_box(p, overlap):
    """Return the box of patch `p`, a row of the array from `make_patches`."""
    return Box(p[0], p[1], p[2], p[3], p[4], p[5], p[6], overlap[0], overlap[1], overlap[2])


@kernel
def simulate_patches(first, last, inputs, work, simulated, rng):
    """Simulate patches `first` to `last` − 1 of the raster path; `simulated` changes in place."""
    patches, before, layers, guide = inputs.patches, inputs.before, inputs.layers, inputs.guide
    oriented, data, search, patterns = inputs.oriented, inputs.data, inputs.search, inputs.patterns
    image, square_bits = oriented.pyramid.image, oriented.pyramid.square_bits
    grid, block, placing = simulated.grid, search.block, work.placing
    places, n_places = work.ranking.places, (oriented.places[1], oriented.places[2])
    coarse = block[0] > 1 or block[1] > 1 or block[2] > 1
    ranks, grid_ranks = oriented.ranks, simulated.ranks
    compared = grid_ranks if grid_ranks.size else grid
    for number in range(first, last):  # line 4: patches in the order of the path
        box = patch_box(patches[number], search.overlap)
        # Lines 5, 6: the first patch has no overlap, so all scores are 0. Ties are broken at
        # random, so the candidates are random locations.
        # Lines 8, 9: the coefficients of the overlap, here block sums
        n_groups = overlap_terms(grid, box, block, oriented.running, work.terms)
        # Line 10: CCW scores
        layer, n_layers = layers[min(number, len(layers) - 1)]
        scores, energies = work.scores[:n_layers], work.energies[layer : layer + n_layers]
        illegal, of = oriented.illegal, work.energies_of
        cached_overlap_energies(oriented.squares, illegal, layer, box, block, energies, of)
        energies = guided_energies(
            guide, box, illegal, layer, energies, work.guided[:n_layers], rng
        )
        score_places(
            oriented.running, layer, oriented.spans, work.terms, n_groups, energies, scores
        )
        # Line 11: the K best candidates
        has_data = data_ahead(data, box, search.co_template)
        is_free = not has_data and box.sides > 0
        if is_free and before.shape[1] > 0:
            locations = simulated.locations
            rule_out_continuations(
                box, before[number], patches, locations, block, search.reach, layer, scores
            )
        if has_data:
            is_split, totals = patches[number, 7] > 0, work.totals[:n_layers]
            n = conditional_candidates(
                box, layer, is_split, simulated, inputs, work, scores, totals, rng
            )
        else:
            slack = search.slack if is_free else np.int64(-1)
            n = unconditional_candidates(scores, slack, work.ranking, rng)
        for k in range(len(places)):  # numbers among all layers
            places[k] += layer * n_places[0] * n_places[1]
        # Line 12: random choice; not in the paper: refinement of the location
        refine = search.refine and coarse and (search.exact or not data_ahead(data, box, 1))
        at_stake = placing.at_stake[:0]
        if refine:
            take_strips(grid, box, square_bits, placing.strips)
            at_stake = placing.at_stake[: data_at_stake(compared, data, box, placing.at_stake)]
        least, place = np.int64(1 << 60), (np.int64(0), np.int64(0), np.int64(0))
        by_unseen = search.by_unseen and is_free and n > 1
        n_drawn = search.n_drawn if by_unseen or (is_free and refine) else 1
        for _ in range(n_drawn):
            drawn = draw(n, number, box, inputs, simulated.counts, work, rng)
            misfit, near = np.int64(0), location_of_number(places[drawn], n_places, block)
            if refine:
                strips, missed = placing.strips, search.missed
                misfit, z, y, x = refine_place(
                    image,
                    square_bits,
                    box,
                    block,
                    near,
                    strips,
                    at_stake,
                    missed,
                    ranks,
                    grid_ranks,
                )
                near = z, y, x
            if by_unseen:
                keep_old(grid, data.required, image, near, box, placing.cut)
                around, mask = simulated_within_reach(box, patterns), placing.cut.keep_mask
                most = min((least - misfit) // UNSEEN + 1, np.int64(1 << 30))
                misfit += UNSEEN * n_unseen_with(
                    image, near, box, around, mask, grid, patterns, most, work.trial
                )
            if misfit < least:
                least, place = misfit, near
                work.choice[:] = n, n_drawn, drawn
        # Line 13: the inverse DWT of Haar coefficients is the slice of the image at the location
        # Line 14: paste, along the cut
        cut_and_paste(number, box, place, image, data, placing.cut, simulated, ranks)


@inlined_part_of_kernel  # without inlining, simulation takes 10 % longer at level 1
def unconditional_candidates(scores, slack, ranking, rng):
    """Fill `ranking.places` with the K best locations; return the number of candidates.

    `slack` is the maximum difference in score between a candidate and the best location (−1: no
    limit). `scores` has the shape (nz, ny, nx) of locations.
    """
    flat, places = scores.reshape(-1), ranking.places
    best_places(flat, rng, ranking)
    return keep_within(flat, places, slack) if slack >= 0 else len(places)


@inlined_part_of_kernel
def conditional_candidates(box, layer, is_split, simulated, inputs, work, scores, totals, rng):
    """Fill `total_ranking.places` by scores plus costs of data (section 4.4); return their number.

    `is_split` is true if the patch is a part of a split tile. `scores` and `totals` begin with
    layer `layer` of locations.
    """
    oriented, data, search = inputs.oriented, inputs.data, inputs.search
    weights = DENSE_WEIGHTS if is_split else SPARSE
    share = 1.0 if weights.everywhere else search.share
    flat, places = totals.reshape(-1), work.total_ranking.places
    start_totals(scores.reshape(-1), share, oriented.illegal.size > 0, flat)
    exclude_illegal(oriented.illegal, layer, totals, ruled_out(totals))
    layers = layer, len(totals) + search.template[0] // search.block[0] - 1
    phases, proportions, times = oriented.pyramid.phases, oriented.proportions, search.co_template
    cost, misses, grid, grid_ranks = search.datum_cost, work.misses, simulated.grid, simulated.ranks
    if grid_ranks.size:
        add_off_ranks(
            oriented.rank_phases, layers, grid_ranks, data, box, times, weights, cost, totals
        )
    else:
        add_missed(
            phases, layers, grid, data, box, times, proportions, weights, cost, misses, totals
        )
    best_places(flat, rng, work.total_ranking)
    return keep_within(flat, places, np.int64(weights.slack * search.slack_cost))


@part_of_kernel
def draw(n, number, box, inputs, counts, work, rng):
    """Return the index of a random candidate of patch `number`, steered towards the targets."""
    oriented, search, steering = inputs.oriented, inputs.search, inputs.steering
    block, n_places = search.block, (work.scores.shape[1], work.scores.shape[2])
    candidates = work.ranking.places[:n]
    if steering.is_on:
        tilt, chances, running = work.tilt, work.chances, oriented.running
        return draw_towards(
            running, candidates, number, box, block, n_places, steering, counts, tilt, chances, rng
        )
    if search.match:
        image, target = oriented.pyramid.image, oriented.proportions
        return closest_to_target(
            image, candidates, box, block, n_places, target, counts, work.after, rng
        )
    return draw_index(rng, n)


@part_of_kernel
def cut_and_paste(number, box, place, image, data, cut, simulated, ranks=NO_RANKS):
    """Paste a patch of `image`, shape (mz, my, mx), along the cut and record its location."""
    grid, grid_ranks = simulated.grid, simulated.ranks
    counts, sources = simulated.counts, simulated.sources
    if grid_ranks.size:
        keep_old(grid_ranks, data.required, ranks, place, box, cut, True)
        paste(ranks, place, box, cut.keep_mask, counts[:0], grid_ranks, sources[:0])
    else:
        keep_old(grid, data.required, image, place, box, cut)
    paste(image, place, box, cut.keep_mask, counts, grid, sources)
    simulated.locations[number] = place
