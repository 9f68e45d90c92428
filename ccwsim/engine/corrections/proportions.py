"""Steer the choice among candidates towards target proportions of facies (not in the paper).

Each realization has target proportions; patches that bring the realization closer to the target are
more likely. Targets vary as much as proportions vary between pieces of the training image that are
as large as the grid. Hard data reduce this variation.
"""

from math import prod
from typing import NamedTuple

import numpy as np

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.candidates import draw_index, location_of_number
from ccwsim.engine.stages.path import Triple
from ccwsim.engine.stages.similarity import box_sums, summed_up
from ccwsim.model import Bytes, Floats, Integers, Ints, Shape

N_COMPARED_CANDIDATES = 3
"""Number of candidates compared by proportions. With more candidates, proportions match sooner, but
patches vary less."""
GAIN = 800.0
"""Strength of the steering: if a facies exceeds its target by a share s of the grid, a patch with
only that facies is less likely by a factor of e^(−GAIN s)."""
N_PIECES_ALONG = 4
"""Length of the image divided by the length of the pieces from which the spread of proportions is
estimated."""
MAX_PLACES = 4000
"""Approximate number of grid cells for which the nearest column of data is searched."""
N_TARGETS = 50  # number of random targets from which the variance of targets is estimated
# the image counts as this number of columns when the variance of columns is estimated
N_ASSUMED_COLUMNS = 5
CONTRADICTED = 4
"""Squared difference between the proportions of data and image, in squared standard errors, above
which data contradict the image."""
MAX_LOCATIONS = 50_000
"""Approximate maximum number of locations from which margin weights are estimated."""
MAX_SHARES = 1_000_000
"""Maximum number of proportions, one for each location and facies, from which these weights are
estimated; with more than 20 facies it limits the number of locations."""
MAX_PRODUCTS = 1_000_000_000
"""Approximate maximum number of products in all steps of Newton's method; with more than 20 facies
it limits the number of steps."""
MAX_NEWTON_STEPS = 50  # maximum number of steps of Newton's method; a few suffice
ACCURATE = 1e-7
MAX_RARE_PROPORTION = 0.2  # maximum proportion of a rare facies
USUAL_VARIANCE = 0.05
"""Variance of the proportion of a facies between patches for which GAIN is made. Rare facies vary
less, so their gain is larger."""
MAX_FACTOR = 100.0  # maximum factor of the gain of a rare facies


class Steering(NamedTuple):
    """Target proportions of a realization."""

    # shape (1 or n_patches, n_facies): targets for the cells that are simulated before a patch
    targets: Floats
    margin: Floats  # shape (1 or n_patches, n_facies): made by `margin_weights`
    gain: Floats  # shape (n_facies,): change of λ per excess cell, see `draw_towards`
    is_on: bool


