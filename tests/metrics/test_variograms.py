"""Test variograms and transiograms against GSTools, plain loops and each other."""

from __future__ import annotations

import itertools
from functools import partial

import gstools
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ccwsim import Parameters, simulate
from ccwsim.metrics import (
    band,
    connectivity,
    transiograms,
    variogram,
    variogram_map,
    variogram_of_values,
)
from ccwsim.metrics.lags import lags_within
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.training_image import TrainingImage

images = st.builds(
    lambda seed, ny, nx, p: np.random.default_rng(seed).choice([0, 1, 2], (ny, nx), p=p),
    st.integers(0, 10**6),
    st.integers(6, 14),
    st.integers(6, 14),
    st.sampled_from([[0.2, 0.5, 0.3], [0.9, 0.1, 0.0]]),
).filter(lambda image: (image == 1).any())


def pairs(image, dy, dx):
    """Return all pairs (value at x, value at x + h), one by one."""
    ny, nx = image.shape
    return [
        (image[i, j], image[i + dy, j + dx])
        for i in range(ny)
        for j in range(nx)
        if 0 <= i + dy < ny and 0 <= j + dx < nx
    ]


def test_axes_agree_with_gstools():
    image = np.random.default_rng(0).integers(0, 3, (30, 41))
    field = (image == 1).astype(float)
    for direction, axis in (("N-S", "x"), ("E-W", "y")):
        theirs = gstools.vario_estimate_axis(field, axis)
        ours = variogram(image, 1, direction, len(theirs) - 1).gamma[0]
        np.testing.assert_allclose(ours, theirs, atol=1e-12)


@settings(deadline=None, max_examples=20)
@given(image=images, step=st.sampled_from([(0, 1), (1, 0), (1, 1), (1, -1), (-1, 1), (-2, -1)]))
def test_variogram_is_that_of_all_pairs(image, step):
    lags = [0, 1, 2]
    found = variogram(image, 1, step, lags)
    for lag, gamma in zip(lags, found.gamma[0], strict=True):
        inside = np.array(pairs(image, lag * step[0], lag * step[1])) == 1
        assert gamma == pytest.approx(np.mean(inside[:, 0] != inside[:, 1]) / 2)
    p = np.mean(image == 1)
    assert found.sill[0] == pytest.approx(p * (1 - p))


@settings(deadline=None, max_examples=20)
@given(image=images, max_lag=st.integers(1, 5))
def test_map_by_fft_is_exact_and_symmetric(image, max_lag):
    found = variogram_map(image, 1, max_lag)
    gamma = found.gamma[0]
    np.testing.assert_array_equal(gamma, gamma[::-1, ::-1])
    for row, dy in enumerate(found.lags):
        for column, dx in enumerate(found.lags):
            inside = np.array(pairs(image, dy, dx)) == 1
            expected = np.mean(inside[:, 0] != inside[:, 1]) / 2
            assert gamma[row, column] == pytest.approx(expected, abs=1e-15)


@settings(deadline=None, max_examples=20)
@given(image=images, direction=st.sampled_from(["E-W", "N-S", "NW-SE"]))
def test_transiograms_are_those_of_all_pairs(image, direction):
    step = {"E-W": (0, 1), "N-S": (1, 0), "NW-SE": (1, -1)}[direction]
    found = transiograms(image, range(3), direction, 4).probability[0]
    for lag in range(5):
        both = pairs(image, lag * step[0], lag * step[1])
        for tail in range(3):
            heads = [b for a, b in both if a == tail]
            for head in range(3):
                expected = heads.count(head) / len(heads) if heads else np.nan
                assert found[tail, head, lag] == pytest.approx(expected, nan_ok=True)


def test_transition_probabilities_sum_to_one():
    image = np.random.default_rng(3).integers(0, 4, (20, 20))
    np.testing.assert_allclose(transiograms(image, lags=10).probability.sum(axis=2), 1)


def test_a_stack_has_one_row_an_image():
    stack = np.random.default_rng(4).integers(0, 2, (3, 12, 13))
    assert variogram(stack, 1, lags=5).gamma.shape == (3, 6)
    assert variogram_map(stack, 1, 5).gamma.shape == (3, 11, 11)
    assert transiograms(stack, lags=5).probability.shape == (3, 2, 2, 6)
    alone = variogram(stack[1], 1, "N-S", 5).gamma[0]
    np.testing.assert_array_equal(variogram(stack, 1, "N-S", 5).gamma[1], alone)


def test_bands_hold_the_quantiles_and_pass_over_what_is_missing():
    curves = np.random.default_rng(5).random((40, 7))
    curves[:, 3] = np.nan
    curves[0, 1] = np.nan
    found = band(curves, 0.25, 0.75)
    assert np.isnan(found.mean[3])
    assert found.mean[1] == pytest.approx(curves[1:, 1].mean())
    np.testing.assert_allclose(found.high[0], np.quantile(curves[:, 0], 0.75))
    order = [found.smallest, found.low, found.median, found.high, found.largest]
    assert all((b >= a)[~np.isnan(a)].all() for a, b in itertools.pairwise(order))
    with pytest.raises(CCWSIMError, match="ascending"):
        band(curves, 0.9, 0.1)
    with pytest.raises(CCWSIMError, match="curves"):
        band([1.0, 2.0])


