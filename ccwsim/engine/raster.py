"""A realization along the raster path, at one scale or from a coarse scale to the finest."""

from __future__ import annotations

from collections.abc import Iterator
from math import prod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.lengths import ScaledLengths, lengths_of, templates
from ccwsim.engine.prepared_image import OrientedImage, PreparedImage
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
    make_path,
    overlap_cells,
    to_path,
)
from ccwsim.engine.stages.pyramid import upgrid_data
from ccwsim.engine.tiles import (
    Search,
    Simulated,
    Workspace,
    make_patches,
    make_workspace,
    refine_patches,
    simulate_patches,
)
from ccwsim.model.parameters import Parameters
from ccwsim.model.study import Study
from ccwsim.system.workers import Watch

TERMS_PER_CALL = 500_000_000
"""Terms of scores summed between two looks at progress and cancel: some hundredths of a second."""
CELLS_PER_CALL = 100_000_000
"""Cells compared in refinement between two such looks."""
MAX_PATCHES_PER_CALL = 512
DATUM_FACTOR = 25
"""How much more data weigh that are not honoured exactly: as in the authors' code."""
RASTER_SHARE = 0.7
"""What the raster pass takes of the time of a realization with data, for the progress bar."""


class Plan(NamedTuple):
    """What is settled before the first patch of a realization."""

    path: RasterPath
    lengths: ScaledLengths  # along the path, in cells of the grid
    oriented: OrientedImage  # the training image in path coordinates, at the scale of the search
    search: Search
    data: tuple[PlacedData, ...]  # by scale, the finest first
    patches: NDArray[np.int64]  # from `make_patches`, in cells of the searched scale
    totals: type[np.signedinteger]  # from `totals_of`

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
    n, work = len(patches), plan.workspace()
    simulated = empty_grid(study, plan, p.scale, n, keep_sources)
    at_once = _patches_per_call(oriented, plan.search)
    for first in _reported(study, 0, n, at_once, watch):
        last = min(first + at_once, n)
        simulate_patches(
            first, last, patches, oriented, plan.data[p.scale], plan.search, rng, work, simulated
        )
    at_once = min(max(CELLS_PER_CALL // prod(plan.lengths.template), 1), MAX_PATCHES_PER_CALL)
    coarser = plan.lengths.at_scale(p.scale)
    for scale in range(p.scale - 1, -1, -1):
        own = plan.lengths.at_scale(scale)
        z, y, x = (b // a for a, b in zip(own.unit, coarser.unit, strict=True))
        finer, coarser = (z, y, x), own
        patches = patches * np.array([*finer, *finer, 1, 1, 1, 1])
        scaled, bits = image.scaled(path.orientation, scale), image.bits(path.orientation, scale)
        data, size = plan.data[scale], own.template
        work = work._replace(
            at_stake=np.zeros((min(len(data.columns), prod(size)), 4), np.int64),
            strips=make_strips(bits, size),
            cut=make_cut(size, own.overlap),
        )
        locations = simulated.locations
        simulated = empty_grid(study, plan, scale, n, keep_sources)._replace(locations=locations)
        fixed = plan.search.missed, own.overlap, finer, p.refine, work, simulated
        for first in _reported(study, p.scale - scale, n, at_once, watch):
            last = min(first + at_once, n)
            refine_patches(first, last, patches, scaled, bits, data, *fixed)
    return to_grid(simulated.grid, simulated.sources, path, study)


def empty_grid(
    study: Study, plan: Plan, scale: int, n_patches: int, keep_sources: bool
) -> Simulated:
    """Return the grid of a scale before its first patch."""
    p = study.parameters
    shape = _scaled(plan.path.full, plan.lengths.at_scale(scale))
    return Simulated(
        np.full(shape, UNKNOWN, np.uint8),
        np.zeros(shape if keep_sources and scale == 0 else (0, 0, 0), np.int32),
        np.zeros(study.training_image.n_facies if p.match_proportions else 0, np.int64),
        np.zeros((n_patches, 3), np.int32),
    )


def _scaled(shape: Triple, lengths: ScaledLengths) -> Triple:
    """Return the shape of a grid in cells of a scale."""
    z, y, x = (n >> s for n, s in zip(shape, lengths.scales, strict=True))
    return z, y, x


def _reported(study: Study, n_scales: int, n: int, at_once: int, watch: Watch) -> Iterator[int]:
    """Yield the first patch of each call, and report how far the raster pass is."""
    whole = (RASTER_SHARE if study.hard_data.n else 1.0) / (study.parameters.scale + 1)
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
    path = make_path(grid_shape, orientation, lengths.template, lengths.overlap, order)
    data = tuple(_data_at(scale, study, path, lengths) for scale in range(p.scale + 1))
    search = _search(study, lengths, oriented, orientation)
    splits = oriented.splits
    legal = [(z, y, x) for z, y, x in splits.tolist()]
    split_of = split_tiles(
        legal, data[0], path, lengths.template, lengths.overlap, lengths.max_data
    )
    patches = make_patches(path, lengths.at_scale(p.scale), splits, split_of)
    return Plan(path, lengths, oriented, search, data, patches, totals_of(image))


def totals_of(image: PreparedImage) -> type[np.signedinteger]:
    """Return the type of scores with the costs of data and location, for the study of an image."""
    study = image.study
    p, lengths = study.parameters, lengths_of(study.parameters, study.grid.shape)
    search = _search(study, lengths, image.oriented(0, lengths.template))
    cells = prod(t * search.co_template for t in search.template)
    missed = min(study.hard_data.n, cells) * max(SPARSE.missed, DENSE.missed)
    overlap = prod(search.template) * prod(search.block)
    bound = 2 * overlap + missed * search.datum_cost + 3 * search.location_cost
    return total_type(bound * (1 + p.template_variation) ** 4)


def _data_at(scale: int, study: Study, path: RasterPath, lengths: ScaledLengths) -> PlacedData:
    """Return the data in path coordinates at a scale, as far as they count there.

    Data that only condition the search count there alone, each as the first cell of its block.
    """
    p, own = study.parameters, lengths.at_scale(scale)
    shape = _scaled(path.full, own)
    cells = in_three(cells_to_path(study.hard_data.cells, study.grid.shape, path.orientation))
    if not p.exact_data and scale < p.scale:
        return place_data(cells[:0], study.facies_of_data[:0], shape, keep=False)
    block = (1, 1, 1) if p.exact_data else own.block
    z, y, x = (b * u for b, u in zip(block, own.unit, strict=True))
    blocks, facies = upgrid_data(cells, study.facies_of_data, (z, y, x))
    return place_data(blocks * np.array(block), facies, shape, keep=p.exact_data)


def in_three(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return cells with their layer, 0 in a map."""
    return np.pad(cells, ((0, 0), (3 - cells.shape[1], 0)))


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
        nz, ny, nx = path.shape
        found = from_path(cells[:nz, :ny, :nx], path.orientation)
        return np.ascontiguousarray(found if len(study.grid.shape) == 3 else found[0])

    return own(grid), own(sources) if sources.size else np.zeros((0, 0), np.int32)


def _patches_per_call(oriented: OrientedImage, search: Search) -> int:
    template, overlap, block = search.template, search.overlap, search.block
    cells = overlap_cells(template, overlap) * len(oriented.pyramid.sums)
    terms = max(cells // prod(block), 1) * oriented.n_places
    return min(max(TERMS_PER_CALL // terms, 1), MAX_PATCHES_PER_CALL)


def _search(
    study: Study, lengths: ScaledLengths, oriented: OrientedImage, orientation: int = 0
) -> Search:
    """Return the parameters in cells of the grid that is searched: the coarsest."""
    p = study.parameters
    own = lengths.at_scale(p.scale)
    planes = 1 if len(oriented.pyramid.sums) == 1 else 2  # in which a wrong cell counts
    # A coarse cell stands for 4^scale cells and for 2^scale along a boundary: counted as one it
    # leaves shapes broken, counted as 4^scale it leaves most data to local re-simulation.
    cell_cost = prod(own.block) * planes / 2**p.scale
    corner = _usual_overlap(lengths_of(p, study.grid.shape)) / 4**p.scale
    of_data = lengths.weight_of_data
    z, y, x = along_path(p.location_weights, orientation)
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
