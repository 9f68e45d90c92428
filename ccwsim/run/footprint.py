"""An estimate of the memory that a run takes, before it starts: a little too high, not too low."""

from __future__ import annotations

import numpy as np

from ccwsim.engine.stages.conditioning import MAX_DATA, legal_splits
from ccwsim.engine.stages.path import N_ORIENTATIONS
from ccwsim.engine.stages.similarity import score_type
from ccwsim.model.parameters import legal_sizes
from ccwsim.model.study import Study
from ccwsim.system.workers import n_cores

GRIDS_AT_WORK = 2
"""Grids of one byte a cell that a thread needs: in path coordinates and in grid coordinates."""
GRIDS_OF_DATA = 2
"""With data: their positions in both."""
BYTES_A_DATUM = 200
MARGIN = 1.15


def footprint(
    study: Study, n: int, n_workers: int | None = None, keep_sources: bool = False
) -> int:
    """Return about how many bytes `simulate` takes for n realizations, with what it returns.

    The arguments are those of `simulate`.
    """
    cells, threads = study.grid.ny * study.grid.nx, min(n, n_workers or n_cores())
    bytes_a_cell = 5 if keep_sources else 1
    grids = GRIDS_AT_WORK * bytes_a_cell + (GRIDS_OF_DATA if study.hard_data.n else 0)
    per_datum = BYTES_A_DATUM + 2 * n
    return int(
        MARGIN
        * (
            _of_image(study)
            + threads * cells * grids
            + n * cells * bytes_a_cell
            + study.hard_data.n * per_datum
        )
    )


def _of_image(study: Study) -> int:
    """Return what the training image takes, in all orientations and template sizes drawn."""
    p, image = study.parameters, study.training_image
    low = max(round(p.template_size * (1 - p.template_variation)), 2 * p.overlap_size, 4)
    high = round(p.template_size * (1 + p.template_variation))
    sizes = legal_sizes(p.level, low, high) if p.template_variation else [p.template_size]
    oriented = sum(_of_oriented(study, size) for size in sizes)
    making = 8 * image.indices.size * 3  # the decomposition is computed in floats
    return (N_ORIENTATIONS if p.random_path else 1) * oriented + making


def _of_oriented(study: Study, template: int) -> int:
    p, image = study.parameters, study.training_image
    scale = p.scale
    level, cells = p.level - scale, image.indices.size / 4**scale
    n_planes = 1 if p.similarity == "ssd" and image.n_facies <= 2 else image.n_facies
    locations = cells / 4**level
    split = p.exact_data and study.hard_data.n > MAX_DATA
    size, overlap = template >> scale, p.overlap_size >> scale
    n_splits = len(legal_splits(size, overlap)) if split else 1
    score = np.dtype(score_type(level, size, overlap)).itemsize
    sums = locations * n_planes * (1 if 4**level <= 255 else 2)
    bits = cells * max(image.n_facies - 1, 1).bit_length() / 8
    return int(3 * cells + bits + sums + n_splits * 4 * locations * score)
