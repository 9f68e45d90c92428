"""Maps and curves of the realizations of a study, as blocks of its report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccwsim.figures import (
    LIGHT,
    Bundle,
    Dots,
    curves_chart,
    data_map_png,
    map_png,
    proportions_chart,
    share_png,
    times_chart,
)
from ccwsim.metrics import band, connectivity, etype, variogram
from ccwsim.model.bounds import MAX_CURVES, MAX_LAG
from ccwsim.model.ensemble import Ensemble
from ccwsim.report import Chart, Picture, Row

MAX_MAPS = 24
LEGEND = (
    ("training image", LIGHT.reference),
    ("median", LIGHT.ink),
    ("5–95 %", "#DDDCDA"),
    ("each realization", "#BCBEC0"),
)
WAYS = (("E-W", "E–W"), ("N-S", "N–S"))


def image_map(ensemble: Ensemble, colours: Sequence[str]) -> Picture:
    """Return the training image, at the scale of the realizations where it can be."""
    image = ensemble.training_image
    ny, nx = image.shape
    share = min(max(nx / ensemble.grid.nx, 0.5), 2.0)
    caption = f"Training image {image.name or ''}, {nx} × {ny} cells"
    return Picture(data_map_png(image.indices, colours), caption, caption, share, pixelated=True)


def realization_map(ensemble: Ensemble, colours: Sequence[str], number: int) -> Picture:
    """Return a realization with the hard data; those that are wrong are ringed red."""
    caption = f"Realization {number + 1} of {ensemble.n}"
    data = ensemble.hard_data
    wrong = np.zeros(data.n, bool)
    if data.n:
        rows, columns = data.cells.T
        wrong = ensemble.realizations[number][rows, columns] != data.facies
        caption += f", with {data.n} hard data"
    if wrong.any():
        caption += f", {np.count_nonzero(wrong)} of them wrong (ringed red)"
    dots = _dots(ensemble, colours, wrong)
    return Picture(data_map_png(ensemble.indices[number], colours, dots), caption, caption)


def _dots(ensemble: Ensemble, colours: Sequence[str], wrong: NDArray[np.bool_]) -> Dots:
    data = ensemble.hard_data
    places = np.searchsorted(ensemble.training_image.codes, data.facies)
    return Dots(data.cells, [str(colours[k]) for k in places.tolist()], wrong)


def small_maps(ensemble: Ensemble, colours: Sequence[str]) -> Row:
    """Return the realizations, small, side by side."""
    n = min(ensemble.n, MAX_MAPS)
    items = tuple(
        Picture(
            map_png(ensemble.indices[r], colours), str(r + 1), f"Realization {r + 1}", 0.6, True
        )
        for r in range(n)
    )
    said = "" if n == ensemble.n else f"The first {n} of {ensemble.n} realizations"
    return Row(items, said, columns=6)


def e_type_maps(ensemble: Ensemble, facies: int) -> Row:
    """Return the probability of a facies and the entropy, cell by cell."""
    image = ensemble.training_image
    found = etype(ensemble.indices, image.n_facies)
    name = image.facies_names[facies]
    items = tuple(
        Picture(share_png(shares), caption, f"Map: {caption}", pixelated=True)
        for shares, caption in (
            (found.probability[facies], f"Probability of {name}: dark blue 0, yellow 1"),
            (found.entropy, "Entropy: dark blue where all agree, yellow where none knows"),
        )
    )
    return Row(items)


def curve_charts(ensemble: Ensemble, facies: int) -> tuple[Row, ...]:
    """Return variograms, then connection, of a facies, each E–W and N–S; none of one row."""
    if min(*ensemble.training_image.shape, *ensemble.grid.shape) < 2:
        return ()
    name = ensemble.training_image.facies_names[facies]
    rows = []
    for statistic, sign in (("Variogram", "γ"), ("Connection", "τ")):
        bundles = [_bundle(ensemble, facies, statistic, way) for way, _ in WAYS]
        tops = [np.nanmax([b.each.max(), b.reference.max()]) for b in bundles]
        top = 1.04 if statistic == "Connection" else 1.1 * float(max(tops)) or 1.0
        charts = []
        for bundle, (_, said) in zip(bundles, WAYS, strict=True):
            title = f"{statistic} {said} of {name}"
            drawn = curves_chart(bundle, LIGHT, y_title=sign, y_range=(0, top), height=240)
            charts.append(Chart(drawn, title, f"{title}: realizations, training image", LEGEND))
        rows.append(Row(tuple(charts)))
    return tuple(rows)


def _bundle(ensemble: Ensemble, facies: int, statistic: str, way: str) -> Bundle:
    image, axis = ensemble.training_image, 1 if way == "E-W" else 0
    lags = max(1, min(MAX_LAG, image.shape[axis] // 2, ensemble.grid.shape[axis] // 2))

    def curve(images: np.ndarray) -> np.ndarray:
        if statistic == "Variogram":
            return variogram(images, facies, way, lags).gamma
        return connectivity(images, facies, way, lags).tau

    reference = curve(image.indices).reshape(-1)
    each = curve(ensemble.indices[:MAX_CURVES])
    spread = band(each, 0.05, 0.95)
    steps = np.arange(len(reference), dtype=float)
    return Bundle(steps, reference, each, spread.low, spread.median, spread.high)


def counted_charts(ensemble: Ensemble, colours: Sequence[str]) -> Row:
    """Return CPU times and proportions."""
    image, mean = ensemble.training_image, float(ensemble.cpu_seconds.mean())
    times = times_chart(1000 * ensemble.cpu_seconds, 1000 * mean, LIGHT, height=240)
    shares = proportions_chart(
        image.facies_names, image.proportions, ensemble.proportions, colours, LIGHT
    )
    return Row(
        (
            Chart(times, "CPU time of each realization", "CPU time of each realization"),
            Chart(shares, "Facies proportions", "Facies proportions, image and realizations",
                  (("training image", LIGHT.reference),)),
        )
    )  # fmt: skip
