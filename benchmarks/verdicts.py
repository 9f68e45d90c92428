"""Rates of red headlines by case: ``python -m benchmarks.verdicts FILE [N_SEEDS]``.

Three kinds of fields are judged as if they were the realizations of a training image:

- true fields: other images from the generator of the image, in ensembles of 1, 8, 12 and 40 fields.
  They are judged by the bundled image and by another image of the same generator. The published
  images in the folder CCWSIM_DATA have no generator: one half of them is judged by the other half.
- faults: 12 realizations with poor settings.
- altered: 12 realizations of the altered image, judged by the image itself.

Volumes have 32 × 96 × 96 cells; theirs are "true volumes" of the bundled images, and faults.

A row of FILE (CSV) has the checks of one ensemble. Rows in FILE are not computed again, so a run
can be interrupted. The tables of the rows in FILE are printed at the end.
"""

from __future__ import annotations

import csv
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from benchmarks.reproduction import AS_PUBLISHED, SIDE, VOLUME_SHAPE, as_ensemble, with_indices
from ccwsim import Ensemble, Parameters, TrainingImage, read_training_image, simulate
from ccwsim.metrics import check_ensemble, default_parameters
from tools.datasets import GENERATORS, VOLUMES, generate, generate_volume

CHOSEN = ("channels", "stone_wall", "lenses", "levees")
"""Generators whose rates chose the constants of the bands; the others and real images confirm."""
REAL = {
    "paper's channels": "paper/ti_channel_256x256.npy",
    "paper's stone wall": "paper/ti_stonewall_200x200.npy",
    "paper's three facies": "paper/ti_three_facies_400x400.npy",
    "Strebelle": "formats/ti_strebelle_250_250_1.dat",
}
SEED, N_SEEDS, N_FIELDS, N_REALIZATIONS = 9700, 10, 40, 12
GROUPS = {
    1: [slice(k, k + 1) for k in range(4)],
    8: [slice(24, 32), slice(32, 40)],
    12: [slice(0, 12), slice(12, 24)],
    40: [slice(0, 40)],
}
"""Fields of each ensemble, by the number of fields."""
GROUPS_OF_VOLUMES = (*(slice(k, k + 1) for k in range(4)), slice(4, 12), slice(0, 12))
FAULTS = {
    "default": Parameters(),
    "T 8": Parameters(template_size=8, overlap_size=4),
    "K 500": Parameters(n_candidates=500),
    "K 500 as published": replace(AS_PUBLISHED, n_candidates=500),
    "OR 2": Parameters(overlap_size=2, wavelet_level=1),
}
HEAD = ("case", "name", "seed", "m", "group", "checks", "cannot tell", "red")
Key = tuple[str, ...]


def dilated(image: NDArray) -> NDArray:
    """Return an image whose last facies is one cell thicker on all sides."""
    last = image.max()
    return np.where(binary_dilation(image == last), last, image)


