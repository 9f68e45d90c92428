"""Test that the figures of *Validate* show their values with the right labels and colours."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim.figures import (
    DARK,
    LIGHT,
    Bundle,
    Group,
    Strip,
    calibration_chart,
    data_status_chart,
    divergence_chart,
    lag_map_chart,
    mds_chart,
    repetition_chart,
    strip_chart,
    transiogram_chart,
)
from ccwsim.figures.style import bytes_of


def named(chart):
    return {trace.name: trace for trace in chart.data}


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_mds_places_every_realization_and_the_image_in_red(theme):
    positions = np.array([[0.0, 1.0], [2.0, 3.0], [-4.0, 5.0]])
    labels = ["realization 8", "realization 9"]
    group = Group("realizations", positions[1:], theme.ink, labels=labels, ringed=1)
    chart = mds_chart(positions[0], [group], theme)
    traces = named(chart)
    assert list(traces["realizations"].x) == [2.0, -4.0]
    assert list(traces["realizations"].text) == ["realization 8", "realization 9"]
    assert (traces["shown"].x[0], traces["shown"].y[0]) == (-4.0, 5.0)
    assert (traces["training image"].x[0], traces["training image"].y[0]) == (0.0, 1.0)
    assert traces["training image"].marker.color == theme.reference
    assert chart.layout.yaxis.scaleanchor == "x"
    low, high = chart.layout.xaxis.range
    assert low < -4
    assert high > 5


def test_mds_without_the_shown_one_draws_no_ring():
    group = Group("realizations", np.zeros((2, 2)), "#000000")
    chart = mds_chart(np.zeros(2), [group], LIGHT)
    assert "shown" not in named(chart)
    assert np.diff(chart.layout.xaxis.range) > 0


@pytest.mark.parametrize(("azimuth", "east", "north"), [(0, 0, 1), (90, 1, 0), (45, 1, 1)])
def test_a_lag_map_has_north_up_and_marks_the_direction(azimuth, east, north):
    lags = np.arange(-2, 3)
    values = np.arange(25.0).reshape(5, 5)
    chart = lag_map_chart(lags, values, LIGHT, name="γ", largest=24.0, azimuth=azimuth)
    heat, line = chart.data
    assert np.array_equal(heat.z, values.astype(np.float32))
    assert list(heat.y) == list(lags)
    assert chart.layout.yaxis.range[1] > chart.layout.yaxis.range[0]
    assert (heat.zmin, heat.zmax) == (0.0, 24.0)
    tip = np.array([line.x[1], line.y[1]])
    assert tip / np.linalg.norm(tip) == pytest.approx(
        np.array([east, north]) / np.hypot(east, north)
    )


def test_a_difference_map_parts_at_zero():
    chart = lag_map_chart(
        np.arange(-1, 2), np.ones((3, 3)), LIGHT, name="γ", largest=0.5, difference=True
    )
    assert (chart.data[0].zmin, chart.data[0].zmax) == (-0.5, 0.5)
    assert len(chart.data) == 1


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_zero_of_a_difference_is_as_the_ground(theme):
    chart = lag_map_chart(
        np.arange(-1, 2), np.ones((3, 3)), theme, name="γ", largest=0.5, difference=True
    )
    zero = chart.data[0].colorscale[1][1]
    assert zero == theme.difference[1]
    ground, at_zero = (np.array(rgb) for rgb in bytes_of([theme.paper, zero]))
    assert abs(at_zero - ground).max() < 32


def test_a_strip_shows_each_realization_and_the_image_as_a_stroke():
    each = np.array([0.2, 0.4, np.nan])
    chart = strip_chart(Strip("Γ", each, 0.9), LIGHT, colour="#123456")
    traces = named(chart)
    assert np.array_equal(traces["realizations"].x, each, equal_nan=True)
    assert traces["realizations"].marker.color == "#123456"
    assert list(traces["training image"].x) == [0.9, 0.9]
    low, high = chart.layout.xaxis.range
    assert 0 <= low < 0.2
    assert high > 0.9
    assert chart.layout.xaxis.title.text == "Γ"


def test_a_strip_of_nothing_known_is_still_a_chart():
    chart = strip_chart(Strip("Γ", np.array([np.nan]), np.nan), LIGHT, colour="#123456")
    assert len(named(chart)["training image"].x) == 0
    assert np.isfinite(chart.layout.xaxis.range).all()


def test_divergences_are_a_row_a_resolution():
    between, within = np.array([0.1, 0.2]), np.array([0.3, 0.4])
    chart = divergence_chart([1, 3], between, within, LIGHT)
    traces = named(chart)
    assert list(traces["between realizations"].x) == [0.1, 0.2]
    assert list(traces["to the training image"].x) == [0.3, 0.4]
    assert traces["to the training image"].marker.color == LIGHT.reference
    assert list(chart.layout.yaxis.ticktext) == ["full resolution", "1 / 3 resolution"]
    assert chart.layout.xaxis.range[1] > 0.4


def test_divergences_of_one_realization_have_no_between():
    chart = divergence_chart([1], np.array([np.nan]), np.array([0.3]), LIGHT)
    assert np.isfinite(chart.layout.xaxis.range).all()


def bundle(value: float) -> Bundle:
    lags = np.arange(5.0)
    each = np.full((2, 5), value)
    return Bundle(lags, each[0], each, each[0], each[0], each[0])


def test_transiograms_have_a_panel_for_each_pair():
    bundles = {(t, h): bundle(0.1 * (2 * t + h)) for t in range(2) for h in range(2)}
    chart = transiogram_chart(bundles, [0, 1], [0, 1], ["mud", "sand"], LIGHT)
    titles = [a.text for a in chart.layout.annotations]
    assert titles == ["mud → mud", "mud → sand", "sand → mud", "sand → sand"]
    traces = named(chart)
    assert traces["sand → mud, training image"].y[0] == pytest.approx(0.2)
    assert traces["sand → mud, training image"].line.color == LIGHT.reference
    axes = {traces[f"{pair}, median"].xaxis for pair in ("mud → mud", "sand → sand")}
    assert len(axes) == 2
    assert chart.layout.yaxis.range[0] == 0
    assert chart.layout.yaxis.range[1] >= 1


def test_calibration_is_in_percent_with_dots_by_number_of_cells():
    chart = calibration_chart(
        np.array([0.1, 0.5]), np.array([0.2, 0.5]), np.array([400, 100]), LIGHT
    )
    dots = named(chart)["realizations"]
    assert list(dots.x) == pytest.approx([10, 50])
    assert list(dots.y) == pytest.approx([20, 50])
    assert dots.marker.size[0] == pytest.approx(2 * dots.marker.size[1])
    assert list(named(chart)["perfect"].x) == [0, 100]
    assert chart.layout.xaxis.title.text == "probability in the realizations (%)"
    empty = np.empty(0, int)
    chart = calibration_chart(empty, empty, empty, LIGHT, guided=True)
    assert chart.layout.xaxis.title.text == "given probability (%)"
    assert chart.layout.yaxis.title.text == "share in the realizations (%)"


def test_data_status_shows_means_and_marks_force():
    shares = np.array([[0.9, 0.1, 0.0], [0.7, 0.2, 0.1]])
    bars = data_status_chart(["raster", "re-simulated, 8 × 8 cells", "forced"], shares, LIGHT).data[
        0
    ]
    assert list(bars.x) == pytest.approx([80, 15, 5])
    assert list(bars.y) == ["raster", "re-simulated, 8 × 8 cells", "forced"]
    assert list(bars.marker.color) == [LIGHT.ink, LIGHT.quiet, LIGHT.reference]


def test_repetition_marks_the_template():
    lags = np.arange(10)
    chart = repetition_chart(lags, np.cos(lags), np.sin(lags), {"T 32": 32}, LIGHT)
    assert list(named(chart)["E–W"].y) == pytest.approx(np.cos(lags))
    assert chart.layout.annotations[0].text == "T 32"
    assert chart.layout.xaxis.range[1] > 32
    assert chart.layout.yaxis.range[0] < np.sin(lags).min()
