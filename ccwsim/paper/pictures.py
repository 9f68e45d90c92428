"""Maps and curves of an experiment as blocks of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ccwsim.figures import (
    LIGHT,
    Bundle,
    Dots,
    Line,
    curves_chart,
    data_map_png,
    facies_colours,
    lines_chart,
    share_png,
)
from ccwsim.metrics import band, connectivity, variogram
from ccwsim.metrics.lags import Direction
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage
from ccwsim.report import Chart, Picture

COLOURS = {
    "training image": LIGHT.reference,
    "CCWSIM": "#173F6B",
    "MS-CCSIM": "#B9770E",
    "CCSIM": "#3A9E7E",
    "published CCWSIM": "#6F93BC",
    "published MS-CCSIM": "#E8B765",
    "DeeSse": "#A78BD0",
    "SNESIM": "#7A7F86",
}
"""One colour a method, in every chart of the report."""
LAGS = (21, 41, 61, 81)
"""At which connection is told in numbers."""
BUNDLE_LEGEND = (
    ("training image", LIGHT.reference),
    ("median", LIGHT.ink),
    ("5–95 %", "#DDDCDA"),
    ("each realization", "#BCBEC0"),
)


def map_picture(
    indices: NDArray[np.uint8],
    image: TrainingImage,
    caption: str,
    data: HardData | None = None,
    share: float = 1.0,
) -> Picture:
    """Return a map; data that it does not honour are ringed red and counted in the caption."""
    colours = facies_colours(image)
    dots = None
    if data is not None and data.n:
        codes = np.searchsorted(image.codes, data.facies)
        wrong = indices[data.cells[:, 0], data.cells[:, 1]] != codes
        dots = Dots(data.cells, [colours[k] for k in codes], wrong)
        if wrong.any():
            caption += f"; {np.count_nonzero(wrong)} of {data.n} data wrong (ringed red)"
    png = data_map_png(indices, colours, dots)
    return Picture(png, caption, f"Map of facies: {caption}", share, pixelated=dots is None)


def image_picture(image: TrainingImage, said: str, share: float = 0.6) -> Picture:
    """Return the training image itself."""
    ny, nx = image.shape
    caption = f"Training image, {nx} × {ny}: {said}"
    return map_picture(image.indices, image, caption, share=share)


def share_picture(shares: NDArray[np.float64], caption: str) -> Picture:
    """Return a map of probabilities: dark blue never, yellow always."""
    return Picture(share_png(shares), caption, f"Map of probability: {caption}", pixelated=True)


def lags_for(*shapes: tuple[int, ...], largest: int) -> NDArray[np.int64]:
    """Return the lags 0 … up to half of the smallest side of some images, at most `largest`.

    Examples
    --------
    >>> lags_for((8, 30), (100, 100), largest=50)
    array([0, 1, 2, 3, 4])
    """
    smallest = min(side for shape in shapes for side in shape[-2:])
    return np.arange(min(largest, smallest // 2) + 1)


def curve_of(
    statistic: str, images: NDArray, facies: int, way: Direction, lags: NDArray
) -> NDArray[np.float64]:
    """Return the "variogram" or the "connection" of images, one row each."""
    if statistic == "variogram":
        return variogram(images, facies, way, lags).gamma
    return connectivity(images, facies, way, lags).tau


def bundle_chart(
    statistic: str, images: NDArray, image: TrainingImage, way: Direction, lags: NDArray
) -> tuple[Chart, Bundle]:
    """Return the chart of one statistic of all realizations around the training image's."""
    facies = image.n_facies - 1
    reference = curve_of(statistic, image.indices, facies, way, lags)[0]
    each = curve_of(statistic, images, facies, way, lags)
    spread = band(each, 0.05, 0.95)
    bundle = Bundle(lags.astype(float), reference, each, spread.low, spread.median, spread.high)
    name, sign = image.facies_names[facies], "γ" if statistic == "variogram" else "τ"
    title = f"{statistic.capitalize()} {str(way).replace('-', '–')} of {name}"
    top = 1.1 * float(np.nanmax(each)) if statistic == "variogram" else 1.04
    figure = curves_chart(bundle, LIGHT, y_title=sign, y_range=(0, top), height=220)
    return Chart(figure, title, f"{title}: realizations and training image", BUNDLE_LEGEND), bundle


def connection_chart(
    stacks: Mapping[str, NDArray], image: TrainingImage, way: Direction, lags: NDArray
) -> Chart:
    """Return mean connection of several methods around the training image's, one line each."""
    facies = image.n_facies - 1
    reference = curve_of("connection", image.indices, facies, way, lags)[0]
    lines = [
        Line(name, lags, np.nanmean(curve_of("connection", images, facies, way, lags), axis=0),
             colour_of(name), dash_of(name))
        for name, images in stacks.items()
    ]  # fmt: skip
    lines.append(Line("training image", lags, reference, LIGHT.reference))
    title = f"Connection {str(way).replace('-', '–')} of {image.facies_names[facies]}, mean"
    figure = lines_chart(
        lines, LIGHT, x_title="lag (cells)", y_title="τ", y_range=(0, 1.04), height=280
    )
    legend = tuple((line.name, line.colour) for line in lines)
    return Chart(figure, title, f"{title}: {', '.join(stacks)}, training image", legend)


def colour_of(name: str) -> str:
    """Return the colour of a method; what follows a comma does not matter."""
    return COLOURS.get(name.split(",")[0], "#7A7F86")


def dash_of(name: str) -> str:
    """Return the dash of a method: level 3 is dashed, data exact dotted."""
    return "dash" if "level 3" in name else "dot" if "exact" in name else "solid"


def relative_tau(
    images: NDArray, image: TrainingImage, lags: Sequence[int] = LAGS
) -> dict[int, float]:
    """Return mean connection E–W relative to the training image's at the lags that fit.

    Examples
    --------
    >>> ti = TrainingImage(np.eye(60, dtype=int))
    >>> relative_tau(ti.indices[None], ti)
    {21: nan}
    """
    smallest = min(*images.shape[-2:], *image.shape)
    fits = [lag for lag in lags if lag <= smallest // 2] or [max(smallest // 4, 1)]
    facies = image.n_facies - 1
    own = np.array([np.mean(c) for c in curve_of("connection", images, facies, "E-W",
                                                 np.array(fits)).T])  # fmt: skip
    reference = curve_of("connection", image.indices, facies, "E-W", np.array(fits))[0]
    with np.errstate(invalid="ignore", divide="ignore"):
        return dict(zip(fits, (own / reference).tolist(), strict=True))
