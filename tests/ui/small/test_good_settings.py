"""Test “Find good settings” on Simulate: the search, its offer, and a setting that is taken."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ccwsim import Grid, HardData, Parameters
from ccwsim.datasets import load
from ccwsim.experiments.sweep import nearest_on_front, recommended
from ccwsim.metrics import recommended_parameters
from ccwsim.sharing.choices import Choices, DataChoice
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study import trials
from ccwsim.ui.study.trials import SweepRun, TuningState, find_settings, setting_tile, tuned_trials
from tests.ui.widgets import html, named, opened, texts

PLACED = HardData([[5, 7], [20, 40], [40, 11]], [1, 0, 1])
OWN = Parameters(template_size=16, overlap_size=6, wavelet_level=1)
SMALL = Choices(data=DataChoice("placed", placed=PLACED), grid=Grid(48, 64), parameters=OWN)


@pytest.fixture
def searched(monkeypatch) -> State:
    """Return a state with a finished search of two settings."""
    monkeypatch.setattr(trials, "tuned_trials", lambda choices: tuned_trials(choices)[:2])
    state = State(choices=SMALL, live=False)
    find_settings(state)
    run = state.page(TuningState).run
    assert run is not None
    assert run.wait(300)
    assert run.error is None
    return state


def test_the_search_is_around_the_study_and_the_fastest_come_first():
    tried = tuned_trials(SMALL)
    assert OWN in [trial.parameters for trial in tried]
    assert len(tried) >= 9
    assert len({trial.parameters.overlap_size for trial in tried}) > 1
    assert all(trial.hard_data.n == 3 for trial in tried)
    seconds = [trials.typical(trial, judged=True) for trial in tried]
    assert seconds == sorted(seconds)


def test_slow_settings_are_not_tried_if_there_are_enough_others(monkeypatch):
    monkeypatch.setattr(trials, "TUNING_SECONDS", 0.0)
    assert len(tuned_trials(SMALL)) == 9


def test_slow_settings_are_tried_with_fewer_realizations(monkeypatch):
    monkeypatch.setattr(SweepRun, "start", lambda run: run)
    for seconds, n in ((trials.TUNING_SECONDS, 3), (0.0, 2)):
        monkeypatch.setattr(trials, "TUNING_SECONDS", seconds)
        state = State(choices=SMALL, live=False)
        find_settings(state)
        run = state.page(TuningState).run
        assert run is not None
        assert run.n_realizations == n
        assert len(run.trials) >= 9


def test_the_dialog_offers_settings_with_pictures_and_reasons(searched):
    app = opened("simulate", searched).run()
    assert not app.exception
    said = html(app)
    assert "Click a setting to use it" in said
    assert "Recommended: T " in said
    assert "Advised: T 28 · OR 8 · level 2. The thinnest facies is 5 cells thick" in said
    run = searched.page(TuningState).run
    results = run.latest_result
    best = recommended(results).index
    for k in nearest_on_front(results):
        tile = setting_tile(run, k, ["template_size", "overlap_size"], best)
        p = results.rows[k].parameters
        assert tile["label"] == f"T {p.template_size} · OR {p.overlap_size}"
        assert "bits · " in tile["note"]
        assert tile["badge"] == ("recommended" if k == best else "")
        assert tile["png"]


def test_a_taken_setting_is_in_the_study_and_the_dialog_is_closed(searched, monkeypatch):
    taken = {}

    def draw_tiles(key, heading, tiles, take, **options) -> None:
        taken.update(take=take, tiles=tiles)

    monkeypatch.setattr(trials, "draw_tiles", draw_tiles)
    monkeypatch.setattr(trials, "session_state", lambda: searched)
    trials._offer_settings(searched, searched.page(TuningState).run)
    k = taken["tiles"][-1]["value"]
    taken["take"](k)
    tuning = searched.page(TuningState)
    assert searched.choices.parameters == tuning.run.rows[k].parameters
    assert not tuning.is_open


def test_the_same_study_is_not_searched_again_but_a_changed_one_is(searched):
    first = searched.page(TuningState).run
    searched.page(TuningState).is_open = False
    find_settings(searched)
    assert searched.page(TuningState).is_open
    assert searched.page(TuningState).run is first
    searched.change(parameters=replace(OWN, overlap_size=4))
    find_settings(searched)
    assert searched.page(TuningState).run is not first


def test_without_a_valid_study_there_is_no_search():
    app = opened("simulate", State(choices=replace(SMALL, grid=Grid(10, 10)), live=False)).run()
    assert named(app.button, "find_settings").disabled


def test_the_page_opens_without_a_dialog():
    app = opened("simulate", State(choices=SMALL, live=False)).run()
    assert not app.exception
    assert not named(app.button, "find_settings").disabled
    assert "Click a setting" not in html(app) + texts(app)
    assert not app.session_state[KEY].page(TuningState).is_open


@pytest.mark.parametrize("page", ["simulate", "sweep", "import"])
def test_each_page_quotes_the_same_advice_with_its_reason(page, searched):
    reason = "The thinnest facies is 5 cells thick: blocks with sides of 4 cells still resolve"
    assert reason in recommended_parameters(load("channels"))[1]
    assert reason in html(opened(page, searched).run())
