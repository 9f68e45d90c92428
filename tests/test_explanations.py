"""Test that explanations in the documents are true: each has an experiment that shows it.

An experiment returns whether it shows the sentence by a wide margin, over several seeds. A sentence
that leaves its document needs another experiment, or none. Tutorials show other causes in their
output, which `test_documents` compares.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import gaussian_filter

import ccwsim
from ccwsim import Ensemble, HardData, Parameters, Secondary, TrainingImage, datasets, flow, metrics
from ccwsim.datasets.sampling import sample_random
from ccwsim.experiments.two_point import simulate_two_point
from tools.datasets import generate

ROOT = Path(__file__).parents[1]
P = Parameters(32, 8, 2)
PUBLISHED = replace(P, published_draw=True, repair_seams=False)
OF_VOLUME = Parameters((16, 32, 32), (4, 8, 8), (1, 2, 2))


def largest_piece(e: Ensemble) -> float:
    """Return the mean number of cells of the largest copied piece of a realization."""
    assert e.sources is not None
    shape = e.training_image.shape
    return float(np.mean([metrics.copying(of, shape).largest_block for of in e.sources]))


def connectivity_error(e: Ensemble, code: int) -> float:
    """Return the mean difference of the connectivity from that of the image, up to lag 40."""
    errors = []
    for direction in ("E-W", "N-S"):
        tau = metrics.connectivity(e, code, direction, 40).tau.mean(axis=0)
        of_image = metrics.connectivity(e.training_image, code, direction, 40).tau[0]
        errors.append(np.abs(tau - of_image).mean())
    return float(np.mean(errors))


def first_study_seed() -> bool:
    ti = datasets.load("channels")
    a, b, other = (ccwsim.simulate(ti, (60, 80), P, seed=seed) for seed in (0, 0, 1))
    return bool((a.indices == b.indices).all() and (a.indices != other.indices).mean() > 0.1)


def wells_forced() -> bool:
    """Show that data in a chessboard, which no window has, are set as single cells."""
    ti = datasets.load("channels")
    cells = np.argwhere(np.ones((3, 3))) + 60
    data = HardData(cells, cells.sum(axis=1) % 2)
    for seed in range(3):
        e = ccwsim.simulate(ti, (128, 128), None, data, 4, seed=seed, keep_sources=True)
        assert e.sources is not None
        forced = np.argwhere(e.data_status == -1)
        of_cells = e.sources[(forced[:, 0], *cells[forced[:, 1]].T)]
        near = e.realizations[:, 57:66, 57:66].astype(int)
        if e.n_mismatched.any() or not len(forced) or of_cells.max() >= 0:
            return False
        if metrics.unseen_patterns(near, ti).min() < 0.1:
            return False
    return True


def volume_runs() -> bool:
    sand = np.pad(datasets.load("sinuous_channels").array == 1, [(1, 1), (0, 0), (0, 0)])
    change = np.diff(sand.astype(int), axis=0)
    starts = np.nonzero(np.moveaxis(change, 0, -1) == 1)[-1]
    ends = np.nonzero(np.moveaxis(change, 0, -1) == -1)[-1]
    return 0.985 < float((ends - starts <= 16).mean()) < 1


def volume_trend() -> bool:
    """Show that sources have any height without a location weight, and that the trend is lost."""
    ti = datasets.load("sinuous_channels")
    wells = datasets.load_hard_data("sinuous_channels_10_wells")
    weighted = replace(OF_VOLUME, location_weight=(0.5, 0, 0))

    def slope(volumes: Ensemble | TrainingImage) -> float:
        sand = metrics.vertical_proportions(volumes)[:, 1].mean(axis=0)
        return float(np.cov(np.arange(48), sand)[0, 1])

    def likeness(p: Parameters, data: HardData | None) -> tuple[float, float]:
        """Return the correlation of heights of cells and sources, and the share of the trend."""
        e = ccwsim.simulate(ti, (48, 100, 100), p, data, 4, seed=1, keep_sources=True)
        assert e.sources is not None
        copied = e.sources >= 0
        height, of_source = np.nonzero(copied)[1], e.sources[copied] // (160 * 160)
        return float(np.corrcoef(height, of_source)[0, 1]), slope(e) / slope(ti)

    lost = [likeness(OF_VOLUME, data) for data in (wells, None)]
    kept = likeness(weighted, wells)
    return bool(np.max(lost) < 0.5 and min(kept) > 0.7)


def dense_locations() -> bool:
    ti, truth = datasets.load("stone_wall"), datasets.load_reference_field("stone_wall_300_data")
    shares = []
    for seed in (1, 2):
        data = sample_random(truth.array, 4000, seed=seed)
        grid = np.full(truth.shape, -1)
        grid[tuple(data.cells.T)] = data.facies
        windows = sliding_window_view(ti.array, (22, 22)).reshape(-1, 22 * 22)
        for row, column in np.ndindex(6, 6):
            tile = grid[80 * row :, 80 * column :][:22, :22].ravel()
            known = np.flatnonzero(tile >= 0)
            shares.append((windows[:, known] == tile[known]).all(axis=1).mean())
    return float(np.median(shares)) < 0.1


def dense_distances() -> bool:
    ti, truth = datasets.load("stone_wall"), datasets.load_reference_field("stone_wall_300_data")
    p = Parameters(22, 6, 1)
    for seed in (1, 2):
        data = sample_random(truth.array, 4000, seed=seed)

        def run(p: Parameters, data: HardData = data, seed: int = seed) -> tuple[np.ndarray, float]:
            e = ccwsim.simulate(ti, truth.shape, p, data, 4, seed=seed)
            score = metrics.score_reference(metrics.etype(e), truth, e.n)
            return metrics.pattern_distance(e, ti).mean(axis=0), score.brier

        searched, of_search = run(replace(p, exact_data=False))
        for exact in (p, replace(p, repair_seams=False)):
            distances, score = run(exact)
            if (distances > 0.95 * searched).any() or abs(score - of_search) > 0.02:
                return False
    return True


def dense_level() -> bool:
    """Show that level 3 is worse than levels 1 and 2 with dense data, and not faster than 2."""
    for image, field in [("stone_wall", "stone_wall_300_data"), ("channels", "channels_400_data")]:
        ti, truth = datasets.load(image), datasets.load_reference_field(field)
        data = sample_random(truth.array, 4000, seed=3)
        runs = [
            ccwsim.simulate(ti, truth.shape, Parameters(32, 8, level), data, 4, seed=1)
            for level in (1, 2, 3)
        ]
        fine, middle, coarse = (metrics.pattern_distance(e, ti).mean(axis=0) for e in runs)
        times = [e.cpu_seconds.min() for e in runs]
        if (coarse < 1.03 * np.maximum(fine, middle)).any() or times[2] < 0.7 * times[1]:
            return False
    return True


def flow_connections() -> bool:
    ti = datasets.load("channels")
    k: dict[int | str, float] = {"sand": 1e-4, "mud": 1e-8}

    def efficiency(e: Ensemble) -> float:
        return float(np.median(flow.effective_k(e, k).efficiency))

    for seed in (2, 3):
        channels = ccwsim.simulate(ti, (128, 128), None, None, 4, seed=seed)
        two_point = simulate_two_point(ti, (128, 128), n_realizations=4, seed=seed)
        closed, joined = channels.indices.copy(), two_point.indices.copy()
        closed[:, :, 64], joined[:, 64] = 0, 1
        if efficiency(channels) < 10 * efficiency(replace(channels, indices=closed)):
            return False
        if efficiency(replace(two_point, indices=joined)) < 5 * efficiency(two_point):
            return False
    return True


def guides_both() -> bool:
    ti = datasets.load("channels")
    truth = datasets.load_reference_field("channels_60_wells").array[:128, :128] == 1
    seismic = Secondary(probabilities={"sand": gaussian_filter(truth.astype(float), 10)})
    scores = np.zeros((3, 3))
    for seed in range(3):
        data = sample_random(truth.astype(int), 40, seed=seed)
        given = [(data, None), (None, seismic), (data, seismic)]
        for k, (wells, secondary) in enumerate(given):
            e = ccwsim.simulate(ti, truth.shape, None, wells, 20, seed=seed, secondary=secondary)
            scores[seed, k] = ((e.probability(1) - truth) ** 2).mean()
    wells_only, map_only, both = scores.mean(axis=0)
    return both < 0.97 * min(wells_only, map_only)


def guides_same_seed() -> bool:
    ti, strip = datasets.load("channels"), np.ones((60, 108))
    strip[:, 50:58] = np.nan
    parts = Secondary(active=strip).compartments(ccwsim.Grid(60, 108))

    def sides(west_seed: int, east_seed: int) -> float:
        west, east = (
            ccwsim.simulate(ti, (60, 108), None, None, 4, seed=seed, secondary=part).realizations
            for seed, part in zip((west_seed, east_seed), parts, strict=True)
        )
        return float((west[:, :, :50] == east[:, :, 58:]).mean())

    return all(sides(seed, seed) == 1 and sides(seed, seed + 9) < 0.9 for seed in range(3))


def guides_weights() -> bool:
    ti, wall = datasets.load("channels"), datasets.load("stone_wall")

    def share_of_wall(weights: tuple[int, int] | None, seed: int) -> float:
        secondary = Secondary(images=[wall], weights=weights)
        e = ccwsim.simulate(
            ti, (160, 200), None, None, 8, seed=seed, secondary=secondary, keep_sources=True
        )
        assert e.sources is not None
        return float((e.sources[e.sources >= 0] >= ti.array.size).mean())

    weighted = [share_of_wall(weights, 0) for weights in ((3, 1), (1, 3))]
    any_image = [share_of_wall(None, seed) for seed in (0, 1)]
    expected = np.abs(np.subtract(weighted, (0.25, 0.75))).max() < 0.1
    return bool(expected and min(any_image) > 0.1 and max(any_image) < 0.9)


def guides_mirrored() -> bool:
    ti = datasets.load("lenses")

    def share_mirrored(axes: str) -> float:
        secondary = Secondary(mirrored=axes) if axes else None
        e = ccwsim.simulate(
            ti, (100, 160), None, None, 4, seed=0, secondary=secondary, keep_sources=True
        )
        assert e.sources is not None
        return float((np.diff(e.sources % ti.shape[1], axis=-1) == -1).mean())

    return share_mirrored("xy") > 0.25 and share_mirrored("") < 0.02


def judge_cause() -> bool:
    ti = datasets.load("channels")
    small = {"template_size": 8, "overlap_size": 4}

    def sand(p: Parameters, seed: int) -> float:
        return float(
            ccwsim.simulate(ti, (200, 200), p, None, 8, seed=seed).proportions[:, 1].mean()
        )

    for seed in (2, 3):
        kept = [replace(PUBLISHED, **small, match_proportions=True), replace(P, **small), PUBLISHED]
        if sand(replace(PUBLISHED, **small), seed) > 0.65 * min(sand(p, seed) for p in kept):
            return False
    of_image = metrics.measure(ccwsim.simulate(ti, (200, 200), P, None, 2, seed=0), 1).reference
    return 8.5 < of_image[3] < 9.5  # mean chord N–S


def judge_crops() -> bool:
    """Show that the sand of the image is one body, so cells apart in a crop join outside."""
    ti = datasets.load("channels")
    corners = [(row, column) for row in (0, 64, 128) for column in (0, 64, 128)]
    crops = np.stack([ti.array[i : i + 128, j : j + 128] for i, j in corners])
    whole = metrics.geobody_statistics(ti, 1).gamma[0]
    return whole > 0.98 and metrics.geobody_statistics(crops, 1).gamma.mean() < 0.9 * whole


def trend_lost() -> bool:
    ti, p = datasets.load("delta"), Parameters(50, 12, 1)

    def difference(cells: np.ndarray) -> float:
        mud = cells == ti.codes[0]
        return float(mud[..., :150].mean() - mud[..., 150:].mean())

    def of(p: Parameters) -> float:
        runs = [ccwsim.simulate(ti, ti.shape, p, None, 10, seed=seed) for seed in (1, 2)]
        return float(np.mean([difference(e.realizations) for e in runs]))

    of_image = difference(ti.array)
    weighted = of(replace(p, location_weight=0.5))
    return abs(of(p)) < 0.4 * of_image and 0.75 < weighted / of_image < 1.25


def settings_level() -> bool:
    ti = datasets.load("stone_wall")

    def error(level: int, refine: bool) -> float:
        p = Parameters(24, 8, level, refine=refine)
        runs = [ccwsim.simulate(ti, (150, 150), p, None, 6, seed=seed) for seed in range(3)]
        return float(np.mean([connectivity_error(e, 1) for e in runs]))

    fine, coarse, refined = error(1, False), error(3, False), error(3, True)
    return coarse > 3 * fine and refined < 0.6 * coarse


def settings_time() -> bool:
    ti = datasets.load("stone_wall")

    def time(level: int) -> float:
        p = Parameters(24, 8, level)
        return float(ccwsim.simulate(ti, (150, 150), p, None, 12, seed=0).cpu_seconds.min())

    slow, middle, fast = time(0), time(2), time(3)
    return slow > 2.5 * middle and fast > 0.6 * middle


def settings_overlap() -> bool:
    """Show that seams improve up to a quarter of the template only, and that time grows."""
    for name, template, overlaps in [("stone_wall", 24, (2, 6, 12)), ("channels", 32, (2, 8, 16))]:
        ti, unseen, times = datasets.load(name), [], []
        for overlap in overlaps:
            p = Parameters(template, overlap, 1, repair_seams=False)
            runs = [ccwsim.simulate(ti, (150, 150), p, None, 12, seed=seed) for seed in (0, 1)]
            unseen.append(np.mean([metrics.unseen_patterns(e, ti).mean() for e in runs]))
            times.append(min(e.cpu_seconds.min() for e in runs))
        narrow, quarter, half = unseen
        if narrow < 1.5 * quarter or half < 0.8 * quarter or times[2] < 1.1 * times[1]:
            return False
    return True


def settings_volume() -> bool:
    ti = datasets.load("sinuous_channels")
    pieces = [
        [
            largest_piece(
                ccwsim.simulate(
                    ti,
                    (32, 80, 80),
                    replace(OF_VOLUME, n_candidates=k),
                    n_realizations=2,
                    seed=seed,
                    keep_sources=True,
                )
            )
            for seed in (0, 1)
        ]
        for k in (1, 20)
    ]
    one, usual = np.mean(pieces, axis=1)
    return bool(one > 1.5 * usual)


def theory_lattice() -> bool:
    ti = datasets.load("channels")

    def unevenness(random_path: bool) -> float:
        p = replace(P, random_path=random_path, repair_seams=False)
        e = ccwsim.simulate(ti, (160, 160), p, None, 60, seed=0, keep_sources=True)
        assert e.sources is not None
        seams = np.mean([metrics.copying(of, ti.shape).seams for of in e.sources], axis=0)
        by_column = seams[20:-20, 20:-20].mean(axis=0)
        return float(by_column.std() / by_column.mean())

    return unevenness(True) < 0.3 and unevenness(False) > 0.7


def theory_margins() -> bool:
    """Show that margins of an image are used less, and that the default draw has less bias."""
    bias = {P: 0.0, PUBLISHED: 0.0}
    for name, seed in [(name, seed) for name in ("lenses", "barchans") for seed in range(3)]:
        ti = datasets.load(name)
        for p in bias:
            e = ccwsim.simulate(ti, (200, 200), p, None, 16, seed=seed, keep_sources=True)
            bias[p] += np.abs(e.proportions.mean(axis=0) - ti.proportions).max()
            assert e.sources is not None
            uses = np.mean([metrics.copying(of, ti.shape).uses for of in e.sources], axis=0)
            margin = np.ones(ti.shape, bool)
            margin[8:-8, 8:-8] = False
            if uses[margin].mean() > 0.3 * uses[32:-32, 32:-32].mean():
                return False
    return bias[P] < 0.6 * bias[PUBLISHED]


def theory_copying() -> bool:
    ti = datasets.load("channels")
    pieces = [
        largest_piece(
            ccwsim.simulate(
                ti, (160, 160), replace(p, n_candidates=1), None, 6, seed=seed, keep_sources=True
            )
        )
        for p in (P, PUBLISHED)
        for seed in (0, 1)
    ]
    return min(pieces[2:]) > 2 * max(pieces[:2])


def theory_seams() -> bool:
    """Show that unseen patterns are at seams, and that repair removes most of them."""
    ti = datasets.load("channels")
    bits = 1 << np.arange(16)

    def patterns(cells: np.ndarray) -> np.ndarray:
        windows = sliding_window_view(cells.astype(int), (4, 4))
        return windows.reshape(*windows.shape[:2], 16) @ bits

    p = replace(P, repair_seams=False)
    e = ccwsim.simulate(ti, (200, 200), p, None, 6, seed=0, keep_sources=True)
    assert e.sources is not None
    unseen = ~np.isin([patterns(cells) for cells in e.realizations], patterns(ti.array))
    seams = np.stack([metrics.copying(of, ti.shape).seams for of in e.sources])
    near = sliding_window_view(seams, (4, 4), axis=(1, 2)).any(axis=(-2, -1))
    repaired = ccwsim.simulate(ti, (200, 200), P, None, 6, seed=0)
    few = metrics.unseen_patterns(repaired, ti).mean() < 0.2 * metrics.unseen_patterns(e, ti).mean()
    return bool(unseen.sum() > 50 and not (unseen & ~near).any() and near.mean() < 0.5 and few)


def theory_terms() -> bool:
    """Count the terms of summation by parts along lines of 32 cells, relative to coefficients."""
    ranges = []
    for level in (0, 1, 2):
        side, shares = 2**level, []
        for name in datasets.names():
            ti = datasets.load(name)
            n_terms = n_nonzero = 0
            ny, nx = (n // side for n in ti.shape)
            for k in range(1 if ti.n_facies == 2 else 0, ti.n_facies):
                cells = (ti.indices == k)[: ny * side, : nx * side].astype(int)
                sums = cells.reshape(ny, side, nx, side).sum(axis=(1, 3))
                for lines in (sums, sums.T):
                    for start in range(0, lines.shape[1] - 32 // side + 1, 32 // side):
                        line = np.pad(lines[:, start : start + 32 // side], [(0, 0), (1, 1)])
                        changes = np.count_nonzero(np.diff(line, axis=1), axis=1)
                        nonzero = np.count_nonzero(line, axis=1)
                        n_terms += np.minimum(changes, nonzero).sum()
                        n_nonzero += nonzero.sum()
            shares.append(n_terms / n_nonzero)
        ranges.append((min(shares), max(shares)))
    return bool((np.round(ranges, 2) == [(0.12, 0.46), (0.33, 0.89), (0.60, 0.98)]).all())


def method_codes() -> bool:
    """Show that the correlation prefers large codes: the paper's method, not that of its code."""
    ti = datasets.load("channels")
    exchanged = TrainingImage(1 - ti.array.astype(int))

    def sand(image: TrainingImage, code: int, variant: Literal["paper", "code"]) -> float:
        p = Parameters.published(variant)
        runs = [ccwsim.simulate(image, (200, 200), p, None, 4, seed=seed) for seed in (0, 1)]
        return float(np.mean([e.realizations == code for e in runs]) / ti.proportions[1])

    much, little = sand(ti, 1, "paper"), sand(exchanged, 0, "paper")
    of_code = [sand(ti, 1, "code"), sand(exchanged, 0, "code")]
    return much > 1.25 and little < 0.4 and 0.8 < min(of_code) <= max(of_code) < 1.2


