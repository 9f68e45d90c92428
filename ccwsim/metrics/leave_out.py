"""Prediction of hard data that a simulation was not given: is the ensemble wide enough?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ccwsim.jobs.workers import Cancel
from ccwsim.metrics.data_fit import MIN_Z, paired_z, wells_of
from ccwsim.metrics.reference import Calibration, calibration
from ccwsim.metrics.stack import Fraction
from ccwsim.model.arrays import check_int
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.hard_data import HardData
from ccwsim.model.study import Study
from ccwsim.run.simulation import simulate

TOO_SURE = 0.5
"""Slope of observed on predicted probabilities below which probabilities are too sure."""
MIN_DATA = 200
"""Minimum number of data for a verdict on the slope."""


@dataclass(frozen=True, eq=False)
class LeaveOut:
    """Result of `leave_out`; all scores are means over data."""

    probability: NDArray[np.float64]
    """Probability of each facies at each datum when it was left out, shape (n, n_facies)."""
    skill: float
    """1 − Brier score / Brier score of the proportions of the other data. The Brier score is the
    score that infinitely many realizations would have. 1 is perfect, 0 is no better."""
    z: float
    """Difference of these two Brier scores in standard errors; positive if simulation is better."""
    log_score: float
    """Mean −ln P of the datum's facies, where the proportions count as one more realization."""
    slope: float
    """Slope of the regression of observed on predicted departures from the proportions: 1 if
    probabilities are reliable, less if they are too sure."""
    reliability: Calibration
    """Predicted probabilities and observed shares in bins."""

    @property
    def words(self) -> str:
        """The verdict in at most eight words."""
        if len(self.probability) < MIN_DATA:
            return "Too few data to judge the probabilities"
        if self.slope < TOO_SURE:
            return "Probabilities are too sure"
        if self.z < MIN_Z:
            return "Simulation predicts no better than proportions"
        return "Probabilities are as sure as they should be"


def leave_out(
    study: Study,
    folds: int = 5,
    n: int = 24,
    by: Literal["datum", "well"] = "datum",
    progress: Fraction | None = None,
    cancel: Cancel | None = None,
) -> LeaveOut:
    """Simulate without a fifth of the hard data, and compare the probabilities with these data.

    Parameters
    ----------
    study : Study
    folds : int
        Number of parts; each part is left out once.
    n : int
        Number of realizations for each part.
    by : str
        "well" leaves out whole vertical wells of a volume, "datum" single data.
    progress, cancel : callable, optional
        As of `simulate`.

    Raises
    ------
    CCWSIMError
        For fewer data or wells than folds, n < 2, or another value of `by`.
    Cancelled
        If `cancel` returned True.

    Examples
    --------
    >>> from ccwsim import Grid, Parameters, TrainingImage
    >>> from ccwsim.model.study import Study
    >>> stripes = TrainingImage(np.tile([[0], [0], [0], [1], [1], [1]], (16, 96)))
    >>> cells = np.argwhere(np.random.default_rng(0).random((60, 60)) < 0.06)
    >>> p = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
    >>> data = HardData(cells, cells[:, 0] // 3 % 2)
    >>> leave_out(Study(stripes, Grid(60, 60), p, data), n=8).skill > 0.5
    True
    """
    check_int("folds", folds, 2)
    check_int("n", n, 2)
    if by not in ("datum", "well"):
        raise CCWSIMError(f'by = {shown(by)} must be "datum" or "well"')
    data, n_facies = study.hard_data, study.training_image.n_facies
    groups = wells_of(data.cells) if by == "well" else np.arange(data.n)
    units = np.unique(groups)
    if len(units) < folds:
        what = "wells" if by == "well" else "data"
        raise CCWSIMError(
            f"{len(units)} {what} cannot be left out in {folds} parts; give more, or fewer folds"
        )
    fold = (np.random.default_rng(study.seed).permutation(len(units)) % folds)[groups]
    facies = study.facies_of_data.astype(np.int64)
    p, shares = np.empty((data.n, n_facies)), np.empty((data.n, n_facies))
    for k in range(folds):
        out = fold == k
        ensemble = simulate(
            study.training_image,
            study.grid,
            study.parameters,
            HardData(data.cells[~out], data.facies[~out]),
            n,
            (study.seed + k) % 2**31,
            progress=progress and (lambda share, _, k=k: progress((k + share) / folds)),
            cancel=cancel,
        )
        found = ensemble.indices[(slice(None), *data.cells[out].T)]
        p[out] = np.stack([(found == f).mean(axis=0) for f in range(n_facies)], axis=1)
        shares[out] = np.bincount(facies[~out], minlength=n_facies) / (~out).sum()
    return _scored(p, shares, facies, n)


def _scored(
    p: NDArray[np.float64], shares: NDArray[np.float64], facies: NDArray[np.int64], n: int
) -> LeaveOut:
    """Return the scores of probabilities from n realizations, and of the proportions `shares`."""
    observed = np.eye(p.shape[1])[facies]
    chance = p * (1 - p) / (n - 1)  # variance of a probability that n realizations estimate
    brier = ((p - observed) ** 2 - chance).sum(axis=1)
    of_shares = ((shares - observed) ** 2).sum(axis=1)
    right = np.arange(len(p)), facies
    departure = p - shares
    explained = (departure**2 - chance).sum()
    return LeaveOut(
        probability=p,
        skill=float(1 - brier.sum() / max(of_shares.sum(), 1e-12)),
        z=paired_z(of_shares - brier),
        log_score=float(-np.log((p[right] * n + shares[right]).clip(1e-4) / (n + 1)).mean()),
        slope=float((departure * (observed - shares)).sum() / max(explained, 1e-9)),
        reliability=calibration(p.T[:, None], facies[None]),
    )
