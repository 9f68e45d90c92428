"""Channels that sweep round a bend: their direction, width and spacing change everywhere."""

from __future__ import annotations

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from ccwsim.datasets.channels import channel_network
from ccwsim.datasets.curves import Curve, painted
from ccwsim.datasets.fields import without_specks

FINEST, COARSEST = 0.55, 1.75
"""How the network is scaled on the inside and on the outside of the bend."""


def bend(shape: tuple[int, int], rng: RandomState) -> NDArray[np.uint8]:
    """Draw sand channels (1) in mud (0) that come in from the north and leave to the east.

    An even network is laid out about a pivot north-east of the image by the complex exponential,
    which keeps angles: bends stay natural, thin and close together inside, wide and far outside.
    """
    size = float(max(shape))
    inner = 0.75 * size
    per_cell = FINEST / inner
    across = int(np.log(COARSEST / FINEST) / per_cell)
    around = int(0.55 * np.pi / per_cell)
    pivot_x, pivot_y = shape[1] + 0.55 * inner, shape[0] + 0.55 * inner
    curves = []
    for flat in channel_network((across, around), rng):
        radius = inner * np.exp(per_cell * flat.y)
        angle = 0.975 * np.pi + per_cell * flat.x
        x, y = pivot_x + radius * np.cos(angle), pivot_y + radius * np.sin(angle)
        curves.append(Curve(x, y, flat.half_width * per_cell * radius))
    return without_specks(painted(curves, shape).astype(np.uint8), 40)