def measures_coarse_cells() -> bool:
    ti = datasets.load("stone_wall")
    full, *coarse = metrics.pattern_distance(ti.array[None, 1:-1], ti)[0]
    return min(coarse) > 10 * full and min(coarse) > 0.01


def example_dense() -> bool:
    """Show that no location fits the data of most tiles with a datum in one cell of sixteen."""
    ti = datasets.load("channels")
    truth = datasets.load_reference_field("channels_400_data").array[:256, :256]
    windows = sliding_window_view(ti.array, (32, 32)).reshape(-1, 32 * 32)
    fitting = []
    for seed in (1, 2):
        data = sample_random(truth, 4000, seed=seed)
        grid = np.full(truth.shape, -1)
        grid[tuple(data.cells.T)] = data.facies
        for tile in grid.reshape(8, 32, 8, 32).swapaxes(1, 2).reshape(64, -1)[::3]:
            known = np.flatnonzero(tile >= 0)
            fitting.append((windows[:, known] == tile[known]).all(axis=1).any())
    return float(np.mean(fitting)) < 0.45


def broken(p: Parameters) -> tuple[float, float]:
    """Return the number of bodies of sand per realization, and the share of unseen patterns."""
    ti = datasets.load("channels")
    runs = [ccwsim.simulate(ti, (256, 256), p, None, 12, seed=seed) for seed in (0, 1)]
    bodies = np.mean([metrics.geobody_statistics(e, 1).n_geobodies.mean() for e in runs])
    return float(bodies), float(np.mean([metrics.unseen_patterns(e, ti).mean() for e in runs]))


