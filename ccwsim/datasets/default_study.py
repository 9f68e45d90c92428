"""Stored realizations of the study that the dashboard opens with, seen before kernels compile.

They are what `simulate` gives for that study, cell by cell; `python -m tools.default_study` writes
them. CPU times are not stored: those of another machine would mean nothing.
"""

from __future__ import annotations

import numpy as np

from ccwsim.datasets.catalogue import ASSETS, load, load_hard_data
from ccwsim.model.arrays import readonly
from ccwsim.model.choices import Choices
from ccwsim.model.ensemble import Ensemble

STORED = ASSETS / "default_study.npz"


def stored_ensemble() -> Ensemble:
    """Return the realizations of `Choices()`, with NaN for the CPU time of each."""
    choices = Choices()
    shape = choices.n_realizations, *choices.grid.shape
    with np.load(STORED) as stored:
        indices = np.unpackbits(stored["bits"], count=int(np.prod(shape))).reshape(shape)
        data_status = stored["data_status"]
    return Ensemble(
        training_image=load(choices.image.bundled),
        grid=choices.grid,
        parameters=choices.parameters,
        hard_data=load_hard_data(choices.data.bundled),
        seed=choices.seed,
        indices=readonly(indices),
        cpu_seconds=readonly(np.full(choices.n_realizations, np.nan)),
        wall_seconds=0.0,
        data_status=readonly(data_status),
        numbers=readonly(np.arange(choices.n_realizations)),
    )
