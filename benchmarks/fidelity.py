"""Bias, lattice and dead ends of realizations: ``python -m benchmarks.fidelity``.

Prints a row for each training image and each variant of the method, and means as ratios to the
published variant (`published_draw`, no seam repair). The means of the images that were used to
choose the default settings ("chosen") and of all other images ("confirmed") are separate. The
columns:

- bias: largest difference between a mean proportion and that of the image, in percentage points
- spread: standard deviation of proportions, relative to that of pieces of the image
- rare: relative error of the mean proportion of the rarest facies, in percent
- JS: divergence between the patterns of 4 × 4 cells (3 × 3 × 3 in volumes) and those of the image
- pooled: the same divergence, between the image and the patterns of all realizations together
- far: divergence as for "pooled" of patterns of 3 × 3 (× 3) cells that are 5 cells apart (in
  volumes 2 cells); no correction optimizes these patterns
- bodies, extent: number of geobodies of the rarest facies per area, and their mean length along the
  longest axis, relative to the image; bodies of fewer than 5 cells do not count
- crossed: share of the pairs of cells at opposite sides, W-E and S-N, that the most frequent facies
  connects, minus the same share in the image
- tau: mean error of the connectivity functions E-W and N-S
- ends: dead ends of all facies except the most frequent, relative to the image (only maps)
- lattice: range of the mean of many realizations over positions in a patch (only maps)
- unseen: share of patterns of 3 × 3 (× 3) cells that are absent from the image
- copied: side of the largest copied square or cube, relative to the template
- variety: share of cells that differ between two realizations
- CPU: time of a realization; the variants are measured alternately

If CCWSIM_DATA is a folder of published data, its images are measured too.

``--drawn N`` instead measures N other maps from each generator of bundled images. These maps were
not used to choose any setting; "chosen" are the generators whose bundled image was used.
``--rare N`` measures N images of each kind of images with a rare facies (`rare_facies.py`).

``--data`` instead measures studies with hard data. Ratios compare the default variant with the
published variant. The columns:

- ends, JS, variety: ratios of the columns above
- Brier: ratio of the Brier scores at every fifth datum; these data are not used for conditioning
- wrong, forced: with the default variant, % of data not honoured, and % forced as single cells

``--trend`` instead measures truths from the generators whose bodies were removed on one side of a
wavy line, with wells at random positions, or three times as likely in the rarest facies.
The training image is another image of the generator. Two generators were used to choose when data
that contradict the image are used. The columns are means over images and ratios to the variant
without steering: Brier score of all cells, JS of 4 × 4 patterns to the truth, and the largest
difference of a proportion from the truth, in points, without and with steering.

``--flow`` instead prints the flow efficiency E of whole grids along x and y, of the image, of our
variants, of other images from the generator of a bundled image and, if CCWSIM_DATA is set, of the
realizations of published codes. E is the effective conductivity divided by the arithmetic mean,
with a contrast of 10⁴; cells connect through sides only. Spanning is the share of realizations in
which the facies connects the sides.

``--joins`` instead prints how geobodies of the second most frequent facies join in maps: unions,
loops and ends per 100 squares of 28 cells (see `metrics.fit_joins`) and Γ, each in crops of the
image and in pieces of 24 realizations, and the breaks per 100 patches. A strand breaks if the
patch, or what it overlaps, continues the strand nowhere in the overlap; an image has no breaks.

``--reach`` instead prints how far geobodies of this facies reach in images from four generators,
and in realizations of 256 × 256 cells with templates of 32, 48 and 64 cells: share of maps that the
facies spans W-E and S-N through sides, Γ, JS, dead ends, flow efficiencies along x and y, and the
least CPU time of a realization.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial.distance import jensenshannon

from benchmarks.rare_facies import rare_images
from benchmarks.volumes import image_of, published as published_volumes
from ccwsim import Ensemble, Grid, HardData, Parameters, TrainingImage, datasets, metrics, simulate
from ccwsim.datasets.sampling import sample_random
from ccwsim.engine import raster
from ccwsim.engine.stages.path import inside_overlap
from ccwsim.engine.trace.trace import Trace
from ccwsim.flow import flow_efficiency
from ccwsim.metrics import copying, pattern_distance, unseen_patterns
from ccwsim.model.study import Study
from ccwsim.paper.experiment import PAPER_IMAGES, inputs_in
from tools.datasets import generate

CHOSEN = (
    *("channels", "stone_wall", "fractures", "levees", "bend", "ti_channel_256x256"),
    *("sinuous_channels", "stacked_lenses", "folded_layers", "ti_maules_creek_340x200x80"),
)
"""Images that were used to choose the default settings."""
WAYS: dict[str, dict[str, bool]] = {
    "published": {"published_draw": True, "repair_seams": False},
    "no repair": {"repair_seams": False},
    "default": {},
}
COLUMNS = (
    "bias", "rare", "spread", "JS", "pooled", "far", "tau", "ends", "bodies", "extent", "crossed",
    "lattice", "unseen", "copied", "variety", "CPU",
)  # fmt: skip
RATIOS = ("JS", "pooled", "far", "tau", "variety", "CPU")
"""Columns that are averaged as ratios to the published variant."""
GEOMETRIC = ("ends", "bodies", "extent")
N, N_LATTICE, N_VOLUMES, N_DATA, N_FLOW, N_OTHERS = 40, 300, 6, 24, 12, 30
REACH_SIDE, N_SOLVED = 256, 6
N_TRACED, MIN_STRAND = 4, 4
"""Number of traced realizations, and minimum number of cells of a strand in an overlap."""
OF_DATA = ("ends", "JS", "Brier", "variety", "wrong", "forced")
"""Columns of studies with hard data."""
DENSE = (1000, 4000)
VOLUME = Parameters((16, 32, 32), (4, 8, 8), (1, 2, 2))


def drawn(n: int) -> Iterator[tuple[str, TrainingImage]]:
    """Yield new images from the generators, with the names of the generators."""
    for seed, name in product(range(101, 101 + n), datasets.names()):
        yield name, generate(name, seed=seed)


def images() -> Iterator[tuple[str, TrainingImage]]:
    """Yield the images to measure, with their names."""
    for name in datasets.names():
        yield name, datasets.load(name)
    folder = Path(os.environ.get("CCWSIM_DATA", "")) / "paper"
    for path in sorted(folder.glob("ti_*.npy")) if "CCWSIM_DATA" in os.environ else []:
        yield path.stem, TrainingImage(np.load(path), name=path.stem)
    for name in (*datasets.volume_names(), *(path.stem for path in published_volumes())):
        if "alluvial" not in name:
            yield name, image_of(name)


def skeleton(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the thinned shapes of a map (Zhang and Suen 1984)."""
    own = np.pad(mask, 1)
    while True:
        before = own.copy()
        for second in (False, True):
            p = [np.roll(own, s, (0, 1)) for s in RING]  # neighbours from the north, clockwise
            n = sum(p, np.zeros(own.shape, int))
            turns = sum((~a & b for a, b in zip(p, p[1:] + p[:1], strict=True)), 0 * n)
            north, east, south, west = p[0], p[2], p[4], p[6]
            one = ~(north & east & west) if second else ~(north & east & south)
            other = ~(north & south & west) if second else ~(east & south & west)
            own &= ~(own & (n >= 2) & (n <= 6) & (turns == 1) & one & other)
        own[[0, -1]] = own[:, [0, -1]] = False
        if (own == before).all():
            return own[1:-1, 1:-1]


