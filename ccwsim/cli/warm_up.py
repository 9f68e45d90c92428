"""The command `warm-up`: compile the kernels now, so that no first run waits for them."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ccwsim.engine.kernels import FOLDER
from ccwsim.metrics import connectivity, etype, variogram
from ccwsim.model.ensemble import Ensemble
from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate

SIZE = 64
"""Side of the training image and of the grid."""

STUDIES = {
    "search and mending, 16-bit scores": Parameters(16, 4, 2),
    "search, 32-bit scores": Parameters(32, 16, 3),
    "search, levels 4 to 6": Parameters(32, 16, 4),
    "finer scales of ms-ccsim": Parameters(16, 4, 2, method="ms-ccsim"),
}
"""One study for each set of types that kernels are compiled for."""


def add_command(commands: Any) -> None:
    """Add `warm-up` to the commands."""
    parser = commands.add_parser(
        "warm-up", help="compile the kernels now, for instance while an image is built",
        usage="python -m ccwsim warm-up [options]",
        description="Compile all kernels that simulations and the first screen of the dashboard "
        "need, and keep them; what is compiled already takes no time.", allow_abbrev=False,
    )  # fmt: skip
    parser.add_argument(
        "-q", "--quiet", action="store_true", help="say nothing unless something is wrong"
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run every kernel once on little, and say how long each part took; return 0."""
    say: Callable[[str], None] = (lambda _: None) if options.quiet else _print
    start = time.perf_counter()
    ensemble = None
    for name, parameters in STUDIES.items():
        before = time.perf_counter()
        ensemble = _simulated(parameters)
        say(f"{time.perf_counter() - before:6.1f} s  {name}")
    before = time.perf_counter()
    if ensemble is not None:
        _measure(ensemble)
    say(f"{time.perf_counter() - before:6.1f} s  statistics of the first screen")
    say(f"{time.perf_counter() - start:6.1f} s  in all; compiled kernels are kept in {FOLDER}")
    return 0


def _simulated(parameters: Parameters) -> Ensemble:
    """Return realizations with data that not all can be met, so that mending runs too."""
    rng = np.random.default_rng(0)
    image = TrainingImage(rng.integers(0, 2, (SIZE, SIZE)))
    flat = rng.choice(SIZE * SIZE, 200, replace=False)
    data = HardData(np.stack(np.divmod(flat, SIZE), axis=1), rng.integers(0, 2, len(flat)))
    return simulate(image, (SIZE, SIZE), parameters, data)


def _measure(ensemble: Ensemble) -> None:
    """Work out the curves and maps that the dashboard shows first."""
    images = (ensemble.indices, ensemble.training_image.indices)
    etype(ensemble.indices, ensemble.training_image.n_facies)
    for image in images:
        for direction in ("E-W", "N-S"):
            lags = np.arange(10)
            variogram(image, 1, direction, lags)
            connectivity(image, 1, direction, lags)


def _print(line: str) -> None:
    print(line, file=sys.stderr)
