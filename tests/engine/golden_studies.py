"""Studies with stored digests: `python -m tests.engine.golden_studies` renews the digests.

Each study is simulated twice: by default, and as published (`published_draw`, no seam repair). If a
change is meant to alter cells, renew the digests and report the change in CHANGELOG.md. No other
change may alter a digest.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from itertools import combinations, product
from math import prod
from pathlib import Path

import numpy as np

from ccwsim import Auxiliary, HardData, Parameters, Secondary, TrainingImage, datasets, simulate

Study = tuple[str, str, dict[str, object], int]
DIGESTS = Path(__file__).with_name("golden_digests.json")
IMAGES = ("channels", "stone_wall", "barchans", "levees")
GRID = (117, 150)
N_DATA = (0, 40, 700, 2500)
SEARCHES = (
    {"method": "ccwsim", "wavelet_level": 0},
    {"method": "ccwsim", "wavelet_level": 1},
    {"method": "ccwsim", "wavelet_level": 2},
    {"method": "ccwsim", "wavelet_level": 3},
    {"method": "ccsim"},
    {"method": "ms-ccsim", "wavelet_level": 1},
    {"method": "ms-ccsim", "wavelet_level": 2},
    {"method": "ms-ccsim", "wavelet_level": 3},
)
OPTIONS = (
    {"similarity": "correlation"},
    {"exact_data": False},
    {"refine": False},
    {"match_proportions": True},
    {"location_weight": 1.0},
    {"template_variation": 0.3},
    {"random_path": False, "n_candidates": 1},
    {"co_template": 4, "search_fraction": 0.5},
    {"template_size": 16, "overlap_size": 8},
    {"template_size": 48, "overlap_size": 16, "n_candidates": 100},
    {"exact_data": False, "method": "ms-ccsim"},
    {"location_weight": 0.3, "method": "ms-ccsim", "match_proportions": True},
    {"template_size": 64, "overlap_size": 8, "wavelet_level": 3},
)
VOLUMES = ("sinuous_channels", "stacked_lenses", "folded_layers")
VOLUME_GRID = (21, 50, 60)
OF_VOLUMES = (
    {"template_size": (8, 16, 16), "overlap_size": (2, 4, 4), "wavelet_level": 0},
    {"template_size": (8, 16, 16), "overlap_size": (2, 4, 4), "wavelet_level": 1},
    {"template_size": (8, 16, 24), "overlap_size": (4, 4, 8), "wavelet_level": (1, 2, 2)},
    {"template_size": 16, "overlap_size": 4, "method": "ms-ccsim", "wavelet_level": 1},
    {"template_size": 8, "overlap_size": 2, "similarity": "correlation", "wavelet_level": 1},
    {"template_size": 8, "overlap_size": 4, "location_weight": (1.0, 0.0, 0.0)},
    {"template_size": 8, "overlap_size": 4, "match_proportions": True, "random_path": False},
)
LARGE = {"template_size": (16, 32, 32), "overlap_size": (4, 8, 8), "wavelet_level": (1, 2, 2)}
"""Parameters of studies whose scores are summed in several groups."""
OF_GUIDES = (
    {"secondary": "probabilities"},
    {"secondary": "probabilities", "method": "ms-ccsim", "template_size": 24},
    {"secondary": "auxiliary"},
    {"secondary": "active"},
    {"secondary": "angle"},
    {"secondary": "zones", "wavelet_level": 1},
)
OF_GUIDES_IN_VOLUMES = tuple(
    {**OF_VOLUMES[1], "secondary": kind} for kind in ("probabilities", "active")
)
PUBLISHED = {"published_draw": True, "repair_seams": False}


def studies() -> Iterator[Study]:
    """Yield each of the 474 studies: name, training image, parameters and number of data.

    Parameters may have the entry "secondary", a kind of `secondary_of`.
    """
    for changes in (PUBLISHED, {}):
        for name, image, options, n_data in _studies():
            yield " ".join([name, *changes]), image, {**options, **changes}, n_data


def _studies() -> Iterator[Study]:
    for image, search, n_data in product(IMAGES, SEARCHES, N_DATA):
        yield _name(image, search, n_data), image, search, n_data
    for k, (image, options) in enumerate(product(IMAGES, OPTIONS)):
        n_data = N_DATA[k % len(N_DATA)]
        yield _name(image, options, n_data), image, options, n_data
    for k, (image, options) in enumerate(product(VOLUMES, OF_VOLUMES)):
        n_data = (0, 60, 900)[k % 3]
        yield _name(image, options, n_data), image, options, n_data
    for image, n_data in product(VOLUMES, (0, 900)):
        yield _name(image, LARGE, n_data), image, LARGE, n_data
    for images, given in ((IMAGES, OF_GUIDES), (VOLUMES, OF_GUIDES_IN_VOLUMES)):
        for k, (image, options) in enumerate(product(images, given)):
            n_data = (0, 40, 700)[k % 3] if k % 2 else 0
            yield _name(image, options, n_data), image, options, n_data


def _name(image: str, options: dict[str, object], n_data: int) -> str:
    return " ".join([image, *(f"{key}={value}" for key, value in options.items()), f"n={n_data}"])


def few(n: int = 60) -> list[Study]:
    """Return quick studies that cover images, numbers of data, options, and most pairs of these.

    The next study is always the study that adds most new pairs.
    """
    rest = [(study, _pairs(study)) for study in studies() if not _takes_long(study)]
    chosen: list[Study] = []
    covered: set[tuple[str, ...]] = set()
    while len(chosen) < n:
        best = max(rest, key=lambda each: len(each[1] - covered))
        rest.remove(best)
        chosen.append(best[0])
        covered |= best[1]
    return chosen


def _takes_long(study: Study) -> bool:
    """Return whether a study takes seconds, or needs a kernel that no other of the tests needs."""
    _, image, options, n_data = study
    long = image in VOLUMES[1:] and bool(n_data) and options.get("wavelet_level") == 0
    return long or (image in VOLUMES and options.get("method") == "ms-ccsim")


def _pairs(study: Study) -> set[tuple[str, ...]]:
    _, image, options, n_data = study
    values = {"image": image, "n_data": n_data, **dict.fromkeys(PUBLISHED, "default"), **options}
    return {*combinations(sorted(f"{key}={value}" for key, value in values.items()), 2)}


def secondary_of(kind: object, image: TrainingImage, grid: tuple[int, ...]) -> Secondary | None:
    """Return secondary information of a kind for a training image and a grid, or None."""
    ramp, column = (np.indices(shape)[-1] / shape[-1] for shape in (grid, image.shape))
    if kind == "probabilities":
        own = dict(zip(image.codes.tolist(), image.proportions, strict=True))
        own.pop(int(image.codes[0]))
        return Secondary(probabilities={code: p * (0.6 + 0.6 * ramp) for code, p in own.items()})
    if kind == "auxiliary":
        return Secondary(auxiliary=[Auxiliary(column, 1 - ramp)])
    if kind == "active":
        return Secondary(active=ramp + np.indices(grid)[-2] / grid[-2] < 1.2)
    if kind == "angle":
        return Secondary(angle=90.0 * ramp)
    if kind == "zones":
        other = datasets.load("lenses" if image.n_facies == 3 else "fractures")
        return Secondary(images=[other], zones=(ramp > 0.5).astype(int))
    return None


def digest(image: str, options: dict[str, object], n_data: int) -> str:
    """Return a digest of two realizations: cells, sources and status of the data."""
    ti = datasets.load(image)
    rng = np.random.default_rng(n_data)
    grid, first = (GRID, (20, 30)) if len(ti.shape) == 2 else (VOLUME_GRID, (4, 20, 30))
    cells = np.argwhere(np.ones(grid))[rng.choice(prod(grid), n_data, replace=False)]
    facies = np.asarray(ti.array)[tuple((cells + first).T)]
    parameters = Parameters(**{k: options[k] for k in options if k != "secondary"})  # type: ignore[arg-type]
    given = secondary_of(options.get("secondary"), ti, grid)
    data = HardData(cells, facies)
    e = simulate(ti, grid, parameters, data, 2, 7, keep_sources=True, secondary=given)
    summary = hashlib.blake2b(digest_size=16)
    for array, kind in ((e.realizations, "<i8"), (e.data_status, "<i2"), (e.sources, "<i4")):
        summary.update(np.ascontiguousarray(np.nan_to_num(array, nan=-1), kind).tobytes())
    return summary.hexdigest()


if __name__ == "__main__":
    found = {name: digest(image, options, n_data) for name, image, options, n_data in studies()}
    DIGESTS.write_text(json.dumps(found, indent=1) + "\n", "utf-8")
