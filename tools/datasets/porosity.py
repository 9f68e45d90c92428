"""Porosity of anastomosing channels: high in the middle of a channel, fading into the mud."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from scipy.ndimage import distance_transform_edt, gaussian_filter

from tools.datasets.channels import HALF_WIDTH, channels
from tools.datasets.fields import Floats

MUD, BANK, MIDDLE = 0.06, 0.22, 0.30
"""Mean porosity of the mud far from channels, at the banks, and in the middle of a channel."""
REACH = 6.0  # distance from a bank in cells at which the porosity has fallen to 37 %
PATCHES, GRAINS = 0.025, 0.003
"""Standard deviations of the porosity between patches, and between cells of a patch."""
PATCH_RADIUS = 4.0


def porous_channels(shape: tuple[int, int], rng: RandomState) -> Floats:
    """Draw the porosity of sand channels that run from west to east, in silt and mud."""
    sand = channels(shape, rng) == 1
    inside, outside = (np.asarray(distance_transform_edt(part)) for part in (sand, ~sand))
    depth, from_bank = np.minimum(inside / HALF_WIDTH, 1.0), np.exp(-outside / REACH)
    mean = np.where(sand, BANK + (MIDDLE - BANK) * depth, MUD + (BANK - MUD) * from_bank)
    patches = gaussian_filter(rng.normal(size=shape), PATCH_RADIUS)
    noise = patches * (PATCHES / patches.std()) + GRAINS * rng.normal(size=shape)
    return np.round(np.clip(mean + noise, 0.01, 0.4), 4)
