"""A round of the quiz: one piece of the training image among pieces of realizations.

A seam shows where it makes a shape, a window of cells, that the training image does not have.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics import Copying, copying
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate
from ccwsim.ui.session.fitting import fitted

N_PICTURES = 6
MAX_SIDE = 96
SIDES_PER_REALIZATION = 2
"""A realization has so many times the side of the piece that is shown of it."""
SIDE = 6
"""Cells of the windows that are compared: seen at a glance, and few enough to be all known."""


@dataclass(frozen=True, eq=False)
class Round:
    """The pictures of a round.

    `pictures` are facies indices and `sources` where in the training image each cell is from, both
    of shape (n, side, side). Picture `answer` is of the training image, the others of one
    realization each, simulated with `parameters`.
    """

    training_image: TrainingImage
    parameters: Parameters
    pictures: NDArray[np.uint8]
    sources: NDArray[np.int32]
    answer: int

    def copying_of(self, k: int) -> Copying:
        """Return how picture k was put together; that of the training image is one piece."""
        return copying(self.sources[k], self.training_image.shape)

    @cached_property
    def known(self) -> NDArray[np.uint64]:
        """The hashes of all windows of the training image."""
        return np.unique(window_hashes(self.training_image.indices))

    def shapes_at(self, k: int) -> tuple[NDArray[np.bool_], float]:
        """Return where picture k has shapes that the training image has not, and their share."""
        return new_shapes(self.pictures[k], self.known)

    @property
    def easiest(self) -> int:
        """The realization with the most shapes that the training image has not."""
        shares = [self.shapes_at(k)[1] for k in range(len(self.pictures))]
        shares[self.answer] = -1.0
        return int(np.argmax(shares))


def draw_round(image: TrainingImage, parameters: Parameters, seed: int) -> Round:
    """Draw a round; the same for the same arguments.

    Every piece is cut at random from inside its image, so that no edge and no location tells.

    Examples
    --------
    >>> from ccwsim import datasets
    >>> drawn = draw_round(datasets.load("channels"), Parameters(), seed=3)
    >>> drawn.pictures.shape, drawn.shapes_at(drawn.answer)[1]
    ((6, 96, 96), 0.0)
    """
    rng = np.random.default_rng(seed)
    side = piece_side(image.shape)
    p, n, length = fitted(parameters, image.shape), N_PICTURES - 1, SIDES_PER_REALIZATION * side
    own_seed, shape = int(rng.integers(2**31)), (length, length)
    e = simulate(image, shape, p, n_realizations=n, seed=own_seed, keep_sources=True)
    assert e.sources is not None
    maps, origins = list(e.indices), list(e.sources)
    answer = int(rng.integers(N_PICTURES))
    maps.insert(answer, image.indices)
    origins.insert(answer, np.arange(image.indices.size, dtype=np.int32).reshape(image.shape))
    pictures, sources = [], []
    for indices, source in zip(maps, origins, strict=True):
        row, column = (int(rng.integers(n - side + 1)) for n in indices.shape)
        window = slice(row, row + side), slice(column, column + side)
        pictures.append(indices[window])
        sources.append(source[window])
    return Round(image, p, np.array(pictures), np.array(sources), answer)


def piece_side(shape: tuple[int, int]) -> int:
    """Return the side of the pieces: no more than half the training image, so that they differ.

    Examples
    --------
    >>> piece_side((256, 256)), piece_side((100, 300))
    (96, 50)
    """
    return max(4, min(MAX_SIDE, min(shape) // 2))


def window_hashes(indices: NDArray[np.integer]) -> NDArray[np.uint64]:
    """Return one number a window of SIDE × SIDE cells, equal for equal windows.

    Two windows that differ have the same number about once in 10¹⁹.

    Examples
    --------
    >>> hashes = window_hashes(np.tile([0, 1], (8, 4)))
    >>> hashes.shape, len(np.unique(hashes))
    ((3, 3), 2)
    """
    ny, nx = (n - SIDE + 1 for n in indices.shape)
    weights = np.random.default_rng(SIDE).integers(2**63, size=(SIDE, SIDE), dtype=np.uint64)
    cells = indices.astype(np.uint64) + np.uint64(1)
    hashes = np.zeros((max(ny, 0), max(nx, 0)), np.uint64)
    for row in range(SIDE):
        for column in range(SIDE):
            hashes += weights[row, column] * cells[row : row + ny, column : column + nx]
    return hashes


def new_shapes(
    indices: NDArray[np.integer], known: NDArray[np.uint64]
) -> tuple[NDArray[np.bool_], float]:
    """Return where a map has windows that the training image has not, and the share of them.

    `known` are the hashes of the windows of the training image; of each other window the four
    cells in its middle are marked.

    Examples
    --------
    >>> stripes = np.tile([0, 0, 1, 1], (12, 6))
    >>> shifted = np.vstack([stripes[:6], 1 - stripes[6:]])
    >>> where, share = new_shapes(shifted, window_hashes(stripes))
    >>> where.any(axis=1).nonzero()[0].tolist(), round(share, 2)
    ([3, 4, 5, 6, 7, 8], 0.71)
    """
    new = ~np.isin(window_hashes(indices), known)
    where = np.zeros(indices.shape, bool)
    middle = SIDE // 2 - 1
    for down in (middle, middle + 1):
        for along in (middle, middle + 1):
            where[down : down + new.shape[0], along : along + new.shape[1]] |= new
    return where, float(new.mean()) if new.size else 0.0
