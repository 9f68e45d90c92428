"""Stored realizations of the dashboard's default study, shown while kernels compile.

Each cell equals the result of `simulate`. `python -m tools.default_study` writes the file. CPU
times are not stored, because they depend on the machine.
"""

import numpy as np

from ccwsim import Ensemble, Grid
from ccwsim.datasets.catalogue import ASSETS, load, load_hard_data
from ccwsim.model.study import Study

STORED = ASSETS / "default_study.npz"
IMAGE, HARD_DATA, SHAPE, N_REALIZATIONS = "channels", "channels_400_data", (512, 512), 12
"""Arguments of `simulate` for the study that `Choices()` describes, with seed 0."""


def stored_ensemble() -> Ensemble:
    """Return the realizations of the default study, with CPU times that are NaN."""
    shape = N_REALIZATIONS, *SHAPE
    with np.load(STORED) as stored:
        indices = np.unpackbits(stored["bits"], count=int(np.prod(shape))).reshape(shape)
        data_status = stored["data_status"]
    return Ensemble(
        study=Study(load(IMAGE), Grid.of(SHAPE), hard_data=load_hard_data(HARD_DATA)),
        indices=indices,
        cpu_seconds=np.full(N_REALIZATIONS, np.nan),
        wall_seconds=0.0,
        data_status=data_status,
        numbers=np.arange(N_REALIZATIONS),
    )
