"""Test the page Sweep: its ranges, its results, and the use of a setting for the study."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, HardData, Parameters, TrainingImage
from ccwsim.datasets import load
from ccwsim.experiments.plan import plan_sweep, suggested_ranges
from ccwsim.experiments.sweep import recommended
from ccwsim.model.parameters import METHODS
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice
from ccwsim.ui.session.progress import progress_text
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.sweep.page import (
    choose_setting,
    indices_of,
    is_current_sweep,
    setting_numbers,
    sweep_csv,
)
from ccwsim.ui.sweep.planning import (
    MAX_SWEPT,
    SweepState,
    describe_plan,
    plan_of,
    ranges_of,
    seconds_of,
    start_sweep,
    sweep_problem,
    use_swept_setting,
    values_on_offer,
)
from tests.some import some
from tests.ui.widgets import csv_rows, html, named, opened, texts
from tests.waiting import wait_until

PLACED = HardData([[5, 7], [20, 40], [40, 11]], [1, 0, 1])
OWN = Parameters(template_size=16, overlap_size=4)
SMALL = Choices(data=DataChoice("placed", placed=PLACED), grid=Grid(48, 64), parameters=OWN)
FEW = {"template_size": [16, 24], "overlap_size": [4], "wavelet_level": [1, 2]}


def state_of(choices: Choices = SMALL, ranges=FEW) -> State:
    state = State(choices=choices)
    chosen = tuple((name, tuple(values)) for name, values in ranges.items())
    state.change_sweep(ranges=chosen, n_realizations=2)
    return state


def swept(**changes) -> State:
    state = state_of(**changes)
    start_sweep(state)
    job = run_of(state).job
    assert job.wait(300)
    assert job.error is None
    return state


def run_of(state: State) -> Any:
    """Return the sweep that was started."""
    return state.page(SweepState).run


def launched(state: State) -> AppTest:
    app = opened("sweep", state).run()
    assert not app.exception
    assert not app.error
    return app


def pills(app: AppTest) -> list[Any]:
    return list(app.get("button_group"))


@pytest.fixture
def done() -> State:
    return swept()


def test_it_opens_cold_and_says_what_it_will_show():
    app = opened("sweep").run()
    assert not app.exception
    assert not app.error
    said = html(app)
    assert "Each point is a setting" in said
    assert "channels, 256 × 256, 2 facies" in said
    assert "settings × 4 realizations on one thread: about" in said
    for key in ("sweep", "sweep_first", "sweep_below"):
        assert not named(app.button, key).disabled


def test_ranges_are_those_that_suit_the_study_until_they_are_changed():
    state = State(choices=SMALL)
    suited, offered = suggested_ranges(OWN, load("channels")), values_on_offer(SMALL)
    assert ranges_of(state) == {name: suited[name] for name in suited if name in offered}
    assert len(plan_of(state)) > 1
    state.change(parameters=Parameters(template_size=64, overlap_size=8, n_candidates=7))
    assert 64 in ranges_of(state)["template_size"]
    assert ranges_of(state)["n_candidates"] == [7]
    state.change_sweep(ranges=(("template_size", (24, 32)),))
    assert ranges_of(state)["template_size"] == [24, 32]


def test_only_values_that_the_study_allows_are_on_offer():
    offered = values_on_offer(SMALL)
    assert offered["method"] == list(METHODS)
    assert max(offered["template_size"]) <= 256
    assert "search_fraction" in offered
    assert "search_fraction" not in values_on_offer(replace(SMALL, data=DataChoice()))
    own = replace(SMALL, parameters=Parameters(n_candidates=37))
    assert 37 in values_on_offer(own)["n_candidates"]


def test_a_pill_changes_the_plan():
    app = launched(state_of())
    group: Any = next(b for b in pills(app) if b.key.startswith("range_n_candidates"))
    group.set_value([1, 20]).run()
    state = app.session_state[KEY]
    assert sorted(dict(state.sweep.ranges)["n_candidates"]) == [1, 20]
    assert len(plan_of(state)) == 8
    ranges = dict(state.sweep.ranges) | {"n_candidates": (20, 1)}
    state.change_sweep(ranges=tuple(ranges.items()))
    assert [p.n_candidates for p in plan_of(state)][:2] == [1, 20]
    assert "Try 8 settings" in named(app.button, "sweep").label
    named(app.button, "ranges_back").click().run()
    assert not app.session_state[KEY].sweep.ranges


def test_sizes_are_rounded_to_each_level_and_repetitions_are_said():
    state = state_of(ranges={**FEW, "wavelet_level": [1, 3], "overlap_size": [4, 8]})
    said = describe_plan(state, plan_of(state))
    assert "2 omitted: rounded to their level, they equal others" in said
    state = state_of(ranges={**FEW, "method": ["ccsim"]})
    assert "2 omitted" in describe_plan(state, plan_of(state))


def test_the_values_of_the_study_are_in_the_ranges_whatever_they_are():
    advised = replace(SMALL, parameters=Parameters(30, 10, 1, n_candidates=7))
    state = State(choices=advised)
    offered = values_on_offer(advised)
    assert 30 in offered["template_size"]
    assert 10 in offered["overlap_size"]
    assert advised.parameters in plan_of(state).fitting
    assert len(plan_of(state)) >= 9
    assert len({p.overlap_size for p in plan_of(state)}) > 1


MANY = {
    "template_size": [8, 12, 16, 24, 32, 48, 64, 96],
    "wavelet_level": [1, 2],
    "n_candidates": [1, 5, 10, 20, 50],
}


@pytest.mark.parametrize(
    ("ranges", "words"),
    [
        (MANY, f"at most {MAX_SWEPT}"),
        ({"template_size": []}, "Template has no value to try"),
    ],
)
def test_too_many_or_no_settings_are_said_and_nothing_starts(ranges, words):
    app = launched(state_of(ranges=ranges))
    assert words in texts(app)
    assert named(app.button, "sweep").disabled
    state = app.session_state[KEY]
    start_sweep(state)
    assert state.page(SweepState).run is None


def test_data_that_do_not_fit_are_said():
    state = state_of(choices=replace(SMALL, grid=Grid(10, 10)))
    assert sweep_problem(state)
    app = launched(state)
    assert named(app.button, "sweep").disabled


def test_a_sweep_from_the_button_to_its_results():
    app = launched(state_of())
    named(app.button, "sweep_first").click().run()
    run = app.session_state[KEY].page(SweepState).run
    assert run.job.wait(300)
    app.run()
    assert not app.exception
    assert len(run.rows) == 4
    said = html(app)
    assert "Recommended: " in said
    assert "Patterns, mean (bits)" in said
    assert "Data not honoured" in said
    assert not texts(app)


def test_the_large_setting_is_the_recommended_one_until_one_is_chosen(done):
    run = run_of(done)
    choice = recommended(run.latest_result)
    app = launched(done)
    assert "<b>Recommended: " in html(app)
    other = (choice.index + 1) % 4
    choose_setting(done, other)
    size = run.rows[other].parameters.template_size
    level = run.rows[other].parameters.wavelet_level
    assert f'class="setting">ccwsim · T {size} · OR 4 · level {level} ·' in html(launched(done))
    choose_setting(done, 99)
    assert done.page(SweepState).chosen == other


@pytest.mark.parametrize("name", some(["stone_wall", "delta", "fractures"], always=["delta"]))
def test_it_is_drawn_for_any_training_image_without_data(name):
    choices = replace(SMALL, image=ImageChoice(bundled=name), data=DataChoice())
    state = swept(choices=choices, ranges={**FEW, "method": list(METHODS), "wavelet_level": [1]})
    state.change_sweep(error="mended")  # this error belongs to a sweep with data
    app = launched(state)
    said = html(app)
    assert "Recommended: " in said
    assert "Re-simulated, of" not in said
    assert "search" not in said


@pytest.mark.slow
def test_using_a_setting_puts_it_into_the_study(done):
    run = run_of(done)
    other = (recommended(run.latest_result).index + 1) % 4
    choose_setting(done, other)
    app = launched(done)
    named(app.button, "use_setting").click().run()
    assert not app.exception
    assert app.session_state[KEY].choices.parameters == run.rows[other].parameters
    named(app.button, "use_recommended").click().run()
    best = run.rows[recommended(run.latest_result).index].parameters
    assert app.session_state[KEY].choices.parameters == best


def test_a_setting_is_fitted_to_another_training_image():
    state = state_of(choices=replace(SMALL, image=ImageChoice(bundled="channels")))
    use_swept_setting(state, Parameters(template_size=1024, overlap_size=8))
    assert state.choices.parameters.template_size == 256


@pytest.mark.slow
def test_realizations_of_a_setting_can_be_gone_through(done):
    app = launched(done)
    assert "Realization 1 of 2" in html(app)
    named(app.button, "swept_next").click().run()
    assert "Realization 2 of 2" in html(app)
    named(app.button, "swept_next").click().run()
    assert "Realization 1 of 2" in html(app)


def test_numbers_are_said_beside_the_best_of_all(done):
    run = run_of(done)
    rows = run.latest_result.rows
    lines = {name: (own, best) for name, own, best in setting_numbers(rows[1], rows, run)}
    best = min(1000 * row.quality.cpu_seconds for row in rows)
    assert float(lines["CPU time (ms)"][1]) == pytest.approx(best, rel=0.01)
    assert lines["Data not honoured"] == ("0", "0")
    assert len(lines) == 12
    assert "±" in lines["Patterns, mean (bits)"][0]
    q = rows[1].quality
    name = run.training_image.facies_names[q.proportion_facies]
    said = lines[f"{name}, relative to TI (%)"][0]
    value, spread = said.replace("−", "-").split(" ± ")
    assert float(value) == pytest.approx(100 * q.proportion_error, rel=0.01)
    assert float(spread) == pytest.approx(100 * q.proportion_spread, rel=0.05)
    assert float(lines["Largest copy (cells)"][0].split(" ± ")[0]) == pytest.approx(
        q.largest_copied, rel=0.01
    )


def test_the_table_has_every_row_and_number(done):
    run = run_of(done)
    found = run.latest_result
    lines = csv_rows(sweep_csv(found, 2))
    assert len(lines) == 4
    for line, row in zip(lines, found.rows, strict=True):
        assert int(line["template_size"]) == row.parameters.template_size
        q = row.quality
        assert float(line["pattern_full"]) == pytest.approx(q.pattern_distances[0], rel=1e-5)
        assert float(line["proportion_error"]) == pytest.approx(q.proportion_error, rel=1e-5)
        assert float(line["largest_copied"]) == pytest.approx(q.largest_copied, rel=1e-5)
        assert float(line["pattern_spread"]) == pytest.approx(q.pattern_spread, rel=1e-5)
        assert float(line["cpu_ms"]) == pytest.approx(1000 * q.cpu_seconds, rel=1e-5)
    assert [line["recommended"] for line in lines] == ["0", "0", "1", "0"]
    assert any(line["on_front"] == "1" for line in lines)


def test_a_stopped_sweep_keeps_what_is_finished():
    state = state_of(ranges={**FEW, "n_candidates": [1, 20, 100]})
    state.change_sweep(n_realizations=1)
    start_sweep(state)
    run = run_of(state)
    wait_until(lambda: run.rows, "the first setting", every=0.005)
    run.job.cancel()
    assert run.job.wait(300)
    n = len(run.latest_result.rows)
    assert n >= 1
    app = launched(state)
    assert "Recommended" in html(app)
    if n < 12:  # a fast machine may have finished
        assert f"Stopped after {n} of 12 settings; these are shown." in texts(app)


def test_results_of_another_study_are_said_to_be(done):
    run = run_of(done)
    assert is_current_sweep(run, done)
    done.change(grid=Grid(50, 64))
    assert not is_current_sweep(run, done)
    said = html(launched(done))
    assert "Out of date:</b> the study&#x27;s training image" in said
    assert '<i class="results-outdated">' in said
    done.change(grid=run.grid)
    assert is_current_sweep(run, done)
    done.change(guides=GuideChoice(angle=30.0))
    assert not is_current_sweep(run, done)


def test_an_error_of_the_sweep_is_said(done):
    run = run_of(done)
    run.job.result, run.job.error = None, RuntimeError("the disk is full")
    assert "The run failed; your study is kept. The reason: an error" in run.describe_end()
    assert "in the server's log" in texts(launched(done))


def test_progress_says_settings_and_time(done):
    run = run_of(done)
    run.job.fraction, run.job.n_done = 0.5, 2
    assert progress_text(run.job).startswith("2 of 4 settings")
    run.job.cancel()
    assert progress_text(run.job) == "Stopping …"


def test_the_estimate_follows_the_pace_of_the_latest_run(done):
    plan = plan_sweep(SMALL.parameters, FEW)
    one = seconds_of(done, plan)
    done.change_sweep(n_realizations=3 * done.sweep.n_realizations)
    assert seconds_of(done, plan) == pytest.approx(3 * one)


def test_kept_realizations_are_read_only_and_few(done):
    run = run_of(done)
    for row in run.latest_result.rows:
        assert row.realizations.shape == (2, 48, 64)
        assert not row.realizations.flags.writeable
        assert np.isin(row.realizations, [0, 1]).all()


def test_inactive_cells_of_a_realization_have_no_facies():
    image = TrainingImage([[2, 5, 7]])
    found = indices_of(np.array([[[7, np.nan], [2, 5]]]), image)
    assert (found.dtype, found.tolist()) == (np.uint8, [[[2, 255], [0, 1]]])
    assert indices_of(np.array([[5, 2]], np.uint8), image).tolist() == [[1, 0]]
