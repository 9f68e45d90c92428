"""Where a patch or a window is placed, as one value."""

from __future__ import annotations

from typing import NamedTuple

LEFT, TOP, RIGHT, BOTTOM = 1, 2, 4, 8
"""Bits of the sides along which a box overlaps what is simulated already."""
L_SHAPE = LEFT | TOP
"""The third shape of the overlap of a patch, beside the strips LEFT and TOP (section 4.1)."""


class Box(NamedTuple):
    """A square of cells in the simulation grid, with its overlap."""

    # first row and column, and side, in cells
    y0: int
    x0: int
    size: int
    sides: int  # sides with an overlap: a sum of LEFT, TOP, RIGHT and BOTTOM
    overlap: int  # width of the overlap, in cells
