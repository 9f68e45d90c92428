"""Compile the kernels of usual studies and of the first screens before the first use."""

import threading
from collections.abc import Callable
from contextlib import suppress

import numpy as np

from ccwsim import CCWSIMError, Grid, HardData, Parameters, TrainingImage
from ccwsim.engine.compilation import LATER, SOON, ask_for
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.realization import walk_through
from ccwsim.metrics import connectivity, etype, variogram
from ccwsim.model import Shape, Study, Watch

MAP_SHAPE, VOLUME_SHAPE = (64, 64), (32, 32, 32)  # shapes of the training images and grids
STUDIES = {
    "maps, 16-bit scores": (MAP_SHAPE, Parameters(16, 4, 2)),
    "maps, 32-bit scores": (MAP_SHAPE, Parameters(32, 16, 3)),
    "maps, levels 4 to 6": (MAP_SHAPE, Parameters(32, 16, 4)),
    "maps, finer scales of ms-ccsim": (MAP_SHAPE, Parameters(16, 4, 2, method="ms-ccsim")),
    "volumes": (VOLUME_SHAPE, Parameters(16, 4, 2)),
}
"""One study for each combination of the argument types of kernels."""


def usual_work() -> dict[str, Callable[[], None]]:
    """Return named computations that call all kernels of usual studies and of first screens."""
    return {
        "statistics of the first screen": _measure,
        **{name: _simulation(shape, p) for name, (shape, p) in STUDIES.items()},
    }


def compile_in_background() -> None:
    """Compile the kernels of `usual_work` in a thread; kernels of the first screen are first."""

    def ask() -> None:
        for k, work in enumerate(usual_work().values()):
            ask_for(work, LATER if k else SOON)

    threading.Thread(target=ask, daemon=True).start()


def _simulation(shape: Shape, parameters: Parameters) -> Callable[[], None]:
    """Simulate a small study whose contradictory data need local re-simulation."""
    rng = np.random.default_rng(0)
    image, grid = TrainingImage(rng.integers(0, 2, shape)), Grid.of(shape)
    cells = np.argwhere(rng.random(shape) < 0.05)
    study = Study(image, grid, parameters, HardData(cells, rng.integers(0, 2, len(cells))))
    return lambda: walk_through(PreparedImage(study), Watch())


def _measure() -> None:
    """Compute the curves and maps that the dashboard shows first."""
    image = TrainingImage(np.random.default_rng(0).integers(0, 2, (16, 16)))
    realizations = np.stack([image.indices, image.indices])
    with suppress(CCWSIMError):  # without compiled kernels, nothing is counted
        etype(realizations)
    for images in (realizations, image):
        for direction in ("E-W", "N-S"):
            variogram(images, 1, direction, np.arange(5))
            connectivity(images, 1, direction, np.arange(5))
