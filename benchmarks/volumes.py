"""Time, memory and quality of volumes: ``python -m benchmarks.volumes``.

Times are medians of several realizations on one thread. To compare machines, the table also has
times relative to a 512 × 512 map of `channels` at level 2, measured alternately. `unseen` is the
share of patterns of 3 × 3 × 3 cells that are absent from the training image, and after the stroke
the same share among patterns at data. `JS` is the distance between the pattern histograms of
realizations and image, and in brackets the same distance for crops as large as the grid. `others`
has `unseen` and `JS` of other volumes from the generator of the image, which share only its type of
geology. If CCWSIM_DATA is a folder of published data, its volumes are measured too.

``--large`` instead measures six images from each bundled generator, nine times as large as the
grid. Each image is simulated with the template above and with the advised template, without data
and with ten wells sampled from another volume of the generator. This volume and crops of the image
have separate rows. In these tables, JS is relative to crops, and `bias` is the largest difference
between mean proportions and those of the image.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.memory import peak_megabytes
from ccwsim import Ensemble, HardData, Parameters, TrainingImage, datasets, metrics, simulate
from tools.datasets import generate_volume

PARAMETERS = Parameters((16, 32, 32), (4, 8, 8), (1, 2, 2))
LARGEST_JUDGED = 3_000_000
"""Maximum number of cells of grids whose patterns are compared."""
LARGE, LARGE_GRID = (50, 300, 300), (50, 100, 100)
N_LARGE = 6
N_REALIZATIONS_LARGE = 24
"""Number of realizations and of crops; equal numbers give equally uncertain means."""
COLUMNS_LARGE = (
    *("CPU s", "bias, points", "unseen, %", "JS over crops"),
    *("with wells: unseen, %", "at data, %", "with wells: JS over crops"),
)
CROPS = "crops of the image"
"""Name of the table row to which distances are relative."""


class Case(NamedTuple):
    """A volume to simulate on a grid (nz, ny, nx), with ten wells or none."""

    image: str
    grid: tuple[int, int, int]
    wells: bool = False


def cases() -> Iterator[Case]:
    """Yield the cases to measure."""
    for image in (*datasets.volume_names(), *(path.stem for path in published())):
        grid = (48, 100, 100) if image in datasets.volume_names() else (50, 100, 100)
        if "alluvial" in image:
            continue  # the image is smaller than the grid along an axis
        yield Case(image, grid)
        yield Case(image, grid, wells=True)
    for grid in ((100, 200, 200), (128, 256, 256), (200, 500, 500)):
        yield Case("sinuous_channels", grid)


def published() -> list[Path]:
    """Return the files of published volumes, if there are any."""
    folder = Path(os.environ.get("CCWSIM_DATA", "")) / "volumes"
    return sorted(folder.glob("*.npz")) if "CCWSIM_DATA" in os.environ else []


def image_of(name: str) -> TrainingImage:
    """Return a bundled volume, or the volume in a file."""
    if name in datasets.volume_names():
        return datasets.load(name)
    path = next(path for path in published() if path.stem == name)
    with np.load(path) as file:
        return TrainingImage(file["ti"], name=name)


def wells_of(image: TrainingImage, grid: tuple[int, int, int]) -> HardData:
    """Return ten vertical wells: the bundled ones, or wells sampled from a corner of the image."""
    if image.name in datasets.volume_names():
        return datasets.load_hard_data(f"{image.name}_10_wells")
    return wells_through(np.asarray(image.array), grid, seed=6)


def wells_through(volume: np.ndarray, grid: tuple[int, int, int], seed: int) -> HardData:
    """Return ten vertical wells sampled from a volume that is at least as large as the grid."""
    rng = np.random.default_rng(seed)
    places = np.unique(np.stack([rng.integers(0, n, 10) for n in grid[1:]], axis=1), axis=0)
    cells = np.array([(z, y, x) for y, x in places for z in range(grid[0])])
    return HardData(cells, volume[tuple(cells.T)])


def measured(case: Case, n: int) -> str:
    """Return a row of the table; call this in a new process, whose peak memory is measured."""
    image = image_of(case.image)
    data = wells_of(image, case.grid) if case.wells else HardData()
    channels, map_of = datasets.load("channels"), Parameters()
    simulate(channels, (512, 512), map_of, n_realizations=8, n_workers=1)
    simulate(image, case.grid, PARAMETERS, data, 1, seed=99, n_workers=1)  # compiles
    seconds, ratios = [], []
    for seed in range(n):
        flat = simulate(channels, (512, 512), map_of, n_realizations=3, seed=seed, n_workers=1)
        own = simulate(image, case.grid, PARAMETERS, data, 2, seed=seed, n_workers=1)
        seconds += own.cpu_seconds.tolist()
        ratios.append(own.cpu_seconds.mean() / np.median(flat.cpu_seconds))
    peak = peak_megabytes()
    nz, ny, nx = case.grid
    row = f"| {case.image}{', 10 wells' if case.wells else ''} | {nx} × {ny} × {nz} "
    row += f"| {np.median(seconds):.3f} s | {np.median(ratios):.1f} | {peak:.0f} MB "
    if nz * ny * nx > LARGEST_JUDGED:
        return row + "| | | | |"
    e = simulate(image, case.grid, PARAMETERS, data, 4, n_workers=1)
    return row + looks(e, image, data)


def looks(e: Ensemble, image: TrainingImage, data: HardData) -> str:
    """Return the last columns of a row: unseen patterns, pattern distances, and data."""
    unseen = f"{100 * metrics.unseen_patterns(e, image).mean():.2f}"
    found = ""
    if data.n:
        mask = np.zeros(e.grid.shape, bool)
        mask[tuple(data.cells.T)] = True
        unseen += f" / {100 * metrics.unseen_patterns(e, image, mask=mask).mean():.2f}"
        wrong, forced = int(e.n_mismatched.sum()), int(e.n_forced.sum())
        found = f"{wrong} wrong, {forced} forced, {e.n_resimulated.mean():.0f} re-simulated"
    own, crops = distance(e, image), distance(np.stack([*crops_of(image, e.grid.shape)]), image)
    of_others = ""
    if image.name in datasets.volume_names():
        drawn = others(image, e.grid.shape)
        seen = f"{100 * metrics.unseen_patterns(drawn, image).mean():.2f}"
        of_others = f"{seen} %, {distance(drawn, image):.4f}"
    return f"| {unseen} % | {own:.4f} ({crops:.4f}) | {of_others} | {found} |"


def distance(images: Ensemble | np.ndarray, image: TrainingImage) -> float:
    """Return the mean distance of the patterns of 3 × 3 × 3 cells from the training image."""
    return metrics.pattern_distance(images, image, size=3, factors=(1,)).mean()


def others(image: TrainingImage, shape: tuple[int, ...], n: int = 6) -> np.ndarray:
    """Return volumes from the generator of an image that have only facies of the image."""
    drawn = (
        generate_volume(image.name, shape=shape, seed=seed).array  # type: ignore[arg-type]
        for seed in range(5000, 5000 + 10 * n)
    )
    alike = [volume for volume in drawn if np.isin(volume, image.codes).all()]
    return np.stack(alike[:n])


def large(name: str, number: int) -> dict[str, dict[str, float]]:
    """Return the rows of a generated image: each template, the volume of the wells, and crops.

    Biases are in percentage points, shares of unseen patterns in %. The columns "with wells" are
    for conditional realizations.
    """
    image = generate_volume(name, shape=LARGE, seed=7000 + number)
    truth = generate_volume(name, shape=LARGE_GRID, seed=9000 + number).array[None]
    data = wells_through(truth[0], LARGE_GRID, number)
    mask = np.zeros(LARGE_GRID, bool)
    mask[tuple(data.cells.T)] = True

    def biased(images: Ensemble | np.ndarray) -> float:
        mean = metrics.proportions(images, image.codes).mean(axis=0)
        return 100 * float(np.abs(mean - image.proportions).max())

    def looks_like(images: Ensemble | np.ndarray) -> list[float]:
        unseen = 100 * metrics.unseen_patterns(images, image).mean()
        return [unseen, distance(images, image)]

    def with_wells(images: Ensemble | np.ndarray) -> list[float]:
        unseen, own = looks_like(images)
        return [unseen, 100 * metrics.unseen_patterns(images, image, mask=mask).mean(), own]

    advised = Parameters(**{each.parameter: each.value for each in metrics.diagnose(image).advice})
    found = {}
    for way, p in {"32 × 32 × 16": PARAMETERS, "advised": advised}.items():
        alone = simulate(image, LARGE_GRID, p, None, N_REALIZATIONS_LARGE, seed=number, n_workers=1)
        wells = simulate(image, LARGE_GRID, p, data, 8, seed=number, n_workers=1)
        seconds = float(np.median(alone.cpu_seconds))
        found[way] = [seconds, biased(alone), *looks_like(alone), *with_wells(wells)]
    found["the wells' volume"] = [np.nan, biased(truth), *looks_like(truth), *with_wells(truth)]
    crops = np.stack([*crops_of(image, LARGE_GRID, N_REALIZATIONS_LARGE)])
    found[CROPS] = [np.nan, biased(crops), *looks_like(crops), *3 * [np.nan]]
    return {way: dict(zip(COLUMNS_LARGE, row, strict=True)) for way, row in found.items()}


def print_large(only: str) -> None:
    """Measure and print the table of large images: means or ratios, with standard errors."""
    print("| image | template | " + " | ".join(COLUMNS_LARGE) + " |")
    print("|---|---" + "|--:" * len(COLUMNS_LARGE) + "|", flush=True)
    with ProcessPoolExecutor(2, get_context("spawn")) as fresh:
        for name in datasets.volume_names():
            if only not in name:
                continue
            images = [*fresh.map(large, [name] * N_LARGE, range(N_LARGE))]
            crops = [image[CROPS]["JS over crops"] for image in images]
            for way in images[0]:
                cells = [
                    ratio(
                        [image[way][column] for image in images],
                        crops if "JS" in column else [1.0] * len(images),
                    )
                    for column in COLUMNS_LARGE
                ]
                print(f"| {name} | {way} | " + " | ".join(cells) + " |", flush=True)


def ratio(values: list[float], bases: list[float]) -> str:
    """Return the ratio of two means with a standard error; empty without values."""
    own, base = np.array(values), np.array(bases)
    of_means = own.mean() / base.mean()
    error = np.std(own - of_means * base, ddof=1) / len(own) ** 0.5 / base.mean()
    return "" if np.isnan(of_means) else f"{of_means:.2f} ± {error:.2f}"


def crops_of(image: TrainingImage, shape: tuple[int, ...], n: int = 6) -> Iterator[np.ndarray]:
    """Yield pieces of an image, as large as the grid if they fit."""
    rng = np.random.default_rng(0)
    sides = [min(a, b) for a, b in zip(image.shape, shape, strict=True)]
    for _ in range(n):
        first = [rng.integers(0, a - b + 1) for a, b in zip(image.shape, sides, strict=True)]
        part = tuple(slice(k, k + b) for k, b in zip(first, sides, strict=True))
        yield np.asarray(image.array)[part]


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.volumes", description=__doc__)
    parser.add_argument("--repeats", type=int, default=3, metavar="N")
    parser.add_argument("--only", metavar="TEXT", default="", help="only cases with this in names")
    parser.add_argument("--large", action="store_true", help="measure large generated images")
    options = parser.parse_args()
    if options.large:
        return print_large(options.only)
    print(
        "| volume | grid | CPU | of a 512² map | peak | unseen / at data | JS (crops) "
        "| others | data |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as fresh:
        for case in cases():
            if options.only in f"{case.image} {case.grid[0]}{' wells' if case.wells else ''}":
                print(fresh.submit(measured, case, options.repeats).result(), flush=True)


if __name__ == "__main__":
    main()
