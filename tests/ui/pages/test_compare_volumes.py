"""Test the page Compare for volumes: settings by axis, slices, curves along z."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import Grid, HardData, Parameters, datasets, simulate
from ccwsim.experiments.comparison import STATISTICS
from ccwsim.metrics import connectivity
from ccwsim.metrics.bands import band
from ccwsim.report.settings import describe_setting
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.compare.findings import sentences, settings_csv
from ccwsim.ui.compare.settings import (
    TWO_POINT,
    ComparePageState,
    change_setting,
    compared_settings,
    n_per_setting,
    usual_others,
)
from ccwsim.ui.session.state import State
from tests.ui.pages.test_compare_page import launched, settled, state_of
from tests.ui.widgets import charts, csv_rows, html, named, opened, texts

pytestmark = pytest.mark.slow
"""The tests are slow; `test_volume_study` tests a volume on the main pages in the quick tests."""

OWN = Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1))
DATA = HardData([(k, 7, 9) for k in range(12)], [0, 1] * 6)
VOLUME = Choices(
    ImageChoice("sinuous_channels"), DataChoice("placed", placed=DATA), Grid(30, 40, nz=12), OWN
)


@pytest.fixture(scope="module")
def app():
    return launched(VOLUME, n=2)


def test_it_compares_what_is_usual_of_volumes(app):
    assert not texts(app)
    found = state_of(app).page(ComparePageState).run.latest_result
    assert [e.indices.shape for e in found.ensembles] == [(2, 12, 30, 40)] * 3
    own, second, third = compared_settings(state_of(app))
    assert own == OWN
    assert second.method == "ccsim"
    assert third.wavelet_level == (2, 3, 3)
    for sentence in sentences(found):
        assert sentence in html(app)
    assert "All 12 data are honoured by all settings." in html(app)
    assert "grid 40 × 30 × 12" in html(app)
    assert "exact histograms of all 3 × 3 × 3 patterns" in html(app)
    for k, letter in enumerate("ABC"):
        expected = simulate(
            datasets.load("sinuous_channels"),
            VOLUME.grid,
            compared_settings(state_of(app))[k],
            DATA,
            2,
        )
        assert found.ensembles[k].digest == expected.digest, letter


def test_curves_go_along_all_axes(app):
    curves = {f"{statistic}_{way}" for statistic in STATISTICS for way in "ENv"}
    assert charts(app) == curves | {"compared_times", "compared_proportions", "compared_mds"}
    found = state_of(app).page(ComparePageState).run.latest_result
    upright = found.curves[1, "connectivity", "vertical"]
    each = connectivity(found.ensembles[1], 1, "vertical", upright.lags).tau
    np.testing.assert_array_equal(upright.bands[1].mean, band(each, 0.05, 0.95).mean)
    assert "Vertical connectivity" in html(app)


def test_sizes_are_chosen_along_z_by_themselves(app):
    named(app.selectbox, "B_overlap_size_z").set_value(4).run()
    p = compared_settings(state_of(app))[1]
    assert p.overlap_size == (4, 4, 4)
    assert compared_settings(state_of(app))[0] == OWN
    assert "Out of date" in html(app)
    app.button(key="compare").click()
    settled(app.run())
    found = state_of(app).page(ComparePageState).run.latest_result
    assert found.ensembles[1].parameters == p
    assert "overlap 4 × 4 × 4" in html(app)
    rows = csv_rows(settings_csv(found))
    assert [row["overlap_size"] for row in rows][1] == "(4, 4, 4)"


def test_settings_are_said_and_usual_ones_differ():
    shape = datasets.load("sinuous_channels").shape
    thin = Parameters((8, 16, 16), (2, 4, 4), (0, 1, 1))
    assert describe_setting(thin, OWN) == "level 1 × 1 × 0"
    usual = usual_others(OWN, shape)
    assert len({p.digest for p in [OWN, *usual]}) == len(usual) + 1
    state = State(choices=VOLUME)
    assert n_per_setting(state) == 4
    assert n_per_setting(State()) == 12
    change_setting(state, 0, template_size=(16, 16, 16))
    assert state.choices.parameters.template_size == (16, 16, 16)


@pytest.mark.parametrize("beside", [TWO_POINT, ImageChoice("sinuous_channels", flip_ew=True)])
def test_a_volume_has_a_two_point_simulation_or_a_second_image_beside(beside):
    choices = Choices(ImageChoice("sinuous_channels"), DataChoice(), Grid(24, 30, nz=8), OWN)
    state = State(choices=choices)
    state.change_compare(n=2, beside=beside)
    app = settled(opened("compare", state).run())
    assert not texts(app)
    assert ("two-point is not CCWSIM" in html(app)) == (beside == TWO_POINT)
    assert ("E-type of both images" in html(app)) == (beside != TWO_POINT)
