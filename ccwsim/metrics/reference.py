"""Comparison of realizations with hard data, given or left out, and with a reference field."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ccwsim import Grid, HardData, TrainingImage
from ccwsim.metrics.data_fit import MIN_Z, paired_z, smooth_data, well_numbers
from ccwsim.metrics.etype import EType
from ccwsim.metrics.stack import Codes, Images, as_image, as_values, codes_or_places, index_of
from ccwsim.model import (
    UNKNOWN,
    ArrayLike,
    Cancel,
    CCWSIMError,
    Floats,
    Fraction,
    Integers,
    Ints,
    Mask,
    Study,
    Watch,
    as_floats,
    check_int,
    check_type,
    ratio,
    refused,
    shown,
)
from ccwsim.run.simulation import simulate_study


@dataclass(frozen=True, eq=False)
class ReferenceScores:
    """Scores of probabilities against the reference field."""

    accuracy: float
    """Share of the cells whose most likely facies is the facies of the reference field."""
    brier: float
    """Mean over cells of Σ (p − o)², with o = 1 for the true facies; 0 is perfect, 2 the worst."""
    log_score: float
    """Mean of −ln p of the true facies; 0 is perfect. The probability p from n realizations is
    replaced by (n p + ½) / (n + n_facies / 2), which is never 0."""
    n_cells: int
    """Number of scored cells."""
    right: Mask
    """Mask of the cells, scored or not, whose most likely facies is the true facies."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Predicted probabilities of a facies, and observed shares of cells with this facies."""

    edges: Floats
    """Edges of the bins of probability, shape (n_bins + 1,)."""
    forecast: Floats
    """Mean probability in each bin, shape (n_bins,); NaN for an empty bin."""
    observed: Floats
    """Observed share of the facies in each bin's cells, shape (n_bins,); NaN for an empty bin."""
    count: Ints
    """Number of probabilities in each bin, shape (n_bins,): one for each cell and facies."""
    error: float
    """Expected calibration error: mean of |forecast − observed| over all cells."""


def score_reference(
    probability: EType | ArrayLike,
    truth: TrainingImage | ArrayLike,
    n_realizations: int | None = None,
    scored: Mask | None = None,
    codes: Codes | None = None,
) -> ReferenceScores:
    """Score probabilities, such as the result of `etype`, against the reference field `truth`.

    An `EType` contains the number of realizations. `scored` is a mask of the scored cells; exclude
    cells with hard data, which every realization honours. The codes of an array of probabilities
    are 0 … n_facies − 1 by default. Raises `CCWSIMError` for different shapes, no realization, or
    no scored cell.

    Examples
    --------
    >>> scores = score_reference([[[1.0, 0.5]], [[0.0, 0.5]]], [[0, 1]], 4)
    >>> scores.accuracy, scores.brier
    (0.5, 0.25)
    """
    p, codes, true, mask = _checked(probability, truth, scored, codes)
    if isinstance(probability, EType) and n_realizations is None:
        n_realizations = probability.n
    n_realizations = check_int("n_realizations", n_realizations, 1, 2**53)
    chances = np.take_along_axis(p, true[None], axis=0)[0]
    right = p.argmax(axis=0) == true
    squares = (p**2).sum(axis=0) - 2 * chances + 1
    smoothed = (n_realizations * chances + 0.5) / (n_realizations + len(p) / 2)
    return ReferenceScores(
        accuracy=float(right[mask].mean()),
        brier=float(squares[mask].mean()),
        log_score=float(-np.log(smoothed[mask]).mean()),
        n_cells=int(mask.sum()),
        right=right,
    )


def calibration(
    probability: EType | ArrayLike,
    truth: TrainingImage | ArrayLike,
    facies: int | None = None,
    n_bins: int = 10,
    scored: Mask | None = None,
    codes: Codes | None = None,
) -> Calibration:
    """Return the reliability of probabilities in bins of equal width.

    By default, all facies are pooled. The other arguments are explained in `score_reference`.

    Examples
    --------
    >>> table = calibration([[[0.5, 0.5]], [[0.5, 0.5]]], [[0, 1]], facies=1, n_bins=2)
    >>> table.observed, table.count
    (array([nan, 0.5]), array([0, 2]))
    """
    p, all_codes, true, mask = _checked(probability, truth, scored, codes)
    which = range(len(p)) if facies is None else [index_of(all_codes, facies)]
    chances = np.concatenate([p[k][mask] for k in which])
    return pooled_calibration(chances, np.concatenate([(true == k)[mask] for k in which]), n_bins)


