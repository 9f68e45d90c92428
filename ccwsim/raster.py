"""Algorithm 1 of the paper: patch after patch along the raster path, compiled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.kernels import kernel
from ccwsim.parameters import MAX_TEMPLATE, Parameters, legal_sizes
from ccwsim.prepared_image import PreparedImage, TurnedImage
from ccwsim.stages.candidates import best_places, draw_index, keep_within
from ccwsim.stages.conditioning import (
    SLACK,
    add_missed,
    choose_split,
    data_ahead,
    place_data,
    start_totals,
)
from ccwsim.stages.cut import UNKNOWN, keep_old, paste, paste_sources
from ccwsim.stages.path import (
    N_ORIENTATIONS,
    cells_to_path_frame,
    from_path_frame,
    n_tiles,
    to_path_frame,
)
from ccwsim.stages.proportions import closest_to_target
from ccwsim.stages.refinement import refine_place
from ccwsim.stages.similarity import LEFT, TOP, overlap_terms, score_places
from ccwsim.study import Study
from ccwsim.workers import Watch

TERMS_A_CALL = 500_000_000
"""Terms of scores summed between two looks at progress and cancel: some hundredths of a second."""
MOST_TILES_A_CALL = 512
RASTER_SHARE = 0.7
"""What the raster takes of the time of a realization with data, for the progress bar."""


class Search(NamedTuple):
    """The parameters as the compiled conductor needs them, lengths in cells."""

    template: int
    overlap: int
    unit: int
    n_candidates: int
    co_template: int
    share: float
    refine: bool
    match: bool


class Room(NamedTuple):
    """Arrays to work in, made once a call."""

    scores: NDArray[np.signedinteger]
    totals: NDArray[np.int64]
    row_best: NDArray[np.int64]
    places: NDArray[np.int64]
    terms: NDArray[np.int64]
    kept: NDArray[np.bool_]


@kernel
def simulate_tiles(
    first, last, n_columns, turned, data, proportions, search, rng, counts, grid, sources
):
    """Simulate tiles `first` to `last` − 1 of the raster path (Algorithm 1, lines 3 to 11).

    A tile with more data than a patch can honour is simulated as smaller patches.

    Parameters
    ----------
    first, last, n_columns : int
        Tiles in the order of the path, and how many a row has.
    turned : TurnedImage
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
    """
    template = search.template
    scores = np.zeros_like(turned.energies[0, 0])
    n_terms = 2 * len(turned.pyramid.sums) * template * search.overlap // search.unit**2
    room = Room(
        scores,
        np.empty(scores.shape, np.int64),
        np.empty(len(scores), np.int64),
        np.empty((search.n_candidates, 2), np.int64),
        np.empty((4, n_terms), np.int64),
        np.empty((template, template), np.bool_),
    )
    step = template - search.overlap
    for tile in range(first, last):
        row, column = divmod(tile, n_columns)
        y0, x0 = row * step, column * step
        split = choose_split(turned.splits, data, y0, x0, template, search.overlap)
        parts = turned.splits[split]
        for part in range(parts * parts):
            down, along = divmod(part, parts)
            shape = (LEFT if column + along > 0 else 0) | (TOP if row + down > 0 else 0)
            simulate_patch(
                y0 + down * (step // parts),
                x0 + along * (step // parts),
                step // parts + search.overlap,
                shape,
                turned.energies[split, shape],
                turned.pyramid,
                data,
                proportions,
                search,
                rng,
                room,
                counts,
                grid,
                sources,
            )


@kernel
def simulate_patch(
    y0,
    x0,
    size,
    shape,
    energy,
    pyramid,
    data,
    proportions,
    search,
    rng,
    room,
    counts,
    grid,
    sources,
):
    """Simulate one patch (Algorithm 1, lines 4 to 10): score, draw, refine, cut, paste.

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
    image, sums, phases = pyramid
    overlap, unit = search.overlap, search.unit
    scores, totals, places = room.scores, room.totals, room.places
    n_terms = overlap_terms(grid, y0, x0, size, overlap, unit, shape, len(sums), room.terms)
    score_places(sums, room.terms, n_terms, energy, scores)
    ahead = search.co_template * size
    has_data = data_ahead(data, y0, x0, ahead)
    if has_data:
        start_totals(scores, search.share, totals)
        unit_cost = unit * unit * (1 if len(sums) == 1 else 2)
        add_missed(phases, grid, data, y0, x0, size, ahead, proportions, unit_cost, totals)
        best_places(totals, search.n_candidates, rng, room.row_best, places)
        candidates = places[: keep_within(totals, places, SLACK * unit_cost)]
    else:
        best_places(scores, search.n_candidates, rng, room.row_best, places)
        candidates = places
    if search.match:
        drawn = closest_to_target(image, candidates, unit, size, counts, proportions, rng)
    else:
        drawn = draw_index(rng, len(candidates))
    ty, tx = candidates[drawn, 0] * unit, candidates[drawn, 1] * unit
    if search.refine and unit > 1:
        ty, tx = refine_place(
            image, grid, data.facies, has_data, y0, x0, size, overlap, shape, unit, ty, tx
        )
    patch = image[ty : ty + size, tx : tx + size]
    kept = room.kept[:size, :size]
    keep_old(grid, data.facies, patch, y0, x0, overlap, shape, kept)
    paste(patch, kept, shape, overlap, counts, y0, x0, grid)
    if sources.size:
        paste_sources(ty, tx, image.shape[1], kept, y0, x0, sources)


