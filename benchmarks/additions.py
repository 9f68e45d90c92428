"""Gain and cost of each addition to the paper: ``python -m benchmarks.additions [N]``.

Simulates N realizations of each image on 256 × 256 cells with the default settings and, in turns,
with one addition switched off; then with everything switched off that the paper does not have. A
row has geometric means over the images, or means of percentages. The columns:

- far: divergence of patterns of 3 × 3 cells that are 5 cells apart, pooled over realizations, with
  the addition relative to without; no correction optimizes these patterns
- tau: error of the connectivity functions, with relative to without
- bias: largest difference between a mean proportion and that of the image, in points: without, with
- wrong: data that are not honoured, in percent: without, with
- CPU: time of a realization, with relative to without

The images are `channels`, `stone_wall` and `barchans`, which helped to choose settings, and
`dunes`, `delta` and `lenses`, which did not.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.fidelity import divergence, tau_error
from ccwsim import Ensemble, HardData, Parameters, TrainingImage, datasets, simulate
from ccwsim.datasets.sampling import sample_random
from tools.datasets import generate

IMAGES = ("channels", "stone_wall", "barchans", "dunes", "delta", "lenses")
SHAPE, N_DATA = (256, 256), 200
WITHOUT: dict[str, dict[str, Any]] = {
    "refine": {"refine": False},
    "exact_data": {"exact_data": False},
    "repair_seams": {"repair_seams": False},
    "published_draw": {"published_draw": True},
}
"""Settings that switch off one addition."""


def studies() -> list[tuple[TrainingImage, HardData | None]]:
    """Return each image without data, and with data sampled from another field of its generator."""
    found: list[tuple[TrainingImage, HardData | None]] = []
    for name in IMAGES:
        image, truth = datasets.load(name), generate(name, shape=SHAPE, seed=77)
        found += [(image, None), (image, sample_random(truth.array, N_DATA, 3))]
    return found


def measured(e: Ensemble, image: TrainingImage) -> dict[str, float]:
    """Return the columns of one ensemble."""
    return {
        "far": divergence(e.indices, np.asarray(image.indices), 3, 5),
        "tau": tau_error(e, image),
        "bias": 100 * float(np.abs(e.proportions.mean(axis=0) - image.proportions).max()),
        "wrong": 100 * float(e.n_mismatched.mean()) / max(e.hard_data.n, 1),
        "CPU": float(np.median(e.cpu_seconds)),
    }


def row(pairs: Sequence[tuple[dict[str, float], dict[str, float]]]) -> str:
    """Return the cells of a row of pairs (without, with)."""

    def ratio(key: str) -> str:
        logs = [np.log(after[key] / before[key]) for before, after in pairs]
        return f"{np.exp(np.mean(logs)):.2f}"

    def both(key: str) -> str:
        return " → ".join(f"{np.mean([pair[k][key] for pair in pairs]):.2f}" for k in (0, 1))

    return " | ".join([ratio("far"), ratio("tau"), both("bias"), both("wrong"), ratio("CPU")])


def main(n: int) -> None:
    """Measure and print a row for each addition, without and with data."""
    print("| addition | data | far | tau | bias | wrong | CPU |\n|---" + "|---" * 6 + "|")
    for name, settings in WITHOUT.items():
        pairs: dict[bool, list[tuple[dict[str, float], dict[str, float]]]] = {}
        for image, data in studies():
            ensembles = [
                simulate(image, SHAPE, replace(Parameters(), **s), data, n, seed=4)
                for s in (settings, {})
            ]
            before, after = (measured(e, image) for e in ensembles)
            pairs.setdefault(data is not None, []).append((before, after))
        for with_data, each in pairs.items():
            print(f"| {name} | {'yes' if with_data else 'no'} | {row(each)} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
