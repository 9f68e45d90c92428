"""Test that ticks of logarithmic axes have their whole numbers, in one way of writing."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ccwsim.figures import LIGHT, breakthrough_chart, conductivity_chart
from ccwsim.figures.style import log_axis
from ccwsim.model.numbers import with_power

NUMBER = re.compile(r"\d+(\.\d+)?( × 10⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹]+)?")


@pytest.mark.parametrize(
    ("start", "end", "names"),
    [
        (-7.1, -3.8, ["1 × 10⁻⁷", "1 × 10⁻⁶", "1 × 10⁻⁵", "0.0001"]),
        (-5.1, -3.4, ["1 × 10⁻⁵", "3 × 10⁻⁵", "0.0001", "0.0003"]),
        (0.5, 1.4, ["5", "10", "20"]),
        (-4.6, -4.2, ["3 × 10⁻⁵", "4 × 10⁻⁵", "5 × 10⁻⁵", "6 × 10⁻⁵"]),
        (3.0, 6.0, ["1000", "10000", "100000"]),  # 10⁶ would be cut off
        (3.0, 6.2, ["1000", "10000", "100000", "1 × 10⁶"]),
    ],
)
def test_ticks_have_their_whole_numbers(start, end, names):
    axis = log_axis(start, end)
    assert axis["ticktext"] == names
    assert axis["range"] == [start, end]
    assert np.log10(axis["tickvals"]) == pytest.approx(
        np.clip(np.log10(axis["tickvals"]), start, end)
    )


@pytest.mark.parametrize("span", np.geomspace(0.03, 8, 12))
def test_an_axis_has_some_ticks_but_not_too_many(span):
    for start in np.linspace(-6, 1, 23):
        assert 3 <= len(log_axis(start, start + span)["tickvals"]) <= 10


def test_axes_of_flow_have_no_digits_without_their_powers():
    k = np.geomspace(2e-6, 7e-5, 9)
    bars = conductivity_chart(k, {"image": (3e-5, "#C8321F")}, LIGHT, unit="m/s", height=200)
    times = np.sort(np.random.default_rng(0).lognormal(4, 2, (3, 40)))
    times[:, -3:] = np.inf
    arrived = breakthrough_chart(times, 1, LIGHT, height=200, accent="#000000")
    for chart, values in ((bars, k), (arrived, times[np.isfinite(times)])):
        axis = chart.layout.xaxis
        assert all(NUMBER.fullmatch(text) for text in axis.ticktext)
        low, high = 10.0 ** np.array(axis.range)
        assert low < values.min() <= values.max() < high
    assert bars.data[1].hovertemplate == "image: 3 × 10⁻⁵<extra></extra>"
    assert bars.data[0].hovertext[0] == with_power(bars.data[0].x[0])
    assert arrived.data[1].text[0] == with_power(times[1, 0])


def test_a_chart_without_arrived_particles_can_be_drawn():
    assert breakthrough_chart(np.full((1, 3), np.inf), 0, LIGHT, height=200, accent="#000000")
