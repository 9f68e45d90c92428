"""Test the advised parameters and the stationarity of volumes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from ccwsim import Parameters, TrainingImage
from ccwsim.metrics import (
    diagnose,
    feature_spacing,
    granulometry,
    stationarity,
    templates_that_fit,
)
from ccwsim.metrics.diagnosis import advise_along_z
from tests.metrics.volumes import a_volume


def lenses(nz=40, side=96, height=4, length=12, seed=1):
    """Return flat boxes at random positions."""
    rng = np.random.default_rng(seed)
    volume = np.zeros((nz, side, side), int)
    for _ in range(nz * side * side // (3 * height * length**2)):
        z, y, x = rng.integers(0, np.array(volume.shape) - (height, length, length) + 1)
        volume[z : z + height, y : y + length, x : x + length] = 1
    return volume


@pytest.mark.parametrize("extend", [False, True])
@pytest.mark.parametrize("vertical", [False, True])
def test_granulometry_opens_as_scipy_does(extend, vertical):
    volume = a_volume(2, (9, 14, 15), smooth=1.2)
    found = granulometry(volume, 1, extend=extend, vertical=vertical)
    for size, kept in zip(found.sizes, found.kept, strict=True):
        box = np.ones((size, 1, 1) if vertical else (1, size, size))
        edge = size if extend else 0
        padded = np.pad(volume == 1, edge, mode="edge") if extend else volume == 1
        opened = ndimage.binary_opening(padded, box)
        inner = tuple(slice(edge, n - edge) for n in opened.shape)
        assert kept == pytest.approx(opened[inner].sum() / (volume == 1).sum())


def test_spacing_along_z_is_that_of_the_layers():
    beds = np.tile((np.arange(60) // 5 % 2)[:, None, None], (1, 20, 24))
    found = feature_spacing(beds, direction="vertical")
    assert (found.range, found.spacing, len(found.lags)) == (3, 10, 30)
    assert len(feature_spacing(beds).lags) == 10


def test_advice_of_a_volume_is_along_each_axis_and_fits_together():
    found = diagnose(TrainingImage(lenses()))
    level, template, overlap = (
        found.advised(name) for name in ("wavelet_level", "template_size", "overlap_size")
    )
    assert len(level) == len(template) == len(overlap) == 3
    assert level[0] < level[1] == level[2]
    assert template[0] < template[1] == template[2]
    for unit, size, width in zip(level, template, overlap, strict=True):
        assert size % 2**unit == width % 2**unit == 0
        assert 0 < width <= size // 2
    assert found.vertical_thickness[1] == 4
    assert found.thickness[1] == 12
    assert found.n_templates == templates_that_fit((40, 96, 96), template)
    assert all("Along z" in each.reason for each in found.advice)
    assert not any("trend" in warning for warning in found.warnings)


@pytest.mark.parametrize("thinnest", [1, 2, 5, 40])
@pytest.mark.parametrize("thick", [1, 7])
def test_advice_along_z_is_one_that_parameters_take(thinnest, thick):
    volume = np.tile((np.arange(64) // thick % 2)[:, None, None], (1, 8, 8))
    for image in (volume, np.zeros((2, 8, 8), int)):
        spacing = feature_spacing(image, direction="vertical")
        for n_layers in [*range(1, 70), 3000]:
            (level, template, overlap), why = advise_along_z(2, thinnest, spacing, n_layers)
            assert why
            assert 0 <= level <= 1
            assert 1 <= template <= min(n_layers, 1024)
            assert template % 2**level == overlap % 2**level == 0
            assert overlap <= template // 2
            assert overlap > 0 or template < 4


def test_few_layers_give_templates_of_all_of_them():
    found = diagnose(lenses(nz=6, height=2))
    assert found.advised("template_size")[0] == 6
    assert found.advised("wavelet_level")[0] == 0
    one = diagnose(TrainingImage(lenses(nz=6)[:1]))
    assert (one.advised("template_size")[0], one.advised("overlap_size")[0]) == (1, 0)
    as_map = diagnose(lenses(nz=6)[0])
    assert as_map.advised("template_size") == one.advised("template_size")[1]
    assert as_map.vertical_spacing is None


def test_a_vertical_trend_is_found_and_chance_is_not():
    assert not any(stationarity(lenses(seed=seed)).vertical_trend.any() for seed in range(4))
    rng = np.random.default_rng(1)
    share = np.linspace(0.2, 0.8, 30)[:, None, None]
    trend = ndimage.median_filter((rng.random((30, 40, 44)) < share).astype(int), (1, 3, 3))
    found = stationarity(trend)
    assert found.vertical_trend.all()
    assert not found.stationary
    upper, lower = trend[15:].mean(), trend[:15].mean()
    assert found.vertical_differences[1] == pytest.approx((upper - lower) / 2)
    advised = diagnose(trend)
    assert any("In the upper half of the layers" in warning for warning in advised.warnings)
    assert advised.advised("location_weight") == (0.5, 0, 0)
    Parameters(**{a.parameter: a.value for a in advised.advice}).along((40, 50, 60))
    few, even = diagnose(trend[::4]), diagnose(lenses())  # templates with all layers keep the trend
    for found in (few, even):
        assert "location_weight" not in [a.parameter for a in found.advice]
    assert few.stationarity.vertical_trend.all()
    assert stationarity(trend[0]).vertical_differences is None


def test_quarters_of_a_volume_have_all_layers():
    volume = a_volume(3, (5, 40, 40), smooth=1.0)
    found = stationarity(volume)
    shares = [volume[:, r : r + 20, c : c + 20].mean() for r in (0, 20) for c in (0, 20)]
    np.testing.assert_allclose(found.proportions[:, 1], shares)
    assert found.stationary
    volume[:, :, 20:] = 1
    assert stationarity(volume).drifting.any()
    flat = a_volume(4, (40, 44), smooth=1.5)
    one, other = stationarity(TrainingImage(flat[None])), stationarity(flat)
    np.testing.assert_array_equal(one.errors, other.errors)
    np.testing.assert_array_equal(one.variogram_scores, other.variogram_scores)
