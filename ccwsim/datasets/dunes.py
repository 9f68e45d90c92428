"""Long dunes whose crests fork, with a slip face along each."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from ccwsim.datasets.fields import gaussian_field, ridge_field, smoothed, without_specks


def dunes(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw interdune (0), dune sand (1) and slip faces (2)."""
    pad = 16
    wide = (shape[0] + pad, shape[1] + pad)
    relief = ridge_field(wide, 30, 20, 11, rng) + 0.12 * gaussian_field(wide, 4, rng)
    relief += 0.2 * gaussian_field(wide, 60, rng)
    crest = relief > np.quantile(relief, 0.66)
    lee = np.roll(crest, (-5, 2), axis=(0, 1)) & ~crest
    facies = np.where(crest, 1, np.where(lee, 2, 0))
    facies = smoothed(facies[:-pad, pad:], 1.2)
    return without_specks(facies, 50)
