"""Facies proportions of images, and the E-type: the probability of each facies in each cell."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ccwsim.jobs.workers import check_stop
from ccwsim.metrics.stack import N_AXES, Codes, Images, Stack, as_stack, codes_or_places
from ccwsim.model import (
    MAX_INT,
    UNKNOWN,
    Array,
    ArrayLike,
    Bytes,
    CCWSIMError,
    Floats,
    Int32s,
    Integers,
    as_array,
    as_floats,
    as_integers,
    codes_with_nan,
    ratio,
    refused,
)

CELLS_OF_ENTROPY = 1_000_000  # number of cells whose entropy is computed at a time


def proportions(images: Images, codes: Codes | None = None) -> Floats:
    """Return the proportion of each facies in each image, shape (n, n_facies).

    Examples
    --------
    >>> proportions([[3, 7, 7, 7]], codes=[3, 7, 9])
    array([[0.25, 0.75, 0.  ]])
    """
    stack = as_stack(images, codes)
    n = stack.n_facies
    counts = np.array([np.bincount(image.ravel(), minlength=n)[:n] for image in stack.indices])
    return ratio(counts, counts.sum(axis=1, keepdims=True))


def vertical_proportions(images: Images, codes: Codes | None = None) -> Floats:
    """Return vertical proportion curves: the share of each facies in each layer of volumes.

    The result has shape (n, n_facies, nz); layer 0 is at the bottom. The shares in each layer sum
    to 1. An array of shape (nz, ny, nx) is one volume. Raises `CCWSIMError` for maps.

    Examples
    --------
    >>> vertical_proportions([[[3, 3]], [[3, 7]]])
    array([[[1. , 0.5],
            [0. , 0.5]]])
    """
    stack = as_stack(images, codes, N_AXES)
    if not stack.is_volumes:
        raise refused("proportions_by_layer", n=len(stack), shape=stack.shape)
    layers = Stack(stack.indices.reshape(-1, *stack.shape[1:]), stack.codes)
    shares = proportions(layers).reshape(len(stack), -1, stack.n_facies)
    return shares.swapaxes(1, 2)


@dataclass(frozen=True, eq=False)
class EType:
    """Probability of each facies in each cell."""

    probability: Floats
    """Probability of each facies, shape (n_facies, ny, nx) or (n_facies, nz, ny, nx)."""
    n: int
    codes: Integers
    names: tuple[str, ...] = ()
    """Names of the facies of an ensemble or training image."""

    @cached_property
    def most_likely(self) -> Integers:
        """Code of the most probable facies in each cell; the smallest code in a tie.

        With inactive cells, the codes are floating-point numbers, and inactive cells have NaN.
        """
        indices = self.most_likely_indices
        return codes_with_nan(self.codes, bool((indices == UNKNOWN).any()))[indices]

    @cached_property
    def most_likely_indices(self) -> Bytes:
        """Index in `codes` of the most probable facies in each cell; 255 in inactive cells."""
        most = self.probability.argmax(axis=0).astype(np.uint8)
        return np.where(np.isnan(self.probability[0]), np.uint8(UNKNOWN), most)

    @property
    def most_likely_probability(self) -> Floats:
        """Probability of the most probable facies in each cell."""
        return self.probability.max(axis=0)

    @property
    def maps(self) -> dict[str, Array]:
        """Dictionary of all maps (or volumes) by name, for `ccwsim.io.write_maps`."""
        # "facies 3" is the name of a facies without a name
        words = (" ".join(name.split()).removeprefix("facies ") for name in self.names)
        names = ["".join(filter(str.isprintable, word))[:32] for word in words]
        labels = names if len({*names}) == len(self.codes) else self.codes.tolist()
        each = zip(labels, self.probability, strict=True)
        return {
            **{f"probability_{label}": values for label, values in each},
            "most_likely": self.most_likely,
            "most_likely_probability": self.most_likely_probability,
            "entropy": self.entropy,
        }

    @cached_property
    def entropy(self) -> Floats:
        """Entropy −Σ p log p / log(n_facies), from 0 (certain) to 1 (all facies equally likely)."""
        return entropy(self.probability)


def etype(images: Images, codes: Codes | None = None) -> EType:
    """Return the E-type of images: probability, most likely facies and entropy of each cell.

    Examples
    --------
    >>> e_type = etype([[[0, 1]], [[1, 1]]])
    >>> e_type.probability[1], e_type.most_likely, e_type.entropy
    (array([[0.5, 1. ]]), array([[0, 1]]), array([[1., 0.]]))
    """
    stack = as_stack(images, codes)
    return replace(etype_of_counts(facies_counts(stack), stack.codes), names=stack.names)


def facies_counts(images: Images, codes: Codes | None = None) -> Int32s:
    """Return the number of realizations with each facies in each cell.

    The shape is (n_facies, ny, nx) or (n_facies, nz, ny, nx).

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


def etype_of_counts(counts: Integers, codes: Codes | None = None) -> EType:
    """Return the E-type computed from the result of `facies_counts`.

    The codes are 0 … n_facies − 1 by default. Raises `CCWSIMError` if all counts are 0.

    Examples
    --------
    >>> etype_of_counts(np.array([[[1]], [[3]]])).probability.ravel()
    array([0.25, 0.75])
    """
    counts = as_array(counts, "counts")
    n_axes = counts.ndim - 1
    if n_axes not in (2, N_AXES) or not counts.size or counts.dtype.kind not in "ui":
        raise refused("counts_shape", shape=counts.shape)
    counts = as_integers(counts, "counts", 0, MAX_INT // counts.size)
    each = counts.sum(axis=0)  # 0 in inactive cells
    n = int(each.max())
    if not n:
        raise CCWSIMError("no realization was counted yet; an E-type needs at least one")
    return EType(ratio(counts, each), n, codes_or_places(codes, len(counts)))


def entropy(probability: ArrayLike) -> Floats:
    """Return −Σ p log p / log(n_facies) of probabilities of shape (n_facies, …).

    It is 0 if certain or if there is one facies, and 1 if all facies are equally likely.

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
    flat, entropies = p.reshape(len(p), -1), np.empty(p[0].size)
    for first in range(0, len(entropies), CELLS_OF_ENTROPY):
        check_stop()
        part = flat[:, first : first + CELLS_OF_ENTROPY]
        terms = part * np.log(np.where(part > 0, part, 1.0))
        entropies[first : first + CELLS_OF_ENTROPY] = -terms.sum(axis=0) / np.log(len(p)) + 0.0
    return entropies.reshape(p.shape[1:])


def add_counts(image: Bytes, counts: Int32s) -> None:
    """Add one realization to counts of shape (n_facies, *image.shape), in place."""
    for k, count in enumerate(counts):  # unknown and inactive cells have another index
        count += image == k
