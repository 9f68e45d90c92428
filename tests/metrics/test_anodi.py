"""Test ANODI and its MDS plot against plain loops over pairs and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.distance import pdist, squareform

from ccwsim.metrics import (
    anodi,
    classical_scaling,
    js_divergence,
    metric_scaling,
    pattern_distance,
    pyramid_histograms,
)
from ccwsim.model.errors import CCWSIMError


@pytest.fixture(scope="module")
def images():
    """Return an image of stripes, realizations with few wrong cells, and with many wrong cells."""
    rng = np.random.default_rng(0)
    ti = np.tile((np.arange(48) // 4 % 2), (48, 1))
    noise = rng.random((10, 48, 48)) < np.repeat([0.02, 0.2], 5)[:, None, None]
    all_ = np.stack([np.roll(ti, k, axis=1) for k in range(10)]) ^ noise
    return ti, all_[:5].astype(int), all_[5:].astype(int)


def test_between_and_within_are_means_of_pairs(images):
    ti, near, far = images
    found = anodi({"near": near, "far": far}, ti, factors=(1, 2))
    for k, stack in enumerate((near, far)):
        rows = pyramid_histograms(stack, factors=(1, 2))
        for g in range(2):
            pairs = [
                js_divergence(rows[i][g], rows[j][g]) for i in range(5) for j in range(i + 1, 5)
            ]
            assert found.between[k, g] == pytest.approx(np.mean(pairs))
        within = pattern_distance(stack, ti, factors=(1, 2)).mean(axis=0)
        np.testing.assert_allclose(found.within[k], within)
    np.testing.assert_allclose(found.ratio, found.between / found.within)


def test_the_divergence_matrix_starts_with_the_training_image(images):
    ti, near, far = images
    found = anodi({"near": near, "far": far}, ti)
    assert found.divergence.shape == (3, 11, 11)
    assert found.owner.tolist() == [-1] + [0] * 5 + [1] * 5
    np.testing.assert_array_equal(found.divergence, found.divergence.transpose(0, 2, 1))
    assert (np.diagonal(found.divergence, axis1=1, axis2=2) == 0).all()


def test_the_better_ensemble_has_the_larger_ratio(images):
    ti, near, far = images
    found = anodi({"near": near, "far": far}, ti, weights=[1, 1, 2])
    between, within, ratio = found.relative("near", "far")
    assert found.weights.tolist() == [0.25, 0.25, 0.5]
    assert within == pytest.approx(found.weights @ (found.within[0] / found.within[1]))
    assert between == pytest.approx(found.weights @ (found.between[0] / found.between[1]))
    assert ratio == pytest.approx(found.weights @ (found.ratio[0] / found.ratio[1]))
    assert within < 1
    assert found.relative("far", "far") == pytest.approx((1, 1, 1))


def test_errors_of_ratios_are_those_of_leaving_each_realization_out(images):
    ti, near, far = images
    found = anodi({"near": near, "far": far}, ti)
    variance = np.zeros(3)
    for left in (0, 1):
        logs = []
        for k in range(5):
            stacks = [np.delete(s, k, 0) if j == left else s for j, s in enumerate((near, far))]
            without = anodi(dict(zip(("near", "far"), stacks, strict=True)), ti)
            logs.append(np.log(without.relative("near", "far")))
        variance += 4 / 5 * ((logs - np.mean(logs, axis=0)) ** 2).sum(axis=0)
    errors = found.relative_errors("near", "far")
    np.testing.assert_allclose(errors, np.sqrt(variance))
    assert found.relative_errors("near", "near") == (0, 0, 0)
    assert np.isnan(anodi({"a": near[:2], "b": far}, ti).relative_errors("a", "b")).all()


def test_one_ratio_of_an_ensemble_is_weighted_as_that_of_two(images):
    ti, near, far = images
    found = anodi({"near": near, "far": far}, ti)
    by_hand = [found.weights @ (found.between[k] / found.within[k]) for k in range(2)]
    np.testing.assert_allclose(found.mean_ratio, by_hand)


def test_weights_halve_from_level_to_level(images):
    ti, near, _ = images
    np.testing.assert_allclose(anodi(near, ti).weights, np.array([4, 2, 1]) / 7)


def test_progress_grows_to_one(images):
    ti, near, far = images
    shares = []
    anodi({"near": near, "far": far}, ti, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1)


def test_facies_may_be_renumbered():
    rng = np.random.default_rng(4)
    ti, stack = rng.integers(0, 3, (20, 20)), rng.integers(0, 3, (3, 20, 20))
    order = np.array([2, 0, 1])
    one = anodi(stack, ti, factors=[1])
    other = anodi(order[stack], order[ti], factors=[1])
    np.testing.assert_allclose(one.divergence, other.divergence)


def test_one_realization_has_no_pairs(images):
    ti, near, _ = images
    found = anodi(near[0], ti)
    assert np.isnan(found.between).all()
    np.testing.assert_allclose(found.within, pattern_distance(near[0], ti))


def test_positions_keep_distances_of_the_plane():
    points = np.random.default_rng(1).random((12, 2)) * [5, 1]
    found = classical_scaling(squareform(pdist(points)))
    np.testing.assert_allclose(pdist(found.positions), pdist(points), atol=1e-9)
    assert found.stress == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(found.positions.mean(axis=0), 0, atol=1e-9)


def test_metric_scaling_has_less_stress_than_its_start_and_than_other_starts():
    rng = np.random.default_rng(2)
    d = squareform(pdist(rng.random((30, 8))))
    start, found = classical_scaling(d), metric_scaling(d)
    assert found.stress < 0.97 * start.stress
    e = pdist(found.positions)
    b = (squareform(d) * e).sum() / (e**2).sum()
    by_hand = np.sqrt(((squareform(d) - b * e) ** 2).sum() / (squareform(d) ** 2).sum())
    assert found.stress == pytest.approx(by_hand)

    def stress(x):
        return ((pdist(x.reshape(30, 2)) - squareform(d)) ** 2).sum()

    best = min(minimize(stress, rng.random(60)).fun for _ in range(3))
    assert stress(found.positions.ravel()) < 1.15 * best
    spread = found.positions.std(axis=0)
    assert spread[0] > spread[1]


def test_all_dimensions_give_back_the_root_of_the_divergence(images):
    """Test distances in all dimensions: the root of a Jensen–Shannon divergence is a metric."""
    ti, near, far = images
    found = anodi({"near": near, "far": far}, ti)
    mixed = np.tensordot(found.weights, found.divergence, axes=1)
    np.testing.assert_allclose(pdist(found.scaling(11).positions) ** 2, squareform(mixed))
    spread = found.scaling().positions
    to_ti = np.linalg.norm(spread - spread[0], axis=1)
    assert to_ti[found.owner == 0].mean() < to_ti[found.owner == 1].mean()


def test_few_points_leave_dimensions_at_zero():
    found = classical_scaling(np.zeros((1, 1)))
    assert found.positions.tolist() == [[0, 0]]


def test_what_does_not_fit_is_said(images):
    ti, near, _ = images
    with pytest.raises(CCWSIMError, match="weights"):
        anodi(near, ti, weights=[1, 1])
    with pytest.raises(CCWSIMError, match="at least one ensemble"):
        anodi({}, ti)
    with pytest.raises(CCWSIMError, match="not one of realizations"):
        anodi(near, ti).relative("other", "realizations")
    with pytest.raises(CCWSIMError, match="symmetric"):
        classical_scaling(np.arange(4.0).reshape(2, 2))
