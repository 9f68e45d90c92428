"""How long a setting will take, roughly, before it is tried."""

from __future__ import annotations

from ccwsim.model.parameters import Parameters

CELL, PLACE, PRODUCT, DATUM = 2e-8, 1.2e-9, 1.2e-11, 1.8e-12
"""Seconds: to cut and paste a cell, to look at a place of the training image, to multiply two
coefficients, and to look for a window's cell in one of the training image; one core of 2024."""
JUDGING = 6e-8
"""Seconds a cell to judge a realization."""


def expected_seconds(
    parameters: Parameters,
    image_shape: tuple[int, int],
    grid_shape: tuple[int, int],
    n_facies: int = 2,
    n_data: int = 0,
) -> float:
    """Return the seconds that one realization will take about, judging it included.

    Right within a factor of about three; the relation between settings is what it is for.

    Examples
    --------
    >>> fine, coarse = Parameters(wavelet_level=1), Parameters(wavelet_level=3)
    >>> shapes = (256, 256), (512, 512)
    >>> expected_seconds(fine, *shapes) > expected_seconds(coarse, *shapes)
    True
    """
    p, shrunk = parameters, 2**parameters.level
    size, overlap = p.template_size, p.overlap_size
    cells, image_cells = grid_shape[0] * grid_shape[1], image_shape[0] * image_shape[1]
    n_tiles = cells / p.step**2
    places = 1.0
    for side in image_shape:
        places *= max(side - size, 0) / shrunk + 1
    planes = 1 if n_facies <= 2 else n_facies
    products = planes * (2 * size - overlap) * overlap / shrunk**2
    raster = n_tiles * (size**2 * CELL + places * (PLACE + products * PRODUCT))
    return raster + n_data * size**2 * image_cells * DATUM + cells * JUDGING