def example_small_template() -> bool:
    return broken(Parameters(8, 4, 2))[0] > 2 * broken(Parameters())[0]


def example_thin_overlap() -> bool:
    p = Parameters(32, 2, 1, refine=False, repair_seams=False)
    bodies, unseen = np.divide(broken(p), broken(replace(p, overlap_size=8)))
    return bool(bodies > 1.15 and unseen > 2)


def example_no_refine() -> bool:
    p = Parameters(32, 8, 3, refine=False, repair_seams=False)
    steps = broken(p)[1]
    return max(broken(replace(p, **{name: True}))[1] for name in ("refine", "repair_seams")) < (
        0.6 * steps
    )


def example_blocks() -> bool:
    """Show that without refinement, sources of cells are whole blocks of 8 cells away."""
    ti = datasets.load("channels")
    p = Parameters(32, 8, 3, refine=False, repair_seams=False, random_path=False)
    e = ccwsim.simulate(ti, (120, 120), p, None, 4, seed=0, keep_sources=True)
    assert e.sources is not None
    offsets = np.array(np.divmod(e.sources, 256)) - np.indices((120, 120))[:, None]
    return not (offsets % 8).any()


def measures_crops() -> bool:
    """Show that connectivity varies less between crops of one image than between all crops."""
    corners = [(row, column) for row in (0, 48, 96) for column in (0, 48, 96)]
    for name in ("channels", "fractures"):
        each = []
        for seed in range(9700, 9710):
            cells = generate(name, seed=seed).array
            crops = np.stack([cells[i : i + 160, j : j + 160] for i, j in corners])
            each.append(metrics.connectivity(crops, 1, "E-W", 60).tau[:, -1])
        within = np.std(each, axis=1, ddof=1).mean()
        if within > 0.9 * np.std(each, ddof=1):
            return False
    return True