@pytest.mark.parametrize(
    ("shape", "direction", "longest"),
    [
        ((60, 80), "E-W", 79),
        ((60, 80), "N-S", 59),
        ((60, 80), (2, 3), 26),
        ((60, 80), 45.0, 84),
        ((150, 150), "E-W", 100),
        ((4, 60, 80), "vertical", 3),
        ((1, 60, 80), "vertical", 0),
    ],
)
def test_default_lags_fit_the_image_and_given_lags_are_not_clipped(shape, direction, longest):
    image = TrainingImage(np.random.default_rng(0).integers(0, 2, shape))
    for function in (partial(variogram, facies=1), partial(connectivity, facies=1), transiograms):
        found = function(image, direction=direction)
        assert found.lags.tolist() == list(range(longest + 1))
        assert np.isfinite(getattr(found, "gamma", 0)).all()
        if longest < 100:
            with pytest.raises(CCWSIMError, match="does not fit"):
                function(image, direction=direction, lags=longest + 1)


def test_default_lags_of_maps_fit_the_image():
    small, large = np.eye(20, dtype=int), np.eye(60, dtype=int)
    assert variogram_map(small, 1).lags[-1] == 19
    assert variogram_map(large, 1).lags[-1] == 50
    with pytest.raises(CCWSIMError, match="max_lag = 50"):
        variogram_map(small, 1, 50)
    with pytest.raises(CCWSIMError, match="max_lag"):
        variogram_map(np.eye(1, dtype=int), 1)


def test_lags_that_do_not_fit_are_said():
    with pytest.raises(CCWSIMError, match="max_lag = 6"):
        variogram_map(np.eye(6, dtype=int), 1, 6)
    with pytest.raises(CCWSIMError, match="not both 0"):
        variogram(np.eye(6, dtype=int), 1, (0, 0), 2)
    with pytest.raises(CCWSIMError, match="does not fit"):
        transiograms(np.eye(6, dtype=int), None, "N-S", 6)


def test_default_lags_fit_the_image():
    assert lags_within((60, 80), "E-W", None)[0].max() == 79
    assert lags_within((5, 60, 80), "vertical", None)[0].tolist() == [0, 1, 2, 3, 4]


OF_VALUES = Parameters(16, 4, 1)
STEPS_OF_VALUES = [("E-W", (0, 1)), ("N-S", (1, 0)), ((2, 1), (2, 1))]


def values_with(gaps: bool) -> np.ndarray:
    values = np.random.default_rng(2).normal(size=(23, 31)).cumsum(axis=1)
    if gaps:
        values[4:9, 3:20] = np.nan
    return values


@pytest.mark.parametrize("gaps", [False, True])
@pytest.mark.parametrize(
    ("direction", "step"), [("E-W", (0, 1)), ("N-S", (1, 0)), ((2, 1), (2, 1))]
)
def test_the_variogram_of_values_is_half_the_mean_square_of_differences(gaps, direction, step):
    values = values_with(gaps)
    image = TrainingImage.from_array(values, continuous=True)
    found = variogram_of_values(image, direction, 6)
    for lag, gamma in zip(found.lags.tolist(), found.gamma[0], strict=True):
        down, right = step[0] * lag, step[1] * lag
        head = values[down:, right:]
        tail = values[: len(values) - down, : values.shape[1] - right]
        np.testing.assert_allclose(gamma, np.nanmean((head - tail) ** 2) / 2, rtol=1e-12)
    np.testing.assert_allclose(found.sill, np.nanvar(values))


def test_the_variogram_of_values_of_zeros_and_ones_is_the_variogram_of_the_indicator():
    values = (values_with(False) > 0).astype(float)
    image = TrainingImage.from_array(values, continuous=True)
    np.testing.assert_allclose(variogram_of_values(image).gamma, variogram(image, 1).gamma)


def test_each_realization_of_values_has_its_variogram():
    image = TrainingImage.from_array(np.tile(values_with(False), (3, 2)), continuous=True)
    e = simulate(image, (40, 40), OF_VALUES, n_realizations=3)
    found = variogram_of_values(e, "N-S", 8)
    for k in range(3):
        one = TrainingImage.from_array(e.values_of()[k], continuous=True)
        np.testing.assert_allclose(found.gamma[k], variogram_of_values(one, "N-S", 8).gamma[0])


def test_facies_have_no_variogram_of_values():
    with pytest.raises(CCWSIMError, match="only facies"):
        variogram_of_values(TrainingImage(np.eye(4, dtype=int)))
    with pytest.raises(CCWSIMError, match="only facies"):
        variogram_of_values(np.eye(4))
