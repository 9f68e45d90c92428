"""Settings, published realizations, measures and charts of the methods compared in the paper."""

from collections.abc import Mapping

import numpy as np

from ccwsim import Ensemble, HardData, Parameters, TrainingImage
from ccwsim.figures import LIGHT, Line, facies_colours, lines_chart
from ccwsim.metrics import pattern_distance
from ccwsim.metrics.bands import curves_of
from ccwsim.metrics.stack import Stack
from ccwsim.model import Array, Bytes, Floats, Ints, Method, Variant
from ccwsim.paper.experiment import PAPER_TEXTS, ExperimentRun
from ccwsim.report.document import Chart, Picture
from ccwsim.report.pictures import map_picture
from ccwsim.report.settings import describe_inputs

TITLES = {"ccwsim": "CCWSIM", "ms-ccsim": "MS-CCSIM", "ccsim": "CCSIM"}
AUTHORS_SETTINGS = "T 32, OR 8, 20 candidates, search fraction 0.1, CT 2"  # as in their script
COLUMNS: dict[str, str] = PAPER_TEXTS["columns"]
"""Titles of columns by variant, and of the column of the authors' realizations ("authors")."""
COMPARED: tuple[Variant, ...] = ("paper", "ours")
"""Variants that every experiment simulates, beside the paper's numbers."""
METHOD_COLOURS = {"training image": LIGHT.reference, **PAPER_TEXTS["colours"]}
"""Colour of each method in all charts of the report."""
LAGS = (21, 41, 61, 81)  # lags in cells at which tables show connectivity


def paper_parameters(
    method: Method, level: int, variant: Variant = "paper", template: int = 32
) -> Parameters:
    """Return the authors' settings of a method, with the rules of a variant.

    The paper counts the levels of MS-CCSIM from 1, which is the image itself.
    """
    return Parameters.published(
        variant,
        template_size=template,
        overlap_size=8,
        wavelet_level=level - 1 if method == "ms-ccsim" else level,
        method=method,
    )


def published(
    run: ExperimentRun, image: TrainingImage, name: str, shape: tuple[int, int]
) -> Array | None:
    """Return realizations of a published code, or None if the code simulated another study."""
    if not run.inputs.is_own("stone wall" if "stonewall" in name else "channel"):
        return None
    stored = run.inputs.published(name, image)
    return stored if stored is not None and stored.shape[1:] == shape else None


def median_seconds(ensemble: Ensemble) -> float:
    """Return the median CPU time of a realization in seconds."""
    return float(np.median(ensemble.cpu_seconds))


def wrong_share(images: Array, image: TrainingImage, data: HardData) -> float:
    """Return the mean share of data that the realizations (facies indices) do not honour."""
    wrong = [data.n_mismatched(image.codes[indices]) for indices in images]
    return float(np.mean(wrong) / max(data.n, 1))


def mean_distances(images: Array, image: TrainingImage) -> Floats:
    """Return the mean pattern distance to the training image at resolutions 1, 1/2 and 1/3."""
    return pattern_distance(Stack(images, image.codes), image).mean(axis=0)


def format_distances(distances: Floats) -> str:
    """Return distances at several resolutions as the text of one table cell."""
    return " ".join(f"{d:.4f}" for d in distances)


def relative_tau(images: Array, image: TrainingImage) -> dict[int, float]:
    """Return mean connectivity E–W relative to the image, at the `LAGS` that fit into the image."""
    smallest = min(images.shape[-2:] + image.shape)
    fits = [lag for lag in LAGS if lag <= smallest // 2] or [max(smallest // 4, 1)]
    code, stack = int(image.codes[-1]), Stack(images, image.codes)
    curves, (reference,) = (
        curves_of("connectivity", images, code, "E-W", np.array(fits)) for images in (stack, image)
    )
    means = np.array([np.mean(values) for values in curves.T])
    with np.errstate(invalid="ignore", divide="ignore"):
        return dict(zip(fits, (means / reference).tolist(), strict=True))


def lags_for(*shapes: tuple[int, ...], largest: int) -> Ints:
    """Return the lags from 0 to half of the smallest image side, but at most `largest`."""
    smallest = min(side for shape in shapes for side in shape[-2:])
    return np.arange(min(largest, smallest // 2) + 1)


def paper_map(
    indices: Bytes, image: TrainingImage, caption: str, data: HardData | None = None
) -> Picture:
    """Return a picture of a map in the default colours, with hard data."""
    return map_picture(indices, image, facies_colours(image), caption, data)


def image_picture(image: TrainingImage, description: str) -> Picture:
    """Return a picture of the training image."""
    ny, nx = image.shape
    caption = f"Training image, {nx} × {ny}: {description}"
    return map_picture(image.indices, image, facies_colours(image), caption, share=0.6)


def connectivity_chart(stacks: Mapping[str, Array], image: TrainingImage, lags: Array) -> Chart:
    """Return a chart of the mean connectivity E–W of several methods and of the training image."""
    code = int(image.codes[-1])
    lines = []
    for name, images in stacks.items():
        stack = Stack(images, image.codes)
        mean = np.nanmean(curves_of("connectivity", stack, code, "E-W", lags), axis=0)
        dash = "dash" if "level 3" in name else "solid"
        lines.append(Line(name, lags, mean, method_colour(name), dash))
    reference = curves_of("connectivity", image, code, "E-W", lags)[0]
    lines.append(Line("training image", lags, reference, LIGHT.reference))
    title = f"Connectivity E–W of {image.facies_names[-1]}, mean"
    figure = lines_chart(
        lines, LIGHT, x_title="lag (cells)", y_title="τ", y_range=(0, 1.04), height=280
    )
    legend = tuple((line.name, line.colour) for line in lines)
    return Chart(figure, title, f"{title}: {', '.join(stacks)}, training image", legend)


def caption_of_cases(e: Ensemble) -> str:
    """Return the caption of a chart of several methods; `e` are realizations of one of them."""
    realizations = f"{e.n} realizations of each of our cases, seed {e.seed}"
    return f"{describe_inputs(e)}; {AUTHORS_SETTINGS}; {realizations}."


def method_colour(name: str) -> str:
    """Return the colour of a method, by its full name or by the part before “, level”."""
    return METHOD_COLOURS.get(name, METHOD_COLOURS.get(name.split(", level")[0], "#7A7F86"))
