"""The raster pass of a realization: choose a random plan, then simulate the coarsest scale.

This file implements section 4.1 and Algorithm 1, lines 3 and 4; `tiles` implements lines 5 to 14.
Only "ms-ccsim" searches a scale that is coarser than the grid (see `multiscale`).
"""

from collections.abc import Iterator
from functools import partial
from math import prod
from typing import NamedTuple

import numpy as np

from ccwsim.engine import tiles
from ccwsim.engine.copies import Copies
from ccwsim.engine.corrections.guidance import score_bound
from ccwsim.engine.corrections.proportions import GAIN, Steering, draw_between, draw_target
from ccwsim.engine.corrections.trend_of_data import expected_before, rake
from ccwsim.engine.corrections.unseen_patterns import NO_PATTERNS
from ccwsim.engine.guides import make_guide
from ccwsim.engine.lengths import ScaledLengths, lengths_of, templates
from ccwsim.engine.prepared_image import OrientedImage, PreparedImage, n_planes, steers
from ccwsim.engine.published import Published, rules_of, simulate_published
from ccwsim.engine.stages import conditioning
from ccwsim.engine.stages.path import (
    FROM_ABOVE,
    N_ORIENTATIONS,
    UNKNOWN,
    RasterPath,
    Triple,
    active_patches,
    cells_to_path,
    clip_patches,
    from_path,
    in_layers,
    in_three,
    make_patches,
    make_path,
    overlap_cells,
    patches_before,
    to_path,
)
from ccwsim.engine.stages.pyramid import upgrid_data
from ccwsim.engine.stages.similarity import summed_up
from ccwsim.model import Array, Bytes, Int32s, Ints, Parameters, Shape, Study, Watch, window_at

TERMS_PER_CALL = 500_000_000  # number of terms of scores computed between two reports of progress
MAX_PATCHES_PER_CALL = 512
CANDIDATE_SLACK = 8
"""Maximum number of wrong cells by which a candidate may exceed the best location, for an overlap
of 448 cells without data. The limit is proportional to the overlap."""
FEW_TEMPLATES, MAX_WIDER = 9, 4
"""In a small image few locations fit well, and steering would have no choice. In maps,
CANDIDATE_SLACK is therefore larger, by a factor of up to MAX_WIDER, if all locations of a patch
together cover fewer than FEW_TEMPLATES templates."""
N_DRAWN = 2  # number of random locations per patch without data; the best after refinement is used
N_DRAWN_THIN, LARGE_TEMPLATE = 6, 64
"""Value of N_DRAWN if an image has thin facies and the template is at least LARGE_TEMPLATE; the
location that leaves the fewest unseen patterns is then used."""
REACH = 4
"""Locations at most this number of cells (at least one block) from the verbatim continuation of a
patch are excluded."""
FEW_LOCATIONS = 100
"""If there are fewer locations than this number plus 4 K, continuations are not excluded."""
TARGET_SPREAD, TARGET_SPREAD_RARE = 0.6, 0.7
"""Spread of the target proportions of maps, divided by the spread between pieces of the image. The
ratio is below 1 because proportions of maps also vary around the target; those of rare facies are
steered more strongly and vary less."""
SOFT_SPREAD = 0.5
"""Spread of the target proportions with probabilities, divided by the spread without them."""
WEIGHT_OF_MORE_FACIES = 2
"""Factor of the weights of data if there are over two facies; fewer locations then honour data."""
WEIGHT_OF_VALUES = 0.3
"""Factor of the weights of data of a continuous variable, whose residuals are kriged; with less
weight, seams around data are smoother."""
DATUM_FACTOR = 25
"""Factor of the weights of data if data are not honoured exactly, as in the authors' code."""
MAX_STORED_CELLS = 2**20
"""Maximum number of cells of an empty data array that is stored for use in other realizations.
Larger arrays would use too much memory."""
RASTER_SHARE, REPAIR_SHARE = 0.7, 0.85
"""Assumed finished shares of the time of a realization at the beginning of local re-simulation
(with data) and of seam repair."""


