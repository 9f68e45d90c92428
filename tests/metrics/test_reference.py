"""Test the scores against a reference field by plain sums."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ccwsim.metrics import calibration, etype, score_reference
from ccwsim.model.errors import CCWSIMError


def forecast(seed, n=7, n_facies=3):
    rng = np.random.default_rng(seed)
    p = etype(rng.integers(0, n_facies, (n, 6, 5)), range(n_facies)).probability
    return p, rng.integers(0, n_facies, (6, 5)), rng.random((6, 5)) < 0.7


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 10**6))
def test_scores_are_those_of_a_loop(seed):
    p, truth, mask = forecast(seed)
    mask[0, 0] = True
    found = score_reference(p, truth, 7, mask)
    cells = list(zip(*np.nonzero(mask), strict=True))
    brier = np.mean([sum((p[k][c] - (truth[c] == k)) ** 2 for k in range(3)) for c in cells])
    log = np.mean([-np.log((7 * p[truth[c]][c] + 0.5) / 8.5) for c in cells])
    assert found.brier == pytest.approx(brier)
    assert found.log_score == pytest.approx(log)
    assert found.accuracy == pytest.approx(np.mean([p[:, *c].argmax() == truth[c] for c in cells]))
    assert found.n_cells == len(cells)


def test_certain_and_right_is_perfect_and_certain_and_wrong_is_worst():
    truth = np.array([[0, 1], [1, 0]])
    sure = np.stack([truth == 0, truth == 1]).astype(float)
    best, worst = score_reference(sure, truth, 1000), score_reference(sure, 1 - truth, 1000)
    assert (best.accuracy, best.brier) == (1, 0)
    assert (worst.accuracy, worst.brier) == (0, 2)
    assert best.log_score < 1e-3 < worst.log_score < np.inf


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 10**6), facies=st.sampled_from([None, 1]), n_bins=st.integers(1, 7))
def test_calibration_is_that_of_a_loop(seed, facies, n_bins):
    p, truth, _ = forecast(seed)
    found = calibration(p, truth, facies, n_bins)
    bins = [[] for _ in range(n_bins)]
    for k in range(3) if facies is None else [facies]:
        for chance, true in zip(p[k].ravel(), truth.ravel(), strict=True):
            bins[min(int(round(chance * 7) * n_bins // 7), n_bins - 1)].append((chance, true == k))
    error = 0.0
    for b, pairs in enumerate(bins):
        assert found.count[b] == len(pairs)
        if pairs:
            chances, came = np.mean(pairs, axis=0)
            assert found.forecast[b] == pytest.approx(chances)
            assert found.observed[b] == pytest.approx(came)
            error += len(pairs) * abs(chances - came)
    assert found.error == pytest.approx(error / found.count.sum())


def test_honest_probabilities_are_calibrated():
    rng = np.random.default_rng(8)
    one = rng.random((300, 300))
    truth = (rng.random(one.shape) < one).astype(int)
    assert calibration([1 - one, one], truth, 1).error < 0.02
    assert calibration([1 - one**3, one**3], truth, 1).error > 0.1


def test_what_cannot_be_scored_is_said():
    p, truth, _ = forecast(0)
    with pytest.raises(CCWSIMError, match="shape"):
        score_reference(p[0], truth, 7)
    with pytest.raises(CCWSIMError, match="facies code 3 is not one of 0, 1, 2"):
        score_reference(p, np.full((6, 5), 3), 7)
    with pytest.raises(CCWSIMError, match="at least one cell"):
        score_reference(p, truth, 7, np.zeros((6, 5), bool))
    with pytest.raises(CCWSIMError, match="n_realizations"):
        score_reference(p, truth, 0)
    with pytest.raises(CCWSIMError, match="facies = 5 must be one of 0, 1, 2"):
        calibration(p, truth, 5)
    with pytest.raises(CCWSIMError, match="n_bins"):
        calibration(p, truth, n_bins=0)
