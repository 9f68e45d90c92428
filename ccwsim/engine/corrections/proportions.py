"""Facies proportions: the draw among the candidates steered to a target.

Not in the paper. A patch is drawn more often the more it brings the realization towards its own
target. That is not simply what the training image has: the proportions of its pieces as large as
the grid differ from its own, and so do the targets of realizations. Hard data say more of them.
"""

from __future__ import annotations

from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.engine.kernels import part_of_kernel
from ccwsim.engine.stages.candidates import draw_index, place_of
from ccwsim.engine.stages.path import Triple
from ccwsim.engine.stages.similarity import box_sums, summed_up

N_COMPARED = 3
"""Candidates drawn to choose from by proportions: more match them faster and vary less."""
GAIN = 800.0
"""How much less likely a patch is for an excess of a facies: by e^−GAIN for an excess of the whole
grid, in a patch of that facies alone."""
PART = 4
"""Pieces of the training image, from which the spread of proportions is taken, are so many times
shorter than it."""
MAX_PLACES = 4000
"""About so many places of the grid say to which of the data they are the nearest."""
N_TARGETS = 50
"""Targets that say how much those of an image vary."""
FEW = 5
"""So many columns of data say as much of how columns vary as the image does."""
CONTRADICTED = 4
"""Squared standard errors by which data differ that contradict the image."""
MAX_LOCATIONS = 50_000
"""Locations that say how often margins are covered."""
MAX_STEPS = 50
"""Of Newton's method; a few suffice."""
ACCURATE = 1e-7


class Steering(NamedTuple):
    """What the proportions of a realization are steered by; a gain of 0 steers nothing."""

    target: NDArray[np.float64]  # shape (n_facies,): proportions
    # shape (n_facies,): what undoes that the margins of the training image are covered less often
    margin: NDArray[np.float64]
    gain: float  # by cell of excess


