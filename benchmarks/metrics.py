"""Time of the metrics: python -m benchmarks.metrics

Prints the wall time, on all cores, of each metric of 100 realizations, in total and per
realization. The realizations have 512 × 512 cells of the bundled channels and 400 data.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from ccwsim import Grid, datasets, simulate
from ccwsim.metrics import (
    anodi,
    connectivity,
    copying,
    data_match,
    etype,
    geobody_statistics,
    proportions,
    transiograms,
    variogram,
)

N = 100


def main() -> None:
    """Print the table."""
    ti = datasets.load("channels")
    data = datasets.load_hard_data("channels_400_data")
    e = simulate(ti, Grid(512, 512), hard_data=data, n_realizations=N, keep_sources=True)
    images, sources = e, e.sources
    assert sources is not None
    cases: dict[str, Callable[[], object]] = {
        "simulation (level 2), for comparison": lambda: simulate(
            ti, Grid(512, 512), hard_data=data, n_realizations=N
        ),
        "proportions": lambda: proportions(images),
        "E-type, most likely facies, entropy": lambda: etype(images),
        "variogram E-W, 100 lags": lambda: variogram(images, 1, "E-W", 100),
        "variogram N-S, 100 lags": lambda: variogram(images, 1, "N-S", 100),
        "transiograms E-W, 30 lags": lambda: transiograms(images, None, "E-W", 30),
        "connectivity E-W, 100 lags": lambda: connectivity(images, 1, "E-W", 100),
        "connectivity N-S, 100 lags": lambda: connectivity(images, 1, "N-S", 100),
        "geobodies, Γ, Euler number": lambda: geobody_statistics(images, 1),
        "ANODI, 3 resolutions": lambda: anodi(images, ti),
        "data honoured": lambda: data_match(e, data),
        "re-use and copy meter": lambda: [copying(s, ti.shape) for s in sources],
    }
    print(f"| metric | {N} realizations, s | each, ms |\n|---|---|---|")
    for name, run in cases.items():
        run()  # compiles
        start = time.perf_counter()
        run()
        seconds = time.perf_counter() - start
        print(f"| {name} | {seconds:.2f} | {1e3 * seconds / N:.1f} |", flush=True)


if __name__ == "__main__":
    main()
