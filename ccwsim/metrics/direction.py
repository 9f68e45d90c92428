"""The local direction of geobodies, by the structure tensor of a smoothed facies."""

import numpy as np

from ccwsim import CCWSIMError, Ensemble, TrainingImage
from ccwsim.metrics.lags import Direction
from ccwsim.metrics.stack import Images, as_stack
from ccwsim.model import (
    UNKNOWN,
    ArrayLike,
    Floats,
    check_number,
    describe_shape,
    refused,
    smallest_box,
    window_shape,
)

GRADIENT_SIGMA = 1.5  # standard deviation, in cells, of the Gaussian whose gradients are taken
AVERAGING_SIGMA = 24.0
"""Standard deviation, in cells, of the Gaussian over which directions are averaged."""
MAX_SPREAD = 25.0  # mean difference, in degrees, from a main direction above which none prevails
HALF_WINDOW = 256  # half of the side, in cells, of the largest window used for curves


def local_direction(
    images: Images, facies: int | str | None = None, width: float = AVERAGING_SIGMA
) -> Floats:
    """Return the mean direction of geobodies around each cell of maps.

    The direction is the axis of least change of the structure tensor (Bigün and Granlund 1987),
    averaged over all images. `width` is the standard deviation of the averaging, 1 … 1000 cells.

    Returns
    -------
    ndarray, shape (ny, nx)
        Azimuth in degrees clockwise from north, 0 … 180; NaN in unknown and inactive cells.

    Examples
    --------
    >>> east = np.tile([[0], [0], [0], [1], [1], [1]], (10, 60))
    >>> local_direction(east).mean().round(3)
    np.float64(90.0)
    """
    width = check_number("width", width, 1.0, 1000.0)
    stack = as_stack(images)
    known = stack.indices.min(axis=0) != UNKNOWN
    box, directions = smallest_box(known), np.full(stack.shape, np.nan)
    if len(stack.shape) != 2 or min(window_shape(box)) < 2:
        raise refused("direction_of_maps", shape=describe_shape(window_shape(box)))
    from scipy.ndimage import gaussian_filter  # slow to import

    index = len(stack.codes) - 1 if facies is None else stack.index_of(facies)
    inside, twice = known[box], np.zeros(window_shape(box), complex)
    # share of known cells around each cell
    near = np.maximum(gaussian_filter(inside.astype(float), GRADIENT_SIGMA), 1e-9)
    for layer in stack.indices[(slice(None), *box)]:
        gy, gx = np.gradient(gaussian_filter((layer == index) * 1.0, GRADIENT_SIGMA) / near)
        tensor = gaussian_filter(inside * (gx + 1j * gy) ** 2, width)
        twice += tensor / np.maximum(np.abs(tensor), 1e-300)
    across = np.degrees(np.angle(twice)) / 2  # counterclockwise from east, across the geobodies
    directions[box] = np.where(inside, (-across) % 180, np.nan)
    return directions  # clockwise from north, along the geobodies


def main_direction(
    image: TrainingImage | ArrayLike,
    facies: int | str | None = None,
    width: float = AVERAGING_SIGMA,
) -> tuple[float, float]:
    """Return the main direction of an image, and the mean difference of local directions from it.

    Both are in degrees: the azimuth clockwise from north, 0 … 180, and the mean absolute difference
    of `local_direction` from it, 45 if all directions are equally frequent. An image with a large
    difference cannot follow a map of angles. In a volume, directions are those of the middle layer.

    Examples
    --------
    >>> main_direction(np.tile([[0], [0], [0], [1], [1], [1]], (10, 60)))
    (90.0, 0.0)
    """
    image = TrainingImage.of(image)
    facies = None if facies is None else image.code_of(facies)
    layer = image.array if image.n_dimensions == 2 else image.array[len(image.array) // 2]
    local = local_direction(as_stack(layer, image.codes), facies, width)
    local = local[~np.isnan(local)]
    main = np.degrees(np.angle(np.exp(2j * np.radians(local)).mean())) / 2 % 180
    off = np.abs((local - main + 90) % 180 - 90)
    return round(float(main), 6) % 180, round(float(off.mean()), 6)


def along_and_across(image: TrainingImage, facies: int | str) -> tuple[Direction, Direction] | None:
    """Return the directions along and across the geobodies of a map, for curves.

    The main direction of the middle of the map, at most 512 × 512 cells, is rounded to 5 degrees; a
    direction along an axis has its name. The result is None if no direction prevails: if local
    directions differ from the main one by more than 25 degrees on average, or there is no geobody.

    Examples
    --------
    >>> stripes = np.tile([[0], [0], [0], [1], [1], [1]], (10, 60))
    >>> along_and_across(TrainingImage(stripes), 1)
    ('E-W', 'N-S')
    """
    window = (slice(max(0, n // 2 - HALF_WINDOW), n // 2 + HALF_WINDOW) for n in image.shape)
    middle = image.array[tuple(window)]
    side = min(middle.shape)
    if side < 2 or len(np.unique(middle == facies)) < 2:
        return None
    # in a small image, directions that are averaged over a wide area would be equal everywhere
    main, spread = main_direction(middle, facies, max(min(AVERAGING_SIGMA, side / 10), 1.0))
    names: dict[int, Direction] = {0: "N-S", 90: "E-W"}
    azimuths = (round(main / 5 + turn) * 5 % 180 for turn in (0, 18))
    ways: list[Direction] = [names.get(azimuth, float(azimuth)) for azimuth in azimuths]
    return (ways[0], ways[1]) if spread <= MAX_SPREAD else None


def direction_error(ensemble: Ensemble, facies: int | str | None = None) -> Floats:
    """Return how much directions differ from the angles that a simulation asks for.

    The mean direction of all realizations is compared with the direction of the training image,
    turned by `Secondary.angle`.

    Returns
    -------
    ndarray, shape (ny, nx)
        Difference in degrees, −90 … 90, positive if geobodies are turned too far clockwise; NaN in
        inactive cells.

    Examples
    --------
    >>> from ccwsim import Parameters, Secondary, simulate
    >>> stripes = np.tile([[0], [0], [0], [1], [1], [1]], (20, 120))
    >>> e = simulate(stripes, (60, 70), Parameters(24, 6, 1), seed=1, n_realizations=4,
    ...              secondary=Secondary(angle=30.0))
    >>> bool(abs(direction_error(e)[20:40, 20:50]).mean() < 5)
    True
    """
    angle = ensemble.study.secondary_or_empty.angle
    if angle is None:
        raise CCWSIMError("direction_error needs angles: simulate with Secondary(angle=...)")
    wanted = main_direction(ensemble.training_image, facies)[0] + angle
    return (local_direction(ensemble, facies) - wanted + 90) % 180 - 90
