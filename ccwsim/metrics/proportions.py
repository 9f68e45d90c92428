"""Facies proportions of images, and their spread over an ensemble."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.metrics.stack import as_indices
from ccwsim.model.arrays import as_floats
from ccwsim.model.errors import CCWSIMError


def proportions(images: ArrayLike, n_facies: int) -> NDArray[np.float64]:
    """Return the share of the cells of each facies, shape (n, n_facies).

    Parameters
    ----------
    images : array_like, shape (ny, nx) or (n, ny, nx)
        Facies indices.
    n_facies : int

    Examples
    --------
    >>> proportions([[0, 1, 1, 1]], 3)
    array([[0.25, 0.75, 0.  ]])
    """
    stack = as_indices(images, n_facies)
    counts = np.array([np.bincount(image.ravel(), minlength=n_facies) for image in stack])
    return counts / stack[0].size


def proportion_quantiles(
    images: ArrayLike, n_facies: int, probabilities: Sequence[float] = (0.1, 0.5, 0.9)
) -> NDArray[np.float64]:
    """Return quantiles over realizations of each facies' proportion, shape (n_quantiles, n_facies).

    Parameters
    ----------
    images, n_facies
        As in `proportions`.
    probabilities : sequence of float
        From 0 to 1.

    Raises
    ------
    CCWSIMError
        For a probability outside 0 … 1.

    Examples
    --------
    >>> proportion_quantiles([[[0, 1]], [[1, 1]]], 2, [0.5])
    array([[0.25, 0.75]])
    """
    chosen = as_floats(probabilities, "probabilities").reshape(-1)
    wrong = chosen[~((chosen >= 0) & (chosen <= 1))]
    if len(wrong):
        raise CCWSIMError(f"quantile {wrong[0]:g} must be a probability from 0 to 1")
    return np.quantile(proportions(images, n_facies), chosen, axis=0)
