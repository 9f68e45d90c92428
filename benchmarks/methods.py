"""Comparison of the methods: python -m benchmarks.methods DATA

Prints a Markdown table for "ccwsim", "ms-ccsim" and "ccsim" in the same engine, by level:
similarity to the channel training image, connectivity, variety, wrong data and CPU time. The
studies have no data, or 397 to 2000 data with `exact_data` on and off. `benchmarks.quality`
explains the columns and the folder DATA.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from benchmarks.quality import N_REALIZATIONS, columns_of
from ccwsim import Grid, HardData, Parameters, TrainingImage, read_hard_data, simulate
from ccwsim.model.parameters import METHODS

IMAGE = "paper/ti_channel_256x256.npy"
DATA = (
    "paper/hd_channel_400_grid512x512",
    "reference/hd_channel_1000_grid512x512",
    "reference/hd_channel_2000_grid512x512",
)
GRID = Grid(512, 512)
HEADER = (
    "| data | exact | method | level | patterns 1, 1/2, 1/3 | all phases 1/2, 1/3 "
    "| τ 21, 41, 61, 81 | differ | wrong | ms |\n" + "|---" * 10 + "|"
)


def main(folder: Path) -> None:
    """Print the whole table."""
    ti = TrainingImage(np.load(folder / IMAGE))
    print(HEADER)
    all_data = [HardData(), *(read_hard_data(folder / f"{name}.csv", GRID) for name in DATA)]
    for exact in (True, False):
        for data in all_data if exact else all_data[1:]:
            for method in METHODS:
                for level in (0,) if method == "ccsim" else (1, 2, 3):
                    p = Parameters(wavelet_level=level, method=method, exact_data=exact)
                    print(_row(ti, data, p), flush=True)


def _row(ti: TrainingImage, data: HardData, p: Parameters) -> str:
    tiny = HardData([[5, 5]], [ti.codes[0]]) if data.n else data
    simulate(ti, (128, 128), p, tiny)  # compiles
    e = simulate(ti, GRID, p, data, n_realizations=N_REALIZATIONS, n_workers=1)
    wrong = f"{100 * e.n_mismatched.mean() / data.n:.1f} %" if data.n else "–"
    exact = "–" if not data.n else "on" if p.exact_data else "off"
    said = f"| {data.n or 'none'} | {exact} | {p.method} | {p.level} | "
    judged, ms = columns_of(e.realizations, ti), 1e3 * np.median(e.cpu_seconds)
    return said + f"{judged} | {wrong} | {ms:.0f} |"


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
