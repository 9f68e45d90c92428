"""A realization along the raster path, at one scale or from a coarse scale to the finest."""

from __future__ import annotations

from collections.abc import Iterator
from math import prod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.corrections.proportions import GAIN, Steering, draw_between, draw_target
from ccwsim.engine.lengths import ScaledLengths, lengths_of, templates
from ccwsim.engine.prepared_image import OrientedImage, PreparedImage, steers
from ccwsim.engine.stages.bits import make_strips
from ccwsim.engine.stages.conditioning import (
    DENSE,
    SPARSE,
    PlacedData,
    place_data,
    split_tiles,
    total_type,
)
from ccwsim.engine.stages.cut import UNKNOWN, make_cut
from ccwsim.engine.stages.path import (
    FROM_ABOVE,
    N_ORIENTATIONS,
    RasterPath,
    Triple,
    along_path,
    cells_to_path,
    from_path,
    in_layers,
    in_three,
    make_path,
    overlap_cells,
    to_path,
)
from ccwsim.engine.stages.pyramid import upgrid_data
from ccwsim.engine.tiles import (
    Search,
    Simulated,
    Workspace,
    clipped,
    make_patches,
    make_workspace,
    patches_before,
    refine_patches,
    simulate_patches,
)
from ccwsim.jobs.workers import Watch
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study

TERMS_PER_CALL = 500_000_000
"""Terms of scores summed between two looks at progress and cancel: some hundredths of a second."""
CELLS_PER_CALL = 100_000_000
"""Cells compared in refinement between two such looks."""
MAX_PATCHES_PER_CALL = 512
SLACK = 8
"""Without data a location is drawn if it is at most so many wrong cells worse than the best, of an
overlap of 448 cells; more where overlaps are larger, in proportion."""
N_DRAWN = 2
"""So many locations are drawn without data: the one is taken that fits best once it is shifted."""
REACH = 4
"""Cells around the verbatim continuation of a patch that are no candidates, or one block."""
FEW_LOCATIONS = 100
"""With so few locations beyond four times the candidates all are candidates."""
TARGET_SPREAD = 0.7
"""The targets of maps vary by so much of what pieces of the image do: maps vary around them too."""
WEIGHT_OF_MORE_FACIES = 2
"""How much more data weigh among three facies and more: there are fewer locations to choose from
that honour them, and the data say more."""
DATUM_FACTOR = 25
"""How much more data weigh that are not honoured exactly: as in the authors' code."""
MAX_KEPT = 2**20
"""Cells of a grid without data that is kept for other realizations: to make a small one takes long
beside its patches, a large one memory."""
RASTER_SHARE, REPAIR_SHARE = 0.7, 0.85
"""The shares of its time after which a realization comes to local re-simulation, where it has data,
and to seam repair; for the progress bar."""


class Plan(NamedTuple):
    """What is settled before the first patch of a realization."""

    path: RasterPath
    lengths: ScaledLengths  # along the path, in cells of the grid
    oriented: OrientedImage  # the training image in path coordinates, at the scale of the search
    search: Search
    data: tuple[PlacedData, ...]  # by scale, the finest first
    patches: NDArray[np.int64]  # from `make_patches`, in cells of the searched scale
    before: NDArray[np.int64]  # from `patches_before`
    steering: Steering
    totals: type[np.signedinteger]  # from `totals_of`

    @property
    def counts(self) -> bool:
        """Whether the cells of each facies are counted."""
        return self.search.match or self.steering.gain > 0

    def workspace(self) -> Workspace:
        """Return the arrays that its patches need."""
        return make_workspace(self.oriented, self.search, self.data[-1], self.totals)


