"""The bundled hard data: read off a hidden truth at scattered cells."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray

from ccwsim.datasets import files
from ccwsim.datasets.catalogue import SURVEYS, Survey
from ccwsim.datasets.images import generate
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage


def hard_data_names() -> tuple[str, ...]:
    """Return the names of the bundled hard data.

    Examples
    --------
    >>> "channels_60_wells" in hard_data_names()
    True
    """
    return tuple(SURVEYS)


@cache
def load_hard_data(name: str) -> HardData:
    """Read bundled hard data; they lie on a grid of `hard_data_grid_shape(name)`.

    Raises
    ------
    CCWSIMError
        For an unknown name (the message lists the names), or where the file is missing.

    Examples
    --------
    >>> load_hard_data("channels_60_wells")
    HardData(n=60)
    """
    grid = Grid(*_survey(name).grid_shape)
    return files.read_hard_data(files.hard_data_path(name), grid)


def hard_data_grid_shape(name: str) -> tuple[int, int]:
    """Return rows and columns of the grid that bundled hard data lie on.

    Examples
    --------
    >>> hard_data_grid_shape("channels_60_wells")
    (512, 512)
    """
    return _survey(name).grid_shape


def hard_data_training_image(name: str) -> str:
    """Return the name of the training image that bundled hard data go with.

    Examples
    --------
    >>> hard_data_training_image("channels_60_wells")
    'channels'
    """
    return _survey(name).training_image


def generate_truth(name: str) -> TrainingImage:
    """Draw the image that bundled hard data were read from, to score realizations against.

    It is of the same kind as the training image, drawn with another seed.

    Examples
    --------
    >>> truth = generate_truth("channels_60_wells")
    >>> load_hard_data("channels_60_wells").n_mismatched(truth.array)
    0
    """
    survey = _survey(name)
    return generate(survey.training_image, shape=survey.grid_shape, seed=survey.truth_seed)


def describe_hard_data(name: str) -> str:
    """Return one line on bundled hard data.

    Examples
    --------
    >>> describe_hard_data("channels_60_wells")
    '60 wells, none close to another (512 × 512 cells, for the training image channels).'
    """
    survey = _survey(name)
    ny, nx = survey.grid_shape
    return f"{survey.picture} ({nx} × {ny} cells, for the training image {survey.training_image})."


def generate_hard_data(name: str) -> HardData:
    """Read the bundled hard data off their truth again."""
    survey = _survey(name)
    rng = RandomState(survey.seed)
    return scattered_data(generate_truth(name).array, survey.n, survey.min_spacing, rng)


def scattered_data(
    truth: NDArray[np.integer], n: int, min_spacing: float, rng: RandomState
) -> HardData:
    """Read n cells of a truth, shape (ny, nx), that lie at least `min_spacing` cells apart.

    Fewer than n come back where the image has no room for more.

    Examples
    --------
    >>> scattered_data(np.eye(40, dtype=int), 12, 4.0, RandomState(0)).n
    12
    """
    cells = np.empty((n, 2), np.int64)
    found = 0
    for candidate in rng.permutation(truth.size):
        cell = np.array(divmod(int(candidate), truth.shape[1]))
        if (np.hypot(*(cells[:found] - cell).T) >= min_spacing).all():
            cells[found] = cell
            found += 1
            if found == n:
                break
    chosen = cells[:found]
    return HardData(chosen, truth[chosen[:, 0], chosen[:, 1]])


def _survey(name: str) -> Survey:
    if name not in SURVEYS:
        raise CCWSIMError(f"hard data {shown(name)} are unknown; there are {', '.join(SURVEYS)}")
    return SURVEYS[name]
