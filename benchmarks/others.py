"""Comparison with other programs: python -m benchmarks.others [N]

Prints a Markdown table with N realizations (3) of each program, all on one thread and in turns: the
time of a realization without data and with data, data that are not honoured, and the distances to
the training image of 4 × 4 patterns (Jensen–Shannon, bits) at full and third resolution, with data
if the program can have them. The grid has 512 × 512 cells. The image and the 400 data are bundled;
with the folder of the paper's data in CCWSIM_DATA they are those of the paper, and the stored
realizations of the published codes are compared, too. Programs are left out if their package is
not installed: pip install geone gstools
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.cases import GRID, load_study
from ccwsim import HardData, Parameters, TrainingImage, simulate
from ccwsim.metrics import pattern_distance

N_REALIZATIONS = 3
N_NEIGHBOURS, SCAN_FRACTION = 24, 0.25  # of DeeSse
THRESHOLDS = 0.05, 0.02
"""Accepted distances of DeeSse."""
LAGS = np.arange(0, 61, 2.0)
"""Bins of the variograms that GSTools fits, in cells."""
HEADER = (
    "| program | s, no data | data | data not honoured | distance of patterns, full | third |\n"
    "|---|--:|--:|--:|--:|--:|"
)
PUBLISHED = "CCWSIM", "MS-CCSIM"

Simulate = Callable[[HardData, int], NDArray[np.integer]]
"""Function of hard data and seed that returns one realization as facies codes."""


@dataclass(frozen=True)
class Program:
    """A program with its settings; `conditional` if facies can be its data."""

    name: str
    simulate: Simulate
    conditional: bool = True


def ours(image: TrainingImage, p: Parameters) -> Simulate:
    """Return the function for this program."""

    def run(data: HardData, seed: int) -> NDArray[np.integer]:
        return simulate(image, GRID, p, data, seed=seed, n_workers=1).realizations[0]

    return run


def deesse(image: TrainingImage, threshold: float) -> Simulate:
    """Return the function for DeeSse in the package geone."""
    img, interface = import_module("geone.img"), import_module("geone.deesseinterface")
    ny, nx = image.shape
    values = image.array[None, None].astype(float)
    picture = img.Img(nx=nx, ny=ny, nz=1, nv=1, val=values, varname="facies")

    def run(data: HardData, seed: int) -> NDArray[np.integer]:
        points = None
        if data.n:
            y, x = data.cells.T + 0.5
            table = np.stack([x, y, np.full(data.n, 0.5), data.facies])
            names = ["X", "Y", "Z", "facies"]
            points = img.PointSet(npt=data.n, nv=4, val=table, varname=names)
        request = interface.DeesseInput(
            nx=GRID.nx, ny=GRID.ny, nz=1, nv=1, varname="facies", TI=picture, dataPointSet=points,
            distanceType="categorical", nneighboringNode=N_NEIGHBOURS, distanceThreshold=threshold,
            maxScanFraction=SCAN_FRACTION, npostProcessingPathMax=1, seed=seed + 1, nrealization=1,
        )  # fmt: skip
        result = interface.deesseRun(request, nthreads=1, verbose=0)
        return result["sim"][0].val[0, 0].astype(np.uint8)

    return run


def gstools(image: TrainingImage) -> Simulate:
    """Return the function for Gaussian fields of GSTools that are cut at the proportion."""
    gs = import_module("gstools")
    indicator = (image.indices == 1).astype(float)
    axes = [np.arange(n, dtype=float) for n in image.shape[::-1]]
    bins, gamma = gs.vario_estimate(
        axes, indicator.T, LAGS, direction=np.eye(2), angles_tol=np.pi / 16,
        mesh_type="structured", sampling_size=4000, sampling_seed=0,
    )  # fmt: skip
    model = gs.Exponential(dim=2)
    model.fit_variogram(bins, gamma, nugget=False)
    grid = [np.arange(n, dtype=float) for n in (GRID.nx, GRID.ny)]

    def run(data: HardData, seed: int) -> NDArray[np.integer]:
        field = gs.SRF(model, seed=seed)(grid, mesh_type="structured").T
        return image.codes[(field > np.quantile(field, 1 - image.proportions[1])).astype(int)]

    return run


def programs(image: TrainingImage) -> Iterator[Program]:
    """Yield the programs that are installed."""
    yield Program("CCWSIM (this), level 2", ours(image, Parameters()))
    yield Program("CCWSIM (this), level 1", ours(image, Parameters(wavelet_level=1)))
    yield Program(
        "search of MS-CCSIM in this program, level 2", ours(image, Parameters(method="ms-ccsim"))
    )
    if find_spec("geone"):
        for threshold in THRESHOLDS:
            name = f"DeeSse (geone), {N_NEIGHBOURS} neighbours, threshold {threshold:g}"
            yield Program(name, deesse(image, threshold))
    if find_spec("gstools"):
        yield Program("GSTools, truncated Gaussian field", gstools(image), conditional=False)


def distances(maps: NDArray[np.integer], image: TrainingImage) -> str:
    """Return the mean pattern distances at full and third resolution as cells of the table."""
    full, _, third = pattern_distance(maps, image).mean(axis=0)
    return f"{full:.4f} | {third:.4f}"


def wrong(maps: NDArray[np.integer], data: HardData) -> str:
    """Return the share of the data that are not honoured."""
    return f"{100 * np.mean([data.n_mismatched(one) for one in maps]) / data.n:.1f} %"


def published(image: TrainingImage, data: HardData) -> Iterator[str]:
    """Yield rows of the stored realizations of the published codes at level 2."""
    folder = Path(os.environ["CCWSIM_DATA"]) / "reference"
    for code in PUBLISHED:
        maps = np.load(folder / f"{code}_channel512_hd400_L2.npz")["r"]
        name = f"{code}, published code, level 2"
        yield f"| {name} | – | – | {wrong(maps, data)} | {distances(maps, image)} |"


def main(n: int = N_REALIZATIONS) -> None:
    """Print the table."""
    image, data = load_study()
    compared = [*programs(image)]
    seconds: dict[tuple[str, int], list[float]] = {}
    maps: dict[tuple[str, int], list[Any]] = {}
    for turn in range(-1, n):  # the first turn compiles
        for program in compared:
            for study in (HardData(), data)[: 1 + program.conditional]:
                start = time.perf_counter()
                realization = program.simulate(study, max(turn, 0))
                if turn >= 0:
                    key = program.name, study.n
                    seconds.setdefault(key, []).append(time.perf_counter() - start)
                    maps.setdefault(key, []).append(realization)
    print(f"{image.name or 'channels'}, {data.n} data, {n} realizations\n\n{HEADER}")
    for program in compared:
        free, conditional = (program.name, 0), (program.name, data.n)
        medians = (np.median(seconds[key]) for key in (free, conditional) if key in seconds)
        times = [f"{median:.2g}" for median in medians] + ["–"] * (not program.conditional)
        missed = wrong(np.array(maps[conditional]), data) if program.conditional else "–"
        judged = maps[conditional if program.conditional else free]
        cells = *times, missed, distances(np.array(judged), image)
        print(f"| {program.name} | {' | '.join(cells)} |")
    if os.environ.get("CCWSIM_DATA"):
        print("\n".join(published(image, data)))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