def simulate_raster(
    study: Study,
    template: Triple,
    image: PreparedImage,
    keep_sources: bool,
    rng: np.random.Generator,
    watch: Watch,
) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """Return a realization as the raster path leaves it, and where its cells came from.

    The search fills the grid at the coarsest scale, which is the only one but for "ms-ccsim"; each
    finer scale places the patches again, near the locations that the coarser one chose.
    """
    p = study.parameters
    plan = make_plan(study, template, image, rng)
    path, oriented, patches = plan.path, plan.oriented, plan.patches
    fixed = patches, plan.before, oriented, plan.data[p.scale], plan.search, plan.steering
    n, work = len(patches), plan.workspace()
    simulated = empty_grid(study, plan, p.scale, n, keep_sources)
    at_once = _patches_per_call(oriented, plan.search)
    for first in _reported(study, 0, n, at_once, watch):
        last = min(first + at_once, n)
        simulate_patches(first, last, *fixed, rng, work, simulated)
    at_once = min(max(CELLS_PER_CALL // prod(plan.lengths.template), 1), MAX_PATCHES_PER_CALL)
    coarser = plan.lengths.at_scale(p.scale)
    for scale in range(p.scale - 1, -1, -1):
        own = plan.lengths.at_scale(scale)
        z, y, x = (b // a for a, b in zip(own.unit, coarser.unit, strict=True))
        finer, coarser = (z, y, x), own
        patches = patches * np.array([*finer, *finer, 1, 1, 1, 1])
        scaled = image.scaled(path.orientation, scale)
        square_bits = image.square_bits(path.orientation, scale)
        data, size = plan.data[scale], own.template
        work = work._replace(
            at_stake=np.zeros((min(len(data.columns), prod(size)), 4), np.int64),
            strips=make_strips(square_bits, size),
            cut=make_cut(size, own.overlap),
        )
        locations = simulated.locations
        simulated = empty_grid(study, plan, scale, n, keep_sources)._replace(locations=locations)
        at_scale = plan.search.missed, own.overlap, finer, p.refine, work, simulated
        for first in _reported(study, p.scale - scale, n, at_once, watch):
            last = min(first + at_once, n)
            refine_patches(first, last, patches, scaled, square_bits, data, *at_scale)
    return to_grid(simulated.grid, simulated.sources, path, study)


def empty_grid(
    study: Study, plan: Plan, scale: int, n_patches: int, keep_sources: bool
) -> Simulated:
    """Return the grid of a scale before its first patch."""
    shape = _scaled(plan.path.full, plan.lengths.at_scale(scale))
    return Simulated(
        np.full(shape, UNKNOWN, np.uint8),
        np.zeros(shape if keep_sources and scale == 0 else (0, 0, 0), np.int32),
        np.zeros(study.training_image.n_facies if plan.counts else 0, np.int64),
        np.zeros((n_patches, 3), np.int32),
    )


def _scaled(shape: Triple, lengths: ScaledLengths) -> Triple:
    """Return the shape of a grid in cells of a scale."""
    z, y, x = (n >> s for n, s in zip(shape, lengths.scales, strict=True))
    return z, y, x


def _reported(study: Study, n_scales: int, n: int, at_once: int, watch: Watch) -> Iterator[int]:
    """Yield the first patch of each call, and report how far the raster pass is."""
    whole = (RASTER_SHARE if study.hard_data.n else REPAIR_SHARE) / (study.parameters.scale + 1)
    for first in range(0, n, at_once):
        watch.report(whole * (n_scales + first / n))
        yield first


def make_plan(
    study: Study, template: Triple, image: PreparedImage, rng: np.random.Generator
) -> Plan:
    """Draw where the path starts (Algorithm 1, line 3), and orient everything along it."""
    p, grid_shape = study.parameters, in_layers(study.grid.shape)
    volume = len(study.grid.shape) == 3
    drawn = int(rng.integers(48 if volume else N_ORIENTATIONS)) if p.random_path else 0
    order, orientation = divmod(drawn, 2 * FROM_ABOVE)
    oriented = image.oriented(orientation, template)
    lengths = lengths_of(p, study.grid.shape, template).along(orientation)
    fixed = orientation, lengths.template, lengths.overlap, order
    path = make_path(grid_shape, *fixed, _offset(p, lengths, rng))
    data = tuple(_data_at(scale, study, image, path, lengths) for scale in range(p.scale + 1))
    search = _search(study, lengths, oriented, path)
    patches, before = _patches(study, image, path, lengths, oriented, data[0])
    steering = _steering(study, image, oriented, rng)
    totals = image.part(("totals",), lambda: totals_of(image))
    return Plan(path, lengths, oriented, search, data, patches, before, steering, totals)


def _patches(
    study: Study,
    image: PreparedImage,
    path: RasterPath,
    lengths: ScaledLengths,
    oriented: OrientedImage,
    data: PlacedData,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the patches in their order, and which of them lie beside each and come before it."""
    p, splits = study.parameters, oriented.splits
    own = lengths.at_scale(p.scale)

    def make(split_of: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        patches = make_patches(path, own, splits, split_of)
        few = oriented.n_places < FEW_LOCATIONS + 4 * p.n_candidates
        if p.draws_as_published or few or lengths.volume:
            return patches, np.zeros((len(patches), 0), np.int64)
        return patches, patches_before(patches, path)

    if len(splits) == 1:  # then all paths with so many tiles have the same
        key = "patches", path.tiles, path.order, lengths.template, lengths.overlap
        patches, before = image.part(key, lambda: make(np.zeros(prod(path.tiles), np.int64)))
    else:
        legal = [(z, y, x) for z, y, x in splits.tolist()]
        lattice = path, lengths.template, lengths.overlap
        patches, before = make(split_tiles(legal, data, *lattice, lengths.max_data, lengths.volume))
    if lengths.volume and p.random_path and not p.draws_as_published:
        patches = clipped(patches, path, own)
        before = before[: len(patches)]
    return patches, before


def _offset(p: Parameters, lengths: ScaledLengths, rng: np.random.Generator) -> Triple:
    """Draw how far before the grid the first tile begins: whole cells of the coarsest scale.

    Along z it begins with the grid where patches are to come from their own height.
    """
    if p.draws_as_published or not p.random_path:
        return 0, 0, 0
    units = lengths.at_scale(p.scale).unit
    z, y, x = (int(rng.integers(s // u)) * u for s, u in zip(lengths.step, units, strict=True))
    return (0 if p.location_weights[0] else z), y, x


def _steering(
    study: Study, image: PreparedImage, oriented: OrientedImage, rng: np.random.Generator
) -> Steering:
    """Draw the proportions of a realization."""
    unsteered = Steering(oriented.proportions, oriented.margin, 0.0)
    if not steers(study):
        return unsteered
    shape = in_layers(study.grid.shape)
    target = draw_target(image.scaled(), oriented.proportions, shape, rng)
    if shape[0] == 1:
        target = oriented.proportions + TARGET_SPREAD * (target - oriented.proportions)
    if study.hard_data.n:
        target = draw_between(target, oriented.proportions, image.proportions_of_data(), rng)
        if target is None:
            return unsteered
    units = lengths_of(study.parameters, study.grid.shape).at_scale(study.parameters.scale).unit
    gain = GAIN * prod(units) / prod(shape)
    return Steering(target, oriented.margin, gain)


def totals_of(image: PreparedImage) -> type[np.signedinteger]:
    """Return the type of scores with the costs of data and location, for the study of an image."""
    study = image.study
    p, lengths = study.parameters, lengths_of(study.parameters, study.grid.shape)
    path = make_path(in_layers(study.grid.shape), 0, lengths.template, lengths.overlap)
    search = _search(study, lengths, image.oriented(0, lengths.template), path)
    cells = prod(t * search.co_template for t in search.template)
    missed = min(study.hard_data.n, cells) * max(SPARSE.missed, DENSE.missed)
    overlap = prod(search.template) * prod(search.block)
    bound = 2 * overlap + missed * search.datum_cost + 3 * search.location_cost
    return total_type(bound * (1 + p.template_variation) ** 4)


def _data_at(
    scale: int, study: Study, image: PreparedImage, path: RasterPath, lengths: ScaledLengths
) -> PlacedData:
    """Return the data in path coordinates at a scale, as far as they count there.

    Data that only condition the search count there alone, each as the first cell of its block.
    """
    p, own = study.parameters, lengths.at_scale(scale)
    shape = _scaled(path.full, own)
    if not study.hard_data.n or (not p.exact_data and scale < p.scale):
        none = np.empty((0, 3), np.int64), np.empty(0, np.uint8), shape
        if prod(shape) > MAX_KEPT:
            return place_data(*none)
        return image.part(("no data", shape), lambda: place_data(*none))
    cells = in_three(cells_to_path(study.hard_data.cells, study.grid.shape, path.orientation))
    cells = cells + np.array(path.offset)
    block = (1, 1, 1) if p.exact_data else own.block
    z, y, x = (b * u for b, u in zip(block, own.unit, strict=True))
    blocks, facies = upgrid_data(cells, study.facies_of_data, (z, y, x))
    return place_data(blocks * np.array(block), facies, shape, keep=p.exact_data)


def to_grid(
    grid: NDArray[np.uint8], sources: NDArray[np.int32], path: RasterPath, study: Study
) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """Return a realization in grid coordinates, its sources as flat indices in the TI itself."""
    shape = in_layers(study.training_image.shape)
    if sources.size:
        numbers = np.arange(prod(shape), dtype=np.int32).reshape(shape)
        oriented = np.ascontiguousarray(to_path(numbers, path.orientation))
        sources = oriented.ravel()[sources]

    def own(cells: NDArray) -> NDArray:
        part = tuple(slice(k, k + n) for k, n in zip(path.offset, path.shape, strict=True))
        found = from_path(cells[part], path.orientation)
        return np.ascontiguousarray(found if len(study.grid.shape) == 3 else found[0])

    return own(grid), own(sources) if sources.size else np.zeros((0, 0), np.int32)


def _patches_per_call(oriented: OrientedImage, search: Search) -> int:
    template, overlap, block = search.template, search.overlap, search.block
    cells = overlap_cells(template, overlap) * len(oriented.pyramid.sums)
    terms = max(cells // prod(block), 1) * oriented.n_places
    return min(max(TERMS_PER_CALL // terms, 1), MAX_PATCHES_PER_CALL)


def _search(
    study: Study, lengths: ScaledLengths, oriented: OrientedImage, path: RasterPath
) -> Search:
    """Return the parameters in cells of the grid that is searched: the coarsest."""
    p = study.parameters
    own = lengths.at_scale(p.scale)
    planes = 1 if len(oriented.pyramid.sums) == 1 else 2  # in which a wrong cell counts
    # A coarse cell stands for 4^scale cells and for 2^scale along a boundary: counted as one it
    # leaves shapes broken, counted as 4^scale it leaves most data to local re-simulation.
    cell_cost = prod(own.block) * planes / 2**p.scale
    of_data = lengths.weight_of_data
    if planes > 1 and not p.published_draw:
        of_data *= WEIGHT_OF_MORE_FACIES
    # In a volume patches that go on with what is beside them are few: no others are ruled out,
    # so that they are not copied on and on, but the slack is narrower.
    slack = SLACK * lengths.weight_of_data * (0.75 if lengths.volume else 1.0)
    corner = _usual_overlap(lengths_of(p, study.grid.shape)) / 4**p.scale
    z, y, x = along_path(p.location_weights, path.orientation)
    location = max(z, y, x)
    axes = (z / location, y / location, x / location) if location else (0.0, 0.0, 0.0)
    return Search(
        template=own.template,
        overlap=own.overlap,
        block=own.block,
        n_candidates=min(p.n_candidates, oriented.n_places),
        co_template=p.co_template,
        share=p.search_fraction,
        refine=p.refine,
        match=p.match_proportions,
        cell_cost=cell_cost,
        datum_cost=cell_cost * of_data * (1 if p.exact_data else DATUM_FACTOR),
        slack_cost=cell_cost * of_data,
        missed=round(SPARSE.missed * of_data),
        location_cost=location * cell_cost * corner,
        location_axes=axes,
        exact=p.exact_data,
        slack=-1 if p.draws_as_published else round(slack * cell_cost),
        n_drawn=1 if p.draws_as_published or p.match_proportions else N_DRAWN,
        reach=tuple(max(1, REACH >> n) for n in lengths.level),  # type: ignore[arg-type]
    )


def _usual_overlap(lengths: ScaledLengths) -> int:
    """Return the cells of overlap that a location at the other end of the image costs."""
    if not lengths.volume:
        return 2 * lengths.template[1] * lengths.overlap[1]
    return overlap_cells(lengths.template, lengths.overlap)


def draw_template(p: Parameters, shape: tuple[int, ...], rng: np.random.Generator) -> Triple:
    """Return T along z, y and x, or one within the share that `template_variation` allows."""
    if p.template_variation == 0:
        return p.along(shape).template
    sizes = templates(p, shape)
    return sizes[int(rng.integers(len(sizes)))]
