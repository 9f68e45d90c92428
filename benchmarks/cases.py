"""The studies in the table of `python -m benchmarks`, and the measurement of one study."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.memory import peak_megabytes
from benchmarks.reference import simulate_reference
from ccwsim import Grid, HardData, Parameters, TrainingImage, datasets, read_hard_data, simulate

LEVELS = (1, 2, 3, 0)
GRID = Grid(512, 512)
N_REALIZATIONS = 15
N_REFERENCE = 3


@dataclass(frozen=True)
class Case:
    """One row of the table: the level of the search, and whether the study has hard data."""

    level: int
    conditional: bool = False

    @property
    def parameters(self) -> Parameters:
        """Parameters of the case: T 32, OR 8, K 20, as in the paper."""
        return Parameters(wavelet_level=self.level)


@dataclass(frozen=True)
class Row:
    """Measurements of a case: CPU times in ms and memory in MB."""

    data: int
    level: int
    ms: float
    reference_ms: float | None
    memory_mb: float | None


CASES = tuple(Case(level, conditional) for conditional in (False, True) for level in LEVELS)


def load_study() -> tuple[TrainingImage, HardData]:
    """Return training image and data: those of the paper in CCWSIM_DATA, or bundled ones.

    Examples
    --------
    >>> image, data = load_study()
    >>> image.shape, data.n in (397, 400)
    ((256, 256), True)
    """
    folder = os.environ.get("CCWSIM_DATA")
    if not folder:
        return datasets.load("channels"), datasets.load_hard_data("channels_400_data")
    paper = Path(folder) / "paper"
    image = TrainingImage(np.load(paper / "ti_channel_256x256.npy"), name="the paper's channels")
    return image, read_hard_data(paper / "hd_channel_400_grid512x512.csv", GRID)


def compile_kernels() -> None:
    """Compile all kernels before the measurements."""
    for case in CASES:
        _warm_up(case, load_study()[0])


def measure(
    case: Case, n_realizations: int = N_REALIZATIONS, n_reference: int = N_REFERENCE
) -> Row:
    """Measure one case on one thread; call it in a separate process to measure its memory.

    The first realization of each of the 8 orientations also rotates the training image. This time
    hardly affects the median.
    """
    image, data = load_study()
    data = data if case.conditional else HardData()
    _warm_up(case, image)
    e = simulate(image, GRID, case.parameters, data, n_realizations, n_workers=1)
    memory = peak_megabytes()
    reference = None
    if not case.conditional:
        times = [
            simulate_reference(image, GRID.shape, case.parameters, seed)[1]
            for seed in range(n_reference)
        ]
        reference = 1e3 * float(np.median(times))
    return Row(data.n, case.level, 1e3 * float(np.median(e.cpu_seconds)), reference, memory)


def _warm_up(case: Case, image: TrainingImage) -> None:
    """Compile all kernels for this study; dense data split tiles, which needs more kernels."""
    rows, columns = np.divmod(np.arange(0, 64 * 64, 37), 64)
    data = HardData(np.stack([rows, columns], axis=1), image.array[rows, columns])
    simulate(image, (64, 64), case.parameters, data if case.conditional else None, 24)
