"""The local direction of geobodies, by the structure tensor of a smoothed facies."""

import numpy as np
from numpy.typing import ArrayLike

from ccwsim import CCWSIMError, Ensemble, TrainingImage
from ccwsim.metrics.stack import Images, as_stack
from ccwsim.model.arrays import Floats, check_number, describe_shape
from ccwsim.model.errors import refused

EDGE = 1.5  # standard deviation, in cells, of the Gaussian whose gradients are taken
WIDTH = 24.0
"""Standard deviation, in cells, of the Gaussian over which directions are averaged."""


def local_direction(images: Images, facies: int | None = None, width: float = WIDTH) -> Floats:
    """Return the mean direction of geobodies around each cell of maps.

    The direction is the axis of least change of the structure tensor (Bigün and Granlund 1987),
    averaged over all images. `width` is the standard deviation of the averaging, 1 … 1000 cells.

    Returns
    -------
    ndarray, shape (ny, nx)
        Azimuth in degrees clockwise from north, 0 … 180.

    Examples
    --------
    >>> east = np.tile([[0], [0], [0], [1], [1], [1]], (10, 60))
    >>> local_direction(east).mean().round(3)
    np.float64(90.0)
    """
    width = check_number("width", width, 1.0, 1000.0)
    stack = as_stack(images)
    if len(stack.shape) != 2 or min(stack.shape) < 2:
        raise refused("direction_of_maps", shape=describe_shape(stack.shape))
    from scipy.ndimage import gaussian_filter  # slow to import

    index = len(stack.codes) - 1 if facies is None else stack.index_of(facies)
    twice = np.zeros(stack.shape, complex)
    for k in range(len(stack)):
        indicator = (stack.volume(k)[0] == index).astype(float)
        gy, gx = np.gradient(gaussian_filter(indicator, EDGE))
        tensor = gaussian_filter((gx + 1j * gy) ** 2, width)
        twice += tensor / np.maximum(np.abs(tensor), 1e-300)
    across = np.degrees(np.angle(twice)) / 2  # counterclockwise from east, across the geobodies
    return (-across) % 180  # clockwise from north, along the geobodies


def main_direction(
    image: TrainingImage | ArrayLike, facies: int | None = None
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
    layer = image.array if image.n_dimensions == 2 else image.array[len(image.array) // 2]
    local = local_direction(as_stack(layer, image.codes), facies)
    main = np.degrees(np.angle(np.exp(2j * np.radians(local)).mean())) / 2 % 180
    off = np.abs((local - main + 90) % 180 - 90)
    return round(float(main), 6) % 180, round(float(off.mean()), 6)


def direction_error(ensemble: Ensemble, facies: int | None = None) -> Floats:
    """Return how much directions differ from the angles that a simulation asks for.

    The mean direction of all realizations is compared with the direction of the training image,
    turned by `Secondary.angle`.

    Returns
    -------
    ndarray, shape (ny, nx)
        Difference in degrees, −90 … 90, positive if geobodies are turned too far clockwise.

    Examples
    --------
    >>> from ccwsim import Parameters, Secondary, simulate
    >>> stripes = np.tile([[0], [0], [0], [1], [1], [1]], (20, 120))
    >>> e = simulate(stripes, (60, 70), Parameters(24, 6, 1), seed=1, n_realizations=4,
    ...              secondary=Secondary(angle=30.0))
    >>> bool(abs(direction_error(e)[20:40, 20:50]).mean() < 5)
    True
    """
    angle = ensemble.secondary.angle if ensemble.secondary else None
    if angle is None:
        raise CCWSIMError("direction_error needs angles: simulate with Secondary(angle=...)")
    wanted = main_direction(ensemble.training_image, facies)[0] + angle
    return (local_direction(ensemble, facies) - wanted + 90) % 180 - 90
