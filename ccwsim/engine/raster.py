"""A realization along the raster path, at one scale or from a coarse scale to the finest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.multiscale import refine_tiles
from ccwsim.engine.prepared_image import OrientedImage, PreparedImage
from ccwsim.engine.stages.conditioning import PlacedData, place_data
from ccwsim.engine.stages.cut import UNKNOWN
from ccwsim.engine.stages.path import (
    N_ORIENTATIONS,
    RasterPath,
    cells_to_path,
    from_path,
    make_path,
    to_path,
)
from ccwsim.engine.stages.upgrid import upgrid_data
from ccwsim.engine.tiles import Search, simulate_tiles, split_tiles
from ccwsim.model.bounds import MAX_TEMPLATE
from ccwsim.model.parameters import Parameters, legal_sizes
from ccwsim.model.study import Study
from ccwsim.system.workers import Watch

TERMS_A_CALL = 500_000_000
"""Terms of scores summed between two looks at progress and cancel: some hundredths of a second."""
CELLS_A_CALL = 100_000_000
"""Cells compared in refinement between two such looks."""
MAX_TILES_A_CALL = 512
STRICT = 25
"""How much more data weigh where they only steer: as in the published codes, before the overlap."""
RASTER_SHARE = 0.7
"""What the raster takes of the time of a realization with data, for the progress bar."""


class Plan(NamedTuple):
    """What is settled before the first tile of a realization.

    Attributes
    ----------
    path : RasterPath
    turned : OrientedImage
        The training image in the path frame, at the scale of the search.
    search : Search
    data : tuple of PlacedData
        By scale, the finest first.
    split_of : ndarray of int64, shape (n_tiles,)
        Into how many parts each tile is split, as an index of `turned.splits`.
    """

    path: RasterPath
    oriented: OrientedImage
    search: Search
    data: tuple[PlacedData, ...]
    split_of: NDArray[np.int64]


def simulate_raster(
    study: Study,
    template: int,
    image: PreparedImage,
    keep_sources: bool,
    rng: np.random.Generator,
    watch: Watch,
) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """Return a realization before its data are mended, and where its cells came from.

    The search fills the grid at the coarsest scale, which is the only one but for "ms-ccsim"; each
    finer scale lays the tiles again, near the places that the coarser one chose.
    """
    p, ti = study.parameters, study.training_image
    path, oriented, search, data, split_of = make_plan(study, template, image, rng)
    n, n_columns = path.n_rows * path.n_columns, path.n_columns
    places = np.empty((n, oriented.splits[-1] ** 2, 2) if p.scale else (0, 0, 0), np.int32)
    for scale in range(p.scale, -1, -1):
        full = path.full[0] >> scale, path.full[1] >> scale
        grid = np.full(full, UNKNOWN, np.uint8)
        sources = np.zeros(full if keep_sources and scale == 0 else (0, 0), np.int32)
        counts = np.zeros(ti.n_facies if p.match_proportions else 0, np.int64)
        at_once = _tiles_a_call(oriented, search) if scale == p.scale else _laid_a_call(template)
        for first in range(0, n, at_once):
            share = (p.scale - scale + first / n) / (p.scale + 1)
            watch.report(share * (RASTER_SHARE if study.hard_data.n else 1.0))
            last = min(first + at_once, n)
            if scale == p.scale:
                simulate_tiles(
                    first, last, n_columns, split_of, oriented, data[scale], ti.proportions, search,
                    rng, counts, grid, sources, places,
                )  # fmt: skip
            else:
                refine_tiles(
                    first, last, n_columns, split_of, oriented.splits,
                    image.scaled(path.orientation, scale), image.bits(path.orientation, scale),
                    data[scale], template >> scale, p.overlap_size >> scale, p.refine, counts,
                    grid, sources, places,
                )  # fmt: skip
    return to_grid(grid, sources, path, ti.shape)


def make_plan(study: Study, template: int, image: PreparedImage, rng: np.random.Generator) -> Plan:
    """Draw where the path starts, and turn and place everything along it."""
    p = study.parameters
    orientation = int(rng.integers(N_ORIENTATIONS)) if p.random_path else 0
    oriented = image.oriented(orientation, template)
    path = make_path(study.grid.shape, orientation, template, p.overlap_size)
    data = tuple(_data_at(scale, study, path) for scale in range(p.scale + 1))
    split_of = split_tiles(
        path.n_rows, path.n_columns, oriented.splits, data[0], template, p.overlap_size
    )
    return Plan(path, oriented, _search(p, template, oriented), data, split_of)


def _data_at(scale: int, study: Study, path: RasterPath) -> PlacedData:
    """Return the data in the path frame at a scale, as far as they are told there.

    Data that only steer are told to the search alone, each as the first cell of its block.
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
    """Return a grid as it lies in the world, and its sources as flat indices in the TI itself."""
    rows, columns = path.shape
    if sources.size:
        numbers = np.arange(image_shape[0] * image_shape[1], dtype=np.int32).reshape(image_shape)
        oriented = np.ascontiguousarray(to_path(numbers, path.orientation))
        sources = oriented.ravel()[sources]
    return (
        np.ascontiguousarray(from_path(grid[:rows, :columns], path.orientation)),
        np.ascontiguousarray(from_path(sources[:rows, :columns], path.orientation)),
    )


def _tiles_a_call(oriented: OrientedImage, search: Search) -> int:
    cells = 2 * search.template * search.overlap * len(oriented.pyramid.sums)
    terms = cells // search.block_size**2 * oriented.energies[0, 0].size
    return min(max(TERMS_A_CALL // terms, 1), MAX_TILES_A_CALL)


def _laid_a_call(template: int) -> int:
    return min(max(CELLS_A_CALL // template**2, 1), MAX_TILES_A_CALL)


def _search(p: Parameters, template: int, oriented: OrientedImage) -> Search:
    """Return the parameters in cells of the grid that is searched: the coarsest."""
    unit = 2 ** (p.level - p.scale)
    planes = 1 if len(oriented.pyramid.sums) == 1 else 2  # in which a wrong cell counts
    # A coarse cell stands for 4^scale cells and for 2^scale along a boundary: counted as one it
    # leaves shapes broken, counted as 4^scale it leaves most data to mending.
    cell_cost = unit * unit * planes / 2**p.scale
    return Search(
        template >> p.scale, p.overlap_size >> p.scale, unit,
        min(p.n_candidates, oriented.energies[0, 0].size), p.co_template, p.search_fraction,
        p.refine, p.match_proportions, cell_cost, cell_cost * (1 if p.exact_data else STRICT),
        p.location_weight * cell_cost * 2 * p.template_size * p.overlap_size / 4**p.scale,
        p.exact_data,
    )  # fmt: skip


def draw_template(p: Parameters, shape: tuple[int, int], rng: np.random.Generator) -> int:
    """Return T, or a size within the share that `template_variation` allows."""
    if p.template_variation == 0:
        return p.template_size
    low = max(round(p.template_size * (1 - p.template_variation)), 2 * p.overlap_size, 4)
    high = min(round(p.template_size * (1 + p.template_variation)), *shape, MAX_TEMPLATE)
    sizes = legal_sizes(p.level, low, high)
    return sizes[int(rng.integers(len(sizes)))]
