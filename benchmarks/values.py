"""Continuous variables on images that had no part in choices: `python -m benchmarks.values`.

One line for each image, number of data and method: Kolmogorov–Smirnov distance of the values from
those of the image, mean |ln| of the variogram divided by that of the image at 1 to 32 cells, the
same ratio at 1 cell, Jensen–Shannon divergence of the patterns of 3 × 3 cells in three classes,
share of left-out cells in the interval of 80 %, root mean square error of the mean there divided by
the standard deviation, and CPU time in ms, also divided by that of the same study of 8 classes. The
other method is a Gaussian field with the covariance of the image, kriged to the data.

``python -m benchmarks.values verdicts`` prints in how many ensembles a verdict of *Validate*
differs: the variogram of the values, or a check of what is above the median. The ensembles are true
fields, which are other images of the generator, and realizations with and without faults.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import ndtri

from benchmarks.reproduction import with_indices
from ccwsim import Ensemble, HardData, Parameters, TrainingImage, simulate
from ccwsim.engine.corrections.residuals import correct, residuals_of
from ccwsim.metrics import check_ensemble, fit_curve
from ccwsim.model.study import Study

Floats = NDArray[np.floating[Any]]
SIDE, GRID, N = 300, (200, 200), 19
LAGS = (1, 2, 4, 8, 16, 32)
N_DATA = (0, 50, 400)
PARAMETERS = Parameters(template_size=32, overlap_size=8, wavelet_level=2)


def smooth(sigma: float, seed: int, shape: tuple[int, int] = (SIDE, SIDE)) -> Floats:
    """Return a Gaussian field with mean 0 and variance 1."""
    margin = int(4 * sigma)
    noise = np.random.default_rng(seed).standard_normal([n + 2 * margin for n in shape])
    field = ndimage.gaussian_filter(noise, sigma)[
        margin : -margin or None, margin : -margin or None
    ]
    return (field - field.mean()) / field.std()


def conductivity(seed: int) -> Floats:
    """Return ln K whose high values are connected (Zinn and Harvey 2003)."""
    ranks = np.abs(smooth(7, seed)).ravel().argsort().argsort()
    return -ndtri((ranks + 0.5) / ranks.size).reshape(SIDE, SIDE) + 0.15 * smooth(1, seed + 50)


def elevation(seed: int) -> Floats:
    """Return a relief of power-law noise with ridges."""
    rng = np.random.default_rng(seed)
    q = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.rfftfreq(SIDE))
    spectrum = np.fft.rfft2(rng.standard_normal((SIDE, SIDE))) * (q**2 + 0.012**2) ** -1.1
    field = np.fft.irfft2(spectrum)
    return 400 + 70 * (field - field.mean()) / field.std() - 120 * np.abs(smooth(12, seed + 1))


def amplitudes(seed: int) -> Floats:
    """Return folded layers with noise."""
    y, x = np.mgrid[:SIDE, :SIDE]
    column = smooth(2.2, seed, (SIDE + 200, SIDE))[:, 0]
    depth = y + 90 + 12 * np.sin(x / 45) + 10 * smooth(25, seed + 2)
    layers = np.interp(depth, np.arange(len(column)), column)
    return layers / layers.std() + 0.2 * smooth(1, seed + 3)


def stones(seed: int) -> Floats:
    """Return cells around random points, each with its own level and a rounded surface."""
    rng = np.random.default_rng(seed)
    far = np.ones((SIDE, SIDE))
    points = rng.integers(SIDE, size=(260, 2))
    far[tuple(points.T)] = 0
    distance, nearest = ndimage.distance_transform_edt(far, return_indices=True)
    levels = rng.normal(size=(SIDE, SIDE))[tuple(nearest)]
    return levels - 0.1 * distance + 0.05 * smooth(1, seed + 3)


def plume(seed: int) -> Floats:
    """Return the logarithm of concentrations in plumes that widen towards the east."""
    rng = np.random.default_rng(seed)
    total, (y, x) = np.zeros((SIDE, SIDE)), np.mgrid[:SIDE, :SIDE]
    for _ in range(60):
        start = rng.uniform((0, -60), SIDE)
        along = np.clip(x - start[1], 0.5, None)
        width, mass = 1.5 + 0.4 * np.sqrt(along), rng.lognormal(0, 0.6)
        across = y - start[0] - 8 * np.sin(along / 40 + rng.uniform(0, 6))
        spread = mass * np.exp(-(across**2) / 2 / width**2 - along / 120) / width
        total += np.where(x > start[1], spread, 0)
    return np.log10(total + 1e-3) + 0.02 * smooth(1, seed + 4)


KINDS = (conductivity, elevation, amplitudes, stones, plume)
SEEDS = (21, 22)  # of image and truth; no choice was made with these seeds


def variogram(field: Floats) -> Floats:
    """Return the variogram along x and y at `LAGS`."""
    pairs = [(field[:, h:], field[:, :-h]) for h in LAGS] + [(field[h:], field[:-h]) for h in LAGS]
    return np.array([np.mean((a - b) ** 2) / 2 for a, b in pairs])


def patterns(field: Floats, edges: Floats) -> Floats:
    """Return the frequency of each pattern of 3 × 3 cells in three classes."""
    classes = np.digitize(field, edges)
    windows = np.lib.stride_tricks.sliding_window_view(classes, (3, 3))
    numbers = (windows * 3 ** np.arange(9).reshape(3, 3)).sum(axis=(2, 3))
    return np.bincount(numbers.ravel(), minlength=3**9) / numbers.size


def divergence(p: Floats, q: Floats) -> float:
    """Return the Jensen–Shannon divergence of two distributions in bits."""
    terms = [np.sum(f[f > 0] * np.log2(2 * f[f > 0] / (p + q)[f > 0])) for f in (p, q)]
    return float(np.mean(terms))


def distance(a: Floats, b: Floats) -> float:
    """Return the Kolmogorov–Smirnov distance of two samples."""
    a, b = np.sort(a, axis=None), np.sort(b, axis=None)
    both = np.concatenate([a, b])
    shares = (np.searchsorted(each, both, side="right") / each.size for each in (a, b))
    return float(np.abs(np.subtract(*shares)).max())


def gaussian(study: Study, seed: int) -> Floats:
    """Return a Gaussian field with covariance and values of the image, kriged to the data."""
    has_data = study.hard_data.n > 0
    if not has_data:  # any datum, because only the covariance is used
        any_datum = HardData([[0, 0]], values={"value": study.training_image.sorted_values[:1]})
        study = replace(study, hard_data=any_datum)
    residuals = residuals_of(study)
    noise = np.random.default_rng(seed).standard_normal(residuals.wide)
    field = np.fft.irfft2(np.fft.rfft2(noise) * np.sqrt(residuals.spectrum), residuals.wide)
    values = np.interp(field[: GRID[0], : GRID[1]], residuals.scores, residuals.values)
    if has_data:
        correct(values, residuals)
    return values


def line(name: str, values: Floats, image: Floats, truth: Floats, left_out: Floats) -> str:
    """Return the measures of realizations as text."""
    ratios = np.mean([variogram(one) for one in values], axis=0) / variogram(image)
    edges = np.quantile(image, (1 / 3, 2 / 3))
    js = divergence(np.mean([patterns(v, edges) for v in values], axis=0), patterns(image, edges))
    low, high = np.quantile(values, (0.1, 0.9), axis=0, method="weibull")  # unbiased
    inside = np.mean(((low <= truth) & (truth <= high))[left_out])
    error = np.sqrt(np.mean((values.mean(axis=0) - truth)[left_out] ** 2)) / image.std()
    near = ratios[[0, len(LAGS)]].mean()
    return (
        f"| {name} | {distance(values, image):.3f} | {np.abs(np.log(ratios)).mean():.3f} "
        f"| {near:.2f} | {js:.4f} | {inside:.2f} | {error:.2f} "
    )


def as_ensemble(image: TrainingImage, fields: list[Floats]) -> Ensemble:
    """Return fields as the realizations of an image."""
    e = with_indices(image, np.array([image.class_indices(field) for field in fields]))
    return replace(e, values={image.variable: np.array(fields)})


def differing(e: Ensemble) -> list[str]:
    """Return the kinds of verdicts that differ."""
    curves = [fit_curve(e, "values", 0, way) for way in ("E-W", "N-S")]
    kinds = ["variogram of values" for fit in curves if fit is not None and not fit.fits]
    above = e.indicator(e.training_image.median)
    return kinds + [check.kind for check in check_ensemble(above) if not check.fit.fits]


def judged(kind: Any, seed: int) -> Iterator[tuple[str, list[str]]]:
    """Yield the name of each case, and the verdicts that differ."""
    image = TrainingImage.from_array(kind(seed), continuous=True)
    fields = [kind(1000 * seed + k) for k in range(12)]
    for k in range(3):
        yield "1 true field", differing(as_ensemble(image, fields[k : k + 1]))
    yield "8 true fields", differing(as_ensemble(image, fields[:8]))
    yield "12 true fields", differing(as_ensemble(image, fields))
    for name, p in (("default", Parameters()), ("template of 8 cells", Parameters(8, 4))):
        yield name, differing(simulate(image, GRID, p, None, 12, seed))
    half = kind(seed)[: SIDE // 2, : SIDE // 2].repeat(2, axis=0).repeat(2, axis=1)
    twice = simulate(TrainingImage.from_array(half, continuous=True), GRID, None, None, 12, seed)
    yield "image scaled × 2", differing(as_ensemble(image, [*twice.values_of()]))


def print_verdicts(seeds: range = range(60, 64)) -> None:
    """Print the share of ensembles in which a verdict differs, by case and generator."""
    found: dict[str, dict[str, list[list[str]]]] = {}
    for kind in KINDS:
        for seed in seeds:
            for case, kinds in judged(kind, seed):
                found.setdefault(case, {}).setdefault(kind.__name__, []).append(kinds)
    print(f"| ensembles | {' | '.join(kind.__name__ for kind in KINDS)} | all | of values |")
    for case, by_kind in found.items():
        each = [*by_kind.values(), [kinds for all_ in by_kind.values() for kinds in all_]]
        cells = [f"{sum(map(bool, kinds))} of {len(kinds)}" for kinds in each]
        print(
            f"| {case} | {' | '.join(cells)} | {sum('values' in ' '.join(k) for k in each[-1])} |"
        )


def main(what: str = "quality") -> None:
    """Print the table."""
    if what == "verdicts":
        print_verdicts()
        return
    print("| image | data | method | KS | ln γ | γ(1) | JS | in 80 % | error | ms | ratio |")
    for kind in KINDS:
        image, truth = kind(SEEDS[0]), kind(SEEDS[1])[: GRID[0], : GRID[1]]
        continuous = TrainingImage.from_array(image, continuous=True)
        classes = TrainingImage.from_array(image, classes=8)
        for n in N_DATA:
            cells = np.random.default_rng(n).permutation(truth.size)[:n]
            cells = np.column_stack(np.unravel_index(cells, GRID))
            data = HardData(cells, values={"value": truth[tuple(cells.T)]}) if n else HardData()
            left_out = np.ones(GRID, bool)
            left_out[tuple(cells.T)] = False
            options: dict[str, Any] = {"n_realizations": N, "n_workers": 1, "seed": 1}
            e = simulate(continuous, GRID, PARAMETERS, data, **options)
            assert not e.n_mismatched.any()
            of_classes = HardData(e.hard_data.cells, e.hard_data.facies)
            of_classes.numbering = classes.numbering_of_data
            other = simulate(classes, GRID, PARAMETERS, of_classes, **options)
            seconds, usual = np.median(e.cpu_seconds), np.median(other.cpu_seconds)
            text = line(f"{kind.__name__} | {n} | CCWSIM", e.values_of(), image, truth, left_out)
            print(f"{text}| {1e3 * seconds:.0f} | {seconds / usual:.2f} |", flush=True)
            start = time.thread_time()
            fields = np.stack([gaussian(e.study, seed) for seed in range(N)])
            seconds = (time.thread_time() - start) / N
            text = line(f"{kind.__name__} | {n} | Gaussian", fields, image, truth, left_out)
            print(f"{text}| {1e3 * seconds:.0f} | {seconds / usual:.2f} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
