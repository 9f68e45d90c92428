"""What measured times say: how long others will take, and whether time grows with the cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccwsim.experiments.timing import Timing
from ccwsim.experiments.timing_case import TimingCase, usual_seconds
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.training_image import TrainingImage

LINEAR = (0.9, 1.1)
"""Exponents of the number of cells that count as linear growth."""


@dataclass(frozen=True)
class Growth:
    """How time grows with the cells of the grid.

    Attributes
    ----------
    seconds_per_million : float
        CPU seconds of a million cells, by least squares of the relative errors.
    exponent : float
        Of the number of cells in a power law; 1 is linear growth.
    """

    seconds_per_million: float
    exponent: float

    @property
    def linear(self) -> bool:
        """Whether twice the cells take about twice the time."""
        return LINEAR[0] <= self.exponent <= LINEAR[1]


def growth(timings: Sequence[Timing]) -> Growth:
    """Return how the time of one setting grows from grid to grid.

    Raises
    ------
    CCWSIMError
        Where all grids have the same number of cells.

    Examples
    --------
    >>> from ccwsim.model.parameters import Parameters
    >>> def took(side, seconds):
    ...     return Timing(Parameters(), (side, side), 0, np.array([seconds]), np.zeros(1, int))
    >>> found = growth([took(1000, 0.2), took(2000, 0.8)])
    >>> round(found.seconds_per_million, 3), round(found.exponent, 3), found.linear
    (0.2, 1.0, True)
    """
    cells = np.array([t.n_cells for t in timings], float)
    seconds = np.array([max(t.seconds, 1e-9) for t in timings])
    if len(np.unique(cells)) < 2:
        raise CCWSIMError("growth needs times of at least two sizes of the grid")
    exponent = np.polyfit(np.log(cells), np.log(seconds), 1)[0]
    rate = cells / seconds
    return Growth(1e6 * float(rate.sum() / (rate**2).sum()), float(exponent))


def expected_seconds(
    training_image: TrainingImage,
    cases: Sequence[TimingCase],
    n_realizations: int = 1,
    measured: Sequence[Timing] = (),
) -> float:
    """Return about how long timing the cases will take.

    Parameters
    ----------
    training_image : TrainingImage
    cases : sequence of TimingCase
    n_realizations : int
        Of each case.
    measured : sequence of Timing
        What was measured of the same training image. Each case follows the most similar of them.

    Examples
    --------
    >>> from ccwsim.model.parameters import Parameters
    >>> ti = TrainingImage(np.eye(64, dtype=int))
    >>> p = Parameters(wavelet_level=1)
    >>> one = Timing(p, (500, 500), 0, np.array([0.3]), np.zeros(1, int))
    >>> round(expected_seconds(ti, [one.case], 10, [one]), 6)
    3.0
    """
    each = (
        usual_seconds(training_image, case) * _slower(training_image, case, measured)
        for case in cases
    )
    return n_realizations * sum(each)


def _slower(training_image: TrainingImage, case: TimingCase, measured: Sequence[Timing]) -> float:
    """Return how many times the usual time the most similar measured case took."""
    if not measured:
        return 1.0

    def unlike(timing: Timing) -> tuple[bool, bool, int, int, float]:
        p, own = timing.parameters, case.parameters
        return (
            p.method != own.method,
            bool(timing.n_data) != bool(case.n_data),
            abs(p.level - own.level),
            abs(timing.n_data - case.n_data),
            abs(np.log(timing.n_cells / case.n_cells)),
        )

    nearest = min(measured, key=unlike)
    return nearest.seconds / usual_seconds(training_image, nearest.case)
