"""The bundled training images, and the generators that made them."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.random import RandomState

from ccwsim.datasets import files
from ccwsim.datasets.catalogue import DATASETS, Dataset
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.training_image import TrainingImage

SMALLEST, LARGEST = 64, 1024
"""Fewest and most cells along a side of a generated image."""


def names() -> tuple[str, ...]:
    """Return the names of the bundled training images.

    Examples
    --------
    >>> "channels" in names()
    True
    """
    return tuple(DATASETS)


@cache
def load(name: str) -> TrainingImage:
    """Read a bundled training image.

    Parameters
    ----------
    name : str
        One of `names()`.

    Raises
    ------
    CCWSIMError
        For an unknown name (the message lists the names), or where the file is missing.

    Examples
    --------
    >>> ti = load("channels")
    >>> ti.shape, ti.facies_names
    ((256, 256), ('mud', 'sand'))
    """
    dataset = _dataset(name)
    return TrainingImage(
        files.read_image(files.image_path(name)), name=name, facies_names=dataset.facies_names
    )


def generate(
    name: str, *, shape: tuple[int, int] | None = None, seed: int | None = None
) -> TrainingImage:
    """Draw a training image with the generator that made the bundled one.

    Parameters
    ----------
    name : str
        One of `names()`.
    shape : pair of int, optional
        Rows and columns, each from 64 to 1024; the size of the bundled image where it is not given.
    seed : int, optional
        From 0 to 2³² − 1; that of the bundled image where it is not given.

    Returns
    -------
    TrainingImage
        The same for the same arguments. Another processor or library version may round a bank the
        other way, which changes single cells.

    Raises
    ------
    CCWSIMError
        For an unknown name, or a shape or seed out of range.

    Examples
    --------
    >>> generate("dunes", shape=(80, 120), seed=3)
    TrainingImage('dunes', 120 × 80, 3 facies)
    """
    dataset = _dataset(name)
    # RandomState, because its stream is frozen: newer generators may change with NumPy.
    rng = RandomState(dataset.seed if seed is None else _checked_seed(seed))
    facies = dataset.draw(dataset.shape if shape is None else _checked_shape(shape), rng)
    return TrainingImage(
        facies, name=name, facies_names=[dataset.facies_names[code] for code in np.unique(facies)]
    )


def describe(name: str) -> str:
    """Return one line on a bundled training image: what it is, its size, what it is good for.

    Raises
    ------
    CCWSIMError
        For an unknown name.

    Examples
    --------
    >>> print(describe("stone_wall"))
    Rounded stones of many sizes in mortar that is connected everywhere (200 × 200 cells; stone,
    mortar). Good for closed shapes: stones must not break, joints must not stop.
    """
    dataset = _dataset(name)
    ny, nx = dataset.shape
    facies = ", ".join(dataset.facies_names)
    return f"{dataset.picture} ({nx} × {ny} cells; {facies}). Good for {dataset.good_for}."


def _dataset(name: str) -> Dataset:
    if name not in DATASETS:
        raise CCWSIMError(
            f"training image {shown(name)} is unknown; there are {', '.join(DATASETS)}"
        )
    return DATASETS[name]


def _checked_seed(seed: int) -> int:
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < 2**32:
        raise CCWSIMError(f"seed = {shown(seed)} must be a whole number from 0 to {2**32 - 1}")
    return int(seed)


def _checked_shape(shape: tuple[int, int]) -> tuple[int, int]:
    sides = shape if isinstance(shape, (tuple, list)) else ()
    fitting = [n for n in sides if isinstance(n, (int, np.integer)) and SMALLEST <= n <= LARGEST]
    if len(sides) != 2 or len(fitting) != 2:
        raise CCWSIMError(
            f"shape = {shown(shape)} must be two whole numbers (rows, columns) from {SMALLEST} to "
            f"{LARGEST}"
        )
    return int(shape[0]), int(shape[1])
