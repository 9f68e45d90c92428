"""Test the numbers that compare settings and methods against their definitions."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from ccwsim import CCWSIMError, HardData, Parameters, TrainingImage, simulate
from ccwsim.metrics import copying, judge
from ccwsim.metrics.connectivity import connected_geobodies
from ccwsim.metrics.quality import differing_share, lags_of
from tests.small_images import blobs, noise

P = Parameters(template_size=8, overlap_size=2, wavelet_level=1, n_candidates=5)


@pytest.fixture(scope="module")
def ensemble():
    image = TrainingImage(blobs((40, 48), 3, seed=1) * 10)
    rng = np.random.default_rng(3)
    cells = np.column_stack(np.divmod(rng.choice(30 * 36, 25, replace=False), 36))
    return simulate(image, (30, 36), P, HardData(cells, rng.choice([0, 10, 20], 25)), 4, seed=2)


def tau_by_hand(image, facies, dy, dx, lags):
    """Return the probability that two cells of the facies are in one geobody, pair by pair."""
    labels = connected_geobodies(image, facies)[0]
    ny, nx = labels.shape
    found = []
    for lag in lags:
        pairs = [
            (labels[i, j], labels[i + lag * dy, j + lag * dx])
            for i in range(ny - lag * dy)
            for j in range(nx - lag * dx)
        ]
        both = [(a, b) for a, b in pairs if a and b]
        found.append(np.mean([a == b for a, b in both]) if both else np.nan)
    return np.array(found)


def patterns_by_hand(image, factor):
    """Return the shares of the 4 × 4 patterns of an image, without coarsening."""
    windows = np.lib.stride_tricks.sliding_window_view(image, (4, 4)).reshape(-1, 16)
    found, counts = np.unique(windows, axis=0, return_counts=True)
    return {tuple(row): n / len(windows) for row, n in zip(found, counts, strict=True)}


def test_patterns_at_full_resolution_are_the_divergence_of_their_shares(ensemble):
    target = patterns_by_hand(ensemble.training_image.indices, 1)
    each = []
    for image in ensemble.indices:
        own = patterns_by_hand(image, 1)
        total = 0.0
        for pattern in target.keys() | own.keys():
            a, b = own.get(pattern, 0.0), target.get(pattern, 0.0)
            total += sum(p * np.log2(2 * p / (a + b)) for p in (a, b) if p) / 2
        each.append(total)
    found = judge(ensemble)
    assert found.pattern_distances[0] == pytest.approx(np.mean(each))
    assert found.pattern_distance == pytest.approx(np.mean(found.pattern_distances))
    assert found.pattern_spread > 0


@pytest.mark.parametrize("facies", [0, 10, 20])
def test_tau_error_is_the_mean_difference_of_mean_curves(ensemble, facies):
    lags = lags_of(ensemble)
    assert list(lags) == list(range(1, 16))
    for found, (dy, dx) in zip(judge(ensemble, facies).tau_errors, ((0, 1), (1, 0)), strict=True):
        each = [tau_by_hand(image, facies, dy, dx, lags) for image in ensemble]
        wanted = tau_by_hand(ensemble.training_image, facies, dy, dx, lags)
        assert found == pytest.approx(np.nanmean(np.abs(np.nanmean(each, axis=0) - wanted)))


def test_the_last_facies_is_judged_where_none_is_chosen(ensemble):
    assert judge(ensemble) == judge(ensemble, 20)
    assert judge(ensemble).facies == 20
    with pytest.raises(CCWSIMError, match="facies = 2 must be one of 0, 10"):
        judge(ensemble, 2)


def test_the_differing_share_is_the_mean_over_pairs(ensemble):
    pairs = combinations(ensemble.indices, 2)
    assert judge(ensemble).differing == pytest.approx(np.mean([(a != b).mean() for a, b in pairs]))
    images = np.array([noise((7, 9), 4, seed) for seed in range(6)])
    by_hand = np.mean([(a != b).mean() for a, b in combinations(images, 2)])
    assert differing_share(images) == pytest.approx(by_hand)


def test_the_worst_proportion_is_signed_and_relative(ensemble):
    shares = np.array([[(one == k).mean() for k in range(3)] for one in ensemble.indices])
    image = ensemble.training_image.indices
    relative = shares / [(image == k).mean() for k in range(3)] - 1
    worst = int(np.argmax(np.abs(relative.mean(axis=0))))
    found = judge(ensemble)
    assert found.proportion_facies == 10 * worst
    assert found.proportion_error == pytest.approx(relative[:, worst].mean())
    assert found.proportion_spread == pytest.approx(relative[:, worst].std(ddof=1))


def test_the_largest_copied_piece_is_known_where_sources_are_kept(ensemble):
    assert np.isnan(judge(ensemble).largest_copied)
    e = simulate(ensemble.training_image, (30, 36), P, None, 3, seed=2, keep_sources=True)
    each = [copying(one, (40, 48)).largest_block for one in e.sources]
    assert judge(e).largest_copied == np.mean(each)
    assert judge(e).copied_spread == pytest.approx(np.std(each, ddof=1))


def test_data_and_time_are_those_of_the_ensemble(ensemble):
    found = judge(ensemble)
    assert found.n == 4
    assert found.n_resimulated == ensemble.n_resimulated.mean()
    assert found.n_forced == ensemble.n_forced.mean()
    assert found.n_mismatched == ensemble.n_mismatched.mean()
    assert found.cpu_seconds == np.median(ensemble.cpu_seconds)


def test_one_realization_has_no_spread_and_no_variety():
    found = judge(simulate(TrainingImage(blobs((40, 40), 2)), (24, 24), P))
    assert np.isnan(found.differing)
    assert np.isnan(found.pattern_spread)
    assert found.tau_error >= 0


def test_a_constant_image_is_met_exactly():
    found = judge(simulate(TrainingImage(np.full((20, 20), 5)), (16, 16), P, n_realizations=2))
    assert found.pattern_distances == (0.0, 0.0, 0.0)
    assert found.tau_error == 0.0
    assert found.differing == 0.0


def test_connection_that_no_lag_shows_is_not_known():
    lonely = np.zeros((24, 24), int)
    lonely[11, 11] = 1
    found = judge(simulate(TrainingImage(lonely), (16, 16), P), facies=1)
    assert np.isnan(found.tau_errors).all()
    assert np.isnan(found.tau_error)
