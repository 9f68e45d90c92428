"""The trend of hard data: proportions that data suggest for each location (not in the paper).

A global target proportion would move facies from areas where data show them to areas where data
exclude them. If a smooth map of the data predicts single data better than their mean does, the
running proportions of a realization are therefore compared with the part of the map that is already
simulated.
"""

from typing import NamedTuple

import numpy as np

from ccwsim.engine.corrections.proportions import DataProportions
from ccwsim.engine.stages.path import RasterPath, Triple
from ccwsim.model import Floats, Ints

N_PIXELS = 64  # number of pixels of the map along the longer side of the grid
N_PIXELS_GIVEN = 32  # number of pixels for given probabilities; the resolution of the targets
TREND_WIDTHS = (1 / 4, 1 / 6, 1 / 8, 1 / 12, 1 / 16, 1 / 24, 1 / 32)
"""Standard deviations of the Gaussian that are tried, divided by the longer side of the grid."""
MIN_COLUMNS = 10  # minimum number of columns of data from which a trend is estimated
SIGNIFICANT = 2.0  # minimum improvement of the prediction, in standard errors
MANY_COLUMNS = 150  # minimum number of columns from which preferential sampling is found
PREFERENTIAL = 4.0
"""Squared difference between weighted and plain mean of data, in squared standard errors, above
which their locations depend on the facies."""
N_RAKINGS = 3  # number of steps that bring the mean of the map to the target of a realization


class Trend(NamedTuple):
    """Expected proportions of facies at each location, estimated from hard data."""

    proportions: Floats  # shape (n_rows, n_columns, n_facies): one value per pixel
    pixel: float  # side of a pixel in cells
    residual: float  # variance of data around the map / variance around their mean
    between: float  # variance of the map; 0 if the locations of data may depend on the facies


def trend_of_data(data: DataProportions, grid_shape: Triple, min_width: float) -> Trend | None:
    """Return the Gaussian mean of data that best predicts left-out columns of data.

    The standard deviation of the Gaussian is at least `min_width` cells. Return None if no mean is
    significantly better than the mean of all data.
    """
    n = len(data.shares)
    if n < MIN_COLUMNS:
        return None
    from scipy.ndimage import gaussian_filter  # slow to import; only data need it

    _, ny, nx = grid_shape
    pixel = max(ny, nx) / N_PIXELS
    shape = int(np.ceil(ny / pixel)), int(np.ceil(nx / pixel))
    pixels = tuple((data.columns / pixel).astype(int).T)  # pixel of each column of data
    sums = np.zeros((*shape, data.shares.shape[1]))
    np.add.at(sums, pixels, data.shares)
    mean = data.shares.mean(axis=0)
    errors = np.square((data.shares - mean) * n / (n - 1)).sum(axis=1)  # each column left out
    best, best_map = float(errors.mean()), None
    for fraction in TREND_WIDTHS:
        width = fraction * N_PIXELS
        if width * pixel < min_width:
            break
        options = {"sigma": (width, width, 0), "mode": "constant"}
        impulse = np.zeros((2 * N_PIXELS + 1,) * 2 + (1,))
        impulse[N_PIXELS, N_PIXELS] = 1
        peak = float(gaussian_filter(impulse, **options).max())  # weight of a datum in its pixel
        smooth = gaussian_filter(sums, **options)
        weight = smooth.sum(axis=2, keepdims=True)
        others, their_weight = smooth[pixels] - peak * data.shares, weight[pixels] - peak
        predicted = (others + peak * mean) / (their_weight + peak)  # the mean counts as one column
        error = np.square(data.shares - predicted).sum(axis=1)
        gain = errors - error
        if error.mean() < best and gain.mean() > SIGNIFICANT * gain.std() / np.sqrt(n):
            best, best_map = float(error.mean()), (smooth + peak * mean) / (weight + peak)
    if best_map is None:
        return None
    between = float(best_map.var(axis=(0, 1)).sum()) if is_representative(data) else 0.0
    return Trend(best_map, pixel, best / float(errors.mean()), between)


