"""Connected bodies of a facies: number, sizes, Γ, percolation and Euler number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.engine.kernels import kernel
from ccwsim.metrics.connectivity import connected_geobodies
from ccwsim.metrics.stack import Fraction, as_stack, map_parallel


@dataclass(frozen=True, eq=False)
class Geobodies:
    """Connected bodies of one facies, one value an image.

    Attributes
    ----------
    n_bodies : ndarray of int, shape (n,)
    sizes : tuple of ndarray
        Cells of each body of each image, largest first.
    gamma : ndarray, shape (n,)
        Γ = Σ nᵢ² / m², the probability that two random cells of the facies are connected; NaN
        where the facies does not occur.
    percolates_ew, percolates_ns : ndarray of bool, shape (n,)
        Whether one body touches both the west and the east edge, or the south and the north one.
    euler_number : ndarray of int, shape (n,)
        Bodies minus holes.
    neighbours : int
        4 or 8: which cells count as touching. Holes use the other of the two.
    """

    n_bodies: NDArray[np.int64]
    sizes: tuple[NDArray[np.int64], ...]
    gamma: NDArray[np.float64]
    percolates_ew: NDArray[np.bool_]
    percolates_ns: NDArray[np.bool_]
    euler_number: NDArray[np.int64]
    neighbours: int


class _One(NamedTuple):
    sizes: NDArray[np.int64]
    ew: bool
    ns: bool
    euler: int


def geobody_statistics(
    images: ArrayLike, facies: int, neighbours: int = 8, progress: Fraction | None = None
) -> Geobodies:
    """Return the connected bodies of a facies in each image (Renard & Allard 2013).

    Parameters
    ----------
    images : array_like, shape (ny, nx) or (n, ny, nx)
        Facies codes or indices.
    facies : int
        Which value of the images.
    neighbours : int
        4 (sides) or 8 (sides and corners).
    progress : callable, optional
        Called with the share that is done.

    Raises
    ------
    CCWSIMError
        For other neighbours than 4 or 8.

    Examples
    --------
    >>> bodies = geobody_statistics([[1, 1, 0, 1]], 1)
    >>> bodies.n_bodies, bodies.sizes[0].tolist(), bodies.gamma.round(3)
    (array([2]), [2, 1], array([0.556]))
    """
    stack = as_stack(images)
    found = map_parallel(lambda k: _of_one(stack[k], facies, neighbours), len(stack), progress)
    totals = np.array([one.sizes.sum() for one in found], dtype=float)
    squares = np.array([(one.sizes.astype(float) ** 2).sum() for one in found])
    gamma = np.full(len(found), np.nan)
    np.divide(squares, totals**2, out=gamma, where=totals > 0)
    return Geobodies(
        n_bodies=np.array([len(one.sizes) for one in found]),
        sizes=tuple(one.sizes for one in found),
        gamma=gamma,
        percolates_ew=np.array([one.ew for one in found]),
        percolates_ns=np.array([one.ns for one in found]),
        euler_number=np.array([one.euler for one in found]),
        neighbours=neighbours,
    )


def _of_one(image: NDArray[np.integer], facies: int, neighbours: int) -> _One:
    labels, n_bodies = connected_geobodies(image, facies, neighbours)
    sizes = np.bincount(labels.ravel(), minlength=n_bodies + 1)[1:]
    return _One(
        sizes=np.sort(sizes)[::-1],
        ew=_shared(labels[:, 0], labels[:, -1]),
        ns=_shared(labels[0], labels[-1]),
        euler=int(_euler_number(labels, neighbours == 8)),
    )


def _shared(one: NDArray[np.int32], other: NDArray[np.int32]) -> bool:
    both = np.intersect1d(one, other)
    return bool((both > 0).any())


@kernel
def _euler_number(labels, corners_touch):
    """Count squares of 2 × 2 cells with one, three, or two diagonal cells inside (Gray 1971)."""
    ny, nx = labels.shape
    one, three, diagonal = 0, 0, 0
    for i in range(-1, ny):
        for j in range(-1, nx):
            a = i >= 0 and j >= 0 and labels[i, j] > 0
            b = i >= 0 and j + 1 < nx and labels[i, j + 1] > 0
            c = i + 1 < ny and j >= 0 and labels[i + 1, j] > 0
            d = i + 1 < ny and j + 1 < nx and labels[i + 1, j + 1] > 0
            n = int(a) + int(b) + int(c) + int(d)
            one += n == 1
            three += n == 3
            diagonal += n == 2 and a == d
    return (one - three + (-2 if corners_touch else 2) * diagonal) // 4
