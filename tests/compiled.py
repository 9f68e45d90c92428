"""Compile the kernels that tests need: `python -m tests.compiled`.

This only saves time. The first test that needs a missing kernel compiles it.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ccwsim import HardData, Parameters, TrainingImage, metrics, simulate
from ccwsim.engine.trace import Trace
from ccwsim.model.grid import Grid
from ccwsim.model.study import Study

SIZE = 64
BASE = Parameters(16, 4, 2)
OTHERS = (
    Parameters(32, 16, 3),  # 32-bit scores
    Parameters(32, 16, 4),  # other scores
    Parameters(16, 4, 2, method="ms-ccsim"),
    Parameters(16, 4, 2, similarity="correlation"),
)


def noise(seed: int = 0) -> TrainingImage:
    return TrainingImage(np.random.default_rng(seed).integers(0, 2, (SIZE, SIZE)))


def data() -> HardData:
    """Return data that contradict each other, so that the raster pass misses some of them."""
    rng = np.random.default_rng(1)
    flat = rng.choice(SIZE * SIZE, 200, replace=False)
    return HardData(np.stack(np.divmod(flat, SIZE), axis=1), rng.integers(0, 2, len(flat)))


def search(parameters: Parameters) -> None:
    simulate(noise(), (SIZE, SIZE), parameters, data())


def follow(level: int) -> None:
    """Compute patches one by one, like the page How it works."""
    study = Study(noise(), Grid(SIZE, SIZE), Parameters(16, 4, level), data(), 0)
    Trace(study, 0).at(3)


def measure() -> None:
    """Compute all measures of images, of stored indices as well as of arrays of codes."""
    image = noise()
    for stack in (np.stack([noise(seed).indices for seed in range(3)]), image.indices):
        metrics.etype(stack)
        metrics.geobody_statistics(stack, 1)
        metrics.transiograms(stack, None, "E-W", 5)
        for curve in (metrics.variogram, metrics.connectivity):
            curve(stack, 1, "E-W", 5)
    metrics.variogram(image.array, 1, "E-W", 5)
    metrics.etype(image.array)


def judge() -> None:
    """Compute the statistics of realizations on Validate, Compare and Sweep."""
    image = noise()
    ensemble = simulate(image, (SIZE, SIZE), BASE, data(), 3, keep_sources=True)
    metrics.judge(ensemble)
    if ensemble.sources is not None:
        metrics.copying(ensemble.sources[0], (SIZE, SIZE))
    stack = np.concatenate([ensemble.indices, image.indices[None]])
    metrics.divergences(metrics.pyramid_histograms(stack))


def main() -> None:
    """Start all computations at once; processes compile kernels while these threads wait."""
    with ThreadPoolExecutor() as pool:
        work = [pool.submit(search, parameters) for parameters in (BASE, *OTHERS)]
        work += [pool.submit(judge), pool.submit(measure)]
        work += [pool.submit(follow, level) for level in (0, 2)]
        for each in work:
            each.result()


if __name__ == "__main__":
    main()
