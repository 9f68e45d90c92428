"""Write the realizations of the dashboard's default study: `python -m tools.default_study`."""

from __future__ import annotations

import numpy as np

from ccwsim import Ensemble, datasets, simulate
from ccwsim.datasets.default_study import STORED_ENSEMBLE
from ccwsim.sharing.choices import Choices


def simulated() -> Ensemble:
    """Simulate the default study."""
    choices = Choices()
    return simulate(
        datasets.load(choices.image.bundled),
        choices.grid,
        choices.parameters,
        datasets.load_hard_data(choices.data.bundled),
        choices.n_realizations,
        choices.seed,
    )


def write() -> None:
    """Store the default study with one bit per cell, because the study has two facies."""
    e = simulated()
    np.savez_compressed(STORED_ENSEMBLE, bits=np.packbits(e.indices), data_status=e.data_status)


if __name__ == "__main__":
    write()
