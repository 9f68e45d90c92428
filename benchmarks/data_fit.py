"""Rates of right verdicts of `fit_data`: ``python -m benchmarks.data_fit [N_TRUTHS]``.

Data are sampled at random cells of reference fields, which come from the generators of bundled
images with other seeds. The first table has the false alarms: the share of reference fields whose
data are found to contradict the bundled image of the same generator. The second table has this
share for all other images, and how often `rank_images` names the right or a wrong image. The third
table has the shares for vertical wells in reference volumes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np

from ccwsim import HardData, TrainingImage, datasets
from ccwsim.metrics import DataFit, fit_data, rank_images
from ccwsim.metrics.data_fit import winner
from tools.datasets import generate, generate_volume

NAMES = ("channels", "stone_wall", "lenses", "barchans")
SIDES = (256, 384, 512)
NUMBERS = (100, 400)
OTHERS = {
    "channels": ("fractures", "turned channels", "bend", "stone_wall"),
    "stone_wall": ("channels", "fractures", "bend"),
    "barchans": ("lenses", "turned barchans", "delta"),
}
WELLS, VOLUME_SHAPE = (10, 20), (32, 96, 96)
OF_VOLUMES = {
    "sinuous_channels": ("sinuous_channels", "turned sinuous_channels", "stacked_lenses"),
    "stacked_lenses": ("stacked_lenses", "turned stacked_lenses", "folded_layers"),
}
"""Images to compare with the wells of a generator; the first image is the right one."""
SEED = 7200


def image(name: str) -> TrainingImage:
    """Return a bundled image, or a bundled image rotated by 90°."""
    if not name.startswith("turned "):
        return datasets.load(name)
    upright = datasets.load(name.removeprefix("turned "))
    turned = np.rot90(upright.array, axes=(-2, -1))
    return TrainingImage(turned, name=name, facies_names=upright.facies_names)


def samples(name: str, side: int, n: int, first: int, n_truths: int) -> Iterator[HardData]:
    """Yield n data at random cells of each reference field of a generator."""
    for seed in range(SEED + first, SEED + first + n_truths):
        truth = generate(name, shape=(side, side), seed=seed)
        flat = np.random.default_rng(1000 * seed + n).choice(truth.indices.size, n, replace=False)
        rows, columns = np.divmod(flat, side)
        yield HardData(np.column_stack([rows, columns]), truth.array[rows, columns])


def rejected(name: str, other: str, side: int, n: int, first: int, n_truths: int) -> list[bool]:
    """Return for each reference field of a generator whether its data contradict another image."""
    candidate = image(other)
    return [
        is_flagged(fit_data(candidate, data, (side, side)))
        for data in samples(name, side, n, first, n_truths)
    ]


def is_flagged(fit: DataFit) -> bool:
    """Return whether data contradict an image, or prefer one of its facies."""
    return fit.contradicts or bool(fit.preferred)


def wells(name: str, n: int, seed: int) -> HardData:
    """Return n vertical wells at random positions in a reference volume."""
    truth = generate_volume(name, shape=VOLUME_SHAPE, seed=seed)  # type: ignore[arg-type]
    nz, ny, nx = VOLUME_SHAPE
    places = np.random.default_rng(1000 * seed + n).choice(ny * nx, n, replace=False)
    cells = np.array([(z, *divmod(int(place), nx)) for place in places for z in range(nz)])
    return HardData(cells, truth.array[tuple(cells.T)])


def wells_rejected(name: str, other: str, n: int, n_truths: int) -> str:
    """Return how many reference volumes of a generator contradict an image, or lack its facies."""
    candidate = image(other)
    data = [wells(name, n, seed) for seed in range(SEED, SEED + n_truths)]
    known = [each for each in data if np.isin(each.facies, candidate.codes).all()]
    found = sum(fit_data(candidate, each, VOLUME_SHAPE).contradicts for each in known)
    return f"{found} of {len(known)}"


def main(n_truths: int = 8) -> None:
    """Print the tables."""
    print(f"{'data of':<12}{'side':>5}" + "".join(f"{n:>8}" for n in NUMBERS) + "  false alarms")
    everything: list[bool] = []
    for name in NAMES:
        for side in SIDES:
            found = [rejected(name, name, side, n, 0, n_truths) for n in NUMBERS]
            everything += [alarm for each in found for alarm in each]
            print(f"{name:<12}{side:>5}" + "".join(f"{np.mean(each):>8.2f}" for each in found))
    print(f"all: {sum(everything)} of {len(everything)}\n")
    print(f"{'data of':<12}{'image':<18}" + "".join(f"{n:>8}" for n in NUMBERS) + "  found")
    for name, others in OTHERS.items():
        for other in others:
            found = [rejected(name, other, 512, n, 0, n_truths) for n in NUMBERS]
            print(f"{name:<12}{other:<18}" + "".join(f"{np.mean(each):>8.2f}" for each in found))
        candidates = [image(each) for each in (name, *others)]
        for n in NUMBERS:
            named = [
                winner(rank_images(candidates, data)) for data in samples(name, 512, n, 0, n_truths)
            ]
            right = sum(one is candidates[0] for one in named)
            wrong = sum(one is not None for one in named) - right
            print(f"{name:<12}named of {n} data: right {right}, wrong {wrong} of {n_truths}")
    print(f"\n{'wells of':<18}{'image':<26}" + "".join(f"{n:>10}" for n in WELLS) + "  found")
    for name, others in OF_VOLUMES.items():
        for other in others:
            each = "".join(f"{wells_rejected(name, other, n, n_truths):>10}" for n in WELLS)
            print(f"{name:<18}{other:<26}{each}", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