def is_representative(data: DataProportions) -> bool:
    """Return whether there are many columns of data whose locations do not depend on the facies.

    If wells were preferentially drilled into one facies, its data are closer together, and their
    mean weighted by distances differs from their plain mean.
    """
    unequal = data.weights - 1 / len(data.weights)
    error = np.square(unequal).sum() * data.shares.var(axis=0).sum()
    off = np.square(unequal @ data.shares).sum()
    return len(unequal) >= MANY_COLUMNS and bool(off <= PREFERENTIAL * error)


def trend_of_map(probabilities: Floats, proportions: Floats) -> Trend:
    """Return the trend of given probabilities, shape (n_facies, (nz,) ny, nx).

    Cells without probabilities have `proportions`, shape (n_facies,) or (*shape, n_facies).
    """
    soft = np.moveaxis(probabilities, 0, -1)
    filled = np.where(np.isnan(soft), proportions, soft)
    plane = filled.mean(axis=0) if filled.ndim == 4 else filled
    pixel = max(1, -(-max(plane.shape[:2]) // N_PIXELS_GIVEN))
    for axis, n in enumerate(plane.shape[:2]):
        first = np.arange(0, n, pixel)
        counts = np.diff(np.append(first, n)).reshape([-1 if a == axis else 1 for a in range(3)])
        plane = np.add.reduceat(plane, first, axis) / counts
    return Trend(plane, float(pixel), 0.0, 0.0)


def rake(proportions: Floats, target: Floats) -> Floats:
    """Return a map of proportions, shape (…, n_facies), whose mean is about `target`."""
    axes = tuple(range(proportions.ndim - 1))
    for _ in range(N_RAKINGS):
        proportions = proportions * (target / np.maximum(proportions.mean(axis=axes), 1e-9))
        proportions /= np.maximum(proportions.sum(axis=-1, keepdims=True), 1e-9)
    return proportions


def expected_before(
    proportions: Floats,
    pixel: float,
    patches: Ints,
    overlap: Triple,
    cell_size: Triple,
    path: RasterPath,
) -> Floats:
    """Return the mean proportions of all tiles before each patch, shape (n_patches, n_facies).

    `proportions`, shape (n_rows, n_columns, n_facies), are in path coordinates. `patches` come from
    `make_patches`; their cells have `cell_size` grid cells along each axis.
    """
    ny, nx, n_facies = proportions.shape
    table = np.zeros((ny + 1, nx + 1, n_facies))
    table[1:, 1:] = proportions.cumsum(axis=0).cumsum(axis=1)
    new = patches[:, 3:6] - overlap * (patches[:, :3] > 0)  # lengths without the overlap
    last = patches[:, :3] + patches[:, 3:6]
    scale, start = np.array(cell_size) / pixel, np.array(path.offset) / pixel
    low = np.floor((last - new) * scale - start).astype(int)[:, 1:]
    high = np.ceil(last * scale - start).astype(int)[:, 1:]
    (y0, x0), (y1, x1) = np.clip(low, 0, (ny - 1, nx - 1)).T, np.clip(high, 1, (ny, nx)).T
    y1, x1 = np.maximum(y1, y0 + 1), np.maximum(x1, x0 + 1)
    mean = table[y1, x1] - table[y0, x1] - table[y1, x0] + table[y0, x0]
    mean /= ((y1 - y0) * (x1 - x0))[:, None]
    n_cells = new.prod(axis=1)[:, None]
    sums, totals = np.cumsum(mean * n_cells, axis=0), np.cumsum(n_cells, axis=0)
    whole = proportions.mean(axis=(0, 1), keepdims=True)[0]
    return np.concatenate([whole, sums[:-1] / np.maximum(totals[:-1], 1)])
