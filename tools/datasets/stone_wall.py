"""A dry-stone wall: rounded stones of many sizes in connected mortar."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import KDTree

from tools.datasets.fields import Floats, gaussian_field, without_specks

THINNEST = 2.6
"""Minimum thickness of a joint in cells; thinner joints would have gaps."""


def stone_wall(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw stones (0) in mortar (1)."""
    centres, radii = _packed_stones(shape, rng)
    gap = _gap_between(centres, radii, shape, rng)
    joint = 4.2 + 0.8 * gaussian_field(shape, 18, rng) + 0.9 * gaussian_field(shape, 3.5, rng)
    stones = _rounded(gap > np.maximum(joint, THINNEST), 2.6)
    return without_specks((~stones).astype(np.uint8), 24)


def _packed_stones(shape: tuple[int, int], rng: RandomState) -> tuple[Floats, Floats]:
    """Place stones at random without overlap, the largest first; small stones fill the holes."""
    area = (shape[0] + 40) * (shape[1] + 40)
    sizes = np.concatenate([rng.uniform(11, 20, area // 220), rng.uniform(5.5, 9, area // 170)])
    sizes = np.sort(sizes)[::-1]
    centres, radii = np.empty((len(sizes), 2)), np.empty(len(sizes))
    n = 0
    for radius in sizes:
        spot = rng.uniform(-20, 20 + np.array(shape), size=2)
        clear = np.hypot(*(centres[:n] - spot).T) > 0.98 * (radii[:n] + radius)
        if clear.all():
            centres[n], radii[n] = spot, radius
            n += 1
    return centres[:n], radii[:n]


def _gap_between(
    centres: Floats, radii: Floats, shape: tuple[int, int], rng: RandomState
) -> Floats:
    """Return for each cell the distance to the second-nearest stone minus the nearest distance.

    Distances are measured from the rim of a stone; each stone is stretched in a random direction.
    """
    warp = np.array([2.0 * gaussian_field(shape, 9, rng) for _ in range(2)])
    cells = np.moveaxis(np.mgrid[: shape[0], : shape[1]] + warp, 0, -1)
    _, near = KDTree(centres).query(cells, k=min(14, len(centres)))
    offset = cells[..., None, :] - centres[near]
    angle, stretch = rng.uniform(0, np.pi, len(radii)), rng.uniform(0.8, 1.0, len(radii))
    cos, sin = np.cos(angle)[near], np.sin(angle)[near]
    along = offset[..., 1] * cos + offset[..., 0] * sin
    across = offset[..., 0] * cos - offset[..., 1] * sin
    reach = np.hypot(along * stretch[near], across / stretch[near]) - radii[near]
    first, second = np.partition(reach, 1, axis=-1)[..., :2].transpose(2, 0, 1)
    return second - first


def _rounded(stones: NDArray[np.bool_], radius: float) -> NDArray[np.bool_]:
    """Return the stones with corners rounded by a disc of this radius (morphological opening)."""
    padded = np.pad(stones, 8, mode="edge")
    core = np.asarray(ndimage.distance_transform_edt(padded)) > radius
    grown = np.asarray(ndimage.distance_transform_edt(~core)) <= radius
    return grown[8:-8, 8:-8]
