"""The settings that the paper compares, and realizations of the published codes beside them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ccwsim.model.hard_data import HardData
from ccwsim.model.parameters import Parameters
from ccwsim.model.training_image import TrainingImage
from ccwsim.paper.experiment import Run
from ccwsim.paper.published_times import SINGLE_TIMES

CONDITIONING = "Data conditioning “to a considerable degree” (the authors' page)."
TITLES = {"ccwsim": "CCWSIM", "ms-ccsim": "MS-CCSIM", "ccsim": "CCSIM"}
SAID = "T 32, OR 8, 20 candidates, search fraction 0.1, CT 2"
"""The settings of the authors' script."""


def settings(method: str, level: int, *, exact: bool = True, template: int = 32) -> Parameters:
    """Return the settings of the authors' script for a method and level.

    Parameters
    ----------
    method : str
        "ccwsim", "ms-ccsim" or "ccsim".
    level : int
    exact : bool
        Whether every datum is honoured at full resolution; the published codes do not.
    template : int

    Examples
    --------
    >>> settings("ccwsim", 1).overlap_size
    8
    """
    return Parameters(
        template_size=template, overlap_size=8, wavelet_level=level, method=method,
        exact_data=exact,
    )  # fmt: skip


def published(run: Run, image: TrainingImage, name: str, shape: tuple[int, int]) -> NDArray | None:
    """Return realizations of a published code where they are of this very study."""
    if not run.inputs.is_own(image_named(name)):
        return None
    found = run.inputs.published(name, image)
    return found if found is not None and found.shape[1:] == shape else None


def image_named(name: str) -> str:
    """Return which training image a file of published realizations is of.

    Examples
    --------
    >>> image_named("MS-CCSIM_stonewall512_hd300_L1")
    'stone wall'
    """
    return "stone wall" if "stonewall" in name else "channel"


def stated_seconds(where: str) -> float:
    """Return a time that the paper, or the authors' page, states for one experiment.

    Examples
    --------
    >>> stated_seconds("Fig. 6")
    6.52
    """
    found = next(t.cpu_seconds for t in SINGLE_TIMES if t.where == where)
    assert found is not None
    return found


def wrong_share(images: NDArray, image: TrainingImage, data: HardData) -> float:
    """Return the share of the data that realizations (facies indices) do not honour, mean.

    Examples
    --------
    >>> ti = TrainingImage([[0, 1]])
    >>> wrong_share(np.array([[[0, 1]], [[1, 1]]]), ti, HardData([[0, 0]], [0]))
    0.5
    """
    wrong = [data.n_mismatched(image.codes[one]) for one in images]
    return float(np.mean(wrong) / max(data.n, 1))
