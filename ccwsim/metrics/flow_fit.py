"""Flow through realizations compared with the training image, as a measure of connectivity."""

from dataclasses import dataclass

import numpy as np

from ccwsim import Ensemble
from ccwsim.flow import flow_efficiency
from ccwsim.metrics.reference_band import Fit, fit_values
from ccwsim.metrics.stack import Fraction, Stack, map_parallel
from ccwsim.model import Bytes, Floats

MAX_SOLVED = 12  # realizations that are solved as a whole; a solution takes up to seconds
MIN_EFFICIENCY_GAP, MIN_EFFICIENCY_SPREAD = 0.05, 0.02
"""Smallest reported difference of E, and smallest standard deviation between crops."""

OVERHEAD = 50_000  # a solution takes as long as if it had so many more cells
MIN_COMPARED = 4  # minimum number of crops, and of pieces, that are compared
N_ERRORS = (3.0, 2.5)  # allowed differences of E in standard errors, for maps and for volumes


@dataclass(frozen=True, eq=False)
class FlowFit:
    """Flow efficiency of a facies along each axis, in the order x, y (and z)."""

    each: Floats
    """E of the first realizations, shape (n, dimensions), in `Study.whole_window` if some cells are
    inactive."""
    reference: Floats
    """E of the training image, shape (dimensions,); NaN if it was not solved."""
    fit: Fit | None
    """Comparison of pieces of the realizations with crops of the training image, by axis."""
    is_of_image_size: bool = False
    """Whether realizations have the size of the image, so that whole E can be compared."""


def fit_flow(
    ensemble: Ensemble,
    facies: int | str,
    progress: Fraction | None = None,
    max_cells: float = np.inf,
) -> FlowFit:
    """Compare the flow efficiency E = effective K / arithmetic mean K with the training image.

    The facies conducts 10⁴ times as well as all others; cells that touch at corners only are not
    connected. Whole grids and pieces are compared, because broken geobodies matter more over longer
    distances. `max_cells` limits the cells in all solutions of each kind of image, and thereby the
    time: fewer images are solved, or none if they are too large.

    Examples
    --------
    >>> from ccwsim import datasets, simulate
    >>> e = simulate(datasets.load("channels"), (64, 64))
    >>> fit_flow(e, facies=1).each.shape
    (1, 2)
    """
    image = ensemble.training_image
    index, n_axes = image.index_of(facies), image.n_dimensions

    def one(indices: Bytes) -> list[float]:
        return [flow_efficiency(indices == index, axis) for axis in reversed(range(n_axes))]

    def allowed(n: int, n_cells: int) -> int:
        return int(min(n, max_cells / (n_axes * (n_cells + OVERHEAD))))

    def values(images: Stack) -> Floats:
        most = allowed(len(images), images.indices[0].size)
        if most < min(len(images), MIN_COMPARED):
            return np.full((len(images), n_axes), np.nan)
        chosen = np.linspace(0, len(images) - 1, most).astype(int)
        return np.array(map_parallel(lambda k: one(images.indices[chosen[k]]), most))

    whole = ensemble.indices[(slice(MAX_SOLVED), *ensemble.study.whole_window)]
    n = allowed(len(whole), whole[0].size)
    each = map_parallel(lambda k: one(whole[k]), n, progress)
    fit = fit_values(
        ensemble,
        ("flow", index, max_cells),
        np.arange(n_axes, dtype=float),
        values,
        min_gap=MIN_EFFICIENCY_GAP,
        min_spread=MIN_EFFICIENCY_SPREAD,
        n_errors=N_ERRORS[image.n_dimensions - 2],
    )
    reference = one(image.indices) if allowed(1, image.indices.size) else [np.nan] * n_axes
    return FlowFit(
        each=np.reshape(each, (n, n_axes)),
        reference=np.array(reference),
        fit=fit,
        is_of_image_size=whole[0].shape == image.shape,
    )
