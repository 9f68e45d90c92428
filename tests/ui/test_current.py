"""Test that results belong to the study beside them, or are dimmed with a description."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccwsim.model.hard_data import HardData
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice
from ccwsim.ui.session.resolve import same_realizations
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.share.menu import project_of
from ccwsim.ui.study import run as study_run
from ccwsim.ui.study.run import is_current, start_run
from tests.ui.test_live import SIX, one_run
from tests.ui.test_pages import launched, settled
from tests.ui.widgets import html, named, opened

OLD, DIM = "Out of date", '<i class="results-outdated">'


def changed() -> State:
    """Return a state whose seed was changed after its run."""
    return State(
        choices=replace(SIX, seed=3), live=False, ensemble=one_run(SIX), ensemble_choices=SIX
    )


@pytest.mark.parametrize("page", ["simulate", "validate"])
def test_results_of_the_study_before_are_dim_and_say_so(page):
    app = opened(page, changed()).run()
    assert not app.exception
    assert DIM in html(app)
    assert f"<b>{OLD}:</b> simulated before these changes: seed 0 → 3." in html(app)
    settled(named(app.button, "run_news").click().run())
    assert DIM not in html(app)
    assert OLD not in html(app)
    assert is_current(app.session_state[KEY])


def test_a_change_on_simulate_without_live_dims_and_its_undoing_does_not():
    app = launched(SIX)
    assert DIM not in html(app)
    named(app.number_input, "seed").set_value(9).run()
    assert DIM in html(app)
    assert "simulated before these changes: seed 0 → 9" in html(app)
    named(app.number_input, "seed").set_value(0).run()
    assert DIM not in html(app)


def test_a_project_of_a_changed_study_vouches_for_no_realizations():
    state = changed()
    assert project_of(state).digest == ""
    state.change(seed=0)
    assert project_of(state).digest == state.ensemble.digest


def test_names_colours_and_the_way_data_came_decide_no_realization():
    names = replace(SIX, image=ImageChoice(names=("mud", "river"), colours=((0, "#112233"),)))
    none = replace(SIX, data=DataChoice("placed", placed=HardData()))
    assert same_realizations(SIX, names)
    assert same_realizations(SIX, none)
    other = [
        replace(SIX, n_realizations=7),
        replace(SIX, image=ImageChoice(flip_ew=True)),
        replace(SIX, data=DataChoice("placed", placed=HardData([[1, 1]], [0]))),
        replace(SIX, data=DataChoice("placed", placed=HardData([[999, 1]], [0]))),
    ]
    assert not any(same_realizations(SIX, one) for one in other)


def test_a_renamed_facies_is_called_so_at_once_without_a_run(monkeypatch):
    app = launched(SIX)
    before = app.session_state[KEY].ensemble
    monkeypatch.setattr("ccwsim.ui.study.run.simulate_study", None)
    state = app.session_state[KEY]
    state.change(image=ImageChoice(names=("mud", "river")))
    app.run()
    assert not app.exception
    assert DIM not in html(app)
    assert "river" in html(app)
    assert state.ensemble.training_image.facies_names == ("mud", "river")
    assert state.ensemble.indices is before.indices


@pytest.mark.usefixtures("no_kept_run")
def test_without_live_too_the_first_realizations_come_before_the_rest(monkeypatch):
    sizes = []

    def part_of(choices: Choices):
        some = part_as_ever(choices)

        def noted(first, n, watch):
            sizes.append(n)
            return some(first, n, watch)

        return noted

    part_as_ever = study_run.part_of
    monkeypatch.setattr(study_run, "part_of", part_of)
    state = State(choices=SIX)
    start_run(state)
    assert state.job.wait(60)
    assert sizes[0] == study_run.MIN_PART < SIX.n_realizations
    assert np.array_equal(state.job.result.indices, one_run(SIX).indices)


@pytest.mark.usefixtures("no_kept_run")
def test_a_run_without_memory_for_parts_is_simulated_in_one(monkeypatch):
    demands = []

    def check(demand, promised=0.0):
        demands.append(demand.n_bytes)
        if len(demands) == 1:
            raise study_run.CCWSIMError("too little memory")

    monkeypatch.setattr("ccwsim.jobs.job.admit", check)
    state = State(choices=SIX)
    start_run(state)
    assert not state.message
    assert state.job.wait(60)
    assert state.job.result.n == 6
    assert demands[1] < demands[0]
