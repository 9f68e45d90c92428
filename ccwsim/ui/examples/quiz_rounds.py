"""A round of the quiz: one piece of the training image among pieces of realizations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ccwsim.metrics import Copying, copying
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.run.simulation import simulate
from ccwsim.ui.examples.quiz_shapes import new_shapes, window_names
from ccwsim.ui.session.fitting import fitted

N_PICTURES = 6
LARGEST_SIDE = 96
ROOM = 2
"""A realization has so many times the side of the piece that is shown of it."""


@dataclass(frozen=True, eq=False)
class Round:
    """The pictures of a round.

    Attributes
    ----------
    training_image : TrainingImage
    parameters : Parameters
        What the realizations were simulated with.
    pictures : ndarray of uint8, shape (n, side, side)
        Facies indices; one is of the training image, the others of one realization each.
    sources : ndarray of int32, shape (n, side, side)
        Where in the training image each cell is from.
    answer : int
        Which one is of the training image.
    """

    training_image: TrainingImage
    parameters: Parameters
    pictures: NDArray[np.uint8]
    sources: NDArray[np.int32]
    answer: int

    def reuse_of(self, k: int) -> Copying:
        """Return how picture k was put together; that of the training image is one piece."""
        return copying(self.sources[k], self.training_image.shape)

    @cached_property
    def known(self) -> NDArray[np.uint64]:
        """The names of all windows of the training image."""
        return np.unique(window_names(self.training_image.indices))

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

    Every piece is cut at random from inside its image, so that no edge and no place tells.

    Examples
    --------
    >>> from ccwsim import datasets
    >>> drawn = draw_round(datasets.load("channels"), Parameters(), seed=3)
    >>> drawn.pictures.shape, drawn.shapes_at(drawn.answer)[1]
    ((6, 96, 96), 0.0)
    """
    rng = np.random.default_rng(seed)
    side = piece_side(image.shape)
    p = fitted(parameters, image.shape)
    e = simulate(
        image, (ROOM * side, ROOM * side), p, n_realizations=N_PICTURES - 1,
        seed=int(rng.integers(2**31)), keep_sources=True,
    )  # fmt: skip
    assert e.sources is not None
    own = np.arange(image.indices.size, dtype=np.int32).reshape(image.shape)
    maps, places = list(e.indices), list(e.sources)
    answer = int(rng.integers(N_PICTURES))
    maps.insert(answer, image.indices)
    places.insert(answer, own)
    pictures, sources = [], []
    for indices, source in zip(maps, places, strict=True):
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
    return max(4, min(LARGEST_SIDE, min(shape) // 2))
