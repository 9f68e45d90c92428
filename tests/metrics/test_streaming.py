"""Test statistics updated with one realization at a time against those of the whole stack."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim.metrics import (
    RunningCurves,
    RunningStatistics,
    band,
    connectivity,
    etype,
    proportions,
    variogram,
)
from ccwsim.model.errors import CCWSIMError


@pytest.fixture(scope="module")
def stack():
    rng = np.random.default_rng(0)
    shares = rng.dirichlet([5, 3, 2], 25)
    return np.stack([rng.choice([0, 1, 2], (14, 17), p=p) for p in shares])


@pytest.fixture(scope="module")
def running(stack):
    statistics = RunningStatistics((14, 17), range(3), max_lag=6)
    for image in stack:
        statistics.add(image)
    return statistics


def close(found, expected, width):
    """Check that values are equal, and that quantiles differ by at most one bin."""
    for name in ("mean", "smallest", "largest"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name))
    for name in ("low", "median", "high"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), atol=width)


def test_what_is_counted_cell_by_cell_is_exact(stack, running):
    found, expected = running.summary(), etype(stack, range(3))
    assert found.n == 25
    np.testing.assert_array_equal(found.etype.probability, expected.probability)
    np.testing.assert_array_equal(found.etype.most_likely, expected.most_likely)
    np.testing.assert_array_equal(found.etype.entropy, expected.entropy)


def test_bands_of_curves_are_those_of_all_realizations(stack, running):
    found = running.summary(0.2, 0.8)
    close(found.proportions, band(proportions(stack, range(3)), 0.2, 0.8), 1 / 1024)
    assert sorted(found.variograms) == [(k, d) for k in range(3) for d in ("E-W", "N-S")]
    for (facies, direction), own in found.variograms.items():
        gamma = variogram(stack, facies, direction, 6).gamma
        close(own, band(gamma, 0.2, 0.8), 1 / 2048)
        tau = connectivity(stack, facies, direction, 6).tau
        close(found.connectivity[facies, direction], band(tau, 0.2, 0.8), 1 / 1024)


def test_memory_does_not_grow_and_a_summary_does_not_change(stack):
    statistics = RunningStatistics(
        (14, 17), range(3), facies=[2], directions=["NE-SW"], max_lag=500
    )
    before = statistics.nbytes
    statistics.add(stack[0])
    first = statistics.summary()
    kept = first.etype.probability.copy(), first.variograms[2, "NE-SW"].mean.copy()
    for image in stack[1:]:
        statistics.add(image)
    assert statistics.nbytes == before
    assert len(first.lags) == 14
    np.testing.assert_array_equal(first.etype.probability, kept[0])
    np.testing.assert_array_equal(first.variograms[2, "NE-SW"].mean, kept[1])


def test_of_two_facies_one_is_followed(stack):
    statistics = RunningStatistics((14, 17), range(2))
    statistics.add(stack[0] > 0)
    assert {facies for facies, _ in statistics.summary().variograms} == {1}


@pytest.mark.parametrize("n", [1, 2, 3, 10, 101])
@pytest.mark.parametrize("p", [0.0, 0.1, 0.5, 0.75, 1.0])
def test_running_quantiles_are_right_to_one_bin(n, p):
    values = np.random.default_rng(n).beta(2, 5, (n, 3))
    values[0] = [0.0, 1.0, 0.5]
    curves = RunningCurves(3, 0.0, 1.0, n_bins=200)
    for row in values:
        curves.add(row)
    np.testing.assert_allclose(
        curves.band(p, 1.0).low, np.quantile(values, p, axis=0), atol=1 / 200
    )


def test_missing_values_are_passed_over():
    curves = RunningCurves(3, 0.0, 1.0)
    curves.add([0.5, np.nan, np.nan])
    curves.add([0.7, np.nan, 0.2])
    found = curves.band()
    assert found.mean[[0, 2]] == pytest.approx([0.6, 0.2])
    for name in ("mean", "low", "median", "high", "smallest", "largest"):
        assert np.isnan(getattr(found, name)[1])


def test_what_does_not_fit_is_said(stack):
    statistics = RunningStatistics((14, 17), range(3), max_lag=2)
    with pytest.raises(CCWSIMError, match="at least one"):
        statistics.summary()
    with pytest.raises(CCWSIMError, match=r"shape \(14, 17\)"):
        statistics.add(stack[0].T)
    with pytest.raises(CCWSIMError, match="facies code 3 is not one of 0, 1, 2"):
        statistics.add(stack[0] + 1)
    assert statistics.n == 0
    with pytest.raises(CCWSIMError, match="facies = 5 must be one of 0, 1, 2"):
        RunningStatistics((14, 17), range(3), facies=[5])
    curves = RunningCurves(2, 0.0, 1.0)
    with pytest.raises(CCWSIMError, match="is not inside the bins"):
        curves.add([0.5, 1.5])
    with pytest.raises(CCWSIMError, match="2 points"):
        curves.add([0.5])
    with pytest.raises(CCWSIMError, match="low below high"):
        RunningCurves(2, 1.0, 0.0)
    with pytest.raises(CCWSIMError, match="probabilities"):
        curves.band(0.9, 0.1)
