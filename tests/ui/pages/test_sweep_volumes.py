"""Test the page Sweep for volumes: ranges along z, slices of a setting, its numbers."""

from __future__ import annotations

import pytest

from ccwsim import CCWSIMError, Grid, HardData, Parameters, simulate
from ccwsim.datasets import load
from ccwsim.experiments.plan import label, plan_sweep, value_of, varied
from ccwsim.experiments.sweep import recommended, sweep
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.sweep.page import sweep_csv
from ccwsim.ui.sweep.planning import (
    SweepState,
    describe_study,
    plan_of,
    ranges_of,
    use_swept_setting,
    values_on_offer,
)
from tests.ui.widgets import charts, csv_rows, html, opened, texts

pytestmark = pytest.mark.slow
"""The tests are slow; `test_volume_study` tests a volume on the main pages in the quick tests."""

OWN = Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1))
DATA = HardData([(k, 7, 9) for k in range(12)], [0, 1] * 6)
VOLUME = Choices(
    ImageChoice("sinuous_channels"), DataChoice("placed", placed=DATA), Grid(30, 40, nz=12), OWN
)
RANGES = {"template_size": [16], "overlap_size": [4], "wavelet_level": [1], "n_candidates": [20]}
RANGES |= {"wavelet_level_z": [0, 1]}


def test_ranges_along_z_are_combined_with_the_others():
    ranges = {"template_size": [16, 20], "template_size_z": [4, 8], "wavelet_level_z": [0, 1]}
    found = plan_sweep(OWN, ranges, (48, 160, 160))
    assert len(found) == 8
    assert {p.template_size for p in found} == {(z, x, x) for z in (4, 8) for x in (16, 20)}
    assert {p.wavelet_level for p in found} == {(0, 1, 1), (1, 1, 1)}
    assert varied(found) == ["template_size", "template_size_z", "wavelet_level_z"]
    assert label(found.fitting[0], varied(found)) == "T 16 · T z 4 · level z 0"
    alone = plan_sweep(OWN, {"template_size": [20], "overlap_size_z": [4]}, (48, 160, 160)).fitting[
        0
    ]
    assert (alone.template_size, alone.overlap_size) == ((8, 20, 20), (4, 4, 4))
    tall = plan_sweep(OWN, {"template_size_z": [8, 64]}, (48, 160, 160))
    assert [p.template_size[0] for p in tall] == [8, 48]  # rounded to the layers of the image
    assert value_of(Parameters(), "template_size_z") is None


def test_settings_along_z_give_their_own_realizations():
    plan = plan_sweep(OWN, {"wavelet_level_z": [0, 1]}, (48, 160, 160))
    image = load("sinuous_channels")
    found = sweep(image, VOLUME.grid, plan.fitting, DATA, n_realizations=2, seed=3)
    for row in found.rows:
        e = simulate(image, VOLUME.grid, row.parameters, DATA, 2, seed=3)
        assert (row.realizations == e.realizations).all()
        assert len(row.quality.tau_errors) == 3
    assert recommended(found).index in (0, 1)
    rows = csv_rows(sweep_csv(found, 0))
    assert [row["wavelet_level_z"] for row in rows] == ["0", "1"]
    assert all(float(row["tau_error_vertical"]) >= 0 for row in rows)
    with pytest.raises(CCWSIMError, match="has no range"):
        plan_sweep(OWN, {"template_size_x": [8]})


def test_a_sweep_of_volumes_is_planned_run_and_taken():
    state = State(choices=VOLUME)
    offered = values_on_offer(VOLUME)
    assert {"template_size_z", "overlap_size_z", "wavelet_level_z"} < set(offered)
    assert max(offered["template_size_z"]) <= 48
    assert "160 × 160 × 48" in describe_study(state)
    assert all(len(values) for values in ranges_of(state).values())
    assert 9 <= len(plan_of(state)) <= 16
    chosen = tuple((name, tuple(values)) for name, values in RANGES.items())
    state.change_sweep(ranges=chosen, n_realizations=2)
    app = opened("sweep", state).run()
    assert not app.exception
    assert not texts(app)
    app.button(key="sweep").click()
    app.run()
    run = state_of(app).page(SweepState).run
    assert run.job.wait(300)
    app.run()
    assert not app.exception
    assert [row.parameters.wavelet_level for row in run.latest_result.rows] == [
        (0, 1, 1),
        (1, 1, 1),
    ]
    assert not run.latest_result.failed
    assert "sweep" in charts(app)
    assert "τ vertical of sand, error" in html(app)
    assert "a layer of one realization of each" in html(app)
    use_swept_setting(state_of(app), run.latest_result.rows[0].parameters)
    assert state_of(app).choices.parameters.wavelet_level == (0, 1, 1)


def state_of(app) -> State:
    return app.session_state[KEY]
