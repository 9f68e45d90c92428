"""Pictures of maps and charts of curves for the reports on realizations."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from ccwsim import Ensemble, Grid, HardData, TrainingImage, figures
from ccwsim.figures import LIGHT, Bundle, Dots, LayerData, Theme
from ccwsim.metrics import band, vertical_proportions
from ccwsim.metrics.bands import Statistic, curves_of
from ccwsim.metrics.lags import Direction, distinct_lags, max_lag
from ccwsim.metrics.stack import N_AXES, Fraction, Stack
from ccwsim.model import MAX_CURVES, Bytes, Floats, frozen
from ccwsim.report.document import Chart, Picture
from ccwsim.report.verdicts import SIGNS, curve_title

N_VALUE_BINS = 24  # bins of a histogram of values
LEGEND = (
    ("training image", LIGHT.reference),
    ("median", LIGHT.ink),
    ("5–95 %", "#DDDCDA"),
    ("each realization", "#BCBEC0"),
)


def map_picture(
    indices: Bytes,
    image: TrainingImage,
    colours: Sequence[str],
    caption: str,
    data: HardData | None = None,
    share: float = 1.0,
) -> Picture:
    """Return a map or slices of a volume with data; the caption counts wrong data (red)."""
    dots = dots_of(data, image, indices, colours)
    if dots is not None and dots.wrong.any():
        n_wrong, n = np.count_nonzero(dots.wrong), len(dots.wrong)
        caption += f"; {n_wrong} of {n} data not honoured (red rings)"
    if indices.ndim == N_AXES:
        return _slices(figures.slices_png(indices, colours, dots=dots), caption, share)
    png = figures.data_map_png(indices, colours, dots)
    return Picture(png, caption, f"Map of facies: {caption}", share, pixelated=dots is None)


def dots_of(
    data: HardData | None, image: TrainingImage, indices: Bytes, colours: Sequence[str]
) -> Dots | None:
    """Return hard data to draw on a map or volume of facies `indices`; None without data."""
    if data is None or not data.n:
        return None
    facies = np.searchsorted(image.codes, data.facies)
    wrong = indices[tuple(data.cells.T)] != facies
    return Dots(data.cells, [str(colours[k]) for k in facies.tolist()], wrong)


def share_picture(shares: Floats, caption: str) -> Picture:
    """Return a picture of a share per cell of a map or volume: 0 is dark blue, 1 is yellow."""
    steps, colours = figures.steps_of(shares)
    if shares.ndim == N_AXES:
        return _slices(figures.slices_png(steps, colours), caption)
    return Picture(figures.data_map_png(steps, colours), caption, f"Map: {caption}", pixelated=True)


def _slices(png: bytes, caption: str, share: float = 1.0) -> Picture:
    words = f"{caption}; slices through the middle, counted from the bottom, south and west"
    return Picture(png, words, f"Slices of a volume: {words}", share)


def bundle_of(
    ensemble: Ensemble,
    statistic: Statistic,
    facies: int,
    direction: Direction,
    progress: Fraction | None = None,
) -> Bundle:
    """Return a curve of a facies, given by its index, for the image and the realizations."""
    image = ensemble.training_image
    code = int(image.codes[facies])
    n_lags = max_lag(direction, image.shape, ensemble.study.whole_shape)
    lags, distances = distinct_lags(direction, n_lags)
    reference = _curve_of_image(image, statistic, code, direction, n_lags)
    values = ensemble.values_of()[:MAX_CURVES] if statistic == "values" else None
    stack = Stack(ensemble.indices[:MAX_CURVES], image.codes, values=values)
    each = curves_of(statistic, stack, code, direction, lags, progress=progress)
    return bundle_of_curves(distances, reference, each)


@lru_cache(maxsize=64)
def _curve_of_image(
    image: TrainingImage, statistic: Statistic, code: int, direction: Direction, n_lags: int
) -> Floats:
    """Return a curve of a training image; ensembles with this training image share the curve."""
    lags, _ = distinct_lags(direction, n_lags)
    return frozen(curves_of(statistic, image, code, direction, lags)[0])


def bundle_of_curves(lags: Floats, reference: Floats, each: Floats) -> Bundle:
    """Return a bundle of curves with their quantiles; quantiles are NaN at lags without values."""
    spread = band(each, 0.05, 0.95)
    return Bundle(
        lags=lags,
        reference=reference,
        each=each,
        low=spread.low,
        median=spread.median,
        high=spread.high,
    )


def histogram_bundle(ensemble: Ensemble) -> Bundle:
    """Return the share of cells, in %, in bins of the values of a continuous variable.

    Lags are the middles of the bins, which divide the range of the training image.
    """
    values = ensemble.training_image.sorted_values
    edges = np.linspace(values[0], values[-1], N_VALUE_BINS + 1)

    def shares(of_cells: Floats) -> Floats:
        known = of_cells[np.isfinite(of_cells)]
        return 100 * np.histogram(np.clip(known, *edges[[0, -1]]), edges)[0] / known.size

    each = np.array([shares(one) for one in ensemble.values_of()[:MAX_CURVES]])
    return bundle_of_curves((edges[1:] + edges[:-1]) / 2, shares(values), each)


def layers_bundle(ensemble: Ensemble, facies: int) -> Bundle:
    """Return the share of a facies, given by its index, in each layer; lags are elevations."""
    image = ensemble.training_image
    each = vertical_proportions(Stack(ensemble.indices[:MAX_CURVES], image.codes))[:, facies]
    reference = vertical_proportions(image)[0, facies]
    return bundle_of_curves(np.asarray(ensemble.grid.axes[-1], float), reference, each)


def layers_of_image(grid: Grid, n_layers: int) -> Floats:
    """Return the elevations of a training image's layers, stretched to the height of the grid."""
    shares = (np.arange(n_layers) + 0.5) / n_layers
    return grid.origin[-1] + grid.cell_size[-1] * (grid.nz or 1) * shares


def layer_data(data: HardData, grid: Grid, code: int) -> LayerData:
    """Return the share of a facies among the hard data of each layer with data."""
    layers, count = np.unique(data.cells[:, 0], return_counts=True)
    facies_count = np.bincount(data.cells[data.facies == code, 0], minlength=grid.nz or 1)[layers]
    return LayerData(np.asarray(grid.axes[-1], float)[layers], facies_count / count, count)


def layers_chart(
    ensemble: Ensemble, facies: int, bundle: Bundle, theme: Theme, **options: Any
) -> Any:
    """Return the chart of `layers_bundle`; `options` are passed to `vertical_proportions_chart`."""
    image, grid = ensemble.training_image, ensemble.grid
    return figures.vertical_proportions_chart(
        bundle,
        theme,
        x_title=f"{image.facies_names[facies]} (%)",
        reference_at=layers_of_image(grid, image.shape[0]),
        data=layer_data(ensemble.hard_data, grid, int(image.codes[facies])),
        **options,
    )


def bundle_chart(
    bundle: Bundle, statistic: Statistic, direction: Direction, facies: str, top: float, height: int
) -> Chart:
    """Return the chart of a bundle; the y axis ends at `top` for variograms, otherwise at 1."""
    top = 1.04 if statistic == "connectivity" else top
    title = f"{curve_title(statistic, direction)} of {facies}"
    figure = figures.curves_chart(
        bundle, LIGHT, y_title=SIGNS[statistic], y_range=(0, top), height=height
    )
    return Chart(figure, title, f"{title}: realizations and training image", LEGEND)