def quality_anodi() -> bool:
    small = replace(PUBLISHED, template_size=8, overlap_size=4)
    for name, seed in [("channels", 1), ("channels", 2), ("stone_wall", 0), ("stone_wall", 1)]:
        ti = datasets.load(name)
        compared = {
            label: ccwsim.simulate(ti, (160, 160), p, None, 10, seed=seed)
            for label, p in {"whole": PUBLISHED, "broken": small}.items()
        }
        between, within, _ = metrics.anodi(compared, ti).relative("broken", "whole")
        if between < 1.2 or within < 2:
            return False
    return True


def quality_candidates() -> bool:
    ti = datasets.load("stone_wall")

    def distance(p: Parameters, k: int) -> float:
        p = replace(p, n_candidates=k)
        runs = [ccwsim.simulate(ti, (160, 160), p, None, 10, seed=seed) for seed in (0, 1)]
        return float(np.mean([metrics.pattern_distance(e, ti)[:, 0].mean() for e in runs]))

    usual, published = ([distance(p, k) for k in (1, 20, 500)] for p in (P, PUBLISHED))
    return max(usual) < 1.3 * min(usual) and published[2] > 1.7 * published[0]


TUTORIALS = "docs/tutorials/"
EXPLANATIONS: list[tuple[str, str, Callable[[], bool], bool]] = [
    (
        TUTORIALS + "first-study.md",
        "the image, the grid, the parameters and a seed determine the realizations",
        first_study_seed,
        False,
    ),
    (
        TUTORIALS + "wells.md",
        "`n_forced` counts the data for which no window fitted, so only the cell of the datum was "
        "set.",
        wells_forced,
        False,
    ),
    (
        TUTORIALS + "dense-data.md",
        "A forced cell may be an isolated speck that is absent from the image.",
        wells_forced,
        False,
    ),
    (
        TUTORIALS + "volumes.md",
        "of the vertical runs of sand, 99 % have at most 16 cells",
        volume_runs,
        False,
    ),
    (
        TUTORIALS + "volumes.md",
        "Patches may come from any height of the image, so the realizations lose most of this "
        "trend, with wells or without.",
        volume_trend,
        True,
    ),
    (
        TUTORIALS + "dense-data.md",
        "Few locations of the training image honour all data of a tile",
        dense_locations,
        False,
    ),
    (
        TUTORIALS + "dense-data.md",
        "all three distances (at full, half and third resolution) are smaller for `exact`, also "
        "if seams are not repaired.",
        dense_distances,
        True,
    ),
    (TUTORIALS + "dense-data.md", "The scores hardly differ.", dense_distances, True),
    (
        TUTORIALS + "dense-data.md",
        "With a large template, level 3 gives larger pattern distances than level 2",
        dense_level,
        True,
    ),
    (
        "ccwsim/assets/advice.toml",
        "at level {level} the small patches between the data break shapes more than at level 2 or "
        "1, and save no time.",
        dense_level,
        True,
    ),
    (
        TUTORIALS + "settings.md",
        "With dense data, level 3 breaks shapes and saves no time",
        dense_level,
        True,
    ),
    (
        TUTORIALS + "flow.md",
        "A model that reproduces only the variogram therefore predicts wrong arrival times.",
        flow_connections,
        True,
    ),
    (
        TUTORIALS + "guides.md",
        "Map and wells together are better than either of them",
        guides_both,
        True,
    ),
    (
        TUTORIALS + "guides.md",
        "With the same seed, parts of the same shape would be equal.",
        guides_same_seed,
        False,
    ),
    (
        TUTORIALS + "guides.md",
        "Without `zones`, all images are searched for each patch, or `weights` gives the share of "
        "patches of each.",
        guides_weights,
        False,
    ),
    (
        TUTORIALS + "guides.md",
        '`mirrored="xy"` adds mirrored copies as further patterns of a small image.',
        guides_mirrored,
        False,
    ),
    (
        TUTORIALS + "judge.md",
        "The cause is a template narrower than the channels (9 cells) together with the published "
        "draw, which does not control proportions: realizations lose half of their sand.",
        judge_cause,
        True,
    ),
    (
        TUTORIALS + "judge.md",
        "Crops of the image are less connected than the image, because channels that join outside "
        "a crop are separate in it",
        judge_crops,
        False,
    ),
    (
        TUTORIALS + "nonstationary.md",
        "If the image is treated as stationary, the trend is lost, and both halves have about the "
        "same proportion of mud.",
        trend_lost,
        True,
    ),
    (
        TUTORIALS + "settings.md",
        "Without refinement, larger blocks break thin facies; with refinement (the default) the "
        "effect is small.",
        settings_level,
        True,
    ),
    (
        TUTORIALS + "settings.md",
        "Level 2 saves most of the time of level 0, and level 3 little more.",
        settings_time,
        True,
    ),
    (
        TUTORIALS + "settings.md",
        "A wider overlap makes seams hardly better and takes longer.",
        settings_overlap,
        True,
    ),
    (
        TUTORIALS + "settings.md",
        "With `published_draw`, and in volumes, K = 1 copies large pieces of the image.",
        settings_volume,
        True,
    ),
    (
        "docs/theory.md",
        "If seams are at the same cells in all realizations, the seams are visible in the mean of "
        "the realizations.",
        theory_lattice,
        True,
    ),
    (
        "docs/theory.md",
        "Few patches cover the margins of an image, and the best-fitting patches favour the common "
        "facies.",
        theory_margins,
        True,
    ),
    (
        "docs/theory.md",
        "The location that continues the neighbouring patch in the image always fits best.",
        theory_copying,
        False,
    ),
    (
        "docs/theory.md",
        "Bad seams show as patterns of cells that are absent from the image.",
        theory_seams,
        False,
    ),
    (
        "docs/theory.md",
        "For lines of 32 cells in the nine bundled maps, the number of terms is 0.12 to 0.46 times "
        "the number of nonzero coefficients at level 0, 0.33 to 0.89 at level 1 and 0.60 to 0.98 "
        "at level 2",
        theory_terms,
        False,
    ),
    (
        "docs/method.md",
        "ΣA·B is large wherever the image has much of the facies with large codes, so the paper's "
        "method gives too much of these facies.",
        method_codes,
        False,
    ),
    (
        "docs/method.md",
        "If the codes of mud and sand are exchanged, there is too little sand instead.",
        method_codes,
        False,
    ),
    (
        "docs/quality.md",
        "Broken shapes increase both *between* and *within*, so read *between*, *within* and the "
        "ratio together.",
        quality_anodi,
        True,
    ),
    (
        "docs/quality.md",
        "By default, K has little effect even without data, because candidates are excluded if "
        "they fit much worse than the best or merely continue the image.",
        quality_candidates,
        True,
    ),
    (
        "docs/measures.md",
        "crops of one image share its long bodies, so they differ less than images do.",
        measures_crops,
        True,
    ),
    (
        "docs/measures.md",
        "At half and third resolution, pattern distances depend on the cell at which coarse cells "
        "begin.",
        measures_coarse_cells,
        False,
    ),
    (
        "ccwsim/assets/parameters.toml",
        "Up to about a quarter of the template, a wider overlap joins shapes better; it takes "
        "longer.",
        settings_overlap,
        True,
    ),
    (
        "ccwsim/ui/examples/catalogue.toml",
        "In most tiles, no location of the training image fits all of these data",
        example_dense,
        True,
    ),
    (
        "ccwsim/ui/examples/catalogue.toml",
        "The template must be larger than the shapes (B).",
        example_small_template,
        True,
    ),
    (
        "ccwsim/ui/examples/catalogue.toml",
        "The search hardly recognizes a channel, so more channels break than with an overlap of 8 "
        "cells (B).",
        example_thin_overlap,
        True,
    ),
    (
        "ccwsim/ui/examples/catalogue.toml",
        "Seam repair, which is off here, would remove most steps.",
        example_no_refine,
        False,
    ),
    (
        "ccwsim/ui/examples/catalogue.toml",
        "Locations are multiples of 8 cells, so channel banks have steps at seams (A).",
        example_blocks,
        False,
    ),
]
"""Document, sentence, experiment, and whether the experiment takes more than two seconds."""
EXPERIMENTS = {experiment: is_slow for _, _, experiment, is_slow in EXPLANATIONS}


@pytest.mark.parametrize(
    ("document", "sentence"), [(document, sentence) for document, sentence, _, _ in EXPLANATIONS]
)
def test_the_sentence_is_in_its_document(document, sentence):
    text = (ROOT / document).read_text("utf-8").replace("\\\n", "")
    assert sentence in re.sub(r"\s+", " ", text)


@pytest.mark.parametrize(
    "experiment",
    [
        pytest.param(of, marks=[pytest.mark.slow] * is_slow, id=of.__name__)
        for of, is_slow in EXPERIMENTS.items()
    ],
)
def test_the_experiment_shows_what_the_sentence_says(experiment):
    assert experiment()
