"""ANODI of our program and of other codes: python -m benchmarks.anodi DATA

Prints a Markdown table of the mean Jensen–Shannon divergence between realizations (between), and
between realizations and training image (within), at full, half and third resolution (4 × 4
patterns). For each other code, the ratio of ANODI is (our between / other between) / (our within /
other within); above 1, our code is better. The folder DATA has training images and realizations of
the other codes.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ccwsim import Grid, HardData, Parameters, TrainingImage, read_hard_data, simulate
from ccwsim.metrics import anodi


@dataclass(frozen=True)
class Case:
    """Realizations of other codes, and the study that was simulated."""

    title: str
    image: str
    level: int
    others: tuple[str, ...]
    data: str = ""


CASES = (
    Case(
        "channel 256², no data, level 2",
        "ti_channel_256x256",
        2,
        (
            "CCWSIM_channel256_uncond_L2",
            "MS-CCSIM_channel256_uncond_L2",
            "DeeSse_channel256_uncond",
            "SNESIM_MPSLIB_channel256_uncond",
        ),
    ),
    Case(
        "stone wall 200², no data, level 2",
        "ti_stonewall_200x200",
        2,
        ("CCWSIM_stonewall200_uncond_L2", "MS-CCSIM_stonewall200_uncond_L2"),
    ),
    *(
        Case(
            f"channel 512², 397 data, level {level}",
            "ti_channel_256x256",
            level,
            (f"CCWSIM_channel512_hd400_L{level}", f"MS-CCSIM_channel512_hd400_L{level}"),
            "hd_channel_400_grid512x512",
        )
        for level in (1, 2, 3)
    ),
    Case(
        "stone wall 512², 298 data, level 1",
        "ti_stonewall_200x200",
        1,
        ("CCWSIM_stonewall512_hd300_L1", "MS-CCSIM_stonewall512_hd300_L1"),
        "hd_stonewall_300_grid512x512",
    ),
)


def main(folder: Path) -> None:
    """Print the whole table."""
    print("| study | code | n | between 1, 1/2, 1/3 | within 1, 1/2, 1/3 | ours against it | all |")
    print("|---|---|---|---|---|---|---|")
    for case in CASES:
        _compare(case, folder)


def _compare(case: Case, folder: Path) -> None:
    ti = TrainingImage(np.load(folder / "paper" / f"{case.image}.npy"))
    files = [folder / "reference" / f"{name}.npz" for name in case.others]
    stacks = {f.stem: np.load(f)["r"] for f in files if f.exists()}
    if not stacks:
        return
    shape = next(iter(stacks.values())).shape
    data = HardData()
    if case.data:
        data = read_hard_data(folder / "paper" / f"{case.data}.csv", Grid(*shape[1:]))
    ours = simulate(ti, shape[1:], Parameters(wavelet_level=case.level), data, max(shape[0], 20))
    result = anodi({"ours": ours, **stacks}, ti)
    for k, name in enumerate(result.names):
        shown = [
            " ".join(f"{v:.4f}"[1:] for v in row[k]) for row in (result.between, result.within)
        ]
        per_level = " ".join(f"{v:.2f}" for v in result.ratio[0] / result.ratio[k])
        n = int(np.count_nonzero(result.owner == k))
        total = result.relative("ours", name)[2]
        row = case.title, name.split("_")[0], n, *shown, per_level, f"{total:.2f}"
        print(f"| {' | '.join(map(str, row))} |", flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