class Plan(NamedTuple):
    """The inputs of a realization, fixed before the first patch is simulated."""

    path: RasterPath
    lengths: tuple[ScaledLengths, ...]  # lengths along the path at each scale, the finest first
    data: tuple[conditioning.PlacedData, ...]  # data at each scale
    inputs: tiles.PatchInputs  # inputs at the coarsest scale
    totals: type[np.signedinteger]  # from `totals_of`
    published: Published | None  # None for our own method

    def workspace(self) -> tiles.PatchWorkspace:
        """Return the workspace to simulate the patches."""
        return tiles.make_tile_workspace(self.inputs, self.totals)

    def simulate_patches(
        self,
        first: int,
        last: int,
        work: tiles.PatchWorkspace,
        simulated: tiles.Simulated,
        rng: np.random.Generator,
    ) -> None:
        """Simulate patches `first` to `last` − 1 of the path; `simulated` changes in place."""
        if self.published is None:
            tiles.simulate_patches(first, last, self.inputs, work, simulated, rng)
        else:
            simulate_published(first, last, self.published, self.inputs, work, simulated, rng)


def make_plan(prepared: PreparedImage, template: Triple, rng: np.random.Generator) -> Plan:
    """Draw a random origin and direction of the path (Algorithm 1, line 3); orient all inputs.

    Patches have the next smaller template if none of the size `template` fits into the image.
    """
    study, p = prepared.study, prepared.study.parameters
    volume = len(study.grid.shape) == 3
    drawn = int(rng.integers(48 if volume else N_ORIENTATIONS)) if p.random_path else 0
    order, orientation = divmod(drawn, 2 * FROM_ABOVE)
    if prepared.copies:  # four rotations suffice; preparing an orientation of the copies takes long
        orientation ^= orientation.bit_count() & 1
    template, oriented = prepared.fitting(orientation, template)
    lengths = lengths_of(p, study.grid.shape, template, orientation)
    path = make_path(
        in_layers(study.grid.shape),
        orientation,
        template=lengths[0].template,
        overlap=lengths[0].overlap,
        order=order,
        offset=_offset(p, lengths, rng),
    )
    data = tuple(_data_at(prepared, path, lengths, k) for k in range(p.scale + 1))
    search = _search(prepared, lengths, n_places=int(oriented.n_places.min()))
    patches, before = _patches(prepared, path, lengths, oriented, data[0])
    kinds = _kinds(prepared.copies, path, lengths[-1], patches, rng)
    steering = _steering(
        prepared, path, coarse=lengths[-1], oriented=oriented, patches=patches, kinds=kinds, rng=rng
    )
    totals = prepared.part(("totals",), lambda: totals_of(prepared))
    inputs = tiles.PatchInputs(
        patches=patches,
        before=before,
        oriented=oriented,
        data=data[-1],
        search=search,
        steering=steering,
        patterns=prepared.patterns(orientation) if search.by_unseen else NO_PATTERNS,
        layers=oriented.layers[kinds],
        guide=make_guide(prepared, template, path, lengths[-1]),
    )
    published = None
    if p.variant != "ours":
        rules = prepared.part(("rules", orientation), lambda: rules_of(study, oriented))
        published = Published(rules, np.zeros(oriented.places, np.int64))
    return Plan(
        path=path, lengths=lengths, data=data, inputs=inputs, totals=totals, published=published
    )


def simulate_tiles(
    prepared: PreparedImage, plan: Plan, keep_sources: bool, rng: np.random.Generator, watch: Watch
) -> tiles.Simulated:
    """Simulate all patches of a realization, at its coarsest scale."""
    inputs, work, n = plan.inputs, plan.workspace(), len(plan.inputs.patches)
    simulated = empty_grid(prepared, plan, prepared.study.parameters.scale, keep_sources)
    at_once = _patches_per_call(inputs.oriented, inputs.search)
    for first in reported_calls(prepared.study, 0, n, at_once, watch):
        plan.simulate_patches(first, min(first + at_once, n), work, simulated, rng)
    return simulated


def empty_grid(
    prepared: PreparedImage, plan: Plan, scale: int, keep_sources: bool
) -> tiles.Simulated:
    """Return the grid of a scale before its first patch."""
    shape, inputs = _scaled(plan.path.full, plan.lengths[scale]), plan.inputs
    counted = inputs.search.match or inputs.steering.is_on
    return tiles.Simulated(
        np.full(shape, UNKNOWN, np.uint8),
        np.zeros(shape if keep_sources and scale == 0 else (0, 0, 0), np.int32),
        np.zeros(prepared.study.training_image.n_facies if counted else 0, np.int64),
        np.zeros((len(inputs.patches), 3), np.int32),
        np.full(shape if inputs.oriented.ranks.size else (0, 0, 0), UNKNOWN, np.uint8),
    )


