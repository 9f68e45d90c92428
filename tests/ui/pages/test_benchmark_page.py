"""Test the page Benchmark: its measurements, chart, table, cancellation and refusals.

No test asserts a time.
"""

from __future__ import annotations

import re
import time
from dataclasses import replace

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, Parameters, datasets
from ccwsim.experiments.trials import Trial, TrialResult
from ccwsim.figures import DARK, LIGHT, TimeSeries, timings_chart
from ccwsim.paper.times import measured_series, paper_series
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.benchmark import page as benchmark_page
from ccwsim.ui.benchmark.page import (
    Benchmark,
    TimingRun,
    chosen_values,
    describe_growth,
    offered_values,
    timed_trials,
    times_table,
)
from ccwsim.ui.session.state import KEY, State
from tests.ui.widgets import charts, html, named, opened
from tests.waiting import wait_until

CHANNELS = datasets.load("channels")
SMALL = Choices(data=DataChoice(), grid=Grid(48, 64), n_realizations=1)
VOLUME = Choices(
    ImageChoice("sinuous_channels"),
    DataChoice(),
    Grid(30, 40, nz=12),
    Parameters((8, 16, 16), (2, 4, 4), (1, 1, 1)),
)
SIDES = benchmark_page.OFFERED["n_cells"]


def took(side: int, seconds: float, level: int = 1, n_data: int = 0) -> TrialResult:
    p = Parameters(wavelet_level=level)
    trial = Trial(CHANNELS, Grid(side, side), p, seed=3, n_sampled=n_data)
    return TrialResult(trial, np.array([seconds]), np.zeros(1, int))


def run_of(*trials: Trial, **changes) -> TimingRun:
    return TimingRun(trials=trials, n_realizations=1, **changes)


def state_of(choices: Choices = SMALL, **changes) -> State:
    return State(choices=choices, pages={Benchmark: Benchmark(n_realizations=1, **changes)})


def launched(choices: Choices = SMALL, **changes) -> AppTest:
    return opened("benchmark", state_of(choices, **changes)).run()


def settled(app: AppTest) -> AppTest:
    end = time.monotonic() + 120
    while time.monotonic() < end:
        page_state = app.session_state[KEY].page(Benchmark)
        if not page_state.going:
            break
        page_state.run.job.wait(60)
    app.run()
    assert not app.exception
    return app


def test_it_opens_cold_and_teaches():
    app = opened("benchmark").run()
    assert not app.exception
    assert not app.error
    said = html(app)
    assert "Press Measure" in said
    assert "cannot be compared" in said
    assert "numba" in said
    assert re.search(r"9 settings × 3 realizations on one thread: about \d+ s", said)
    assert "56 s" in said
    assert charts(app) == {"benchmark"}


def test_grids_are_measured_and_shown_beside_the_paper(monkeypatch):
    monkeypatch.setitem(benchmark_page.OFFERED, "n_cells", (48, 64, 96))
    app = launched(levels=[1, 3])
    settled(app.button(key="measure").click().run())
    run = app.session_state[KEY].page(Benchmark).run
    assert [t.trial for t in run.rows] == run.trials
    assert {t.grid.nx for t in run.trials} == {48, 64, 96}
    assert {t.n_data for t in run.trials} == {0}
    said = html(app)
    assert "Growth with cells of the grid, as a power:" in said
    assert "(level 3); 1 is linear" in said
    assert "paper, level 2" in said
    assert "5000²" in said
    assert "median of 1 realization on one thread" in said


def test_data_are_sampled_on_the_grid_of_the_study():
    app = launched(varied="n_data", values={benchmark_page.OFFERED["n_data"]: [500]}, levels=[3])
    settled(app.button(key="measure").click().run())
    run = app.session_state[KEY].page(Benchmark).run
    assert [(t.trial.n_data, t.trial.grid.shape) for t in run.rows] == [(500, (48, 64))]
    assert "Table 2" in html(app)


@pytest.mark.parametrize("name", ["template_size", "n_candidates"])
def test_parameters_are_varied_in_the_study_with_its_data(name):
    choices = replace(SMALL, data=DataChoice("sampled", n_sampled=30))
    trials = timed_trials(state_of(choices, varied=name, levels=[1]))
    assert [getattr(t.parameters, name) for t in trials] == [*benchmark_page.OFFERED[name][:3]]
    assert {t.n_data for t in trials} == {30}
    assert {t.grid.shape for t in trials} == {(48, 64)}


def test_choices_are_kept_when_the_page_is_left():
    app = launched()
    named(app.selectbox, "benchmark_varied").set_value("n_data").run()
    named(app.button_group, "timed_levels_0_1_2_3").set_value([2]).run()
    assert app.session_state[KEY].page(Benchmark).levels == [2]
    again = opened("benchmark", app.session_state[KEY]).run()
    assert named(again.selectbox, "benchmark_varied").value == "n_data"
    assert "3 settings × 1 realization on" in html(again)


