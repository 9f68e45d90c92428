"""An estimate of the memory that a run takes, before it starts: a little too high, not too low."""

from __future__ import annotations

from math import prod

import numpy as np

from ccwsim.engine.lengths import ScaledLengths, lengths_of, templates
from ccwsim.engine.stages.conditioning import legal_splits
from ccwsim.engine.stages.path import N_ORIENTATIONS
from ccwsim.engine.stages.similarity import score_type
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
    cells, threads = prod(study.grid.shape), min(n, n_workers or n_cores())
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
    usual = lengths_of(p, study.grid.shape)
    sizes = templates(p, image.shape) if p.template_variation else [usual.template]
    oriented = sum(_of_oriented(study, usual._replace(template=size)) for size in sizes)
    ways = (2 if usual.volume else 1) * N_ORIENTATIONS
    making = 8 * image.indices.size  # energies are summed up in whole numbers of 64 bits
    return (ways if p.random_path else 1) * oriented + making


def _of_oriented(study: Study, lengths: ScaledLengths) -> int:
    p, image = study.parameters, study.training_image
    own = lengths.at_scale(p.scale)
    cells = image.indices.size / prod(own.unit)
    correlation = p.similarity == "correlation"
    n_planes = 1 if not correlation and image.n_facies <= 2 else image.n_facies
    locations = cells / prod(own.block)
    split = p.exact_data and study.hard_data.n > own.max_data
    n_splits = len(legal_splits(own.template, own.overlap)) if split else 1
    score = np.dtype(score_type(own.level, own.template, own.overlap, correlation)).itemsize
    sums = locations * n_planes * (1 if prod(own.block) <= 255 else 2)
    bits = cells * max(image.n_facies - 1, 1).bit_length() / 8
    shapes = 8 if own.overlap[0] else 4
    return int(3 * cells + bits + sums + n_splits * shapes * locations * score)
