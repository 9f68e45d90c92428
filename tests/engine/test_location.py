"""Test that `location_weight` keeps patches near their location in the training image."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from ccwsim import (
    Auxiliary,
    CCWSIMError,
    Grid,
    Parameters,
    Secondary,
    TrainingImage,
    datasets,
    simulate,
)
from ccwsim.engine.prepared_image import steers
from ccwsim.metrics import proportions, unseen_patterns, vertical_proportions
from ccwsim.model.study import Study


def likeness(parameters: Parameters) -> float:
    """Return the correlation of the probability of sand with the image, in 30 × 30 blocks."""
    image = datasets.load("delta")
    ensemble = simulate(image, image.shape, parameters, n_realizations=12)

    def blocks(field):
        return field.reshape(10, 30, 10, 30).mean(axis=(1, 3)).ravel()

    probability = (ensemble.indices == 1).mean(axis=0)
    return float(np.corrcoef(blocks(image.indices == 1.0), blocks(probability))[0, 1])


@pytest.mark.parametrize("method", ["ccwsim", "ms-ccsim"])
def test_a_delta_stays_a_delta(method):
    free = likeness(Parameters(method=method))
    kept = likeness(Parameters(method=method, location_weight=2))
    assert kept > 0.7 > 0.5 > free


def test_a_vertical_trend_is_kept_alone():
    rng = np.random.default_rng(0)
    shares = np.linspace(0.05, 0.9, 24)[:, None, None]  # sand becomes more frequent upwards
    cells = ndimage.gaussian_filter(rng.random((24, 40, 40)), 1.5)
    ranks = cells.reshape(24, -1).argsort(axis=1).argsort(axis=1).reshape(cells.shape) / 1600
    image = TrainingImage((ranks < shares).astype(np.uint8))
    p = Parameters((8, 12, 12), (2, 4, 4), (0, 1, 1))

    def drift(weight: Any) -> float:
        e = simulate(image, (24, 30, 30), replace(p, location_weight=weight), n_realizations=8)
        return float(np.abs(vertical_proportions(e)[:, 1].mean(axis=0) - shares.ravel()).mean())

    assert drift((3, 0, 0)) < 0.5 * drift((0, 3, 3))
    assert drift(3) < 0.7 * drift(0)


@pytest.mark.slow
def test_beds_keep_their_height_their_share_and_fewer_unseen_patterns():
    image = datasets.load("folded_layers")
    p = Parameters((16, 32, 32), (4, 8, 8), (1, 2, 2))
    off = {}
    for weight in (0.0, (0.5, 0.0, 0.0)):
        e = simulate(image, (48, 80, 80), replace(p, location_weight=weight), n_realizations=12)
        layers = vertical_proportions(e).mean(axis=0) - vertical_proportions(image)[0]
        bias = np.abs(proportions(e).mean(axis=0) - image.proportions).max()
        off[weight] = np.array([np.abs(layers).mean(), bias, unseen_patterns(e, image).mean()])
    free, kept = off.values()
    assert kept[0] < 0.7 * free[0]
    assert max(kept[1], free[1]) < 0.02  # both are steered to the proportions of the image
    assert kept[2] < free[2]


def test_a_location_weight_is_an_auxiliary_variable():
    """Test that positions as auxiliary variables lead to the locations of the weight."""
    image, t = datasets.load("delta"), 32
    shape = image.shape

    def places(size: tuple[int, ...], axis: int) -> np.ndarray:
        return (np.indices(size)[axis] - (t - 1) / 2) / (size[axis] - t)

    given = [
        Auxiliary(own, places(shape, axis), float(2 * np.ptp(own) ** 2))
        for axis, own in enumerate(places(image.shape, axis) for axis in (0, 1))
    ]
    found = [
        simulate(image, shape, Parameters(location_weight=weight), None, 12, secondary=secondary)
        for weight, secondary in ((2, None), (0, Secondary(auxiliary=given)), (0, None))
    ]
    weighted, auxiliary, free = (e.probability(1) for e in found)
    alike, other = (np.corrcoef(weighted.ravel(), e.ravel())[0, 1] for e in (auxiliary, free))
    assert alike > 0.5 > 0.3 > other


def test_a_weight_steers_no_proportions_but_one_along_z_does():
    image = datasets.load("folded_layers")
    p = Parameters((16, 32, 32), (4, 8, 8), (1, 2, 2))
    weights = 0.0, (1.0, 0.0, 0.0), 1.0
    studies = [Study(image, Grid.of((20, 60, 70)), replace(p, location_weight=w)) for w in weights]
    assert [steers(study) for study in studies] == [True, True, False]
    assert [study.is_guided for study in studies] == [False, True, True]


def test_an_image_that_is_the_same_everywhere_does_not_change():
    stripes = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
    p = Parameters(16, 4, 1, random_path=False, location_weight=3)
    e = simulate(stripes, (40, 50), p)
    assert (e.realizations[0] == e.realizations[0][:, :1]).all()


def test_a_weight_that_is_not_allowed_is_said():
    with pytest.raises(CCWSIMError, match="location_weight = -1"):
        Parameters(location_weight=-1)
    with pytest.raises(CCWSIMError, match="location_weight along y = 11"):
        Parameters(location_weight=(0, 11, 0))
    with pytest.raises(CCWSIMError, match=r"location_weight = \(2.0, 0.0, 0.0\) .* is a map"):
        Parameters(location_weight=(2, 0, 0)).along((40, 50))
