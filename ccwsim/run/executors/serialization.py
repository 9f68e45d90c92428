"""A study as bytes, to be sent to a worker and known there by its name."""

from __future__ import annotations

import pickle

from ccwsim.model.arrays import digest
from ccwsim.model.hard_data import HardData
from ccwsim.model.study import Study
from ccwsim.model.training_image import TrainingImage


def packed(study: Study) -> bytes:
    """Return all that a study is made of."""
    image, data = study.training_image, study.hard_data
    parts = (
        (image.array, image.name, image.facies_names), study.grid, study.parameters,
        (data.cells, data.facies), study.seed,
    )  # fmt: skip
    return pickle.dumps(parts)


def unpacked(content: bytes) -> Study:
    """Return the study made anew: its arrays are frozen as at home, so kernels know their types.

    Examples
    --------
    >>> import numpy as np
    >>> from ccwsim.model.grid import Grid
    >>> study = Study(TrainingImage(np.eye(40)), Grid(50, 60), seed=3)
    >>> name_of(unpacked(packed(study))) == name_of(study)
    True
    """
    (array, name, facies_names), grid, parameters, (cells, facies), seed = pickle.loads(content)
    image = TrainingImage(array, name=name, facies_names=facies_names)
    return Study(image, grid, parameters, HardData(cells, facies), seed)


def name_of(study: Study) -> str:
    """Return a short name of the content: equal for studies with equal realizations."""
    return digest(
        study.training_image.digest, study.grid, study.parameters, study.hard_data.digest,
        study.seed,
    )  # fmt: skip
