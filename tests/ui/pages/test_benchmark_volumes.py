"""Test the page Benchmark for volumes: maps and volumes in one chart, data in volumes."""

from __future__ import annotations

import numpy as np
import pytest

from ccwsim import Grid, Parameters, datasets, simulate
from ccwsim.experiments.timing import time_trials
from ccwsim.experiments.trials import Trial, TrialResult
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.benchmark import measurement as benchmark_run
from ccwsim.ui.benchmark.findings import (
    describe_volumes,
    grid_table,
    growth_lines,
    name_of,
    setting_of,
    timings_csv,
)
from ccwsim.ui.benchmark.measurement import Benchmark, timed_n_layers, timed_trials
from ccwsim.ui.benchmark.page import has_paper, measured_series, ticks_of
from ccwsim.ui.session.state import KEY, State
from tests.ui.pages.test_benchmark_page import settled
from tests.ui.widgets import csv_rows, html, opened

pytestmark = pytest.mark.slow
"""The tests are slow; `test_volume_study` tests a volume on the main pages in the quick tests."""

OWN = Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1))
VOLUME = Choices(ImageChoice("sinuous_channels"), DataChoice(), Grid(30, 40, nz=12), OWN)


def took(shape: tuple[int, ...], seconds: float, level: int = 2) -> TrialResult:
    p = Parameters(wavelet_level=level)
    if len(shape) == 3:
        p = Parameters((8, 32, 32), (2, 8, 8), (1, level, level))
    trial = Trial(datasets.load("sinuous_channels"), Grid.of(shape), p)
    return TrialResult(trial, np.array([seconds]), np.zeros(1, int))


def state_of(**changes) -> State:
    return State(choices=VOLUME, pages={Benchmark: Benchmark(n_realizations=1, **changes)})


def test_maps_of_the_middle_layer_have_as_many_cells_as_volumes():
    state = state_of(largest_volume=64, grid_levels=[1])
    assert timed_n_layers(state) == 12
    trials = timed_trials(state, "grids")
    volumes = [trial for trial in trials if trial.grid.n_dimensions == 3]
    maps = [trial for trial in trials if trial.grid.n_dimensions == 2]
    assert [trial.grid.shape for trial in volumes] == [(12, 48, 48), (12, 64, 64)]
    for a, b in zip(volumes, maps, strict=True):
        assert abs(a.grid.n_cells / b.grid.n_cells - 1) < 0.02
    image = datasets.load("sinuous_channels")
    flat = maps[0].training_image
    np.testing.assert_array_equal(flat.array, image.array[24])
    (timing,) = time_trials(maps[:1], 1)
    expected = simulate(flat, maps[0].grid, maps[0].parameters)
    assert timing.n_mismatched.tolist() == expected.n_mismatched.tolist()
    state.page(Benchmark).maps = False
    assert [t.grid for t in timed_trials(state, "grids")] == [t.grid for t in volumes]


def test_both_are_measured_and_shown_together(monkeypatch):
    monkeypatch.setattr(benchmark_run, "VOLUME_SIDES", (24, 32))
    app = opened("benchmark", state_of(largest_volume=32, grid_levels=[1])).run()
    assert not app.exception
    settled(app.button(key="measure_grids").click().run())
    run = app.session_state[KEY].page(Benchmark).grids.run
    assert {t.trial.grid.n_dimensions for t in run.rows} == {2, 3}
    said = html(app)
    assert "volume level 1" in said
    assert "32 × 32 × 12" in said
    assert "maps of the middle layer of the image, with as many cells" in said
    assert "times as long as a cell of a map of the middle layer" in said
    assert "paper, 5000²" not in said.split("Table 2")[0]
    rows = csv_rows(timings_csv([run], "here"))
    assert {row["image_nz"] for row in rows} == {"1", "48"}
    assert {row["nz"] for row in rows} == {"1", "12"}
    assert "middle layer of sinuous_channels" in {row["image"] for row in rows}


def test_times_with_data_are_of_a_volume():
    changes = {"side_volume": 64, "numbers": [0, 100], "data_levels": [1]}
    app = opened("benchmark", state_of(data_methods=["ccwsim"], **changes)).run()
    settled(app.button(key="measure_data").click().run())
    run = app.session_state[KEY].page(Benchmark).data.run
    assert [(t.trial.grid.shape, t.trial.n_data) for t in run.rows] == [
        ((12, 64, 64), n) for n in (0, 100)
    ]
    assert "64 × 64 × 12 cells" in html(app)


def test_words_and_lines_tell_maps_from_volumes():
    timings = [took((10, 50, 50), 0.1), took((10, 100, 100), 0.4), took((158, 158), 0.005),
               took((316, 316), 0.02)]  # fmt: skip
    settings = [setting_of(t.trial) for t in timings]
    assert {name_of(s, settings) for s in settings} == {"volume level 2", "map level 2"}
    assert "A cell of a volume takes 20" in describe_volumes(timings)
    assert any("50 × 50 × 10 to 100 × 100 × 10: linear" in line for line in growth_lines(timings))
    assert {series.dashed for series in measured_series(timings, per_cell=True)} == {True, False}
    assert not has_paper(timings)
    assert ticks_of(timings, volumes=True) == {10**4: "10,000", 10**5: "100,000"}
    table = grid_table(timings)
    assert table.index("158²") < table.index("100 × 100 × 10")
