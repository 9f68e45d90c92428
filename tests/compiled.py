"""Compile the kernels that several tests need: `python -m tests.compiled`.

This only saves time: the first test that needs a missing kernel compiles it, but workers and
servers of browser tests that need a kernel at the same time would each compile it.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ccwsim import HardData, Parameters, Secondary, TrainingImage, metrics, simulate
from ccwsim.engine.compilation import SOON, ask_for, await_all
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.engine.realization import walk_through
from ccwsim.engine.trace import Trace
from ccwsim.experiments.warm_up import usual_work
from ccwsim.model.grid import Grid
from ccwsim.model.study import Study
from ccwsim.model.watch import Watch

MAP, VOLUME = (64, 64), (32, 32, 32)
BASE = Parameters(16, 4, 2)


def noise(shape: tuple[int, ...] = MAP, seed: int = 0) -> TrainingImage:
    return TrainingImage(np.random.default_rng(seed).integers(0, 2, shape))


def data(shape: tuple[int, ...] = MAP) -> HardData:
    """Return data that contradict each other, so that the raster pass misses some of them."""
    rng = np.random.default_rng(1)
    cells = np.argwhere(rng.random(shape) < 0.05)
    return HardData(cells, rng.integers(0, 2, len(cells)))


def study(
    parameters: Parameters, shape: tuple[int, ...] = MAP, secondary: Secondary | None = None
) -> Study:
    return Study(noise(shape), Grid.of(shape), parameters, data(shape), secondary=secondary)


OTHERS = (
    study(Parameters(16, 4, 2, similarity="correlation")),
    study(BASE, secondary=Secondary(probabilities={1: 0.3})),
    study(Parameters(8, 2, 1), VOLUME),  # 16-bit scores
)
"""Studies that need kernels with unusual types of arguments."""


def search(one: Study) -> Callable[[], None]:
    return lambda: walk_through(PreparedImage(one), Watch())


def follow(level: int) -> None:
    """Compute patches one by one, like the page How it works."""
    Trace(study(Parameters(16, 4, level)), 0).at(3)


def measure() -> None:
    """Compute all measures of images, of stored indices as well as of arrays of codes."""
    image = noise()
    for stack in (np.stack([noise(seed=seed).indices for seed in range(3)]), image.indices):
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
    ensemble = simulate(image, MAP, BASE, data(), 3, keep_sources=True)
    metrics.judge(ensemble)
    if ensemble.sources is not None:
        metrics.copying(ensemble.sources[0], MAP)
    stack = np.concatenate([ensemble.indices, image.indices[None]])
    metrics.divergences(metrics.pyramid_histograms(stack))
    metrics.fit_data(image, data(), MAP, n_null=10, parameters=BASE)


def main() -> None:
    """Compile kernels of studies in other processes, then the remaining kernels in this process."""
    requests = [
        request
        for work in (*usual_work().values(), *map(search, OTHERS))
        for request in ask_for(work, SOON)
    ]
    await_all(requests)
    with ThreadPoolExecutor() as pool:
        work = [pool.submit(judge), pool.submit(measure)]
        work += [pool.submit(follow, level) for level in (0, 2)]
        for each in work:
            each.result()


if __name__ == "__main__":
    main()
