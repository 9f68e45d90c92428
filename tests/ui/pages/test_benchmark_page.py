"""Test the page Benchmark: its measurements, charts, cancellation and refusals.

No test asserts a time.
"""

from __future__ import annotations

import re
import time
from dataclasses import replace

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, Parameters, TrainingImage, datasets
from ccwsim.experiments.trials import Trial, TrialResult
from ccwsim.figures import DARK, LIGHT, TimeSeries, timings_chart
from ccwsim.jobs.job import Job
from ccwsim.model.parameters import METHODS
from ccwsim.sharing.choices import Choices, DataChoice
from ccwsim.ui.benchmark import measurement as benchmark_run
from ccwsim.ui.benchmark.findings import (
    compare_levels,
    data_table,
    describe_growth,
    grid_table,
    octave_table,
    timings_csv,
)
from ccwsim.ui.benchmark.measurement import Benchmark, TimingRun, side_options, timed_trials
from ccwsim.ui.session.progress import progress_text
from ccwsim.ui.session.state import KEY, State
from tests.ui.widgets import charts, csv_rows, html, named, opened
from tests.waiting import wait_until

CHANNELS = datasets.load("channels")
SMALL = Choices(data=DataChoice(), grid=Grid(48, 64), n_realizations=1)


def took(
    side: int, seconds: float, level: int = 1, n_data: int = 0, wrong: int = 0, image=CHANNELS
) -> TrialResult:
    p = Parameters(wavelet_level=level)
    trial = Trial(image, Grid(side, side), p, seed=3, n_sampled=n_data)
    return TrialResult(trial, np.array([seconds]), np.array([wrong]))


def run_of(*trials: Trial, **changes) -> TimingRun:
    return TimingRun(trials=trials, n_realizations=1, **changes)


def launched(**changes) -> AppTest:
    page_state = Benchmark(n_realizations=1, **changes)
    return opened("benchmark", State(choices=SMALL, pages={Benchmark: page_state})).run()


def settled(app: AppTest) -> AppTest:
    end = time.monotonic() + 120
    while time.monotonic() < end:
        run = app.session_state[KEY].page(Benchmark).running
        if run is None:
            break
        run.job.wait(60)
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
    assert re.search(r"12 settings × 3 realizations on one thread: about \d+ s", said)
    assert "26.78" in said or "ms-ccsim" not in METHODS
    assert "23.09 s" in said
    assert charts(app) == {"times_grid", "times_cell"}


@pytest.mark.slow
def test_grids_are_measured_and_shown_beside_the_paper(monkeypatch):
    monkeypatch.setattr(benchmark_run, "TIMED_SIDES", (48, 64, 96, 128, 160, 192))
    app = launched(largest=512, grid_levels=[1, 3])
    settled(app.button(key="measure_grids").click().run())
    run = app.session_state[KEY].page(Benchmark).grids.run
    assert [t.parameters for t in run.rows] == run.settings
    assert [t.trial for t in run.rows] == run.trials
    said = html(app)
    assert "Level 1:" in said
    assert "times at 25 million cells in the paper (Fig. 13)" in said
    assert "56 s" in said
    assert "Training image" in said
    assert any(b.proto.label == "Download CSV" for b in app.get("download_button"))


def test_data_are_measured_and_shown_in_the_layout_of_table_2():
    app = launched(side=256, numbers=[0, 100, 400], data_levels=[3], data_methods=["ccwsim"])
    settled(app.button(key="measure_data").click().run())
    run = app.session_state[KEY].page(Benchmark).data.run
    assert [t.trial.n_data for t in run.rows] == [0, 100, 400]
    said = html(app)
    assert "400 / 100" in said
    assert "256 × 256 cells" in said


def test_all_methods_there_are_can_be_measured():
    app = launched(side=256, numbers=[100], data_levels=[2], data_methods=["ccwsim", "ms-ccsim"])
    settled(app.button(key="measure_data").click().run())
    assert not app.warning
    timings = app.session_state[KEY].page(Benchmark).data.run.rows
    there = [m for m in METHODS if m != "ccsim"]
    assert [t.parameters.method for t in timings] == there


