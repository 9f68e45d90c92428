"""Test that charts of several settings show every series with the values of the comparison."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import Parameters, TrainingImage
from ccwsim.experiments.comparison import Comparison, compare
from ccwsim.figures import (
    DARK,
    DASHES,
    LIGHT,
    MARKER_SYMBOLS,
    Bundle,
    Group,
    compared_proportions_chart,
    compared_times_chart,
    curves_chart,
    mds_chart,
    mds_title,
)
from tests.small_images import blobs

NAMES = ("A", "B", "C", "D")


@pytest.fixture(scope="module")
def found() -> Comparison:
    settings = {
        name: Parameters(16, 4, level) for name, level in zip(NAMES, (0, 1, 2, 1), strict=True)
    }
    return compare(TrainingImage(blobs((48, 48), 3)), (40, 44), settings, n_realizations=2)


def series(chart) -> dict:
    return {trace.name: trace for trace in chart.data}


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_no_two_settings_look_alike_and_none_like_the_image(theme):
    colours = theme.settings
    assert len({*colours, theme.reference}) == 5
    assert len(set(DASHES)) == len(set(MARKER_SYMBOLS)) == 4


def test_curves_have_a_median_and_a_band_a_setting(found):
    for curves in found.curves.values():
        none = np.empty((0, 0))
        bundles = {
            name: Bundle(curves.lags, curves.reference, none, band.low, band.median, band.high)
            for name, band in zip(NAMES, curves.bands, strict=True)
        }
        chart = curves_chart(bundles, LIGHT, y_title="y", y_range=(0, 1))
        drawn = series(chart)
        np.testing.assert_array_equal(drawn["training image"].y, curves.reference)
        for name, band in zip(NAMES, curves.bands, strict=True):
            np.testing.assert_array_equal(drawn[name].y, band.median)
            both = np.concatenate([band.high, band.low[::-1]])
            np.testing.assert_array_equal(drawn[f"{name}, 5–95 %"].y, both)
        assert chart.data[-1].name == "training image"


def test_times_are_bars_with_a_dot_a_realization(found):
    each = [1000 * e.cpu_seconds for e in found.ensembles]
    chart = compared_times_chart(
        dict(zip(NAMES, each, strict=True)), 1000 * found.cpu_seconds, NAMES, LIGHT
    )
    np.testing.assert_array_equal(series(chart)["mean"].x, 1000 * found.cpu_seconds)
    np.testing.assert_array_equal(series(chart)["B"].x, each[1])


def test_proportions_are_drawn_as_differences(found):
    image = found.ensembles[0].training_image
    chart = compared_proportions_chart(
        image.facies_names,
        image.proportions,
        dict(zip(NAMES, found.proportions, strict=True)),
        LIGHT,
    )
    for name, shares in zip(NAMES, found.proportions, strict=True):
        own = series(chart)[name]
        np.testing.assert_allclose(own.x, 100 * (shares - image.proportions).ravel())
        np.testing.assert_allclose(own.customdata, 100 * shares.ravel())
        assert len(set(own.y)) == image.n_facies


def test_the_title_of_an_mds_plot_says_its_stress(found):
    assert mds_title(found.scaling.stress) == f"MDS plot: stress {found.scaling.stress:.2f}"


def test_every_realization_has_its_position_in_the_mds_plot(found):
    assert found.anodi is not None
    assert found.scaling is not None
    placed, owner = found.scaling.positions, found.anodi.owner
    groups = [Group(name, placed[owner == k], "#000000", ringed=1) for k, name in enumerate(NAMES)]
    chart = mds_chart(placed[0], groups, LIGHT)
    for k, name in enumerate(NAMES):
        assert chart.data[k].name == name
        own = found.scaling.positions[1 + 2 * k : 3 + 2 * k]
        np.testing.assert_array_equal(np.column_stack([chart.data[k].x, chart.data[k].y]), own)
    np.testing.assert_array_equal(series(chart)["shown"].x, found.scaling.positions[2::2, 0])