def _scaled(shape: Triple, lengths: ScaledLengths) -> Triple:
    """Return the shape of a grid in cells of a scale."""
    z, y, x = (n >> s for n, s in zip(shape, lengths.scales, strict=True))
    return z, y, x


def reported_calls(
    study: Study, n_scales_done: int, n: int, at_once: int, watch: Watch
) -> Iterator[int]:
    """Report progress, then yield the number of the first patch, for each call of the kernel."""
    share = (RASTER_SHARE if study.hard_data.n else REPAIR_SHARE) / (study.parameters.scale + 1)
    for first in range(0, n, at_once):
        watch.tell(share * (n_scales_done + first / n))
        yield first


def _patches_per_call(oriented: OrientedImage, search: tiles.Search) -> int:
    n_cells = overlap_cells(search.template, search.overlap) * len(oriented.pyramid.sums)
    terms = max(n_cells // prod(search.block), 1) * int(oriented.n_places.max())
    return min(max(TERMS_PER_CALL // terms, 1), MAX_PATCHES_PER_CALL)


def _patches(
    prepared: PreparedImage,
    path: RasterPath,
    lengths: tuple[ScaledLengths, ...],
    oriented: OrientedImage,
    data: conditioning.PlacedData,
) -> tuple[Ints, Ints]:
    """Return the patches in the order of the path, and the earlier neighbours of each patch."""
    p, splits = prepared.study.parameters, oriented.splits
    fine, coarse, active = lengths[0], lengths[-1], prepared.study.active

    def make() -> Ints:
        split_of = conditioning.split_tiles(
            [(z, y, x) for z, y, x in splits.tolist()],
            data,
            path,
            template=fine.template,
            overlap=fine.overlap,
            max_data=fine.max_data,
            volume=fine.volume,
        )
        return make_patches(path, coarse.step, coarse.overlap, splits, split_of)

    def find_before() -> Ints:
        few = oriented.n_places.min() < FEW_LOCATIONS + 4 * p.n_candidates
        if p.published_draw or few or fine.volume:
            return np.zeros((len(patches), 0), np.int64)
        return patches_before(patches, path)

    key = path.tiles, path.order, fine.template, fine.overlap
    is_stored = len(splits) == 1  # without splits, equal numbers of tiles give equal patches
    patches = prepared.part(("patches", *key), make) if is_stored else make()
    if active is not None:
        mask = to_path(active.reshape(in_layers(active.shape)), path.orientation)
        sums = prepared.part(("active", path.orientation), lambda: summed_up(mask))
        patches = active_patches(patches, path, sums, coarse.step, coarse.cell_size)
        is_stored = False
    before = prepared.part(("before", *key), find_before) if is_stored else find_before()
    if fine.volume and p.random_path and not p.published_draw:
        patches = clip_patches(patches, path, coarse.overlap, coarse.block, coarse.cell_size)
        before = before[: len(patches)]
    return patches, before


def _kinds(
    copies: Copies | None,
    path: RasterPath,
    coarse: ScaledLengths,
    patches: Ints,
    rng: np.random.Generator,
) -> Ints:
    """Return the kind of copies in which each patch is searched, shape (n,); or one for all."""
    if copies is None:
        return np.zeros(1, np.int64)
    middle = (patches[:, :3] + patches[:, 3:6] // 2) * coarse.cell_size - path.offset
    cells = np.clip(middle, 0, np.array(path.shape) - 1)
    kinds = to_path(copies.kinds, path.orientation)[tuple(cells.T)].astype(np.int64)
    if len(copies.weights) > 1:
        kinds += rng.choice(len(copies.weights), len(kinds), p=copies.weights)
    return kinds


def _offset(p: Parameters, lengths: tuple[ScaledLengths, ...], rng: np.random.Generator) -> Triple:
    """Return the random distance from the first tile to the grid, in whole coarse cells."""
    if p.published_draw or not p.random_path:
        return 0, 0, 0
    steps = zip(lengths[0].step, lengths[-1].cell_size, strict=True)
    z, y, x = (int(rng.integers(step // size)) * size for step, size in steps)
    return z, y, x


def _steering(
    prepared: PreparedImage,
    path: RasterPath,
    coarse: ScaledLengths,
    oriented: OrientedImage,
    patches: Ints,
    kinds: Ints,
    rng: np.random.Generator,
) -> Steering:
    """Return random target proportions of a realization; `kinds` come from `_kinds`."""
    study, off = prepared.study, np.zeros(len(oriented.proportions))
    margin = oriented.margin[kinds]
    unsteered = Steering(oriented.proportions[None], margin, off, False)
    if not steers(study):
        return unsteered
    secondary, shape = study.secondary_or_empty, in_layers(study.grid.shape)
    target = draw_target(prepared.base, oriented.proportions, shape, rng)
    if shape[0] == 1:
        spread = np.where(oriented.gain_factors > 1, TARGET_SPREAD_RARE, TARGET_SPREAD)
        target = oriented.proportions + spread * (target - oriented.proportions)
    soft, zones = secondary.probabilities is not None, secondary.zones is not None
    trend = prepared.trend(path.orientation) if soft or zones or study.hard_data.n else None
    if soft and trend:  # the variation is smaller, because the map explains a part of it
        mean = trend.proportions.mean(axis=(0, 1))
        target = np.clip(mean + SOFT_SPREAD * (target - oriented.proportions), 0.0, 1.0)
    elif study.hard_data.n:
        data = prepared.proportions_of_data()
        of_trend = {"residual": trend.residual, "between": trend.between} if trend else {}
        target = draw_between(target, oriented.proportions, data, rng, **of_trend)
        if target is None:
            return unsteered
    targets = target[None]
    if trend:
        targets = expected_before(
            rake(trend.proportions, target),
            trend.pixel,
            patches,
            overlap=coarse.overlap,
            cell_size=coarse.cell_size,
            path=path,
        )
    gain = GAIN * prod(coarse.cell_size) / prod(shape) * oriented.gain_factors
    return Steering(targets, margin, gain, True)


def totals_of(prepared: PreparedImage) -> type[np.signedinteger]:
    """Return the integer type for scores plus the costs of data and location."""
    study, p = prepared.study, prepared.study.parameters
    search = _search(prepared, prepared.lengths, 1)
    n_cells = prod(t * search.co_template for t in search.template)
    missed = min(study.hard_data.n, n_cells) * max(
        conditioning.SPARSE.missed, conditioning.DENSE_WEIGHTS.missed
    )
    overlap = prod(search.template) * prod(search.block)
    overlap += score_bound(study, prepared.lengths[-1], n_planes(study))
    largest = conditioning.N_RANKS / conditioning.MISSED_RANKS if study.ranks_of_data.size else 1
    bound = 2 * overlap + missed * search.datum_cost * largest
    return conditioning.total_type(bound * (1 + p.template_variation) ** 4)


def _data_at(
    prepared: PreparedImage,
    path: RasterPath,
    lengths: tuple[ScaledLengths, ...],
    scale: int,
) -> conditioning.PlacedData:
    """Return the data of a scale in path coordinates; empty if the scale does not use data.

    If `exact_data` is off, only the coarsest scale uses data, and each datum is placed in the first
    cell of its block, except in the method of the paper, which compares cells.
    """
    study, p, shape = prepared.study, prepared.study.parameters, _scaled(path.full, lengths[scale])
    in_search_only = not p.exact_data and p.variant == "ours"
    if not study.hard_data.n or (in_search_only and scale < p.scale):
        cells, facies = np.empty((0, 3), np.int64), np.empty(0, np.uint8)
        make = partial(conditioning.place_data, cells, facies, shape)
        is_stored = prod(shape) <= MAX_STORED_CELLS
        return prepared.part(("no data", shape), make) if is_stored else make()
    cells = in_three(cells_to_path(study.hard_data.cells, study.grid.shape, path.orientation))
    cells = cells + np.array(path.offset)
    of_cells = p.exact_data or p.variant == "paper" or p.scale > 0
    block = (1, 1, 1) if of_cells else lengths[scale].block
    z, y, x = np.multiply(block, lengths[scale].cell_size).tolist()
    largest = p.variant == "code"
    blocks, facies = upgrid_data(cells, study.facies_of_data, (z, y, x), largest)
    return conditioning.place_data(
        blocks * np.array(block),
        facies,
        shape,
        keep=p.exact_data,
        ranks=study.ranks_of_data if study.training_image.values else None,
    )


def to_grid(
    prepared: PreparedImage, simulated: tiles.Simulated, path: RasterPath
) -> tuple[Bytes, Int32s]:
    """Return facies and sources in grid coordinates.

    Sources are flat indices in the searched image, which has the shape `prepared.shape`.
    """
    grid, sources, shape = simulated.grid, simulated.sources, prepared.shape
    if sources.size:
        numbers = np.arange(prod(shape), dtype=np.int32).reshape(shape)
        sources = np.ascontiguousarray(to_path(numbers, path.orientation)).ravel()[sources]

    def turned(array: Array) -> Array:
        volume = from_path(array[window_at(path.offset, path.shape)], path.orientation)
        return np.ascontiguousarray(volume if len(prepared.study.grid.shape) == 3 else volume[0])

    return turned(grid), turned(sources) if sources.size else np.zeros((0, 0), np.int32)


def _search(
    prepared: PreparedImage, lengths: tuple[ScaledLengths, ...], n_places: int
) -> tiles.Search:
    """Return the parameters of the search, with lengths in cells of the coarsest grid."""
    p, coarse = prepared.study.parameters, lengths[-1]
    planes = min(n_planes(prepared.study), 2)  # number of planes that a wrong cell changes
    # A coarse cell represents 4^scale cells, of which 2^scale cells are along a boundary. With the
    # cost of 1 cell, shapes would break. With the cost of 4^scale cells, most data would need local
    # re-simulation.
    cell_cost = prod(coarse.block) * planes / 2**p.scale
    weight_of_data = coarse.weight_of_data
    if planes > 1 and not p.published_draw:
        weight_of_data *= WEIGHT_OF_MORE_FACIES
    continuous = bool(prepared.study.training_image.values)
    factor = WEIGHT_OF_VALUES if continuous else 1
    missed = round(conditioning.SPARSE.missed * weight_of_data * factor)
    factor = factor if p.exact_data else DATUM_FACTOR
    # In a volume, continuations are not excluded, because few locations continue neighbouring
    # patches. The slack is smaller instead.
    n_templates = n_places * prod(coarse.block) / prod(coarse.template)
    wider = min(max(FEW_TEMPLATES / n_templates, 1.0), MAX_WIDER)
    if coarse.volume or p.published_draw:
        wider = 1.0
    slack = CANDIDATE_SLACK * coarse.weight_of_data * (0.75 if coarse.volume else wider)
    draws_once = p.published_draw or p.match_proportions
    may_try = not (draws_once or coarse.volume or p.scale or continuous)
    by_unseen = may_try and max(coarse.template) >= LARGE_TEMPLATE and prepared.has_thin_facies
    reach = [max(1, REACH >> n) for n in lengths[0].level]
    return tiles.Search(
        template=coarse.template,
        overlap=coarse.overlap,
        block=coarse.block,
        n_candidates=min(p.n_candidates, n_places),
        co_template=p.co_template,
        share=p.search_fraction,
        refine=p.refine,
        match=p.match_proportions,
        cell_cost=cell_cost,
        datum_cost=cell_cost * weight_of_data * factor,
        slack_cost=cell_cost * weight_of_data * wider,
        missed=missed,
        exact=p.exact_data,
        slack=-1 if p.published_draw else round(slack * cell_cost),
        n_drawn=1 if draws_once else N_DRAWN_THIN if by_unseen else N_DRAWN,
        by_unseen=by_unseen,
        reach=(reach[0] * coarse.volume, reach[1], reach[2]),
    )


def draw_template(p: Parameters, shape: Shape, rng: np.random.Generator) -> Triple:
    """Return T along z, y and x; if `template_variation` is positive, T is random."""
    if p.template_variation == 0:
        return p.along(shape).template
    sizes = templates(p, shape)
    return sizes[int(rng.integers(len(sizes)))]