def pooled_calibration(chances: Floats, came: Floats | Mask, n_bins: int) -> Calibration:
    """Return the reliability of probabilities `chances`, shape (n,), of events or shares `came`."""
    n_bins = check_int("n_bins", n_bins, 1, 10_000)
    bins = np.clip(np.floor(chances * n_bins + 1e-9).astype(int), 0, n_bins - 1)
    count, forecasts, observed = (
        np.bincount(bins, weights=w, minlength=n_bins)
        for w in (np.ones_like(chances), chances, came)
    )
    mean, share = ratio(forecasts, count), ratio(observed, count)
    error = float(np.abs(forecasts - observed).sum() / count.sum())
    return Calibration(np.linspace(0, 1, n_bins + 1), mean, share, count.astype(np.int64), error)


def _checked(
    probability: EType | ArrayLike,
    truth: TrainingImage | ArrayLike,
    scored: Mask | None,
    codes: Codes | None,
) -> tuple[Floats, Integers, Ints, Mask]:
    """Return probabilities, codes, indices of the true facies, and the mask of scored cells."""
    if isinstance(probability, EType):
        p, codes = probability.probability, probability.codes
    else:
        p = as_floats(probability, "probabilities")
    all_codes = codes_or_places(codes, len(p) if p.ndim else 0)
    field = as_image(truth, all_codes, p.ndim - 1)
    if p.shape[1:] != field.shape:
        raise refused("probabilities_of_reference", given=p.shape, field=field.shape)
    true = field.indices[0].astype(np.int64)
    mask = np.ones(true.shape, bool) if scored is None else np.asarray(scored, dtype=bool)
    scorable = (true != UNKNOWN) & ~np.isnan(p).any(axis=0)  # known and active cells
    if mask.shape != true.shape or not (mask & scorable).any():
        raise CCWSIMError(f"scored must be a mask of shape {true.shape} with at least one cell")
    return p, all_codes, np.where(scorable, true, 0), mask & scorable


@dataclass(frozen=True, eq=False)
class DataMatch:
    """Hard data that realizations do not honour."""

    wrong: Mask
    """Mask of the data that each realization does not honour, shape (n, n_data)."""
    n_wrong: Ints
    """Number of data that each realization does not honour, shape (n,)."""
    times_wrong: Ints
    """Number of realizations that do not honour each datum, shape (n_data,)."""
    map: Ints
    """Map (or volume) of `times_wrong`, with −1 in cells without data."""


def data_match(realizations: Images, hard_data: HardData) -> DataMatch:
    """Compare realizations with the hard data, cell by cell at full resolution.

    An array of shape (nz, ny, nx) is one volume if the data have layers. Raises `CCWSIMError` if a
    datum is outside the realizations, and if only the data or only the realizations have layers.

    Examples
    --------
    >>> match = data_match([[0, 1], [1, 1]], HardData([[0, 0], [1, 1]], [1, 1]))
    >>> match.n_wrong, match.map.tolist()
    (array([1]), [[1, -1], [-1, 0]])
    """
    check_type("hard_data", hard_data, HardData)
    cells = hard_data.cells
    stack = as_values(realizations, hard_data.n_dimensions)
    shape = stack.shape[1:]
    hard_data.check(Grid.of(shape))
    if not len(cells):
        cells = np.empty((0, len(shape)), np.int64)
    wrong = stack[:, *cells.T] != hard_data.facies
    times = np.count_nonzero(wrong, axis=0)
    where = np.full(shape, -1)
    where[tuple(cells.T)] = times
    return DataMatch(wrong, np.count_nonzero(wrong, axis=1), times, where)


TOO_SURE = 0.5  # slope of observed on predicted probabilities, below which they are too sure
MIN_SLOPE_DATA = 200  # minimum number of data for a verdict on the slope


