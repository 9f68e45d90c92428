"""Maps and curves of realizations as pictures and charts of a report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccwsim.figures import LIGHT, Bundle, Dots, curves_chart, data_map_png, share_png
from ccwsim.metrics import band
from ccwsim.metrics.bands import Statistic, curves_of
from ccwsim.metrics.lags import Direction
from ccwsim.metrics.stack import Images
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from ccwsim.report.document import Chart, Picture
from ccwsim.report.verdicts import SIGNS

Floats = NDArray[np.float64]
LEGEND = (
    ("training image", LIGHT.reference),
    ("median", LIGHT.ink),
    ("5–95 %", "#DDDCDA"),
    ("each realization", "#BCBEC0"),
)


def map_picture(
    indices: NDArray[np.uint8],
    image: TrainingImage,
    colours: Sequence[str],
    caption: str,
    data: HardData | None = None,
    share: float = 1.0,
) -> Picture:
    """Return a map; data that it does not honour are ringed red and counted in the caption."""
    dots = None
    if data is not None and data.n:
        facies = np.searchsorted(image.codes, data.facies)
        wrong = indices[data.cells[:, 0], data.cells[:, 1]] != facies
        dots = Dots(data.cells, [str(colours[k]) for k in facies.tolist()], wrong)
        if wrong.any():
            caption += f"; {np.count_nonzero(wrong)} of {data.n} data wrong (ringed red)"
    png = data_map_png(indices, colours, dots)
    return Picture(png, caption, f"Map of facies: {caption}", share, pixelated=dots is None)


def share_picture(shares: Floats, caption: str) -> Picture:
    """Return a map of shares from 0, dark blue, to 1, yellow."""
    return Picture(share_png(shares), caption, f"Map: {caption}", pixelated=True)


def bundle_of(
    statistic: Statistic,
    images: Images,
    image: TrainingImage,
    facies: int,
    way: Direction,
    lags: NDArray,
) -> Bundle:
    """Return a statistic of a facies (a code) in realizations and in the training image."""
    reference = curves_of(statistic, image, facies, way, lags)[0]
    each = curves_of(statistic, images, facies, way, lags)
    return bundle_of_curves(lags.astype(float), reference, each)


def bundle_of_curves(lags: Floats, reference: Floats, each: Floats) -> Bundle:
    """Return a bundle with its quantiles; a lag where no realization has a value stays empty.

    Examples
    --------
    >>> each = np.array([[0.0, np.nan], [2.0, np.nan]])
    >>> bundle_of_curves(np.arange(2.0), np.zeros(2), each).median
    array([ 1., nan])
    """
    spread = band(each, 0.05, 0.95)
    return Bundle(lags, reference, each, spread.low, spread.median, spread.high)


def bundle_chart(
    bundle: Bundle, statistic: Statistic, way: Direction, facies: str, top: float, height: int
) -> Chart:
    """Return the chart of a bundle up to γ = `top`; connectivity always goes up to 1."""
    top = 1.04 if statistic == "connectivity" else top
    title = f"{statistic.capitalize()} {str(way).replace('-', '–')} of {facies}"
    figure = curves_chart(bundle, LIGHT, y_title=SIGNS[statistic], y_range=(0, top), height=height)
    return Chart(figure, title, f"{title}: realizations and training image", LEGEND)
