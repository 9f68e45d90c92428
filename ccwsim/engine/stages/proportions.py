"""Prefer patches that bring the facies proportions to those of the TI (option of section 4)."""

from __future__ import annotations

import numpy as np

from ccwsim.engine.kernels import kernel
from ccwsim.engine.stages.candidates import draw_index

N_COMPARED = 3
"""Candidates drawn to choose from: more match the proportions faster and vary less."""


@kernel
def count_facies(patch, counts):
    """Add the cells of a patch, shape (h, w) in facies indices, to `counts`, shape (n_facies,)."""
    for y in range(patch.shape[0]):
        for x in range(patch.shape[1]):
            counts[patch[y, x]] += 1


@kernel
def closest_to_target(image, places, unit, template, counts, proportions, rng):
    """Draw a few candidates and return the index of the one that corrects the proportions best.

    Parameters
    ----------
    image : ndarray of uint8, shape (ny, nx)
        Training image in the path frame.
    places : ndarray of int64, shape (k, 2)
        The candidates, in units of `unit` cells.
    template : int
        Side of the patches in cells.
    counts : ndarray of int64, shape (n_facies,)
        Cells simulated so far.
    proportions : ndarray, shape (n_facies,)
        The target.
    """
    chosen = 0
    smallest = np.inf
    for _ in range(N_COMPARED):
        at = draw_index(rng, len(places))
        after = counts.copy()
        ty, tx = places[at, 0] * unit, places[at, 1] * unit
        count_facies(image[ty : ty + template, tx : tx + template], after)
        n, off = 0, 0.0
        for k in range(len(after)):  # array expressions would take long to compile
            n += after[k]
        for k in range(len(after)):
            off += abs(after[k] - proportions[k] * n)
        if off < smallest:
            chosen, smallest = at, off
    return chosen
