"""Effect and time of secondary information.

``python -m benchmarks.secondary [reliability|time|copies]`` prints one table, or all.

*reliability*: One half of an image is the training image, and the other half is the truth. To make
the map, the truth is blurred, noise is added, and each value is replaced by the mean of the truth
at this value. A row has, for each template, overlap and level, the slope of the E-type on the map
and the largest difference between the given probability and the share in the realizations (in bins
of probability that contain at least 2 % of the cells); and the mean Brier scores of map, wells, and
both.

*time*: CPU time of a realization of channels on 512 × 512 and 1024 × 1024 cells, relative to that
without secondary information. Data have the probabilities of the map. All cases are measured in
turns.

*copies*: Turned and scaled images, and zones of two images, with 24 realizations. The columns:

- difference between the mean direction and the map: mean and 90 % quantile, in degrees, without
  the margins of the grid
- difference of proportions from those of the images, in points
- pattern distance, relative to that of each image alone in the same window
- CPU time of later realizations, relative to that without secondary information, in turns
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
from scipy.ndimage import gaussian_filter

from ccwsim import Auxiliary, Ensemble, Parameters, Secondary, TrainingImage, datasets, simulate
from ccwsim.metrics import direction_error, pattern_distance, reliability

IMAGES = ("channels", "stone_wall", "barchans", "levees", "lenses", "fractures", "dunes", "bend")
VOLUMES = ("sinuous_channels", "folded_layers", "stacked_lenses")
BLURS = (8, 20)  # standard deviations of the Gaussian in cells
NOISE = 0.05
SETTINGS = ((32, 8, 2), (24, 8, 1), (48, 12, 2), (32, 8, 0), (32, 8, 3))  # T, OR, J
OF_VOLUMES = (8, 16, 16), (2, 4, 4), (0, 1, 1)
MIN_SHARE = 0.02
N_REALIZATIONS, N_WELLS, N_TURNS, N_A_TURN = 40, 200, 5, 16


def halves(name: str) -> tuple[TrainingImage, np.ndarray]:
    """Return masks of the last facies: in one half of an image, and in the other half as truth."""
    image = datasets.load(name)
    cells, middle = (image.array == image.codes[-1]).astype(np.uint8), image.shape[-1] // 2
    return TrainingImage(cells[..., :middle]), cells[..., -middle:]


def map_of(truth: np.ndarray, blur: float) -> np.ndarray:
    """Return the mean of a truth of zeros and ones at each value of the blurred truth."""
    sides = (0,) * (truth.ndim - 2) + (blur, blur)
    rng = np.random.default_rng(0)
    noise = gaussian_filter(rng.normal(size=truth.shape), sides)
    blurred = gaussian_filter(truth.astype(float), sides)
    blurred += NOISE * noise / noise.std()
    order = np.argsort(blurred, axis=None)
    parts = np.array_split(order, 20)
    at = [blurred.ravel()[part].mean() for part in parts]
    return np.interp(blurred, at, [truth.ravel()[part].mean() for part in parts])


def worst_bin(e: Ensemble, code: int) -> float:
    """Return the largest difference of a bin that contains enough cells."""
    table = reliability(e, code)
    held = table.count >= MIN_SHARE * table.count.sum()
    return float(np.abs(table.observed - table.forecast)[held].max())


def rows_of_reliability() -> Iterator[str]:
    """Yield the lines of the table of reliability."""
    sizes = [", ".join(map(str, each)) for each in SETTINGS]
    yield f"T, OR, J: {'; '.join(sizes)}; in volumes {', '.join(map(str, OF_VOLUMES))}"
    yield "image, blur | slope | worst bin | Brier: map, wells, both | wrong data"
    for name in IMAGES + VOLUMES:
        image, values = halves(name)
        code = int(image.codes[-1])
        truth = (values == code).astype(float)
        rng = np.random.default_rng(1)
        cells = np.column_stack([rng.integers(0, n, N_WELLS) for n in truth.shape])
        cells = np.unique(cells, axis=0)
        wells = cells, values[tuple(cells.T)]
        for blur in BLURS:
            given = map_of(truth, blur)
            secondary = Secondary(probabilities={code: given})
            slopes, worst, brier, wrong = [], [], [], 0
            for p in SETTINGS if truth.ndim == 2 else [OF_VOLUMES]:
                found = [
                    simulate(
                        *(image, truth.shape, Parameters(*p), data, N_REALIZATIONS),
                        secondary=soft,
                        n_workers=1,
                    )
                    for data, soft in ((None, secondary), (wells, None), (wells, secondary))
                ]
                e_type = found[0].probability(code)
                slopes.append(np.polyfit(given.ravel(), e_type.ravel(), 1)[0])
                worst.append(worst_bin(found[0], code))
                brier.append([((e.probability(code) - truth) ** 2).mean() for e in found])
                wrong = max(wrong, *(int(e.n_mismatched.max()) for e in found))
            columns = slopes, worst, np.mean(brier, axis=0)
            texts = (
                ", ".join(f"{x:.{digits}f}" for x in each)
                for each, digits in zip(columns, (2, 3, 3), strict=True)
            )
            yield f"{name}, {blur} | {' | '.join(texts)} | {wrong}"


def rows_of_time() -> Iterator[str]:
    """Yield the lines of the table of times."""
    image = datasets.load("channels")
    yield "cells | case | data | CPU time | relative"
    for n in (512, 1024):
        ramp = np.linspace(0.1, 0.5, n)[None].repeat(n, axis=0)
        of_image = np.linspace(0.0, 1.0, image.shape[1])[None].repeat(image.shape[0], axis=0)
        rows, columns = np.indices((n, n)) - n / 2
        cases = {
            "none": None,
            "probabilities": Secondary(probabilities={1: ramp}),
            "auxiliary variable": Secondary(auxiliary=[Auxiliary(of_image, 2 * ramp)]),
            "square of 25 %": Secondary(active=np.maximum(abs(rows), abs(columns)) < n / 4),
            "disc of 25 %": Secondary(active=np.hypot(rows, columns) < n / np.sqrt(4 * np.pi)),
        }
        cells = np.unique(np.random.default_rng(0).integers(0, n, (400, 2)), axis=0)
        facies = (np.random.default_rng(1).random(len(cells)) < ramp[tuple(cells.T)]).astype(int)
        for data in (None, (cells, facies)):
            each: dict[str, list[float]] = {name: [] for name in cases}
            for turn in range(N_TURNS + 1):
                for name, secondary in cases.items():
                    e = simulate(
                        *(image, (n, n), None, data, N_A_TURN),
                        n_workers=1,
                        first_realization=N_A_TURN * turn,
                        secondary=secondary,
                    )
                    each[name] += e.cpu_seconds.tolist() if turn else []
            for name, seconds in each.items():
                took, usual = np.median(seconds), np.median(each["none"])
                n_data = 0 if data is None else len(cells)
                yield (f"{n} × {n} | {name} | {n_data} | {1000 * took:.1f} ms | {took / usual:.2f}")


def rows_of_copies() -> Iterator[str]:
    """Yield the lines of the table of turned images and zones.

    The time of two zones is relative to the mean of the times of both images.
    """
    yield "image | case | direction: mean, 90 % | proportion | zones | CPU time"
    n, margin = 400, 40
    rows, columns = np.indices((n, n))
    fan = np.degrees(np.arctan2(rows - n / 2, columns + 120))
    other = datasets.load("stone_wall")
    zones = (columns > n / 2 + 40 * np.sin(rows / 40)).astype(int)
    inside = (slice(margin, -margin),) * 2
    for name in ("channels", "levees", "fractures"):
        image = datasets.load(name)
        of_one = {
            "none": None,
            "0 to 90°": Secondary(angle=90 * columns / n),
            "fan of ±60°": Secondary(angle=fan),
            "37°": Secondary(angle=37.0),
            "scale 0.7 to 1.4": Secondary(scale=0.7 + 0.7 * columns / n),
        }
        cases = {case: (image, secondary) for case, secondary in of_one.items()}
        if name == "channels":
            cases["stone wall"] = other, None
            cases["two zones"] = image, Secondary(images=[other], zones=zones)
        seconds: dict[str, list[float]] = {case: [] for case in cases}
        found: dict[str, Ensemble] = {}
        for turn in range(5):
            for case, (of, secondary) in cases.items():
                e = simulate(
                    *(of, (n, n), None, None, 24, 0),
                    n_workers=1,
                    first_realization=24 * turn,
                    secondary=secondary,
                )
                found.setdefault(case, e)
                # the first realization on each orientation of a path prepares the copies
                seconds[case] += np.sort(e.cpu_seconds)[:12].tolist() if turn else []
        took = {case: float(np.median(each)) for case, each in seconds.items()}
        for case, e in found.items():
            usual = took["none"]
            ratio, error = "", ""
            if e.secondary is not None and e.secondary.angle is not None:
                off = np.abs(direction_error(e)[inside])
                error = f"{off.mean():.1f}, {np.quantile(off, 0.9):.1f}"
            if case == "two zones":
                usual = (usual + took["stone wall"]) / 2  # half of the cells are of each image
                windows = {1: slice(n // 2 + 60, n), 0: slice(0, n // 2 - 60)}
                both = [
                    pattern_distance(e.realizations[..., windows[k]], of).mean()
                    / pattern_distance(own.realizations[..., windows[k]], of).mean()
                    for k, own, of in (
                        (0, found["none"], image),
                        (1, found["stone wall"], other),
                    )
                ]
                ratio = ", ".join(f"{one:.2f}" for one in both)
            of = cases[case][0]
            off = 100 * np.abs(e.proportions.mean(axis=0) - of.proportions).max()
            points = "" if case == "two zones" else f"{off:.2f}"
            yield f"{name} | {case} | {error} | {points} | {ratio} | {took[case] / usual:.2f}"


def main() -> None:
    """Print the tables that are named on the command line, or all."""
    tables = {"reliability": rows_of_reliability, "time": rows_of_time, "copies": rows_of_copies}
    for name in sys.argv[1:] or tables:
        for line in tables[name]():
            print(line, flush=True)


if __name__ == "__main__":
    main()
