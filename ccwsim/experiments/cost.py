"""Estimate the CPU seconds of a realization on a typical core from a count of operations."""

from __future__ import annotations

from math import prod

from ccwsim.engine.corrections.resimulation import MAX_COMPARED
from ccwsim.engine.stages.conditioning import MAX_DATA
from ccwsim.model.arrays import Shape
from ccwsim.model.parameters import Parameters

PER_CELL = 2.5e-8  # seconds to cut and paste a cell of the grid
PER_LOCATION = 4e-10  # seconds to visit one location of the training image in the search
PER_PRODUCT = 1e-12  # mean seconds per overlap coefficient and location
PER_IMAGE_CELL = 6e-9  # seconds to rotate and prepare a cell of the training image
PER_DATUM_SEEN = 5e-11  # seconds to compare a datum with a location
PER_WINDOW_ROW = 3e-10  # seconds to compare a row of a re-simulated window with a location
N_MISSED = 4  # maximum number of re-simulated data in a tile; tiles with more data are split
PER_CELL_OF_VOLUME = 2e-7  # seconds to cut, paste and repair a cell of a volume
PER_LOCATION_OF_VOLUME = 1e-8  # seconds to compare an overlap with a location, by block sums
PER_DATUM_OF_VOLUME = 3e-4  # seconds to honour a datum of a volume
PER_DISORDERED_CELL = 1.2e-5  # seconds to repair a cell of an image without structure, at most
PER_JUDGED_CELL = 1e-7  # seconds to judge a cell of a realization, including copied pieces


def typical_seconds(
    parameters: Parameters,
    image_shape: Shape,
    grid_shape: Shape,
    n_facies: int = 2,
    n_data: int = 0,
    judged: bool = False,
    disorder: float = 0.0,
) -> float:
    """Return the CPU seconds to simulate (and judge) a realization on a typical core.

    It may be wrong by a factor of three; use it to compare settings. Seam repair needs `disorder`.
    """
    p = parameters
    repair = prod(grid_shape) * PER_DISORDERED_CELL * disorder if p.repair_seams else 0.0
    if len(grid_shape) == 3:
        return repair + _seconds_of_volume(p, image_shape, grid_shape, n_data, judged)
    size, overlap, level = (along_x for _, _, along_x in p.along(grid_shape))
    block_size, step = 2**level, size - overlap
    cells, locations = grid_shape[0] * grid_shape[1], 1.0
    for side in image_shape:
        locations *= max(side - size, 0) // block_size + 1
    tiles = max(cells / step**2, 1.0)
    dense = n_data * size**2 / (cells * MAX_DATA)
    patches = tiles * min(max(dense, 1.0), (step // overlap) ** 2)
    planes = 1 if n_facies <= 2 else n_facies
    products = planes * (2 * size - overlap) * overlap / block_size**2
    seen = n_data * (p.co_template * size / step) ** 2 * tiles / patches
    return (
        repair
        + cells * (PER_CELL + (PER_JUDGED_CELL if judged else 0.0))
        + patches * locations * (PER_LOCATION + products * PER_PRODUCT)
        + image_shape[0] * image_shape[1] * PER_IMAGE_CELL
        + seen * locations * PER_DATUM_SEEN
        + min(n_data, N_MISSED * tiles) * MAX_COMPARED * size * PER_WINDOW_ROW
    )


def _seconds_of_volume(
    parameters: Parameters, image_shape: Shape, grid_shape: Shape, n_data: int, judged: bool
) -> float:
    """Return the CPU seconds of a volume; at level 0, the search takes most of the time."""
    lengths, cells = parameters.along(grid_shape), prod(grid_shape)
    sides = zip(image_shape, lengths.template, lengths.level, strict=True)
    locations = prod(max(side - size, 0) // 2**level + 1 for side, size, level in sides)
    steps = (t - overlap for t, overlap in zip(lengths.template, lengths.overlap, strict=True))
    tiles = max(cells / prod(steps), 1.0)
    return (
        cells * (PER_CELL_OF_VOLUME + (PER_JUDGED_CELL if judged else 0.0))
        + tiles * locations * PER_LOCATION_OF_VOLUME
        + n_data * PER_DATUM_OF_VOLUME
    )
