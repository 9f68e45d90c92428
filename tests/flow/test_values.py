"""Test flow through continuous variables: the value of a cell is K, log K or porosity."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from ccwsim import (
    CCWSIMError,
    Ensemble,
    Parameters,
    Secondary,
    TrainingImage,
    flow,
    io,
    simulate,
)
from ccwsim.flow import FromValues
from ccwsim.sharing.choices import FlowChoice
from ccwsim.ui.flow.solving import flow_settings, model_downloads, solution

HEADS = (2.0, 1.0)


def ensemble_of(variable: str, low: float, high: float) -> Ensemble:
    """Return realizations of a smooth field between two values."""
    field = gaussian_filter(np.random.default_rng(1).normal(size=(120, 130)), 3)
    field = low + (high - low) * (field - field.min()) / np.ptp(field)
    image = TrainingImage.from_array(field, continuous=True, variable=variable)
    return simulate(image, (40, 50), Parameters(16, 4, 1), n_realizations=3)


@cache
def log_k() -> Ensemble:
    return ensemble_of("log K", -7.0, -3.0)


@cache
def porosity() -> Ensemble:
    return ensemble_of("porosity", 0.05, 0.4)


@pytest.mark.parametrize("factor", [1.0, 1 / 86400])
def test_k_is_ten_to_the_power_of_the_value(factor):
    e = log_k()
    rocks = FromValues(logarithmic=True, factor=factor)
    k = factor * 10.0 ** e.values_of()
    assert np.array_equal(e.property(rocks)[:], k)
    effective = flow.effective_k(e, rocks, heads=HEADS)
    each = [flow.darcy(part, e.grid, west_east=HEADS).effective_k for part in k]
    assert np.allclose(effective.each, each, rtol=1e-9)
    assert np.allclose(effective.arithmetic, k.mean(axis=(1, 2)))
    image = factor * 10.0 ** e.training_image.values["log K"]
    of_image = flow.darcy(image, west_east=(1.0, 0.0)).effective_k
    assert effective.image == pytest.approx(of_image)


def test_porosity_by_cell_changes_times_only():
    e = porosity()
    k = dict.fromkeys(e.training_image.facies_names, 1e-4)
    times = flow.travel_times(e, k, FromValues(), n_particles=20)
    constant = flow.travel_times(e, k, 1.0, n_particles=20)
    ratio = times / constant  # in uniform flow, the mean porosity along straight lines
    assert ratio.min() > 0.05
    assert ratio.max() < 0.4
    assert ratio.mean() == pytest.approx(e.values_of().mean(), rel=0.1)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (lambda: flow.effective_k(log_k(), FromValues()), "conductivity by log K from -"),
        (lambda: flow.travel_times(log_k(), FromValues(True), FromValues()), "porosity by log K"),
        (
            lambda: flow.travel_times(porosity(), FromValues(), FromValues(factor=5.0)),
            "porosity by porosity = ",
        ),
        (
            lambda: flow.effective_k(simulate(np.eye(40, dtype=int), (20, 20)), FromValues()),
            "only facies",
        ),
    ],
)
def test_values_that_are_no_conductivity_are_refused(values, message):
    with pytest.raises(CCWSIMError, match=message):
        values()


def test_permeabilities_follow_from_values(tmp_path):
    e = log_k()
    io.write_grdecl(tmp_path / "a.grdecl", e, FromValues(logarithmic=True))
    text = (tmp_path / "a_2.inc").read_text()
    numbers = text.split("PERMX")[1].split("/")[0].split()
    values = [part.split("*") for part in numbers]
    k = np.concatenate([np.full(int(v[0]) if v[1:] else 1, float(v[-1])) for v in values])
    wanted = io.millidarcy(10.0 ** e.values_of()[1])[::-1]  # the first row is in the north
    assert np.allclose(np.sort(k), np.sort(wanted.ravel()), rtol=1e-5)


@pytest.mark.parametrize("values_are", ["classes", "K", "log K", "porosity"])
@pytest.mark.parametrize("unit", ["m/s", "m/d"])
def test_the_page_uses_values_as_chosen(values_are, unit):
    e = log_k() if values_are == "log K" else porosity()
    settings = flow_settings(FlowChoice(values_are=values_are, unit=unit), e)
    assert (values_are in ("K", "log K")) == isinstance(settings.conductivity, FromValues)
    assert (values_are == "porosity") == isinstance(settings.porosity, FromValues)
    solved = solution(e, 1, settings).work(lambda share: None)
    per_second = 86400 if unit == "m/d" else 1
    expected = {"K": e.values_of()[1] / per_second, "log K": 10.0 ** e.values_of()[1] / per_second}
    if values_are in expected:
        whole = flow.darcy(expected[values_are], e.grid, west_east=(1.0, 0.0))
        assert solved.flow.effective_k == pytest.approx(whole.effective_k)
    (title,) = model_downloads(FlowChoice(values_are=values_are, unit=unit), e, 1)
    powers = {"K": f"{e.training_image.variable},", "log K": "10^log K,"}
    assert powers.get(values_are, "K in m/s: below 0.") in title


def test_inactive_cells_conduct_nothing():
    active = np.ones((40, 50), bool)
    active[10:20, 15:30] = False
    image = log_k().training_image
    p, rocks = Parameters(16, 4, 1), FromValues(logarithmic=True)
    e = simulate(image, (40, 50), p, n_realizations=2, secondary=Secondary(active=active))
    k = e.property(rocks)[1]
    assert np.array_equal(np.isnan(k), ~active)
    whole = flow.darcy(k, west_east=HEADS, active=active)
    assert flow.effective_k(e, rocks, heads=HEADS).each[1] == pytest.approx(whole.effective_k)
    times = flow.travel_times(e, rocks, 0.3, n_particles=5)
    assert np.isfinite(times).any()