@dataclass(frozen=True, eq=False)
class LeaveOut:
    """Result of `leave_out`; all scores are means over data."""

    probability: Floats
    """Probability of each facies at each datum when it was left out, shape (n, n_facies)."""
    skill: float
    """1 − Brier score / Brier score of the proportions of the other data. The Brier score is the
    score that infinitely many realizations would have. 1 is perfect, 0 is no better than the
    proportions."""
    z: float
    """Difference of these two Brier scores in standard errors; positive if simulation is better."""
    smoothing: float
    """Skill of smoothing the other data, without an image."""
    z_smoothing: float
    """Difference of the Brier scores of smoothing and simulation in standard errors."""
    log_score: float
    """Mean −ln P of the datum's facies, where the proportions count as one more realization."""
    slope: float
    """Slope of observed on predicted departures from the proportions: 1, or less if too sure."""
    reliability: Calibration
    """Predicted probabilities and observed shares in bins."""

    @property
    def words(self) -> str:
        """The verdict: the skill, that of smoothing, and whether probabilities are too sure."""
        if len(self.probability) < MIN_SLOPE_DATA:
            return "Too few data to judge the probabilities"
        if self.z < MIN_Z:
            return "Simulation predicts no better than proportions"
        skill = f"Explains {self.skill:.2f} of the uncertainty, smoothing {self.smoothing:.2f}"
        if self.z_smoothing < MIN_Z:
            return f"{skill}: no gain from this image"
        return f"{skill}{'; probabilities are too sure' if self.slope < TOO_SURE else ''}"


def leave_out(
    study: Study,
    folds: int = 5,
    n: int = 24,
    by: Literal["datum", "well"] = "datum",
    progress: Fraction | None = None,
    cancel: Cancel | None = None,
) -> LeaveOut:
    """Simulate without a fifth of the hard data, and compare the probabilities with these data.

    Each of the `folds` parts is left out once, and `n` realizations are simulated. `by` "well"
    leaves out whole vertical wells of a volume, "datum" single data. Raises `CCWSIMError` for fewer
    data or wells than folds, n < 2, or another value of `by`.

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
    groups = well_numbers(data.cells) if by == "well" else np.arange(data.n)
    units = np.unique(groups)
    if len(units) < folds:
        what = "wells" if by == "well" else "data"
        raise refused("too_few_to_leave_out", n=len(units), what=what, folds=folds)
    fold = (np.random.default_rng(study.seed).permutation(len(units)) % folds)[groups]
    facies = study.facies_of_data.astype(np.int64)
    p, shares = np.empty((data.n, n_facies)), np.empty((data.n, n_facies))
    watch = Watch.of_share(progress)
    for k in range(folds):
        out, part = fold == k, watch.part(k / folds, (k + 1) / folds)
        used = data.part(~out)
        without = replace(study, hard_data=used, seed=(study.seed + k) % 2**31)
        ensemble = simulate_study(without, n, progress=part.progress, cancel=cancel)
        predicted = ensemble.indices[(slice(None), *data.cells[out].T)]
        p[out] = np.stack([(predicted == f).mean(axis=0) for f in range(n_facies)], axis=1)
        shares[out] = np.bincount(facies[~out], minlength=n_facies) / (~out).sum()
    return _scored(p, shares, smooth_data(data.cells, facies, n_facies), facies, n)


def _scored(p: Floats, shares: Floats, smoothed: Floats, facies: Ints, n: int) -> LeaveOut:
    """Return the scores of probabilities from n realizations, of proportions, and of smoothing."""
    observed = np.eye(p.shape[1])[facies]
    chance = p * (1 - p) / (n - 1)  # variance of a probability that n realizations estimate
    brier = ((p - observed) ** 2 - chance).sum(axis=1)
    of_shares, of_smoothing = (((q - observed) ** 2).sum(axis=1) for q in (shares, smoothed))
    right = np.arange(len(p)), facies
    departure = p - shares
    explained = (departure**2 - chance).sum()
    return LeaveOut(
        probability=p,
        skill=float(1 - brier.sum() / max(of_shares.sum(), 1e-12)),
        z=paired_z(of_shares - brier),
        smoothing=float(1 - of_smoothing.sum() / max(of_shares.sum(), 1e-12)),
        z_smoothing=paired_z(of_smoothing - brier),
        log_score=float(-np.log((p[right] * n + shares[right]).clip(1e-4) / (n + 1)).mean()),
        slope=float((departure * (observed - shares)).sum() / max(explained, 1e-9)),
        reliability=calibration(p.T[:, None], facies[None]),
    )
