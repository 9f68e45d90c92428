"""What a datum demands of a cut, and what a cell without one looks like."""

from __future__ import annotations

from ccwsim.engine.kernels import part_of_kernel

UNKNOWN = 255
"""A cell without datum in the grid of data, or not simulated yet in the simulation grid."""
KEEP_OLD, TAKE_NEW = 1, 2


@part_of_kernel
def wanted(old, new, datum):
    """Return which of two facies a cut must choose to honour the datum of a cell, or 0."""
    if datum == UNKNOWN or (old == datum) == (new == datum):
        return 0
    return KEEP_OLD if old == datum else TAKE_NEW
