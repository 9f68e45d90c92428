"""Facies proportions of images, and the E-type: the probability of each facies by cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.metrics.stack import Codes, Images, as_stack, codes_or_places
from ccwsim.model.arrays import as_array, as_floats
from ccwsim.model.errors import CCWSIMError
from ccwsim.system.workers import check_stop

CELLS_OF_ENTROPY = 1_000_000
"""Cells whose entropy is computed at a time."""


def proportions(images: Images, codes: Codes | None = None) -> NDArray[np.float64]:
    """Return the share of the cells of each facies, shape (n, n_facies).

    Parameters
    ----------
    images : Ensemble, TrainingImage or array_like, shape (ny, nx) or (n, ny, nx)
        An array has facies codes.
    codes : array_like of int, optional
        The facies codes, where an array may lack some; those that occur where left out.

    Returns
    -------
    ndarray, shape (n, n_facies)
        Shares of the cells, facies in the order of the sorted codes; each row sums to 1.

    Examples
    --------
    >>> proportions([[3, 7, 7, 7]], codes=[3, 7, 9])
    array([[0.25, 0.75, 0.  ]])
    """
    stack = as_stack(images, codes)
    n = stack.n_facies
    counts = np.array([np.bincount(image.ravel(), minlength=n) for image in stack.indices])
    return counts / stack.indices[0].size


def proportion_quantiles(
    images: Images,
    codes: Codes | None = None,
    probabilities: Sequence[float] = (0.1, 0.5, 0.9),
) -> NDArray[np.float64]:
    """Return quantiles over realizations of each facies' proportion, shape (n_quantiles, n_facies).

    Parameters
    ----------
    images, codes
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
    >>> proportion_quantiles([[[0, 1]], [[1, 1]]], probabilities=[0.5])
    array([[0.25, 0.75]])
    """
    chosen = as_floats(probabilities, "probabilities").reshape(-1)
    wrong = chosen[~((chosen >= 0) & (chosen <= 1))]
    if len(wrong):
        raise CCWSIMError(f"quantile {wrong[0]:g} must be a probability from 0 to 1")
    return np.quantile(proportions(images, codes), chosen, axis=0)


@dataclass(frozen=True, eq=False)
class EType:
    """What an ensemble says about each cell.

    Attributes
    ----------
    probability : ndarray, shape (n_facies, ny, nx)
        Share of the realizations that have each facies.
    n : int
        How many realizations.
    codes : ndarray of int, shape (n_facies,)
        The facies codes, sorted.
    """

    probability: NDArray[np.float64]
    n: int
    codes: NDArray[np.integer]

    @cached_property
    def most_likely(self) -> NDArray[np.integer]:
        """Code of the most probable facies, shape (ny, nx); of several the smallest."""
        return self.codes[self.most_likely_indices]

    @cached_property
    def most_likely_indices(self) -> NDArray[np.uint8]:
        """Where the most probable facies stands in `codes`, shape (ny, nx)."""
        return self.probability.argmax(axis=0).astype(np.uint8)

    @property
    def most_likely_probability(self) -> NDArray[np.float64]:
        """Probability of the most probable facies, shape (ny, nx)."""
        return self.probability.max(axis=0)

    @property
    def maps(self) -> dict[str, NDArray]:
        """All maps (ny, nx) by name, as `ccwsim.io.write_maps` takes them."""
        each = zip(self.codes.tolist(), self.probability, strict=True)
        return {
            **{f"probability_{code}": values for code, values in each},
            "most_likely": self.most_likely,
            "most_likely_probability": self.most_likely_probability,
            "entropy": self.entropy,
        }

    @cached_property
    def entropy(self) -> NDArray[np.float64]:
        """−Σ p log p / log(n_facies), from 0 (certain) to 1 (all equally likely), (ny, nx)."""
        return entropy(self.probability)


def etype(images: Images, codes: Codes | None = None) -> EType:
    """Return probability, most likely facies and entropy of each cell.

    Parameters
    ----------
    images : Ensemble, TrainingImage or array_like, shape (ny, nx) or (n, ny, nx)
        An array has facies codes.
    codes : array_like of int, optional
        The facies codes, where an array may lack some; those that occur where left out.

    Returns
    -------
    EType

    Examples
    --------
    >>> found = etype([[[0, 1]], [[1, 1]]])
    >>> found.probability[1], found.most_likely, found.entropy
    (array([[0.5, 1. ]]), array([[0, 1]]), array([[1., 0.]]))
    """
    stack = as_stack(images, codes)
    return etype_of_counts(facies_counts(stack), stack.codes)


def facies_counts(images: Images, codes: Codes | None = None) -> NDArray[np.int32]:
    """Return how many realizations have each facies in each cell, shape (n_facies, ny, nx).

    Parameters
    ----------
    images : Ensemble, TrainingImage or array_like, shape (ny, nx) or (n, ny, nx)
        An array has facies codes.
    codes : array_like of int, optional
        The facies codes, where an array may lack some; those that occur where left out.

    Returns
    -------
    ndarray of int32, shape (n_facies, ny, nx)

    Examples
    --------
    >>> facies_counts([[[0, 1]], [[1, 1]]]).tolist()
    [[[1, 0]], [[1, 2]]]
    """
    stack = as_stack(images, codes)
    counts = np.zeros((stack.n_facies, *stack.shape), np.int32)
    for image in stack.indices:
        check_stop()
        add_counts(image, counts)
    return counts


def etype_of_counts(counts: NDArray[np.integer], codes: Codes | None = None) -> EType:
    """Return the E-type of counts (n_facies, ny, nx), as `facies_counts` makes them.

    Parameters
    ----------
    counts : ndarray of int, shape (n_facies, ny, nx)
        Realizations by facies and cell, as `facies_counts` gives them.
    codes : array_like of int, shape (n_facies,), optional
        The facies codes, 0 … n_facies − 1 where left out.

    Returns
    -------
    EType

    Raises
    ------
    CCWSIMError
        Where nothing was counted yet, and for another number of codes.

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
    return EType(counts / n, n, codes_or_places(codes, len(counts)))


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