def test_choices_are_kept_when_the_page_is_left():
    app = launched()
    named(app.selectbox, "largest").set_value(512).run()
    named(app.button_group, "grid_levels").set_value([2]).run()
    assert app.session_state[KEY].page(Benchmark).grid_levels == [2]
    again = opened("benchmark", app.session_state[KEY]).run()
    assert named(again.selectbox, "largest").value == 512
    assert "2 settings × 1 realization on" in html(again)


def test_nothing_chosen_says_what_to_choose():
    app = launched(grid_levels=[], numbers=[])
    assert html(app).count("Choose at least one") == 2
    app.button(key="measure_grids").click().run()
    assert "Choose at least one method and one level" in app.error[0].value
    assert app.session_state[KEY].page(Benchmark).grids.run is None
    assert not app.exception


@pytest.mark.slow
def test_a_run_can_be_cancelled_and_keeps_what_was_finished():
    app = launched()
    state = app.session_state[KEY]
    run = run_of(*[Trial(CHANNELS, Grid(48, 48))] * 20_000).start()
    state.page(Benchmark).grids.run = run
    wait_until(lambda: run.rows, "the first time")
    app.run()
    assert not app.exception
    assert app.button(key="measure_data").disabled
    assert not any(b.key == "download_times" for b in app.get("download_button"))
    app.button(key="cancel_grids").click().run()
    settled(app)
    assert "these are shown" in app.warning[0].value
    assert 0 < len(run.rows) < 20_000
    assert not app.button(key="measure_data").disabled


def test_a_failed_run_says_why():
    app = launched()
    run = run_of(Trial(CHANNELS, Grid(48, 48), Parameters(template_size=512))).start()
    assert run.job.wait(60)
    app.session_state[KEY].page(Benchmark).grids.run = run
    app.run()
    assert "Template 512 is larger" in app.warning[0].value
    assert not app.exception


def test_progress_says_what_is_timed():
    run = run_of(took(256, 1.0, 1, 400).trial)
    run.job = Job(lambda job: job.report(0.5, 0))
    run.job.wait(5)
    assert progress_text(run.job, run.label()).startswith(
        "0 of 1 settings · now 256², level 1, 400 data"
    )
    run.job.cancel()
    assert progress_text(run.job, run.label()).endswith("Stopping …")


def test_only_grids_that_fit_into_memory_are_on_offer():
    assert side_options(0) == [512]
    assert side_options(10**8) == [512, 1000, 2000]
    assert side_options(None)[-1] == side_options(10**12)[-1] == 5000


def test_the_cases_are_those_of_the_paper():
    state = State(choices=SMALL)
    grids, data = timed_trials(state, "grids"), timed_trials(state, "data")
    assert {c.grid.nx for c in grids} == {256, 512, 1000, 2000}
    assert {c.parameters.level for c in grids} == {1, 2, 3}
    assert {c.n_data for c in data} == {0, 1000, 2000}
    assert {c.parameters.level for c in data} == {1, 3}
    assert {c.grid.shape for c in data} == {(512, 512)}


def test_settings_fit_the_study():
    p = Parameters(template_size=24, overlap_size=12)
    state = State(choices=replace(SMALL, parameters=p))
    found = {c.parameters.level: c.parameters for c in timed_trials(state, "data")}
    assert (found[1].template_size, found[1].overlap_size) == (24, 12)
    assert found[3].overlap_size % 8 == 0


