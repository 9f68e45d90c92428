"""Test that two-point simulation reproduces proportions and variograms, but not connectivity."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import CCWSIMError, TrainingImage, datasets
from ccwsim.experiments.two_point import simulate_two_point
from ccwsim.metrics import connectivity, variogram


@pytest.mark.parametrize(
    ("name", "most"), [("channels", 0.03), ("stone_wall", 0.03), ("barchans", 0.1)]
)
def test_proportions_and_variograms_are_those_of_the_image(name, most):
    image = datasets.load(name)
    found = simulate_two_point(image, (300, 300), n_realizations=20)
    np.testing.assert_allclose(found.proportions.mean(axis=0), image.proportions, atol=0.02)
    for code in map(int, image.codes):
        for way in ("E-W", "N-S"):
            own, target = (variogram(i, code, way, lags=50) for i in (found, image))
            off = np.abs(own.gamma.mean(axis=0) - target.gamma[0]) / target.sill[0]
            assert off.mean() < most


def test_channels_break_at_the_same_variogram():
    image = datasets.load("channels")
    found = simulate_two_point(image, (300, 300), n_realizations=4)
    own, target = (connectivity(i, 1, "N-S", lags=20).tau.mean(axis=0)[20] for i in (found, image))
    assert target > 0.95
    assert own < 0.5


def test_a_volume_has_the_image_s_vertical_variogram():
    beds = np.random.default_rng(1).integers(0, 2, (8, 20, 24))
    layers = TrainingImage(np.repeat(beds, 4, axis=0))
    found = simulate_two_point(layers, (24, 30, 30), n_realizations=4)
    assert found.shape == (4, 24, 30, 30)
    own, target = (variogram(i, 1, "vertical", lags=4).gamma for i in (found, layers))
    np.testing.assert_allclose(own.mean(axis=0), target[0], atol=0.03)


def test_realizations_depend_on_seed_and_number_only():
    image = np.random.default_rng(2).choice([3, 5, 9], (32, 32))
    few, many = (simulate_two_point(image, (20, 24), n, seed=7) for n in (2, 4))
    np.testing.assert_array_equal(few.realizations, many.realizations[:2])
    assert set(np.unique(many)) == {3, 5, 9}
    assert not np.array_equal(many[0], simulate_two_point(image, (20, 24))[0])


def test_a_number_of_realizations_below_one_is_an_error():
    with pytest.raises(CCWSIMError, match="n_realizations"):
        simulate_two_point(np.eye(8, dtype=int), (20, 24), 0)


def test_gaps_of_the_image_are_not_a_facies():
    image = datasets.load("channels").array[:160, :160].astype(float)
    image[:60, :70] = np.nan
    gappy = TrainingImage(image)
    found = simulate_two_point(gappy, (160, 160), 24)
    np.testing.assert_allclose(found.proportions.mean(axis=0), gappy.proportions, atol=0.015)


def test_unknown_cells_around_an_image_change_no_proportion():
    image = (np.random.default_rng(0).random((64, 64)) < 0.25).astype(float)
    padded = np.full((64, 128), np.nan)
    padded[:, 30:94] = image
    plain, wide = (simulate_two_point(i, (128, 128), 8) for i in (image, padded))
    np.testing.assert_allclose(
        plain.proportions.mean(axis=0), wide.proportions.mean(axis=0), atol=0.01
    )
