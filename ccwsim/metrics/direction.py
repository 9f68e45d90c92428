"""The local direction of bodies, by the structure tensor of a smoothed facies."""

import numpy as np

from ccwsim import CCWSIMError, Ensemble
from ccwsim.metrics.stack import Images, as_stack
from ccwsim.model.arrays import Floats, check_number

EDGE = 1.5  # standard deviation, in cells, of the Gaussian whose gradients are taken
WIDTH = 24.0
"""Standard deviation, in cells, of the Gaussian over which directions are averaged."""


def local_direction(images: Images, facies: int | None = None, width: float = WIDTH) -> Floats:
    """Return the mean direction of bodies around each cell of maps.

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
    if len(stack.shape) != 2:
        raise CCWSIMError("local_direction needs maps; give one layer of a volume")
    from scipy.ndimage import gaussian_filter  # slow to import

    index = len(stack.codes) - 1 if facies is None else stack.index_of(facies)
    twice = np.zeros(stack.shape, complex)
    for k in range(len(stack)):
        indicator = (stack.volume(k)[0] == index).astype(float)
        gy, gx = np.gradient(gaussian_filter(indicator, EDGE))
        found = gaussian_filter((gx + 1j * gy) ** 2, width)
        twice += found / np.maximum(np.abs(found), 1e-300)
    across = np.degrees(np.angle(twice)) / 2  # counterclockwise from east, across the bodies
    return (-across) % 180  # along them, clockwise from north


def direction_error(ensemble: Ensemble, facies: int | None = None) -> Floats:
    """Return how much directions differ from the angles that a simulation asks for.

    The mean direction of all realizations is compared with the direction of the training image,
    turned by `Secondary.angle`.

    Returns
    -------
    ndarray, shape (ny, nx)
        Difference in degrees, −90 … 90, positive if bodies are turned too far clockwise.

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
    image = local_direction(ensemble.training_image, facies)
    own = np.exp(2j * np.radians(image)).mean()
    wanted = np.degrees(np.angle(own)) / 2 + angle
    return (local_direction(ensemble, facies) - wanted + 90) % 180 - 90