RING = ((1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1))


def dead_ends(maps: NDArray[np.uint8], facies: int) -> float:
    """Return the number of ends of a facies' skeleton inside the map, divided by its length."""
    ends = length = 0
    for each in maps:
        thin = skeleton(each == facies)
        n = sum(np.roll(np.pad(thin, 1), s, (0, 1))[1:-1, 1:-1].astype(int) for s in RING)
        inside = np.s_[4:-4, 4:-4]
        ends += int((thin & (n == 1))[inside].sum())
        length += int(thin[inside].sum())
    return ends / max(length, 1)


def lattice(image: TrainingImage, p: Parameters) -> float:
    """Return the range of the mean over positions in a patch, divided by the proportion.

    Mean and proportion are those of the rarest facies; the mean is over many realizations.
    """
    step, overlap = p.step, p.overlap_size
    n = max(min(image.shape) // step, 2) * step + overlap
    e = simulate(image, (n, n), p, n_realizations=N_LATTICE, seed=5)
    rare = int(np.argmin(image.proportions))
    mean = (e.indices == rare).mean(axis=0)[:-overlap, :-overlap]
    folded = mean.reshape(n // step, step, n // step, step).mean(axis=(0, 2))
    profile = (folded.mean(axis=0) + folded.mean(axis=1)) / 2
    return float(np.ptp(profile) / image.proportions[rare])


def spread_of_pieces(image: TrainingImage, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the standard deviation of the proportions in pieces as large as the grid."""
    rng, index = np.random.default_rng(0), np.asarray(image.indices)
    own = [min(n, -(-m // 2)) for n, m in zip(shape, index.shape, strict=True)]
    found = []
    for _ in range(400):
        first = [rng.integers(m - n + 1) for n, m in zip(own, index.shape, strict=True)]
        piece = index[tuple(slice(k, k + n) for k, n in zip(first, own, strict=True))]
        found.append(np.bincount(piece.ravel(), minlength=image.n_facies) / piece.size)
    return np.std(found, axis=0) * np.sqrt(np.prod(own) / np.prod(shape))


def tau_error(e: Ensemble, image: TrainingImage) -> float:
    """Return the mean error of τ over facies, directions, and lags up to a quarter of a side."""
    found, lags = [], np.arange(1, min(image.shape[-2:]) // 4, 3)
    for facies in _own(image):
        for direction in ("E-W", "N-S"):
            own = metrics.connectivity(e, int(facies), direction, lags).tau
            wanted = metrics.connectivity(image, int(facies), direction, lags).tau
            found.append(np.nanmean(np.abs(np.nanmean(own, axis=0) - wanted[0])))
    return float(np.mean(found))


def divergence(found: NDArray[np.uint8], image: NDArray[np.uint8], side: int, step: int) -> float:
    """Return the divergence, in bits, of patterns of `side` cells that are `step` cells apart."""
    n_facies, counts = int(image.max()) + 1, []
    for cells in (found, image[None]):
        shape = [1 if n == 1 else n - (side - 1) * step for n in cells.shape[1:]]
        codes = np.zeros((len(cells), *shape), np.int64)
        for first in np.ndindex(*(1 if n == 1 else side for n in cells.shape[1:])):
            part = (slice(k * step, k * step + n) for k, n in zip(first, shape, strict=True))
            codes = codes * n_facies + cells[(slice(None), *part)]
        counts.append(dict(zip(*np.unique(codes, return_counts=True), strict=True)))
    both = [
        np.array([each.get(code, 0) for code in counts[0] | counts[1]], float) for each in counts
    ]
    return float(jensenshannon(*both, base=2) ** 2)


def geobodies(maps: NDArray[np.uint8], facies: int) -> tuple[float, float]:
    """Return the number of geobodies per cell, and their mean length along the longest axis."""
    n, lengths = 0, []
    for each in maps:
        labels, _ = ndimage.label(each == facies, np.ones((3,) * each.ndim))
        large = np.bincount(labels.ravel()) >= 5
        boxes = [box for box, ok in zip(ndimage.find_objects(labels), large[1:], strict=True) if ok]
        lengths += [max(part.stop - part.start for part in box) for box in boxes]
        n += len(boxes)
    return n / maps.size, float(np.mean(lengths)) if lengths else 0.0


def crossed(maps: NDArray[np.uint8], facies: int) -> float:
    """Return the share of pairs of cells at opposite sides (W-E, S-N) in the same geobody."""
    shares = []
    for each in maps:
        labels, n = ndimage.label(each == facies)
        for axis in (-1, -2):
            sides = [np.bincount(np.take(labels, end, axis).ravel(), minlength=n + 1)[1:]
                     / np.take(labels, end, axis).size for end in (0, -1)]  # fmt: skip
            shares.append(sides[0] @ sides[1])
    return float(np.mean(shares))


def _own(image: TrainingImage) -> NDArray:
    """Return the codes of all facies except the most frequent."""
    return np.delete(image.codes, int(np.argmax(image.proportions)))


def judged(image: TrainingImage, p: Parameters, data: HardData | None = None) -> dict[str, float]:
    """Return the columns of one row, except the time."""
    volume = len(image.shape) == 3
    shape = (48, 100, 100) if volume else image.shape
    n = N_VOLUMES if volume else N
    e = simulate(image, shape, p, data, n, seed=1, keep_sources=True)
    sources = np.asarray(e.sources)[:10]
    index, most = np.asarray(image.indices), int(np.argmax(image.proportions))
    rare = int(np.argmin(image.proportions))
    bodies, wanted_bodies = geobodies(e.indices[:10], rare), geobodies(index[None], rare)
    rows = {
        "rare": 100 * (e.proportions[:, rare].mean() / image.proportions[rare] - 1),
        "pooled": divergence(e.indices, index, 3 if volume else 4, 1),
        "far": divergence(e.indices, index, 3, 2 if volume else 5),
        "bodies": bodies[0] / max(wanted_bodies[0], 1e-9),
        "extent": bodies[1] / max(wanted_bodies[1], 1e-9),
        "crossed": crossed(e.indices[:10], most) - crossed(index[None], most),
        "bias": 100 * np.abs(e.proportions.mean(axis=0) - image.proportions).max(),
        "spread": float((e.proportions.std(axis=0) / spread_of_pieces(image, shape)).mean()),
        "JS": pattern_distance(e, image, size=3 if volume else 4, factors=(1,)).mean(),
        "tau": tau_error(e, image),
        "unseen": 100 * unseen_patterns(e, image).mean(),
        "copied": np.mean([copying(s, image.shape).largest_square for s in sources]),
        "variety": np.mean([(a != b).mean() for a, b in pairwise(e.indices)]),
    }
    size = p.template_size
    rows["copied"] /= size if isinstance(size, int) else max(size)
    if not volume:
        own = [int(np.searchsorted(image.codes, code)) for code in _own(image)]
        wanted = [dead_ends(np.asarray(image.indices)[None], k) for k in own]
        found = [dead_ends(e.indices[:10], k) for k in own]
        rows["ends"] = float(np.mean(found) / max(np.mean(wanted), 1e-4))
        if data is None:
            rows["lattice"] = 100 * lattice(image, p)
    return {key: float(value) for key, value in rows.items()}


def studies() -> Iterator[tuple[str, TrainingImage, HardData, tuple[int, ...]]]:
    """Yield studies of maps with bundled data, denser samples and published data."""
    for name in datasets.hard_data_names():
        image = datasets.load(datasets.hard_data_training_image(name))
        yield name, image, datasets.load_hard_data(name), datasets.hard_data_grid_shape(name)
    for name, n in product(
        ("channels_60_wells", "stone_wall_300_data", "barchans_200_data"), DENSE
    ):
        image = datasets.load(datasets.hard_data_training_image(name))
        truth = datasets.load_reference_field(name)
        yield f"{image.name}, {n} data", image, sample_random(truth.array, n, 3), truth.shape
    authors = inputs_in(os.environ.get("CCWSIM_DATA"))
    each = ((kind, *data) for kind, about in PAPER_IMAGES.items() for data in about["data"].items())
    for kind, number, file in each:
        if authors.is_own(kind):
            n, (ny, nx) = int(number), map(int, file.rsplit("grid", 1)[1].split("x"))
            yield (
                f"the paper's {kind}, {n} data",
                authors.image(kind),
                authors.data(kind, n, (ny, nx)),
                (ny, nx),
            )


def conditioned(image: TrainingImage, data: HardData, shape: tuple[int, ...]) -> dict[str, float]:
    """Return a row of the table of studies with data."""
    held = np.arange(data.n) % 5 == 4
    known = HardData(data.cells[~held], data.facies[~held])
    ways = [replace(Parameters(), **WAYS[way]) for way in ("published", "default")]
    found = [simulate(image, shape, p, known, N_DATA, seed=1) for p in ways]
    own = [int(np.searchsorted(image.codes, code)) for code in _own(image)]
    at = (slice(None), *data.cells[held].T)
    true = np.searchsorted(image.codes, data.facies[held])
    sure = np.eye(image.n_facies)[true]

    def of(e: Ensemble) -> dict[str, float]:
        share = np.mean(np.eye(image.n_facies)[e.indices[at]], axis=0)
        return {
            "ends": float(np.mean([dead_ends(e.indices, k) for k in own])),
            "JS": float(pattern_distance(e, image, factors=(1,)).mean()),
            "Brier": float(((share - sure) ** 2).sum(axis=1).mean()),
            "variety": float(np.mean([(a != b).mean() for a, b in pairwise(e.indices)])),
        }

    before, after = map(of, found)
    e = found[1]
    row = {key: after[key] / max(before[key], 1e-9) for key in before}
    row["wrong"] = float(e.n_mismatched.sum())
    return {**row, "forced": 100 * float(e.n_forced.mean()) / known.n}


def print_studies(only: str) -> None:
    """Measure and print the studies with hard data."""
    print("| study | " + " | ".join(OF_DATA) + " |\n|---" + "|---" * len(OF_DATA) + "|")
    rows = []
    for name, image, data, shape in studies():
        if only in name:
            rows.append(conditioned(image, data, shape))
            print(
                f"| {name} | " + " | ".join(f"{rows[-1][c]:.3g}" for c in OF_DATA) + " |",
                flush=True,
            )
    means = [np.exp(np.mean(np.log([max(row[c], 1e-3) for row in rows]))) for c in OF_DATA[:4]]
    means += [np.mean([row[c] for row in rows]) for c in OF_DATA[4:]]
    print("| mean | " + " | ".join(f"{m:.3g}" for m in means) + " |")


def trend_studies() -> Iterator[tuple[str, TrainingImage, NDArray[np.uint8], HardData]]:
    """Yield studies of truths without bodies on one side: group, image, truth and data."""
    for name, seed in product(datasets.names(), (401, 402)):
        image, whole = generate(name, seed=seed), generate(name, seed=seed + 100)
        if image.n_facies != whole.n_facies:
            continue
        rng, truth = np.random.default_rng(seed), whole.indices.copy()
        y, x = np.indices(truth.shape)
        if seed % 2:
            y, x = x, y
        wavy = 0.55 * y.max() + 8 * np.sin(x / rng.uniform(10, 25))
        truth[(y > wavy) ^ bool(rng.integers(2))] = np.argmax(whole.proportions)
        group = "chosen" if name in ("channels", "levees") else "confirmed"
        for n, preferred in ((200, 1), (500, 1), (300, 3)):
            chance = np.where(truth == np.argmin(whole.proportions), preferred, 1).ravel()
            cells = rng.choice(truth.size, n, replace=False, p=chance / chance.sum())
            at = np.column_stack(np.unravel_index(cells, truth.shape))
            data = HardData(at, image.codes[truth[tuple(at.T)]])
            yield f"{group} | {n} data{', preferential' * (preferred > 1)}", image, truth, data


def print_trends(only: str) -> None:
    """Measure and print the studies of truths with a trend."""
    rows: dict[str, list[list[float]]] = {}
    usual = raster.steers
    for group, image, truth, data in trend_studies():
        if only not in image.name:
            continue
        found, facies = [], np.eye(image.n_facies)
        shares = facies[truth].mean(axis=(0, 1))
        for steered in (False, True):
            raster.steers = usual if steered else lambda _: False
            e = simulate(image, truth.shape, None, data, N_DATA, seed=1)
            raster.steers = usual
            p = facies[e.indices].mean(axis=0)
            brier = np.square(p - facies[truth]).sum(axis=-1).mean()
            js = np.mean([divergence(each[None], truth, 4, 1) for each in e.indices])
            found.append([brier, js, 100 * np.abs(p.mean(axis=(0, 1)) - shares).max()])
        before, after = found
        rows.setdefault(group, []).append(
            [*(np.log(after[k] / before[k]) for k in (0, 1)), before[2], after[2]]
        )
        values = " | ".join(f"{v:.4f}" for v in before + after)
        print(f"| {group} | {image.name} | {values} |", flush=True)
    print("| images | data | Brier score | JS | difference: without | steered |")
    print("|---" * 6 + "|")
    for group, each in rows.items():
        brier, js, without, steered = np.mean(each, axis=0)
        values = f"{np.exp(brier):.3f} | {np.exp(js):.2f} | {without:.2f} | {steered:.2f}"
        print(f"| {group} | {values} |")


CODES = {
    "ti_channel_256x256": ("channel256_uncond", "CCWSIM_{}_L2", "MS-CCSIM_{}_L2", "DeeSse_{}",
                           "SNESIM_MPSLIB_{}"),
    "ti_stonewall_200x200": ("stonewall200_uncond", "CCWSIM_{}_L2", "MS-CCSIM_{}_L2"),
}  # fmt: skip
"""Study and files of the published codes for each image of the paper."""


def spans(inside: NDArray[np.bool_], axis: int, corners: bool) -> bool:
    """Return whether a facies connects both ends of an axis, through corners or only sides."""
    labels, _ = ndimage.label(inside, np.ones((3,) * inside.ndim) if corners else None)
    ends = [set(np.take(labels, end, axis).ravel().tolist()) - {0} for end in (0, -1)]
    return bool(ends[0] & ends[1])


def flow_row(name: str, way: str, stack: NDArray[np.bool_]) -> None:
    """Print E along x and y with its standard error, the shares that span, and the proportion."""
    parts = []
    for axis in (1, 0):
        each = np.array([flow_efficiency(one, axis) for one in stack])
        error = f" ± {each.std() / len(each) ** 0.5:.3f}" if len(each) > 1 else ""
        share = [np.mean([spans(one, axis, corners) for one in stack]) for corners in (False, True)]
        parts += [f"{each.mean():.3f}{error}", f"{100 * share[0]:.0f} / {100 * share[1]:.0f}"]
    print(
        f"| {name} | {way} | {len(stack)} | {' | '.join(parts)} | {100 * stack.mean():.1f} |",
        flush=True,
    )


def print_flow(only: str) -> None:
    """Print the table of flow efficiencies."""
    print("| image | realizations | n | E W–E | span, 4 / 8 | E S–N | span, 4 / 8 | % |")
    print("|---|---|--:|--:|--:|--:|--:|--:|")
    for name, image in images():
        if image.n_dimensions == 3 or only not in name:
            continue
        rare = int(np.argmin(image.proportions))
        flow_row(name, "image", (image.indices == rare)[None])
        for way in ("default", "published"):
            p = replace(Parameters(), **WAYS[way])
            e = simulate(image, image.shape, p, n_realizations=N_FLOW, seed=1)
            flow_row(name, f"ours, {way}", e.indices == rare)
        if name in datasets.names():
            others = [generate(name, seed=101 + k) for k in range(N_OTHERS)]
            rare_of = [each.indices == np.argmin(each.proportions) for each in others]
            flow_row(name, "other images of its generator", np.array(rare_of))
        study, *files = CODES.get(name, ("",))
        for file in files:
            path = Path(os.environ["CCWSIM_DATA"]) / "reference" / f"{file.format(study)}.npz"
            if path.exists():
                found = np.load(path)["r"][:N_FLOW]
                flow_row(name, file.partition("_")[0], found == image.codes[rare])


def breaks_per_patch(image: TrainingImage, facies: int, n: int = N_TRACED) -> float:
    """Return the number of strands that break at the border of a patch, per patch."""
    breaks = n_patches = 0
    for number in range(n):
        trace = Trace(Study(image, Grid(*image.shape), Parameters(), seed=1), number)
        for step in map(trace.at, range(1, len(trace.patches))):
            box, inner = step.box, inside_overlap(step.box)
            overlap = np.ones((box.ny, box.nx), bool)
            overlap[inner.low_y : inner.high_y, inner.low_x : inner.high_x] = False
            before = step.before[box.y0 : box.y0 + box.ny, box.x0 : box.x0 + box.nx] == facies
            after = step.cells == facies
            for strands, others in ((before & overlap, after), (after, before & overlap)):
                labels, n_strands = ndimage.label(strands)
                sizes = np.bincount(labels[overlap], minlength=n_strands + 1)
                continued = np.isin(np.arange(n_strands + 1), labels[others])
                breaks += np.count_nonzero(~continued[1:] & (sizes[1:] >= MIN_STRAND))
            n_patches += 1
    return breaks / n_patches


def joins_row(image: TrainingImage) -> list[float]:
    """Return unions, loops, ends and Γ, each in crops and in realizations, and the breaks."""
    facies = int(np.argsort(-image.proportions, kind="stable")[1])
    e = simulate(image, image.shape, None, None, N_DATA, seed=1)
    joins = metrics.fit_joins(e, int(image.codes[facies]))
    gamma = metrics.fit_geobodies(e, int(image.codes[facies]))
    assert joins is not None
    assert gamma is not None
    pairs = [*zip(joins.reference, joins.found, strict=True), (gamma.reference[0], gamma.found[0])]
    return [*np.ravel(pairs).tolist(), 100 * breaks_per_patch(image, facies)]


def print_joins(only: str) -> None:
    """Print the table of joins."""
    groups = ("unions", "loops", "ends", "Γ")
    head = " | ".join(f"{name}: crops | {name}: realizations" for name in groups)
    print(f"| image | {head} | breaks: realizations |\n|---" + "|--:" * 9 + "|")
    for name, image in images():
        if image.n_dimensions == 2 and only in name:
            *counts, crops, pieces, breaks = joins_row(image)
            values = [*(f"{v:.1f}" for v in counts), f"{crops:.2f}", f"{pieces:.2f}"]
            print(f"| {name} | {' | '.join(values)} | {breaks:.1f} |", flush=True)


def reach(maps: NDArray[np.bool_], n_solved: int) -> dict[str, float]:
    """Return how far the bodies of a facies reach in maps, with dead ends per 1000 cells."""
    row = {
        "span W–E": np.mean([spans(each, 1, False) for each in maps]),
        "span S–N": np.mean([spans(each, 0, False) for each in maps]),
        "Γ": metrics.geobody_statistics(maps, 1).gamma.mean(),
        "dead ends": 1000 * dead_ends(maps[:10].astype(np.uint8), 1),
        "flow W–E": np.mean([flow_efficiency(each, 1) for each in maps[:n_solved]]),
        "flow S–N": np.mean([flow_efficiency(each, 0) for each in maps[:n_solved]]),
    }
    return {key: float(value) for key, value in row.items()}


def reach_of_realizations(image: TrainingImage, p: Parameters) -> dict[str, float]:
    """Return the reach of the second most frequent facies in realizations, JS and CPU time."""
    facies = int(np.argsort(-image.proportions)[1])
    e = simulate(image, (REACH_SIDE, REACH_SIDE), p, None, N_DATA, seed=77, n_workers=1)
    js = 1000 * pattern_distance(e, image, factors=(1,)).mean()
    return {
        **reach(e.indices == facies, N_SOLVED),
        "JS": js,
        "CPU": 1000 * float(e.cpu_seconds.min()),
    }


def reach_of_image(image: TrainingImage) -> dict[str, float]:
    """Return the reach of the second most frequent facies in pieces of an image."""
    inside = image.indices == int(np.argsort(-image.proportions)[1])
    starts = (
        np.linspace(0, n - REACH_SIDE, 3 if n > REACH_SIDE else 1).astype(int).tolist()
        for n in inside.shape
    )
    pieces = [inside[y : y + REACH_SIDE, x : x + REACH_SIDE] for y, x in product(*starts)]
    return reach(np.array(pieces), len(pieces))


def reach_images(group: str) -> list[TrainingImage]:
    """Return the images of a group."""
    if group == "channels":
        return [generate(group, seed=seed) for seed in range(101, 106)]
    return [datasets.load(group), *(generate(group, seed=seed) for seed in (101, 102))]


def print_reach(only: str) -> None:
    """Print the table of reach, as means over the images of each group."""
    columns = ("span W–E", "span S–N", "Γ", "JS", "dead ends", "flow W–E", "flow S–N", "CPU")
    print(f"| images | template | {' | '.join(columns)} |\n|---|---" + "|--:" * 8 + "|")
    for group in ("channels", "fractures", "levees", "bend"):
        images_of_group = reach_images(group) if only in group else []
        for size in (0, 32, 48, 64) if images_of_group else ():
            rows = [
                reach_of_realizations(each, Parameters(size)) if size else reach_of_image(each)
                for each in images_of_group
            ]
            means = (
                f"{np.mean([row[c] for row in rows]):.3g}" if c in rows[0] else "" for c in columns
            )
            print(f"| {group} | {size or 'image'} | {' | '.join(means)} |", flush=True)


def times(image: TrainingImage, ways: dict[str, Parameters]) -> dict[str, float]:
    """Return the CPU seconds of a realization for each variant, measured alternately."""
    shape = (48, 100, 100) if len(image.shape) == 3 else (512, 512)
    found: dict[str, list[float]] = {name: [] for name in ways}
    for seed in range(5):
        for name, p in ways.items():
            e = simulate(image, shape, p, n_realizations=4, seed=seed, n_workers=1)
            found[name].append(float(np.median(e.cpu_seconds)))
    return {name: float(np.median(each[1:])) for name, each in found.items()}


def main() -> None:
    """Measure and print the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fidelity", description=__doc__)
    parser.add_argument("--only", metavar="TEXT", default="", help="only images with this in names")
    parser.add_argument("--template", type=int, default=32, help="template of maps; default: 32")
    parser.add_argument("--data", action="store_true", help="measure studies with hard data")
    parser.add_argument("--trend", action="store_true", help="measure truths with a trend")
    parser.add_argument("--drawn", type=int, default=0, metavar="N", help="maps of each generator")
    parser.add_argument("--rare", type=int, default=0, metavar="N", help="images of each kind")
    parser.add_argument("--flow", action="store_true", help="measure the flow efficiency of maps")
    parser.add_argument("--reach", action="store_true", help="measure how far geobodies reach")
    parser.add_argument("--joins", action="store_true", help="measure how geobodies join in maps")
    options = parser.parse_args()
    if options.reach:
        return print_reach(options.only)
    if options.joins:
        return print_joins(options.only)
    if options.flow:
        return print_flow(options.only)
    if options.trend:
        return print_trends(options.only)
    if options.data:
        return print_studies(options.only)
    tables: dict[str, dict[str, list[dict[str, float]]]] = {"chosen": {}, "confirmed": {}}
    print("| image | way | " + " | ".join(COLUMNS) + " |\n|" + "---|" * (len(COLUMNS) + 2))
    others = rare_images(options.rare) if options.rare else drawn(options.drawn)
    for name, image in others if options.rare or options.drawn else images():
        if options.only not in name:
            continue
        base = VOLUME if len(image.shape) == 3 else Parameters(options.template)
        ways = {way: replace(base, **changes) for way, changes in WAYS.items()}
        seconds = times(image, ways)
        for way, p in ways.items():
            row = {**judged(image, p), "CPU": 1000 * seconds[way]}
            kind = "chosen" if name in CHOSEN else "confirmed"
            tables[kind].setdefault(way, []).append(row)
            print(f"| {name} | {way} | " + _printed(row) + " |", flush=True)
    for kind, table in tables.items():
        for way, rows in table.items():
            print(f"| {kind} | {way} | " + _printed(_mean(rows, table["published"])) + " |")


def _mean(rows: list[dict[str, float]], base: list[dict[str, float]]) -> dict[str, float]:
    found = {}
    for column in COLUMNS:
        pairs = [(a[column], b[column]) for a, b in zip(rows, base, strict=True) if column in a]
        own = np.array([a / b if column in RATIOS else a for a, b in pairs])
        if not len(own):
            continue
        if column in RATIOS or column in GEOMETRIC:
            found[column] = float(np.exp(np.log(np.maximum(own, 1e-3)).mean()))
        else:
            found[column] = float(own.mean())
    return found


def _printed(row: dict[str, float]) -> str:
    return " | ".join(f"{row[c]:.4g}" if c in row else "" for c in COLUMNS)


if __name__ == "__main__":
    main()