def simulate_raster(
    study: Study,
    template: int,
    image: PreparedImage,
    keep_sources: bool,
    rng: np.random.Generator,
    watch: Watch,
) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """Return a realization before its data are mended, and where its cells came from."""
    p = study.parameters
    orientation = int(rng.integers(N_ORIENTATIONS)) if p.random_path else 0
    turned = image.turned(orientation, template)
    shape = study.grid.shape[:: -1 if orientation & 4 else 1]
    n_rows, n_columns = (n_tiles(length, template, p.overlap_size) for length in shape)
    step = template - p.overlap_size
    full = n_rows * step + p.overlap_size, n_columns * step + p.overlap_size
    grid = np.full(full, UNKNOWN, np.uint8)
    sources = np.zeros(full if keep_sources else (0, 0), np.int32)
    cells = cells_to_path_frame(study.hard_data.cells, study.grid.shape, orientation)
    data = place_data(cells, study.facies_of_data, full)
    search = _search(p, template, turned)
    counts = np.zeros(study.training_image.n_facies, np.int64)
    n = n_rows * n_columns
    at_once = _tiles_a_call(turned, search)
    for first in range(0, n, at_once):
        watch.report(first / n * (RASTER_SHARE if study.hard_data.n else 1.0))
        simulate_tiles(
            first, min(first + at_once, n), n_columns, turned, data,
            study.training_image.proportions, search, rng, counts, grid, sources,
        )  # fmt: skip
    if keep_sources:
        sources = _in_world(sources, study.training_image.shape, orientation)
    rows, columns = shape
    return (
        np.ascontiguousarray(from_path_frame(grid[:rows, :columns], orientation)),
        np.ascontiguousarray(from_path_frame(sources[:rows, :columns], orientation)),
    )


def _in_world(
    sources: NDArray[np.int32], shape: tuple[int, int], orientation: int
) -> NDArray[np.int32]:
    """Return the flat index in the TI itself for flat indices in the turned TI."""
    numbers = np.arange(shape[0] * shape[1], dtype=np.int32).reshape(shape)
    return np.ascontiguousarray(to_path_frame(numbers, orientation)).ravel()[sources]


def _tiles_a_call(turned: TurnedImage, search: Search) -> int:
    cells = 2 * search.template * search.overlap * len(turned.pyramid.sums)
    terms = cells // search.unit**2 * turned.energies[0, 0].size
    return min(max(TERMS_A_CALL // terms, 1), MOST_TILES_A_CALL)


def _search(p: Parameters, template: int, turned: TurnedImage) -> Search:
    n_places = turned.energies[0, 0].size
    return Search(
        template, p.overlap_size, 2**p.level, min(p.n_candidates, n_places),
        p.co_template, p.search_fraction, p.refine, p.match_proportions,
    )  # fmt: skip


def draw_template(p: Parameters, shape: tuple[int, int], rng: np.random.Generator) -> int:
    """Return T, or a size within the share that `template_variation` allows."""
    if p.template_variation == 0:
        return p.template_size
    low = max(round(p.template_size * (1 - p.template_variation)), 2 * p.overlap_size, 4)
    high = min(round(p.template_size * (1 + p.template_variation)), *shape, MAX_TEMPLATE)
    sizes = legal_sizes(p.level, low, high)
    return sizes[int(rng.integers(len(sizes)))]