def margin_weights(
    sums: NDArray[np.integer[Any]], size: Triple, cells: int, proportions: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return λ, shape (n_facies,), with which patches at all locations have the proportions.

    Patches of `size` blocks and `cells` cells, each drawn with a chance of exp(−λ·f), where f are
    its proportions, by Newton's method: few patches lie over each cell at the margin of a training
    image, so that their mean is not that of the image. `sums` are block sums, one plane for two
    facies.
    """
    shares = _shares(sums, size) / cells
    wanted = proportions[-shares.shape[1] :]
    weights = np.zeros(len(wanted))
    for _ in range(MAX_STEPS):
        exponents = -shares @ weights
        chance = np.exp(exponents - exponents.max())
        chance /= chance.sum()
        mean = chance @ shares
        off = mean - wanted
        if np.abs(off).max() < ACCURATE:
            break
        spread = (shares * chance[:, None]).T @ shares - np.outer(mean, mean)
        step = np.linalg.lstsq(spread, off, rcond=1e-9)[0]
        weights += step / max(1.0, float(np.abs(step).max()))  # no further than 1 at once
    found = np.zeros(len(proportions))
    found[-len(weights) :] = weights
    return found


def _shares(sums: NDArray[np.integer[Any]], size: Triple) -> NDArray[np.float64]:
    """Return the proportions in patches of `size` blocks, shape (n_locations, n_planes)."""
    found = []
    for plane in sums:
        counts = box_sums(summed_up(plane.astype(np.int64)), size, (0, 0, 0), size).ravel()
        found.append(counts[:: -(-len(counts) // MAX_LOCATIONS)])
    return np.stack(found, axis=1)


def draw_target(
    image: NDArray[np.uint8],
    proportions: NDArray[np.float64],
    grid_shape: tuple[int, ...],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return the proportions of a realization, shape (n_facies,), as pieces of the image vary.

    Those of a random piece of the training image, a quarter as long and as wide as it; as far from
    those of the whole as a piece with the cells of the grid would be. It has as many layers as the
    grid, where the image has them: layers differ more than places in them do, and what a part of
    them lacks the others have.
    """
    parts = [-(-m // PART) for m in image.shape]
    parts[:-2] = image.shape[:-2]
    sides = [min(m, n) for m, n in zip(parts, grid_shape, strict=True)]
    first = [int(rng.integers(m - n + 1)) for m, n in zip(image.shape, sides, strict=True)]
    piece = image[tuple(slice(k, k + n) for k, n in zip(first, sides, strict=True))]
    own = np.bincount(piece.ravel(), minlength=len(proportions)) / piece.size
    return proportions + (own - proportions) * np.sqrt(piece.size / prod(grid_shape))


class DataProportions(NamedTuple):
    """What hard data say of the proportions: those of each column of cells that has data."""

    shares: NDArray[np.float64]  # shape (n, n_facies)
    weights: NDArray[np.float64]  # shape (n,): share of the grid to which each is the nearest
    natural: float  # variance of what `draw_target` draws, summed over the facies


def proportions_of_data(
    cells: NDArray[np.int64],
    facies: NDArray[np.uint8],
    image: NDArray[np.uint8],
    proportions: NDArray[np.float64],
    grid_shape: Triple,
) -> DataProportions:
    """Return what data say; `cells`, shape (n, 3), and `facies` (indices) have n rows.

    A vertical well is one column, as a datum of a map is. Where many are close each counts less.
    """
    _, ny, nx = grid_shape
    columns, of_datum = np.unique(cells[:, 1] * nx + cells[:, 2], return_inverse=True)
    counts = np.zeros((len(columns), len(proportions)))
    np.add.at(counts, (of_datum, facies), 1)
    step = max(int(np.sqrt(ny * nx / MAX_PLACES)), 1)
    rows, across = np.mgrid[step // 2 : ny : step, step // 2 : nx : step]
    places = np.column_stack([rows.ravel(), across.ravel()])
    from scipy.spatial import KDTree  # takes a quarter of a second, and only data need it

    _, nearest = KDTree(np.column_stack(np.divmod(columns, nx))).query(places)
    weights = np.bincount(nearest, minlength=len(columns)) / len(places)
    rng = np.random.default_rng(0)
    drawn = [draw_target(image, proportions, grid_shape, rng) for _ in range(N_TARGETS)]
    shares = counts / counts.sum(axis=1, keepdims=True)
    return DataProportions(shares, weights, float(np.var(drawn, axis=0).sum()))


def draw_between(
    target: NDArray[np.float64],
    proportions: NDArray[np.float64],
    data: DataProportions,
    rng: np.random.Generator,
) -> NDArray[np.float64] | None:
    """Return a target between one that was drawn for the image and what hard data say.

    Each counts as much as it is certain: the image by how much its pieces vary, data by how much
    their columns do. Those are drawn anew, with repeats, so that the target varies as far as data
    leave it open. None where data contradict the image: they may come from other geology, or from
    wells that were drilled where a facies was hoped for.
    """
    n = len(data.weights)
    own = data.weights @ data.shares
    single = 1 - proportions @ proportions  # the variance of one cell, as if it were seen in FEW
    spread = FEW * single + np.square(data.shares - own).sum()
    error = np.square(data.weights).sum() * spread / (FEW + n - 1)
    if np.square(own - proportions).sum() > CONTRADICTED * (data.natural + error):
        return None
    again = rng.integers(n, size=n)
    seen = data.weights[again] @ data.shares[again] / data.weights[again].sum()
    certain = data.natural / (data.natural + error)
    return (1 - certain) * target + certain * seen


@part_of_kernel
def draw_towards(running, candidates, box, block, n_places, steering, counts, tilt, chances, rng):
    """Draw a candidate, with a chance of exp(−λ·f), and return its index.

    λ grows with the excess of a facies over its target; f are the proportions of the candidate. The
    candidates are numbers of locations, of which the image has `n_places` rows and columns, in
    blocks. `running` comes from `running_sums`; `counts` has the cells that are simulated by
    facies, `tilt` and `chances` are workspace by facies and candidate.
    """
    n_planes, n = running.shape[1], 0
    for k in range(len(counts)):
        n += counts[k]
    for k in range(len(counts)):
        excess = counts[k] - steering.target[k] * n
        tilt[k] = steering.margin[k] + steering.gain * excess
    if n_planes == 1:  # facies 1 alone is counted
        tilt[0] = tilt[1] - tilt[0] if len(counts) > 1 else 0.0
    cells, least, flat = box.nz * box.ny * box.nx, np.inf, running.reshape(-1)
    mz, my, mx = running.shape[2:]
    along_x = n_planes * mz * my * mx
    rows, columns = box.ny // block[1], box.nx // block[2]
    for i in range(len(candidates)):
        tz, ty, tx = place_of(candidates[i], n_places, block)
        exponent = 0.0
        for plane in range(n_planes):
            found = np.int64(0)
            for z in range(tz // block[0], (tz + box.nz) // block[0]):
                row = ((plane * mz + z) * my + ty // block[1]) * mx + tx // block[2] + along_x
                for _ in range(rows):
                    low, high = flat[np.uint64(row)], flat[np.uint64(row + columns)]
                    found += np.int64(flat.dtype.type(high - low))  # they wrap around
                    row += mx
            exponent += tilt[plane] * found / cells
        chances[i] = exponent
        least = min(least, exponent)
    total = 0.0
    for i in range(len(candidates)):
        chances[i] = np.exp(least - chances[i])
        total += chances[i]
    left = rng.random() * total
    for i in range(len(candidates)):
        left -= chances[i]
        if left < 0:
            return i
    return len(candidates) - 1


@part_of_kernel
def closest_to_target(image, candidates, box, block, n_places, proportions, counts, after, rng):
    """Draw a few candidates and return the index of the one that corrects the proportions best.

    The candidates are numbers of locations, of which the image has `n_places` rows and columns, in
    blocks; `counts` has the cells that are simulated by facies, and `after` is workspace of the
    same shape.
    """
    chosen = np.int64(0)
    smallest = np.inf
    for _ in range(N_COMPARED):
        at = draw_index(rng, len(candidates))
        tz, ty, tx = place_of(candidates[at], n_places, block)
        for k in range(len(counts)):
            after[k] = counts[k]
        for z in range(tz, tz + box.nz):
            for y in range(ty, ty + box.ny):
                for x in range(tx, tx + box.nx):
                    after[image[z, y, x]] += 1
        n, off = 0, 0.0
        for k in range(len(after)):  # array expressions would take long to compile
            n += after[k]
        for k in range(len(after)):
            off += abs(after[k] - proportions[k] * n)
        if off < smallest:
            chosen, smallest = at, off
    return chosen