def test_words_say_linear_or_not():
    linear = [took(n, 1e-7 * n**2) for n in (100, 1000)]
    square = [took(n, 1e-9 * n**4) for n in (100, 1000)]
    constant = [took(n, 1.0) for n in (100, 1000)]
    assert "0.1 µs a cell from 100² to 1000²: linear" in describe_growth("level 1", linear)
    assert "more than linear" in describe_growth("level 1", square)
    assert "less than linear" in describe_growth("level 1", constant)
    assert describe_growth("level 1", linear[:1]) == ""
    both = [took(1000, 3.0, 1), took(1000, 1.5, 3)]
    said = compare_levels(both)
    assert "Level 1 takes 2.0 times as long as level 3 here (1000² cells), and 1.8" in said
    assert compare_levels(both[:1]) == compare_levels([took(500, 3.0, 1), both[1]]) == ""


def cells_of(table: str) -> list[list[str]]:
    rows = re.findall(r"<tr.*?>(.*?)</tr>", table)
    return [re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row) for row in rows]


def test_tables_have_measured_and_published_times_side_by_side():
    timings = [took(512, 0.2, 1, 1000), took(512, 0.5, 1, 2000, wrong=20)]
    trials = [took(512, 0.0, 1, n).trial for n in (0, 1000, 2000)]
    table = data_table(timings, trials)
    assert cells_of(table)[-1][:3] == ["CCWSIM", "1", "–"]
    assert cells_of(table)[-1][3:9] == ["200 ms", "10.45 s", "0", "500 ms", "23.09 s", "1 %"]
    assert cells_of(table)[-1][9:] == ["2.50", "2.21"]
    assert "10.45" not in data_table([], [took(256, 0.0, 1, n).trial for n in (1000, 2000)])
    rows = cells_of(grid_table([took(256, 0.2, 1), took(256, 0.1, 2)]))
    assert rows[0] == ["cells", "level 1", "level 2"]
    assert rows[1:] == [["256²", "200 ms", "100 ms"], ["paper, 5000²", "56 s", "32 s"]]
    assert "crashes always" in octave_table()


def test_the_name_of_an_image_is_no_formula_in_the_csv():
    image = TrainingImage(datasets.load("channels").array, name="@SUM(A1:A9)")
    timing = took(64, 0.25, image=image)
    (row,) = csv_rows(timings_csv([run_of(timing.trial, rows=[timing])], "=1+1"))
    assert (row["image"], row["machine"]) == ("'@SUM(A1:A9)", "'=1+1")


def test_csv_has_a_line_a_realization():
    run = run_of(rows=[took(64, 0.25, 2, 7, 1), took(32, 1.0)])
    rows = csv_rows(timings_csv([run], "a, b"))
    assert [row["cpu_seconds"] for row in rows] == ["0.25", "1"]
    assert (rows[0]["n_data"], rows[0]["level"], rows[0]["machine"]) == ("7", "2", "a, b")
    assert run.describe_end() == ""


@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_the_chart_has_lines_for_what_was_measured_and_open_markers_for_the_paper(theme):
    cells, values = np.array([1e4, 1e6]), np.array([0.01, 1.0])
    own = [TimeSeries(f"level {k}", k, cells, values) for k in (1, 2, 3)]
    paper = [TimeSeries("paper, level 1", 1, cells[-1:] * 25, np.array([56.0]))]
    ticks = {side**2: f"{side}²" for side in (100, 1000, 5000)}
    chart = timings_chart(own, paper, ticks, theme, y_title="s", unit="s")
    *lines, marker = chart.data
    assert [line.name for line in lines] == ["level 1", "level 2", "level 3"]
    assert len({line.marker.symbol for line in lines}) == 3
    assert marker.marker.symbol == f"{lines[0].marker.symbol}-open"
    assert marker.marker.color == theme.reference
    assert list(chart.layout.xaxis.ticktext) == ["100²", "1000²", "5000²"]
    shifts = sorted(a.yshift for a in chart.layout.annotations if a.text.startswith("level"))
    assert min(np.diff(shifts)) >= 14
    empty = timings_chart([], paper, ticks, theme, y_title="s", unit="s")
    low, high = empty.layout.yaxis.range
    assert low < np.log10(56) < high
