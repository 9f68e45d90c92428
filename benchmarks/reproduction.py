"""Rates of right verdicts of `check_ensemble`: ``python -m benchmarks.reproduction [N_TRUTHS]``.

The first table has the false alarms. Fields from the generators of bundled images, with other
seeds, are judged as if they were realizations, so no check should differ. The table has the share
of fields in which a check differs, and the kinds of these checks. The second table has the same
shares for simulations with poor settings, each with two seeds.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ccwsim import Ensemble, HardData, Parameters, TrainingImage, datasets, simulate
from ccwsim.metrics import Check, check_ensemble
from ccwsim.model.grid import Grid
from tools.datasets import generate, generate_volume

MAPS = ("channels", "stone_wall", "lenses", "barchans")
SIDES = (256, 384, 512)
VOLUMES = ("sinuous_channels", "stacked_lenses")
VOLUME_SHAPE = (32, 96, 96)
TRUTHS = (1, 8)
SEED = 8300
AS_PUBLISHED = Parameters(published_draw=True, repair_seams=False)
POOR = {
    "K 500 as published": replace(AS_PUBLISHED, n_candidates=500),
    "template 8": Parameters(template_size=8, overlap_size=4),
    "level 4, T 32, OR 16": Parameters(template_size=32, overlap_size=16, wavelet_level=4),
    "default": Parameters(),
}
N_REALIZATIONS = 12


def as_ensemble(image: TrainingImage, truths: Sequence[TrainingImage]) -> Ensemble:
    """Return fields as the realizations of a training image."""
    n, shape = len(truths), truths[0].shape
    indices = np.array([np.searchsorted(image.codes, t.array) for t in truths]).astype(np.uint8)
    study = image, Grid.of(shape), Parameters(), HardData(), 0
    return Ensemble(*study, indices, np.ones(n), 1.0, np.zeros((n, 0), np.int16), np.arange(n))


def differing(ensemble: Ensemble) -> list[Check]:
    """Return the checks in which an ensemble differs from its training image."""
    return [check for check in check_ensemble(ensemble) if not check.fit.fits]


def truth_of(name: str, shape: Any, seed: int) -> TrainingImage:
    """Return a map or a volume from a generator, with another seed than the bundled image."""
    if len(shape) == 2:
        return generate(name, shape=shape, seed=seed)
    return generate_volume(name, shape=shape, seed=seed)


def flagged(name: str, shape: tuple[int, ...], n: int, seeds: range) -> list[list[Check]]:
    """Return the differing checks of ensembles of n fields, one ensemble per seed."""
    image = datasets.load(name)
    found = []
    for seed in seeds:
        truths = [truth_of(name, shape, seed + 1000 * r) for r in range(n)]
        found.append(differing(as_ensemble(image, truths)))
    return found


def print_row(name: str, size: object, found: list[list[Check]]) -> None:
    """Print the share of ensembles in which a check differs, and the kinds of these checks."""
    kinds = Counter(kind for checks in found for kind in {check.kind for check in checks})
    said = ", ".join(f"{kind} {n}" for kind, n in kinds.most_common())
    print(f"{name:<24}{size!s:>12}{sum(map(bool, found)):>4} of {len(found):<5}{said}", flush=True)


def main(n_truths: int = 9) -> None:
    """Print both tables."""
    seeds = range(SEED, SEED + n_truths)
    for n in TRUTHS:
        print(f"{f'{n} truths of':<24}{'size':>12}  differ")
        for name in MAPS:
            for side in SIDES:
                print_row(name, side, flagged(name, (side, side), n, seeds))
        for name in VOLUMES:
            print_row(name, "volume", flagged(name, VOLUME_SHAPE, n, seeds[: -(-n_truths // 2)]))
    print(f"\n{'settings':<24}{'image':>12}  differ")
    for said, settings in POOR.items():
        for name in MAPS:
            image = datasets.load(name)
            found = [
                differing(simulate(image, (256, 256), settings, None, N_REALIZATIONS, seed))
                for seed in (SEED, SEED + 100)
            ]
            print_row(said, name, found)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
