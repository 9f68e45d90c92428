"""Stored realizations of the dashboard's default study, shown while kernels compile.

Each cell equals the result of `simulate`. `python -m tools.default_study` writes the file. CPU
times are not stored, because they depend on the machine.
"""

import numpy as np

from ccwsim import Ensemble, Grid
from ccwsim.datasets.catalogue import ASSETS, load, load_hard_data
from ccwsim.model import Study

STORED_ENSEMBLE = ASSETS / "default_study.npz"
DEFAULT_IMAGE, DEFAULT_DATA, DEFAULT_STUDY_SHAPE, DEFAULT_N_REALIZATIONS = (
    "channels",
    "channels_400_data",
    (512, 512),
    12,
)
"""Arguments of `simulate` for the study that `Choices()` describes, with seed 0."""


def stored_ensemble() -> Ensemble:
    """Return the realizations of the default study, with CPU times that are NaN."""
    shape = DEFAULT_N_REALIZATIONS, *DEFAULT_STUDY_SHAPE
    with np.load(STORED_ENSEMBLE) as stored:
        indices = np.unpackbits(stored["bits"], count=int(np.prod(shape))).reshape(shape)
        data_status = stored["data_status"]
    return Ensemble(
        study=Study(
            load(DEFAULT_IMAGE),
            Grid.of(DEFAULT_STUDY_SHAPE),
            hard_data=load_hard_data(DEFAULT_DATA),
        ),
        indices=indices,
        cpu_seconds=np.full(DEFAULT_N_REALIZATIONS, np.nan),
        wall_seconds=0.0,
        data_status=data_status,
        numbers=np.arange(DEFAULT_N_REALIZATIONS),
    )
