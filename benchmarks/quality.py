"""Quality of conditional realizations: python -m benchmarks.quality DATA

Prints a Markdown table with these columns: the pattern distance to the training image (TI) at full,
half and third resolution; the same distance with coarse cells that begin at any cell ("all
phases"); the connectivity function τ E–W at lags 21, 41, 61 and 81 relative to the TI; the share of
cells that differ between seeds; the status of the data; and the CPU time of a realization, also
relative to unconditional realizations of the same run. The folder DATA has the published training
images, hard data and, optionally, realizations of other codes for the same studies.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from itertools import combinations, product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ccwsim import Grid, HardData, Parameters, TrainingImage, read_hard_data, simulate
from ccwsim.metrics import (
    PatternHistogram,
    connectivity,
    js_divergence,
    pattern_distance,
    pyramid_histograms,
)

LAGS = (21, 41, 61, 81)
N_REALIZATIONS = 10


@dataclass(frozen=True)
class Case:
    """One study of the table: names of files in the data folder, and sizes in cells."""

    title: str
    image: str
    data: str
    shape: tuple[int, int]
    others: tuple[str, ...] = ()
    template: int = 32


CASES = (
    Case(
        "channel, 100 data",
        "paper/ti_channel_256x256",
        "paper/hd_channel_100_grid512x512",
        (512, 512),
    ),
    Case(
        "channel, 299 data",
        "paper/ti_channel_256x256",
        "paper/hd_channel_300_grid512x512",
        (512, 512),
    ),
    Case(
        "channel, 397 data",
        "paper/ti_channel_256x256",
        "paper/hd_channel_400_grid512x512",
        (512, 512),
        ("CCWSIM_channel512_hd400", "MS-CCSIM_channel512_hd400"),
    ),
    Case(
        "channel, 1000 data",
        "paper/ti_channel_256x256",
        "reference/hd_channel_1000_grid512x512",
        (512, 512),
        ("CCWSIM_channel512_t2_1000", "MS-CCSIM_channel512_t2_1000"),
    ),
    Case(
        "channel, 2000 data",
        "paper/ti_channel_256x256",
        "reference/hd_channel_2000_grid512x512",
        (512, 512),
    ),
    Case(
        "channel, 3883 data",
        "paper/ti_channel_256x256",
        "paper/hd_channel_dense_4000_grid256x256",
        (256, 256),
        ("CCWSIM_channel256_dense4000",),
    ),
    Case(
        "stone wall, 298 data",
        "paper/ti_stonewall_200x200",
        "paper/hd_stonewall_300_grid512x512",
        (512, 512),
        ("CCWSIM_stonewall512_hd300", "MS-CCSIM_stonewall512_hd300"),
    ),
    Case(
        "three facies, 400 data",
        "paper/ti_three_facies_400x400",
        "paper/hd_three_facies_400_grid1000x1000",
        (1000, 1000),
        template=48,
    ),
)
HEADER = (
    "| study | level | patterns 1, 1/2, 1/3 | all phases 1/2, 1/3 | τ 21, 41, 61, 81 | differ "
    "| wrong | re-simulated | forced | ms | × uncond. |\n" + "|---" * 11 + "|"
)


def main(folder: Path) -> None:
    """Print the whole table."""
    print(HEADER)
    for case in CASES:
        ti = TrainingImage(np.load(folder / f"{case.image}.npy"))
        data = read_hard_data(folder / f"{case.data}.csv", Grid(*case.shape))
        for level in (1, 2, 3):
            _ours(case, ti, data, level)
            for name in case.others:
                _others(folder / "reference" / f"{name}_L{level}.npz", ti, data, level)


def _ours(case: Case, ti: TrainingImage, data: HardData, level: int) -> None:
    p = Parameters(template_size=case.template, wavelet_level=level)
    simulate(ti, (128, 128), p, HardData([[5, 5]], [ti.codes[0]]))  # compiles
    free = simulate(ti, case.shape, p, n_realizations=N_REALIZATIONS, n_workers=1)
    e = simulate(ti, case.shape, p, data, n_realizations=N_REALIZATIONS, n_workers=1)
    ms, free_ms = (1e3 * np.median(s.cpu_seconds) for s in (e, free))
    met = f"{e.n_resimulated.mean():.1f} | {e.n_forced.mean():.1f} | {ms:.0f} | {ms / free_ms:.1f}"
    wrong = f"{100 * e.n_mismatched.mean() / data.n:.1f} %"
    judged = columns_of(e.realizations, ti)
    print(f"| {case.title} | {level} | {judged} | {wrong} | {met} |", flush=True)
    judged = columns_of(free.realizations, ti)
    print(f"| – without data | {level} | {judged} | – | – | – | {free_ms:.0f} | 1 |", flush=True)


def _others(file: Path, ti: TrainingImage, data: HardData, level: int) -> None:
    if not file.exists():
        return
    images = np.load(file)["r"]
    wrong = 100 * np.mean([data.n_mismatched(image) for image in images]) / data.n
    name = file.name.split("_")[0]
    judged = columns_of(images, ti)
    print(f"| – published {name} | {level} | {judged} | {wrong:.1f} % | | | | |", flush=True)


def columns_of(images: NDArray, ti: TrainingImage) -> str:
    """Return the columns "patterns", "all phases", "τ" and "differ" of realizations."""
    images = np.asarray(images[:N_REALIZATIONS])
    patterns = pattern_distance(images, ti).mean(axis=0)
    phases = [distance_of_all_phases(images, ti, factor) for factor in (2, 3)]
    last = int(ti.codes[-1])
    own = connectivity(images, last, "E-W", LAGS).tau.mean(axis=0)
    tau = own / connectivity(ti, last, "E-W", LAGS).tau.mean(axis=0)
    differ = np.mean([(a != b).mean() for a, b in combinations(images, 2)])
    shown = (" ".join(f"{v:.4f}"[1:] for v in values) for values in (patterns, phases))
    return f"{' | '.join(shown)} | {' '.join(f'{v:.2f}' for v in tau)} | {differ:.2f}"


def distance_of_all_phases(images: NDArray, ti: TrainingImage, factor: int) -> float:
    """Return the mean pattern distance to the image at 1 / factor of the resolution, in all phases.

    The phase is the cell at which coarse cells begin. The patterns of an image depend on the phase:
    at half resolution, the stone wall without its first and last row differs more from the complete
    image than realizations do. Patches copied from even to even cells keep the phase; shifted
    patches do not.
    """
    target = histogram_of_all_phases(np.asarray(ti.array), ti, factor)
    found = [js_divergence(histogram_of_all_phases(own, ti, factor), target) for own in images]
    return float(np.mean(found))


def histogram_of_all_phases(image: NDArray, ti: TrainingImage, factor: int) -> PatternHistogram:
    """Return the mean histogram at 1 / factor of the resolution over all phases."""
    # only complete coarse cells, because incomplete cells would be stretched
    ny, nx = (n // factor * factor for n in np.subtract(image.shape, factor - 1))
    starts = product(range(factor), repeat=2)
    parts = [image[y : y + ny, x : x + nx] for y, x in starts]
    each = [pyramid_histograms(part, ti.codes, factors=[factor])[0][0] for part in parts]
    codes, places = np.unique(np.concatenate([h.codes for h in each]), return_inverse=True)
    shares = np.concatenate([h.frequencies for h in each]) / len(each)
    return replace(each[0], codes=codes, frequencies=np.bincount(places, shares))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
