"""An estimate of the memory that a run needs, which is rather too high than too low."""

from math import prod

import numpy as np

from ccwsim.engine.copies import n_cells_of_copies
from ccwsim.engine.corrections.unseen_patterns import NUMBER_BITS, NUMBER_BITS_VOLUME
from ccwsim.engine.lengths import ScaledLengths, lengths_of, templates
from ccwsim.engine.prepared_image import (
    MAX_PARTS_BYTES,
    PreparedImage,
    largest_code,
    n_planes,
)
from ccwsim.engine.realization import is_compiled, repairs
from ccwsim.engine.stages.path import N_ORIENTATIONS
from ccwsim.engine.stages.pyramid import block_sum_type
from ccwsim.engine.stages.similarity import score_type, sum_type
from ccwsim.jobs.limits import Demand
from ccwsim.model import Study
from ccwsim.system.machine import n_cores

GRIDS_AT_WORK = 2
"""Number of 1-byte grids per thread: one in path coordinates and one in grid coordinates."""
ORIGINS_BYTES = 14
"""Bytes per cell of copies for origins, known cells and the running numbers of unknown cells."""
GRIDS_OF_DATA = 2
"""Number of grids with the hard data: one in path coordinates and one in grid coordinates."""
BYTES_A_DATUM = 200
MAKING = 40  # bytes per image block for 64-bit sums while block energies are computed
LOOKING_AROUND = 6  # bytes per image cell while thresholds for isolated data are computed
TOTALS_AND_PLACES = 24  # bytes per location for total scores and for the indices of good locations
KERNELS = 160_000_000
"""Bytes of compiled code and its compiler, which a process loads for the first study of a kind."""
MEMORY_MARGIN = 1.25
MAPS_BYTES = 16
"""Bytes per grid cell for the maps of a page; `FACIES_BYTES` are added for each facies."""
FACIES_BYTES = 12


def footprint(study: Study, n: int, n_workers: int | None = None) -> int:
    """Return an estimate of the bytes that `simulate` needs, including the result."""
    n_cells, threads = study.grid.n_cells, min(n, n_workers or n_cores())
    grids = GRIDS_AT_WORK + (GRIDS_OF_DATA if study.hard_data.n else 0)
    kernels = 0 if is_compiled(PreparedImage(study)) else KERNELS
    return kernels + int(
        MEMORY_MARGIN
        * (
            _bytes_of_image(study, n, threads)
            + threads * (n_cells * grids + _bytes_of_search(study))
            + n * n_cells * (9 if study.training_image.values else 1)
            + study.hard_data.n * (BYTES_A_DATUM + 2 * n)
        )
    )


def demand_of(
    study: Study, n: int, n_kept: int | None = None, n_workers: int | None = None, copies: int = 1
) -> Demand:
    """Return the resources of a run, with `n_kept` realizations in memory, and of its page."""
    n_cells, image = study.grid.n_cells, study.training_image
    kept = n if n_kept is None else min(n, n_kept)
    in_codes = 0 if image.codes[-1] == image.n_facies - 1 else image.codes.itemsize
    n_bytes = footprint(study, kept, n_workers) + n_cells * kept * (copies - 1 + in_codes)
    page = n_cells * (MAPS_BYTES + FACIES_BYTES * image.n_facies)
    return Demand(n_cells * n, study.hard_data.n, n_bytes + page)


def _bytes_of_image(study: Study, n: int, n_threads: int) -> int:
    """Return the bytes of the prepared training image, for all orientations and template sizes."""
    p, image = study.parameters, study.training_image
    usual = lengths_of(p, study.grid.shape)[-1]
    sizes = templates(p, image.shape) if p.template_variation else [None]
    sizes = [lengths_of(p, study.grid.shape, size)[-1] for size in sizes]
    oriented = [_bytes_of_oriented(study, lengths) for lengths in sizes]
    orientations = (2 if usual.volume else 1) * N_ORIENTATIONS if p.random_path else 1
    drawn = min(n, orientations * len(oriented))
    making = MAKING * _n_blocks(study, usual)
    if study.hard_data.n and p.exact_data:
        making = max(making, LOOKING_AROUND * n_cells_of_copies(study))
    repair = _bytes_of_repair(study) if repairs(study) else 0
    if study.secondary and study.secondary.has_copies:
        repair += ORIGINS_BYTES * n_cells_of_copies(study)
    largest = max(oriented)
    repair += _bytes_of_guide(study, 0.0)  # maps of the grid, which are oriented later
    return min(drawn * largest, MAX_PARTS_BYTES + n_threads * largest) + int(making) + repair


def _bytes_of_repair(study: Study) -> int:
    """Return the bytes that seam repair needs for known patterns and running sums."""
    image, volume = study.training_image, len(study.grid.shape) == 3
    n_cells = n_cells_of_copies(study)
    blocks = n_cells / (8 if volume else 16)
    planes = 1 if image.n_facies <= 2 else image.n_facies
    patterns = 2**NUMBER_BITS_VOLUME / 8 if volume else 2 * 2**NUMBER_BITS / 8
    return int(patterns + (planes * 6 + MAKING) * blocks + 2 * n_cells)


def _bytes_of_oriented(study: Study, lengths: ScaledLengths) -> int:
    """Return the bytes of the prepared image in one orientation."""
    n_cells = n_cells_of_copies(study) / prod(lengths.cell_size)
    blocks = _n_blocks(study, lengths)
    bits = n_cells * max(study.training_image.n_facies - 1, 1).bit_length() / 8
    squares = blocks * _score_bytes(study, lengths)
    of_sums = block_sum_type(lengths.block).itemsize
    kind = sum_type(lengths.level, lengths.template, largest_code(study))
    of_running = 3 * np.dtype(kind).itemsize
    sums = n_planes(study) * blocks * (of_sums + of_running)
    return int(3 * n_cells + bits + squares + sums) + _bytes_of_guide(study, blocks)


def _bytes_of_guide(study: Study, blocks: float) -> int:
    """Return the bytes of the maps of secondary information in one orientation."""
    secondary, soft, several = study.secondary, 0, 0
    if secondary is not None:
        several = len(secondary.auxiliary)
        soft = study.training_image.n_facies - 1 if secondary.probabilities is not None else 0
    maps = soft + 3 * several + 4 * (max(study.parameters.location_weights) > 0)
    return int(maps * 4 * blocks + (soft + several) * 8 * study.grid.n_cells)


def _bytes_of_search(study: Study) -> int:
    """Return the bytes that a thread needs for the scores of locations."""
    lengths = lengths_of(study.parameters, study.grid.shape)[-1]
    rankings = 2 if study.hard_data.n else 1
    per_location = 3 * _score_bytes(study, lengths) + rankings * TOTALS_AND_PLACES
    return int(per_location * _n_blocks(study, lengths))


def _n_blocks(study: Study, lengths: ScaledLengths) -> float:
    """Return the approximate number of locations that are searched in the image."""
    return n_cells_of_copies(study) / prod(lengths.cell_size) / prod(lengths.block)


def _score_bytes(study: Study, lengths: ScaledLengths) -> int:
    level, template, overlap = lengths.level, lengths.template, lengths.overlap
    correlation = study.parameters.similarity == "correlation"
    kind = score_type(level, template, overlap, correlation, largest_code=largest_code(study))
    return np.dtype(kind).itemsize