ALTERED: dict[str, Callable[[NDArray], NDArray]] = {
    "turned": lambda a: np.rot90(a, axes=(-2, -1)),
    "mirrored": lambda a: a[..., ::-1],
    "× 2": lambda a: a[..., : a.shape[-2] // 2, : a.shape[-1] // 2].repeat(2, -2).repeat(2, -1),
    "× ½": lambda a: a[..., ::2, ::2],
    "dilated": dilated,
}


@cache
def image_of(name: str, seed: int | None) -> TrainingImage:
    """Return the bundled image, or another image of the same generator and shape."""
    return (generate_volume if name in VOLUMES else generate)(name, seed=seed)


@cache
def fields(name: str, seed: int) -> list[TrainingImage]:
    """Return fields of a generator that no other seed has.

    They are as large as the image, because some generators draw other proportions in other sizes:
    levees have 73 % flood plain in 256² cells, but 68 % in the bundled size.
    """
    seeds = [1000 * seed + k for k in range(N_FIELDS)]
    if name in VOLUMES:
        n = GROUPS_OF_VOLUMES[-1].stop
        return [generate_volume(name, seed=each) for each in seeds[:n]]
    return [generate(name, seed=each) for each in seeds]


def real_images() -> dict[str, TrainingImage]:
    """Return the published images, if there is a folder of them."""
    folder = os.environ.get("CCWSIM_DATA")
    if not folder:
        return {}
    return {name: _real(Path(folder) / file) for name, file in REAL.items()}


def _real(path: Path) -> TrainingImage:
    return TrainingImage(np.load(path)) if path.suffix == ".npy" else read_training_image(path)


def halves(image: TrainingImage) -> Iterator[tuple[TrainingImage, TrainingImage]]:
    """Yield each half of an image with the other half, along both axes."""
    for axis in (0, 1):
        parts = np.array_split(image.array, 2, axis=axis)
        yield from (
            (TrainingImage(one), TrainingImage(other)) for one, other in (parts, parts[::-1])
        )


def ensembles(n_seeds: int) -> Iterator[tuple[Key, Callable[[], Ensemble]]]:
    """Yield the key of each ensemble, and a function that returns it."""
    real = real_images()
    for name, image in real.items():
        for k, (one, other) in enumerate(halves(image)):
            if np.array_equal(one.codes, other.codes):
                key = "true, other half", name, "0", "1", str(k)
                yield key, lambda one=one, other=other: as_ensemble(one, [other])
    for seed in range(SEED, SEED + n_seeds):
        for name in GENERATORS:
            for case, number in (("true, bundled", None), ("true, other", seed)):
                for m, groups in GROUPS.items():
                    for k, group in enumerate(groups):
                        key = case, name, str(seed), str(m), str(k)
                        yield key, lambda a=(name, seed, number, group): true_ensemble(*a)
            yield from _poor(name, partial(image_of, name, seed), seed)
            fields.cache_clear()
        for name, image in real.items():
            yield from _poor(name, lambda image=image: image, seed)
        for name in VOLUMES:
            for k, group in enumerate(GROUPS_OF_VOLUMES):
                m = str(group.stop - group.start)
                for case, number in (
                    ("true volumes, bundled", None),
                    ("true volumes, other", seed),
                ):
                    key = case, name, str(seed), m, str(k)
                    yield key, lambda a=(name, seed, number, group): true_ensemble(*a)
            yield from _poor(name, partial(image_of, name, seed), seed)
            fields.cache_clear()


def true_ensemble(name: str, seed: int, number: int | None, group: slice) -> Ensemble:
    """Return true fields judged by the image with the seed `number`, or by the bundled image."""
    return as_ensemble(image_of(name, number), fields(name, seed)[group])


def _poor(
    name: str, image: Callable[[], TrainingImage], seed: int
) -> Iterator[tuple[Key, Callable[[], Ensemble]]]:
    """Yield the ensembles of faults and of altered images."""
    for case in (*FAULTS, *ALTERED):
        key = case, name, str(seed), str(N_REALIZATIONS), "0"
        yield key, lambda case=case: simulated(image(), case, seed)


def simulated(image: TrainingImage, case: str, seed: int) -> Ensemble:
    """Return realizations with poor settings, or of the altered image, judged by the image."""
    grid = VOLUME_SHAPE if image.n_dimensions == 3 else (SIDE, SIDE)
    if case in FAULTS:
        return simulate(image, grid, FAULTS[case], None, N_REALIZATIONS, seed)
    altered = TrainingImage(np.ascontiguousarray(ALTERED[case](image.array)))
    parameters = Parameters() if min(altered.shape) >= SIDE // 2 else default_parameters(altered)
    e = simulate(altered, grid, parameters, None, N_REALIZATIONS, seed)
    return with_indices(
        image, np.searchsorted(image.codes, altered.codes)[e.indices].astype(np.uint8)
    )


def row_of(ensemble: Ensemble) -> tuple[int, int, str]:
    """Return the number of checks, how many cannot tell, and the names of the red ones."""
    checks = check_ensemble(ensemble)
    red = [f"{c.kind} {c.facies} {c.direction}" for c in checks if not c.fit.fits]
    return len(checks), sum(c.fit.cannot_tell for c in checks), "; ".join(red)


def run(file: Path, n_seeds: int) -> None:
    """Append the rows that are missing in a file."""
    rows = read(file)
    with file.open("a", newline="", encoding="utf-8") as f:
        writer = csv.writer(f)
        if not rows:
            writer.writerow(HEAD)
        for key, ensemble in ensembles(n_seeds):
            if key not in rows:
                writer.writerow([*key, *row_of(ensemble())])
                f.flush()


def read(file: Path) -> dict[Key, list[str]]:
    """Return the rows in a file by the key of their ensemble."""
    if not file.exists():
        return {}
    with file.open(newline="", encoding="utf-8") as f:
        return {tuple(row[:5]): row[5:] for row in csv.reader(f) if row[0] != HEAD[0]}


def print_tables(rows: dict[Key, list[str]]) -> None:
    """Print how many ensembles are red, by case and number of fields, and by name."""
    names = list(dict.fromkeys(name for _, name, *_ in rows))
    print(f"| case | m | all | {' | '.join(names)} | kinds |")
    print("|---|--:|" + "--:|" * (len(names) + 1) + "---|")
    for case, m in sorted({(case, int(m)) for case, _, _, m, _ in rows}):
        own = {key: row for key, row in rows.items() if (key[0], int(key[3])) == (case, m)}
        red = [
            [bool(row[2]) for key, row in own.items() if name in ("all", key[1])]
            for name in ("all", *names)
        ]
        kinds = Counter(
            kind
            for row in own.values()
            for kind in {each.split()[0] for each in row[2].split("; ") if each}
        )
        cells = (f"{sum(each)} of {len(each)}" if each else "" for each in red)
        said = ", ".join(f"{kind} {n}" for kind, n in kinds.most_common())
        print(f"| {case} | {m} | {' | '.join(cells)} | {said} |")
    fields_judged = sum(int(key[3]) for key in rows)
    print(f"\n{fields_judged} fields in {len(rows)} ensembles")


def main(file: str, n_seeds: str = str(N_SEEDS)) -> None:
    """Compute the missing rows and print the tables."""
    run(Path(file), int(n_seeds))
    print_tables(read(Path(file)))


if __name__ == "__main__":
    main(*sys.argv[1:])