def test_without_a_choice_the_page_names_it():
    app = launched(levels=[])
    assert "Choose at least one value and one level" in html(app)
    app.button(key="measure").click().run()
    assert "Choose at least one value and one level" in app.warning[0].value
    assert app.session_state[KEY].page(Benchmark).run is None
    assert not app.exception


@pytest.mark.slow
def test_a_run_can_be_cancelled_and_keeps_what_was_finished():
    app = launched()
    run = run_of(*[Trial(CHANNELS, Grid(48, 48))] * 20_000).start()
    app.session_state[KEY].page(Benchmark).run = run
    wait_until(lambda: run.rows, "the first time")
    app.run()
    assert not app.exception
    assert app.button(key="measure").disabled
    app.button(key="benchmark_cancel").click().run()
    settled(app)
    assert "these are shown" in app.warning[0].value
    assert 0 < len(run.rows) < 20_000
    assert not app.button(key="measure").disabled


def test_a_failed_run_gives_the_reason():
    app = launched()
    run = run_of(Trial(CHANNELS, Grid(48, 48), Parameters(template_size=512))).start()
    assert run.job.wait(60)
    app.session_state[KEY].page(Benchmark).run = run
    app.run()
    assert "Template 512 is larger" in app.warning[0].value
    assert not app.exception


def test_settings_fit_the_study():
    p = Parameters(template_size=24, overlap_size=12)
    trials = timed_trials(state_of(replace(SMALL, parameters=p)))
    sizes = {t.parameters.level: t.parameters for t in trials}
    assert (sizes[1].template_size, sizes[1].overlap_size) == (24, 12)
    assert sizes[3].overlap_size % 8 == 0


@pytest.mark.slow
def test_volumes_are_timed_with_the_layers_of_the_study(monkeypatch):
    monkeypatch.setattr(benchmark_page, "SIDES_OF_LAYERS", (24, 32))
    state = state_of(VOLUME, levels=[1])
    assert offered_values(state) == (24, 32)
    assert [t.grid.shape for t in timed_trials(state)] == [(12, 24, 24), (12, 32, 32)]
    app = opened("benchmark", state).run()
    settled(app.button(key="measure").click().run())
    said = html(app)
    assert "6,912" in said
    assert "paper, level" not in said


def test_values_are_kept_for_each_quantity():
    state = state_of(values={SIDES: [5000, 512]})
    assert chosen_values(state) == [512, 5000]
    state.page(Benchmark).varied = "n_data"
    assert chosen_values(state) == [500, 1000, 2000]


def test_growth_is_that_of_each_level():
    timings = [took(n, 1e-7 * n**2, 1) for n in (100, 1000)] + [took(100, 1.0, 2)]
    series = measured_series(timings)
    assert [each.name for each in series] == ["level 1", "level 2"]
    assert describe_growth(series, "n_cells") == (
        "Growth with cells of the grid, as a power: 1.00 (level 1); 1 is linear."
    )
    assert describe_growth(series[1:], "n_cells") == ""


def test_the_table_has_measured_and_published_times_side_by_side():
    timings = [took(512, 0.2, 1, 1000), took(512, 0.5, 1, 2000)]
    series = [*measured_series(timings, "n_data"), *paper_series("n_data")]
    table = times_table(series, {1000: "1,000", 2000: "2,000"})
    rows = [re.findall(r"<t[dh]>(.*?)</t[dh]>", row) for row in table.split("<tr>")[1:]]
    assert rows == [
        ["", "level 1", "paper, level 1", "paper, level 3"],
        ["1,000", "200 ms", "10.4 s", "2.49 s"],
        ["2,000", "500 ms", "23.1 s", "2.82 s"],
    ]
    assert [each.values[0] for each in paper_series("n_data", "ms-ccsim")] == [26.78, 2.35]
    assert paper_series("template_size") == []


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_the_chart_has_lines_for_what_was_measured_and_open_markers_for_the_paper(theme):
    cells, values = np.array([1e4, 1e6]), np.array([0.01, 1.0])
    own = [TimeSeries(f"level {k}", k, cells, values) for k in (1, 2, 3)]
    paper = [TimeSeries("paper, level 1", 1, cells[-1:] * 25, np.array([56.0]))]
    ticks = {side**2: f"{side}²" for side in (100, 1000, 5000)}
    chart = timings_chart(own, paper, ticks, theme, x_title="cells")
    *lines, marker = chart.data
    assert [line.name for line in lines] == ["level 1", "level 2", "level 3"]
    assert len({line.marker.symbol for line in lines}) == 3
    assert marker.marker.symbol == f"{lines[0].marker.symbol}-open"
    assert marker.marker.color == theme.reference
    assert list(chart.layout.xaxis.ticktext) == ["100²", "1000²", "5000²"]
    shifts = sorted(a.yshift for a in chart.layout.annotations if a.text.startswith("level"))
    assert min(np.diff(shifts)) >= 14
    empty = timings_chart([], paper, ticks, theme, x_title="cells")
    low, high = empty.layout.yaxis.range
    assert low < np.log10(56) < high