def patch_shares(sums: Integers, size: Triple, n_cells: int, illegal: Bytes) -> Floats:
    """Return the proportions in patches at many locations, shape (n_locations, n_planes).

    Patches have `size` blocks, or `n_cells` cells. `sums` are block sums, one plane for two facies.
    Locations that are marked in `illegal`, unless it is empty, are left out.
    """
    planes, most = [], min(MAX_LOCATIONS, MAX_SHARES // len(sums))
    for plane in sums:
        counts = box_sums(summed_up(plane.astype(np.int64)), size).ravel()
        counts = counts[illegal.ravel() == 0] if illegal.size and not illegal.all() else counts
        planes.append(counts[:: -(-len(counts) // most)])
    return np.stack(planes, axis=1) / n_cells


def margin_weights(shares: Floats, proportions: Floats) -> Floats:
    """Return λ, shape (n_facies,), for which random patches have the proportions of the image.

    `shares` come from `patch_shares`. The probability of a patch is proportional to exp(−λ·f), with
    the proportions f of the patch; λ is computed by Newton's method. With λ = 0 the margins of the
    image would be under-represented, because few patches cover the margins.
    """
    target = proportions[-shares.shape[1] :]
    weights = np.zeros(len(target))
    for _ in range(min(MAX_NEWTON_STEPS, MAX_PRODUCTS // (shares.size * len(target)))):
        exponents = -shares @ weights
        chance = np.exp(exponents - exponents.max())
        chance /= chance.sum()
        mean = chance @ shares
        off = mean - target
        if np.abs(off).max() < ACCURATE:
            break
        spread = (shares * chance[:, None]).T @ shares - np.outer(mean, mean)
        step = np.linalg.lstsq(spread, off, rcond=1e-9)[0]
        weights += step / max(1.0, float(np.abs(step).max()))  # steps of at most 1
    return np.pad(weights, (len(proportions) - len(weights), 0))


def gain_factors(shares: Floats, proportions: Floats) -> Floats:
    """Return the factor of the gain for each facies, shape (n_facies,); 1 if a facies is not rare.

    `shares` come from `patch_shares`. In patches that seldom contain a facies, the gain
    would have little effect, so rare facies would be lost.
    """
    variances = np.broadcast_to(np.var(shares, axis=0), len(proportions))
    factors = np.clip(USUAL_VARIANCE / np.maximum(variances, 1e-9), 1.0, MAX_FACTOR)
    return np.where(proportions < MAX_RARE_PROPORTION, factors, 1.0)


def draw_target(
    image: Bytes, proportions: Floats, grid_shape: Shape, rng: np.random.Generator
) -> Floats:
    """Return random target proportions, shape (n_facies,); they vary as in pieces of the image.

    The target is derived from a random piece of the training image, a quarter as long and wide. The
    difference between the proportions of the piece and of the image is scaled to the difference
    expected for a piece as large as the grid. The piece has as many layers as the grid (at most all
    layers of the image), because proportions differ most between layers.
    """
    parts = [-(-m // N_PIECES_ALONG) for m in image.shape]
    parts[:-2] = image.shape[:-2]
    sides = [min(m, n) for m, n in zip(parts, grid_shape, strict=True)]
    indices = []
    for m, n in zip(image.shape, sides, strict=True):  # mirrored, so that all cells count equally
        along = (rng.integers(2 * m if n < m else 1) + np.arange(n)) % (2 * m)
        indices.append(np.minimum(along, 2 * m - 1 - along))
    piece = image[np.ix_(*indices)]
    counts = np.bincount(piece.ravel(), minlength=len(proportions))[: len(proportions)]
    n = int(counts.sum())  # known cells
    shares = counts / n if n else proportions
    return proportions + (shares - proportions) * np.sqrt(n / prod(grid_shape))


class DataProportions(NamedTuple):
    """Proportions of hard data in each column of cells with data."""

    columns: Ints  # shape (n, 2): row and column
    shares: Floats  # shape (n, n_facies)
    weights: Floats  # shape (n,): share of the grid that is nearest to each column
    natural: float  # variance of the targets of `draw_target`, summed over the facies


def proportions_of_data(
    cells: Ints, facies: Bytes, image: Bytes, proportions: Floats, grid_shape: Triple
) -> DataProportions:
    """Return the proportions of data at `cells`, shape (n, 3), with `facies`, shape (n,).

    A column is a vertical well in a volume or a single datum in a map. Columns that are close
    together have smaller weights.
    """
    _, ny, nx = grid_shape
    columns, of_datum = np.unique(cells[:, 1] * nx + cells[:, 2], return_inverse=True)
    counts = np.zeros((len(columns), len(proportions)))
    np.add.at(counts, (of_datum, facies), 1)
    step = max(int(np.sqrt(ny * nx / MAX_PLACES)), 1)
    rows, across = np.mgrid[step // 2 : ny : step, step // 2 : nx : step]
    places = np.column_stack([rows.ravel(), across.ravel()])
    from scipy.spatial import KDTree  # SciPy takes 0.25 s to import; only data need it

    positions = np.column_stack(np.divmod(columns, nx))
    _, nearest = KDTree(positions).query(places)
    weights = np.bincount(nearest, minlength=len(columns)) / len(places)
    rng = np.random.default_rng(0)
    drawn = [draw_target(image, proportions, grid_shape, rng) for _ in range(N_TARGETS)]
    shares = counts / counts.sum(axis=1, keepdims=True)
    return DataProportions(positions, shares, weights, float(np.var(drawn, axis=0).sum()))


def draw_between(
    target: Floats,
    proportions: Floats,
    data: DataProportions,
    rng: np.random.Generator,
    residual: float = 1.0,
    between: float = 0.0,
) -> Floats | None:
    """Return a weighted mean of the random `target` and the proportions of hard data.

    The weights depend on the variance between pieces of the image and the variance between columns
    of data. Columns are resampled with replacement, so that the target reflects the uncertainty of
    data; `residual` is the share of their variance that a trend does not explain. Return None if
    data contradict the image, for example because wells were preferentially drilled into one
    facies, and the variance `between` locations along a trend does not explain the difference.
    """
    n = len(data.weights)
    mean = data.weights @ data.shares
    single = 1 - proportions @ proportions  # variance of one cell
    spread = N_ASSUMED_COLUMNS * single + np.square(data.shares - mean).sum()
    error = np.square(data.weights).sum() * spread * residual / (N_ASSUMED_COLUMNS + n - 1)
    off = np.square(mean - proportions).sum() / CONTRADICTED
    natural = data.natural + (between if off > data.natural + error else 0.0)
    if off > natural + error:
        return None
    columns = rng.integers(n, size=n)
    resampled = data.weights[columns] @ data.shares[columns] / data.weights[columns].sum()
    resampled = mean + np.sqrt(residual) * (resampled - mean)
    certain = natural / (natural + error)
    return (1 - certain) * target + certain * resampled


@part_of_kernel
def draw_towards(
    running, candidates, number, box, block, n_places, steering, counts, tilt, chances, rng
):
    """Return the index of a random candidate, with a probability proportional to exp(−λ·f).

    λ increases with the excess of a facies over its target; f are the proportions of the candidate.
    `candidates`, shape (n,), are numbers of locations of patch `number`. `n_places` has the numbers
    of rows and columns of locations. `running` comes from `running_sums`. `counts`, shape
    (n_facies,), has the number of simulated cells of each facies. `tilt`, shape (n_facies,), and
    `chances`, shape (n,), are workspace.
    """
    n_planes, n = running.shape[1], 0
    target = steering.targets[min(number, len(steering.targets) - 1)]
    margin = steering.margin[min(number, len(steering.margin) - 1)]
    for k in range(len(counts)):
        n += counts[k]
    for k in range(len(counts)):
        excess = counts[k] - target[k] * n
        tilt[k] = margin[k] + steering.gain[k] * excess
    if n_planes == 1:  # for two facies, block sums count only facies 1
        tilt[0] = tilt[1] - tilt[0] if len(counts) > 1 else 0.0
    patch_cells, least, flat = box.nz * box.ny * box.nx, np.inf, running.reshape(-1)
    mz, my, mx = running.shape[2:]
    along_x = n_planes * mz * my * mx
    rows, columns = box.ny // block[1], box.nx // block[2]
    for i in range(len(candidates)):
        tz, ty, tx = location_of_number(candidates[i], n_places, block)
        exponent = 0.0
        for plane in range(n_planes):
            n_cells = np.int64(0)
            for z in range(tz // block[0], (tz + box.nz) // block[0]):
                row = ((plane * mz + z) * my + ty // block[1]) * mx + tx // block[2] + along_x
                for _ in range(rows):
                    low, high = flat[np.uint64(row)], flat[np.uint64(row + columns)]
                    n_cells += np.int64(flat.dtype.type(high - low))  # running sums may overflow
                    row += mx
            exponent += tilt[plane] * n_cells / patch_cells
        chances[i] = exponent
        least = min(least, exponent)
    total = 0.0
    for i in range(len(candidates)):
        chances[i] = np.exp(least - chances[i])
        total += chances[i]
    threshold = rng.random() * total
    for i in range(len(candidates)):
        threshold -= chances[i]
        if threshold < 0:
            return i
    return len(candidates) - 1


@part_of_kernel
def closest_to_target(image, candidates, box, block, n_places, proportions, counts, after, rng):
    """Choose random candidates; return the index of the candidate closest to the target.

    `image` has the shape (mz, my, mx); `after`, with the shape (n_facies,), is workspace; the other
    arguments are documented in `draw_towards`.
    """
    chosen = np.int64(0)
    smallest = np.inf
    for _ in range(N_COMPARED_CANDIDATES):
        drawn = draw_index(rng, len(candidates))
        tz, ty, tx = location_of_number(candidates[drawn], n_places, block)
        for k in range(len(counts)):
            after[k] = counts[k]
        for z in range(tz, tz + box.nz):
            for y in range(ty, ty + box.ny):
                for x in range(tx, tx + box.nx):
                    after[image[z, y, x]] += 1
        n, off = 0, 0.0
        for k in range(len(after)):  # a loop, because array expressions take long to compile
            n += after[k]
        for k in range(len(after)):
            off += abs(after[k] - proportions[k] * n)
        if off < smallest:
            chosen, smallest = drawn, off
    return chosen
