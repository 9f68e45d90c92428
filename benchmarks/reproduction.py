"""Rates of right verdicts of `check_ensemble`: ``python -m benchmarks.reproduction [N_TRUTHS]``.

The first table has the false alarms. Fields from the generators of bundled images, with other
seeds, are judged as if they were realizations, so no check should differ. The table has the share
of fields in which a check differs, and the kinds of these checks. The second table has the same
shares if the training image is one of N_TRUTHS other images from each generator: for another field
of the generator, for simulations with poor settings, and for simulations of a wrong image.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim import Ensemble, Parameters, TrainingImage, datasets, simulate
from ccwsim.metrics import Check, check_ensemble
from ccwsim.model.grid import Grid
from ccwsim.model.study import Study
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
GOOD, WRONG = "another field", "wrong image"
OTHERS = {
    "channels": ("fractures", "bend", "stone_wall"),
    "stone_wall": ("channels", "fractures", "bend"),
    "lenses": ("barchans", "dunes", "delta"),
    "barchans": ("lenses", "dunes", "delta"),
}
"""Wrong images with as many facies as the images of a generator."""
N_REALIZATIONS, SIDE = 12, 256


def as_ensemble(image: TrainingImage, truths: Sequence[TrainingImage]) -> Ensemble:
    """Return fields as the realizations of a training image."""
    indices = np.array([np.searchsorted(image.codes, t.array) for t in truths])
    return with_indices(image, indices.astype(np.uint8))


def with_indices(image: TrainingImage, indices: NDArray[np.uint8]) -> Ensemble:
    """Return facies indices as the realizations of a training image."""
    n, shape = len(indices), indices.shape[1:]
    study = Study(image, Grid.of(shape), checked=False)
    return Ensemble(study, indices, np.ones(n), 1.0, np.zeros((n, 0), np.int16), np.arange(n))


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


def simulated(name: str, case: str, seed: int) -> Ensemble:
    """Return realizations to be judged by an image from a generator, one of the cases above."""
    image, grid = truth_of(name, datasets.load(name).shape, seed), (SIDE, SIDE)
    if case == GOOD:
        return as_ensemble(image, [truth_of(name, grid, seed + 1000)])
    if case != WRONG:
        return simulate(image, grid, POOR[case], None, N_REALIZATIONS, seed)
    wrong = datasets.load(OTHERS[name][seed % len(OTHERS[name])])
    return with_indices(image, simulate(wrong, grid, None, None, N_REALIZATIONS, seed).indices)


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
    print(f"\n{'realizations':<24}{'image':>12}  differ")
    for case in (GOOD, WRONG, *POOR):
        for name in MAPS:
            print_row(case, name, [differing(simulated(name, case, seed)) for seed in seeds])


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
