"""Comparison of realizations with hard data, and of their probabilities with a reference field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ccwsim.metrics.etype import EType
from ccwsim.metrics.stack import Codes, Images, as_image, as_values, codes_or_places, index_of
from ccwsim.model.arrays import as_floats, check_int, ratio
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.grid import Grid
from ccwsim.model.hard_data import HardData
from ccwsim.model.training_image import TrainingImage


@dataclass(frozen=True, eq=False)
class ReferenceScores:
    """Scores of probabilities against the reference field."""

    accuracy: float
    """Share of the cells whose most likely facies is the facies of the reference field."""
    brier: float
    """Brier score: Σ (p − o)² over facies, averaged over cells, with o = 1 for the true facies and
    0 for others. 0 is perfect, and 2 is the worst value."""
    log_score: float
    """Mean of −ln p of the true facies; 0 is perfect. The probability p from n realizations is
    replaced by (n p + ½) / (n + n_facies / 2), which is never 0."""
    n_cells: int
    """Number of scored cells."""
    right: NDArray[np.bool_]
    """Mask of the cells, scored or not, whose most likely facies is the true facies."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Predicted probabilities of a facies, and observed shares of cells with this facies."""

    edges: NDArray[np.float64]
    """Edges of the bins of probability, shape (n_bins + 1,)."""
    forecast: NDArray[np.float64]
    """Mean probability in each bin, shape (n_bins,); NaN for an empty bin."""
    observed: NDArray[np.float64]
    """Observed share of the facies in each bin's cells, shape (n_bins,); NaN for an empty bin."""
    count: NDArray[np.int64]
    """Number of probabilities in each bin, shape (n_bins,): one for each cell and facies."""
    error: float
    """Expected calibration error: mean of |forecast − observed| over all cells."""


def score_reference(
    probability: EType | ArrayLike,
    truth: TrainingImage | ArrayLike,
    n_realizations: int | None = None,
    scored: NDArray[np.bool_] | None = None,
    codes: Codes | None = None,
) -> ReferenceScores:
    """Score probabilities, such as the result of `etype`, against a reference field.

    Raises `CCWSIMError` for different shapes, no realization, or no scored cell.

    Parameters
    ----------
    probability : EType or array_like, shape (n_facies, ny, nx) or (n_facies, nz, ny, nx)
        Probabilities, whose sum in each cell is 1.
    truth : image
        The reference field.
    n_realizations : int, optional
        Number of realizations; not needed for an `EType`, which contains this number.
    scored : ndarray of bool, shape of `truth`, optional
        Mask of the scored cells; exclude cells with hard data, which every realization honours.
    codes : array_like of int, shape (n_facies,), optional
        Facies codes of an array of probabilities; the default is 0 … n_facies − 1.

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
    scored: NDArray[np.bool_] | None = None,
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
    p, known, true, mask = _checked(probability, truth, scored, codes)
    n_bins = check_int("n_bins", n_bins, 1, 10_000)
    which = range(len(p)) if facies is None else [index_of(known, facies)]
    chances = np.concatenate([p[k][mask] for k in which])
    came = np.concatenate([(true == k)[mask] for k in which])
    edges = np.linspace(0, 1, n_bins + 1)
    bins = np.clip(np.floor(chances * n_bins + 1e-9).astype(int), 0, n_bins - 1)
    count, forecasts, observed = (
        np.bincount(bins, weights=w, minlength=n_bins)
        for w in (np.ones_like(chances), chances, came)
    )
    mean, share = ratio(forecasts, count), ratio(observed, count)
    error = float(np.abs(forecasts - observed).sum() / count.sum())
    return Calibration(edges, mean, share, count.astype(np.int64), error)


def _checked(
    probability: EType | ArrayLike,
    truth: TrainingImage | ArrayLike,
    scored: NDArray[np.bool_] | None,
    codes: Codes | None,
) -> tuple[NDArray[np.float64], NDArray[np.integer], NDArray[np.int64], NDArray[np.bool_]]:
    """Return probabilities, codes, indices of the true facies, and the mask of scored cells."""
    if isinstance(probability, EType):
        p, codes = probability.probability, probability.codes
    else:
        p = as_floats(probability, "probabilities")
    known = codes_or_places(codes, len(p) if p.ndim else 0)
    field = as_image(truth, known, p.ndim - 1)
    if p.shape[1:] != field.shape:
        raise CCWSIMError(
            f"probabilities of shape {p.shape} do not fit a reference field of {field.shape}; "
            "give (n_facies, ny, nx) and (ny, nx), or (n_facies, nz, ny, nx) and (nz, ny, nx)"
        )
    true = field.indices[0].astype(np.int64)
    mask = np.ones(true.shape, bool) if scored is None else np.asarray(scored, dtype=bool)
    if mask.shape != true.shape or not mask.any():
        raise CCWSIMError(f"scored must be a mask of shape {true.shape} with at least one cell")
    return p, known, true, mask


@dataclass(frozen=True, eq=False)
class DataMatch:
    """Hard data that realizations do not honour."""

    wrong: NDArray[np.bool_]
    """Mask of the data that each realization does not honour, shape (n, n_data)."""
    n_wrong: NDArray[np.int64]
    """Number of data that each realization does not honour, shape (n,)."""
    times_wrong: NDArray[np.int64]
    """Number of realizations that do not honour each datum, shape (n_data,)."""
    map: NDArray[np.int64]
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
    if not isinstance(hard_data, HardData):
        raise CCWSIMError(f"hard_data must be of type HardData, not {shown(hard_data)}")
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
