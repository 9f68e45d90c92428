"""The command `warm-up`: compile the kernels now, so that no first run waits for them."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from ccwsim.cli.options import quiet

if TYPE_CHECKING:
    from ccwsim.model.ensemble import Ensemble
    from ccwsim.model.parameters import Parameters

SIZE = 64
"""Side of the training image and of the grid."""

STUDIES = {
    "search and local re-simulation, 16-bit scores": (16, 4, 2, "ccwsim"),
    "search, 32-bit scores": (32, 16, 3, "ccwsim"),
    "search, levels 4 to 6": (32, 16, 4, "ccwsim"),
    "finer scales of ms-ccsim": (16, 4, 2, "ms-ccsim"),
}
"""Template, overlap, level and method of a study for each set of types that kernels have."""


@click.command("warm-up")
@quiet
def command(quiet: bool) -> None:
    """Compile the kernels now, for instance while an image is built.

    Compiles all kernels that simulations and the first screen of the dashboard need, and keeps
    them; what is compiled already takes no time.
    """
    from ccwsim.engine.kernels import FOLDER
    from ccwsim.model.parameters import Parameters

    start = time.perf_counter()
    ensembles = []

    def timed(name: str, work: Callable[[], object]) -> None:
        before = time.perf_counter()
        work()
        if not quiet:
            click.echo(f"{time.perf_counter() - before:6.1f} s  {name}", err=True)

    for name, (template, overlap, level, method) in STUDIES.items():
        p = Parameters(template, overlap, level, method=method)
        timed(name, lambda p=p: ensembles.append(_simulated(p)))
    timed("statistics of the first screen", lambda: _measure(ensembles[-1]))
    if not quiet:
        total = time.perf_counter() - start
        click.echo(f"{total:6.1f} s  in all; compiled kernels are kept in {FOLDER}", err=True)


def _simulated(parameters: Parameters) -> Ensemble:
    """Return realizations with contradictory data, so that local re-simulation runs too."""
    import numpy as np

    from ccwsim.model.hard_data import HardData
    from ccwsim.model.training_image import TrainingImage
    from ccwsim.run.simulation import simulate

    rng = np.random.default_rng(0)
    image = TrainingImage(rng.integers(0, 2, (SIZE, SIZE)))
    flat = rng.choice(SIZE * SIZE, 200, replace=False)
    data = HardData(np.stack(np.divmod(flat, SIZE), axis=1), rng.integers(0, 2, len(flat)))
    return simulate(image, (SIZE, SIZE), parameters, data)


def _measure(ensemble: Ensemble) -> None:
    """Compute the curves and maps that the dashboard shows first."""
    import numpy as np

    from ccwsim.metrics import connectivity, etype, variogram

    etype(ensemble)
    image = ensemble.training_image
    for images in (ensemble, image):
        for direction in ("E-W", "N-S"):
            variogram(images, image.codes[1], direction, np.arange(10))
            connectivity(images, image.codes[1], direction, np.arange(10))
