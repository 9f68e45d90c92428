"""Where a patch or a window is placed, as one value."""

from __future__ import annotations

from typing import NamedTuple

from ccwsim.engine.kernels import part_of_kernel

LEFT, TOP, BELOW, RIGHT, BOTTOM, ABOVE = 1, 2, 4, 8, 16, 32
"""Bits of the sides along which a box overlaps what is simulated already."""
L_SHAPE = LEFT | TOP
"""The third shape of the overlap of a patch, beside the strips LEFT and TOP (section 4.1)."""


class Box(NamedTuple):
    """A block of cells in the simulation grid, with its overlap; in a map it has one layer."""

    # first layer, row and column
    z0: int
    y0: int
    x0: int
    # layers, rows and columns
    nz: int
    ny: int
    nx: int
    sides: int  # sides with an overlap: a sum of LEFT, TOP, BELOW, RIGHT, BOTTOM and ABOVE
    # widths of the overlap along each axis, in cells
    oz: int
    oy: int
    ox: int


@part_of_kernel
def inside_overlap(box):
    """Return the first and the end of the layers, rows and columns that no overlap reaches."""
    return (
        box.oz if box.sides & BELOW else 0,
        box.nz - box.oz if box.sides & ABOVE else box.nz,
        box.oy if box.sides & TOP else 0,
        box.ny - box.oy if box.sides & BOTTOM else box.ny,
        box.ox if box.sides & LEFT else 0,
        box.nx - box.ox if box.sides & RIGHT else box.nx,
    )
