"""Facies proportions of images, and the E-type: the probability of each facies by cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.metrics.stack import as_indices
from ccwsim.model.arrays import as_array, as_floats
from ccwsim.model.errors import CCWSIMError
from ccwsim.system.workers import check_stop

CELLS_OF_ENTROPY = 1_000_000
"""Cells whose entropy is computed at a time."""


def proportions(images: ArrayLike, n_facies: int) -> NDArray[np.float64]:
    """Return the share of the cells of each facies, shape (n, n_facies).

    Parameters
    ----------
    images : array_like, shape (ny, nx) or (n, ny, nx)
        Facies indices.
    n_facies : int

    Returns
    -------
    ndarray, shape (n, n_facies)
        Shares of the cells; each row sums to 1.

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

    Returns
    -------
    ndarray, shape (n_quantiles, n_facies)

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


@dataclass(frozen=True, eq=False)
class EType:
    """What an ensemble says about each cell.

    Attributes
    ----------
    probability : ndarray, shape (n_facies, ny, nx)
        Share of the realizations that have each facies.
    n : int
        How many realizations.
    """

    probability: NDArray[np.float64]
    n: int

    @cached_property
    def most_likely(self) -> NDArray[np.uint8]:
        """Index of the most probable facies, shape (ny, nx); of several the smallest."""
        return self.probability.argmax(axis=0).astype(np.uint8)

    @cached_property
    def entropy(self) -> NDArray[np.float64]:
        """−Σ p log p / log(n_facies), from 0 (certain) to 1 (all equally likely), (ny, nx)."""
        return entropy(self.probability)


def etype(images: ArrayLike, n_facies: int) -> EType:
    """Return probability, most likely facies and entropy of each cell.

    Parameters
    ----------
    images : array_like, shape (n, ny, nx)
        Facies indices of the realizations.
    n_facies : int

    Returns
    -------
    EType

    Examples
    --------
    >>> found = etype([[[0, 1]], [[1, 1]]], 2)
    >>> found.probability[1], found.most_likely, found.entropy
    (array([[0.5, 1. ]]), array([[0, 1]], dtype=uint8), array([[1., 0.]]))
    """
    stack = as_indices(images, n_facies)
    return etype_of_counts(facies_counts(stack, n_facies))


def facies_counts(images: ArrayLike, n_facies: int) -> NDArray[np.int32]:
    """Return how many realizations have each facies in each cell, shape (n_facies, ny, nx).

    Parameters
    ----------
    images : array_like, shape (n, ny, nx)
        Facies indices of the realizations.
    n_facies : int

    Returns
    -------
    ndarray of int32, shape (n_facies, ny, nx)

    Examples
    --------
    >>> facies_counts([[[0, 1]], [[1, 1]]], 2).tolist()
    [[[1, 0]], [[1, 2]]]
    """
    stack = as_indices(images, n_facies)
    counts = np.zeros((n_facies, *stack.shape[1:]), np.int32)
    for image in stack:
        check_stop()
        add_counts(image, counts)
    return counts


def etype_of_counts(counts: NDArray[np.integer]) -> EType:
    """Return the E-type of counts (n_facies, ny, nx), as `facies_counts` makes them.

    Parameters
    ----------
    counts : ndarray of int, shape (n_facies, ny, nx)
        Realizations by facies and cell, as `facies_counts` gives them.

    Returns
    -------
    EType

    Raises
    ------
    CCWSIMError
        Where nothing was counted yet.

    Examples
    --------
    >>> etype_of_counts(np.array([[[1]], [[3]]])).probability.ravel()
    array([0.25, 0.75])
    """
    counts = as_array(counts, "counts")
    if counts.ndim != 3 or not counts.size or counts.dtype.kind not in "ui":
        raise CCWSIMError(f"counts of shape (n_facies, ny, nx) are needed, not {counts.shape}")
    n = int(counts[:, 0, 0].sum())
    if not n:
        raise CCWSIMError("no realization was counted yet; an E-type needs at least one")
    return EType(counts / n, n)


def entropy(probability: ArrayLike) -> NDArray[np.float64]:
    """Return −Σ p log p / log(n_facies) over the first axis; 0 for a single facies.

    Parameters
    ----------
    probability : array_like, shape (n_facies, ...)

    Returns
    -------
    ndarray, shape (...)
        From 0 (certain) to 1 (all facies equally likely).

    Raises
    ------
    CCWSIMError
        For an array without facies.

    Examples
    --------
    >>> entropy([[0.5, 1.0], [0.5, 0.0]])
    array([1., 0.])
    """
    p = as_floats(probability, "probabilities")
    if not p.ndim or not len(p):
        raise CCWSIMError(f"probabilities of shape (n_facies, ...) are needed, not {p.shape}")
    if len(p) < 2:
        return np.zeros(p.shape[1:])
    flat, found = p.reshape(len(p), -1), np.empty(p[0].size)
    for first in range(0, len(found), CELLS_OF_ENTROPY):
        check_stop()
        some = flat[:, first : first + CELLS_OF_ENTROPY]
        terms = some * np.log(np.where(some > 0, some, 1.0))
        found[first : first + CELLS_OF_ENTROPY] = -terms.sum(axis=0) / np.log(len(p)) + 0.0
    return found.reshape(p.shape[1:])


@kernel
def add_counts(image, counts):
    """Add one realization (ny, nx) to counts (n_facies, ny, nx) in place."""
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            counts[image[i, j], i, j] += 1
