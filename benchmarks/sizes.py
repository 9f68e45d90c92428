"""Time and memory by size: python -m benchmarks.sizes [--small]

Each row is one study in a separate process. The studies have grids of up to 100 million cells,
large training images, many facies or many data, and one or two threads. Peak memory includes Python
and compiled kernels, which dominate in the first row.
"""

from __future__ import annotations

import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from benchmarks.memory import peak_megabytes
from ccwsim import HardData, Parameters, TrainingImage, datasets, simulate

WARM_UP = (128, 128)


@dataclass(frozen=True)
class Case:
    """A study of the table, described by its sizes."""

    title: str
    grid: int
    level: int
    image: str = "channels"
    side: int = 256
    n_data: int = 0
    template: int = 32
    overlap: int = 8
    n_realizations: int = 1
    n_workers: int = 1


CASES = (
    *(
        Case(f"512², {n} data" if n else "512²", 512, level, n_data=n, n_realizations=8)
        for n in (0, 400, 2000)
        for level in (1, 2, 3)
    ),
    *(
        Case("512², 400 data, two threads", 512, level, n_data=400, n_realizations=8, n_workers=2)
        for level in (1, 2, 3)
    ),
    *(Case("512², 3 facies", 512, level, "barchans", 400, n_realizations=4) for level in (1, 2, 3)),
    *(
        Case("1000², image 1000², T 100, OR 20", 1000, level, side=1000, template=100, overlap=20)
        for level in (1, 2)
    ),
    Case("512², image 2000²", 512, 1, side=2000),
    *(Case("5000²", 5000, level) for level in (1, 2, 3)),
    *(Case("10 000²", 10_000, level) for level in (1, 2, 3)),
)


def image_of(case: Case) -> TrainingImage:
    """Return the training image, tiled until it is large enough."""
    indices = datasets.load(case.image).indices
    n = -(-case.side // min(indices.shape))
    return TrainingImage(np.tile(indices, (n, n))[: case.side, : case.side])


def data_of(case: Case, ti: TrainingImage, p: Parameters) -> HardData | None:
    """Return data sampled from an unconditional realization, as section 5.2 of the paper does."""
    if not case.n_data:
        return None
    field = simulate(ti, (case.grid, case.grid), p, seed=99).realizations[0]
    flat = np.random.default_rng(1).choice(field.size, case.n_data, replace=False)
    cells = np.stack(np.divmod(flat, case.grid), axis=1)
    return HardData(cells, field[cells[:, 0], cells[:, 1]])


def measure(case: Case) -> tuple[float, float, float]:
    """Return CPU seconds of a realization, wall seconds of all realizations, and peak MB."""
    p = Parameters(case.template, case.overlap, case.level)
    ti = image_of(case)
    data = data_of(case, ti, p)
    # Rotating the image to all orientations is not part of the time of a realization.
    simulate(ti, WARM_UP, p, HardData([[3, 3]], [ti.codes[0]]) if data else None, 1)
    start = time.perf_counter()
    e = simulate(ti, (case.grid, case.grid), p, data, case.n_realizations, n_workers=case.n_workers)
    wall = time.perf_counter() - start
    return float(np.median(e.cpu_seconds)), wall, peak_megabytes() or float("nan")


def main(small: bool) -> None:
    """Print the table."""
    print("| study | level | CPU s a realization | µs a cell | realizations a second | peak MB |")
    print("|---|---|---|---|---|---|")
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as fresh:
        for case in CASES:
            if small and case.grid > 1000:
                continue
            seconds, wall, peak = fresh.submit(measure, case).result()
            per_cell = 1e6 * seconds / case.grid**2
            print(
                f"| {case.title} | {case.level} | {seconds:.3g} | {per_cell:.3f} "
                f"| {case.n_realizations / wall:.3g} | {peak:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    if sys.argv[1:] not in ([], ["--small"]):
        sys.exit(__doc__)
    main("--small" in sys.argv)
