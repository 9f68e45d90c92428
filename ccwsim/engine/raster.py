"""A realization along the raster path, at one scale or from a coarse scale to the finest."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.prepared_image import OrientedImage, PreparedImage
from ccwsim.engine.stages.bits import make_strips
from ccwsim.engine.stages.conditioning import PlacedData, place_data, split_tiles
from ccwsim.engine.stages.cut import UNKNOWN, make_cut
from ccwsim.engine.stages.path import (
    N_ORIENTATIONS,
    RasterPath,
    cells_to_path,
    from_path,
    make_path,
    to_path,
)
from ccwsim.engine.stages.pyramid import upgrid_data
from ccwsim.engine.tiles import (
    Search,
    Simulated,
    make_patches,
    make_workspace,
    refine_patches,
    simulate_patches,
)
from ccwsim.model.parameters import MAX_TEMPLATE, Parameters, legal_sizes
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
    oriented: OrientedImage  # the training image in path coordinates, at the scale of the search
    search: Search
    data: tuple[PlacedData, ...]  # by scale, the finest first
    patches: NDArray[np.int64]  # shape (n, 7): from `make_patches`, in cells of the searched scale


def simulate_raster(
    study: Study,
    template: int,
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
    path, oriented, search, data, patches = make_plan(study, template, image, rng)
    n, work = len(patches), make_workspace(oriented, search, data[p.scale])
    simulated = empty_grid(study, path, p.scale, n, keep_sources)
    at_once = _patches_per_call(oriented, search)
    for first in _reported(study, 0, n, at_once, watch):
        last = min(first + at_once, n)
        simulate_patches(
            first, last, patches, oriented, data[p.scale], search, rng, work, simulated
        )
    at_once = min(max(CELLS_PER_CALL // template**2, 1), MAX_PATCHES_PER_CALL)
    for scale in range(p.scale - 1, -1, -1):
        patches = patches * np.array([2, 2, 2, 1, 1, 1, 1])
        finer, bits = image.scaled(path.orientation, scale), image.bits(path.orientation, scale)
        size = template >> scale
        work = work._replace(
            at_stake=np.zeros((min(len(data[scale].columns), size**2), 3), np.int64),
            strips=make_strips(bits, size),
            cut=make_cut(size, p.overlap_size >> scale),
        )
        locations = simulated.locations
        simulated = empty_grid(study, path, scale, n, keep_sources)._replace(locations=locations)
        for first in _reported(study, p.scale - scale, n, at_once, watch):
            last = min(first + at_once, n)
            refine_patches(
                first, last, patches, finer, bits, data[scale], p.refine, work, simulated
            )
    return to_grid(simulated.grid, simulated.sources, path, study.training_image.shape)


def empty_grid(
    study: Study, path: RasterPath, scale: int, n_patches: int, keep_sources: bool
) -> Simulated:
    """Return the grid of a scale before its first patch."""
    p, shape = study.parameters, (path.full[0] >> scale, path.full[1] >> scale)
    return Simulated(
        np.full(shape, UNKNOWN, np.uint8),
        np.zeros(shape if keep_sources and scale == 0 else (0, 0), np.int32),
        np.zeros(study.training_image.n_facies if p.match_proportions else 0, np.int64),
        np.zeros((n_patches, 2), np.int32),
    )


def _reported(study: Study, n_scales: int, n: int, at_once: int, watch: Watch) -> Iterator[int]:
    """Yield the first patch of each call, and report how far the raster pass is."""
    whole = (RASTER_SHARE if study.hard_data.n else 1.0) / (study.parameters.scale + 1)
    for first in range(0, n, at_once):
        watch.report(whole * (n_scales + first / n))
        yield first


def make_plan(study: Study, template: int, image: PreparedImage, rng: np.random.Generator) -> Plan:
    """Draw where the path starts (Algorithm 1, line 3), and orient everything along it."""
    p = study.parameters
    orientation = int(rng.integers(N_ORIENTATIONS)) if p.random_path else 0
    oriented = image.oriented(orientation, template)
    path = make_path(study.grid.shape, orientation, template, p.overlap_size)
    data = tuple(_data_at(scale, study, path) for scale in range(p.scale + 1))
    search = _search(p, template, oriented)
    splits, overlap = oriented.splits, p.overlap_size
    split_of = split_tiles(splits.tolist(), data[0], path, template, overlap)
    patches = make_patches(path, search.template - search.overlap, search.overlap, splits, split_of)
    return Plan(path, oriented, search, data, patches)


def _data_at(scale: int, study: Study, path: RasterPath) -> PlacedData:
    """Return the data in path coordinates at a scale, as far as they count there.

    Data that only condition the search count there alone, each as the first cell of its block.
    """
    p = study.parameters
    shape = path.full[0] >> scale, path.full[1] >> scale
    cells = cells_to_path(study.hard_data.cells, study.grid.shape, path.orientation)
    if not p.exact_data and scale < p.scale:
        return place_data(cells[:0], study.facies_of_data[:0], shape, keep=False)
    block = 1 if p.exact_data else 2 ** (p.level - p.scale)
    blocks, facies = upgrid_data(cells, study.facies_of_data, block << scale)
    return place_data(blocks * block, facies, shape, keep=p.exact_data)


def to_grid(
    grid: NDArray[np.uint8],
    sources: NDArray[np.int32],
    path: RasterPath,
    image_shape: tuple[int, int],
) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """Return a realization in grid coordinates, its sources as flat indices in the TI itself."""
    rows, columns = path.shape
    if sources.size:
        numbers = np.arange(image_shape[0] * image_shape[1], dtype=np.int32).reshape(image_shape)
        oriented = np.ascontiguousarray(to_path(numbers, path.orientation))
        sources = oriented.ravel()[sources]
    return (
        np.ascontiguousarray(from_path(grid[:rows, :columns], path.orientation)),
        np.ascontiguousarray(from_path(sources[:rows, :columns], path.orientation)),
    )


def _patches_per_call(oriented: OrientedImage, search: Search) -> int:
    cells = 2 * search.template * search.overlap * len(oriented.pyramid.sums)
    terms = cells // search.block_size**2 * oriented.energies[0, 0].size
    return min(max(TERMS_PER_CALL // terms, 1), MAX_PATCHES_PER_CALL)


def _search(p: Parameters, template: int, oriented: OrientedImage) -> Search:
    """Return the parameters in cells of the grid that is searched: the coarsest."""
    block_size = 2 ** (p.level - p.scale)
    planes = 1 if len(oriented.pyramid.sums) == 1 else 2  # in which a wrong cell counts
    # A coarse cell stands for 4^scale cells and for 2^scale along a boundary: counted as one it
    # leaves shapes broken, counted as 4^scale it leaves most data to local re-simulation.
    cell_cost = block_size * block_size * planes / 2**p.scale
    overlap_cost = cell_cost * 2 * p.template_size * p.overlap_size / 4**p.scale
    return Search(
        template=template >> p.scale,
        overlap=p.overlap_size >> p.scale,
        block_size=block_size,
        n_candidates=min(p.n_candidates, oriented.energies[0, 0].size),
        co_template=p.co_template,
        share=p.search_fraction,
        refine=p.refine,
        match=p.match_proportions,
        cell_cost=cell_cost,
        datum_cost=cell_cost * (1 if p.exact_data else DATUM_FACTOR),
        location_cost=p.location_weight * overlap_cost,
        exact=p.exact_data,
    )


def draw_template(p: Parameters, shape: tuple[int, int], rng: np.random.Generator) -> int:
    """Return T, or a size within the share that `template_variation` allows."""
    if p.template_variation == 0:
        return p.template_size
    low = max(round(p.template_size * (1 - p.template_variation)), 2 * p.overlap_size, 4)
    high = min(round(p.template_size * (1 + p.template_variation)), *shape, MAX_TEMPLATE)
    sizes = legal_sizes(p.level, low, high)
    return sizes[int(rng.integers(len(sizes)))]
