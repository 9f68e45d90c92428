"""Test the page Flow: the live solution, a well, and the answers of all realizations."""

from __future__ import annotations

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid
from ccwsim.flow import darcy
from ccwsim.sharing.choices import Choices
from ccwsim.ui.flow.page import grdecl_zip, positions, thinned, times_csv, tracks_csv
from ccwsim.ui.flow.solving import (
    DAY,
    FlowState,
    duration,
    rock_of,
    set_well,
    settings_of,
    solution,
    start_answers,
    worth,
)
from ccwsim.ui.session.state import KEY, State
from tests.flow.test_flow import ensemble
from tests.ui.widgets import csv_rows, html, named, opened, texts


def state_of(shape: tuple[int, ...] = (24, 30)) -> State:
    """Return a session with random realizations of two facies as its results."""
    e, state = ensemble(5, shape), State()
    state.ensemble, state.ensemble_choices = e, Choices(grid=e.grid)
    state.choices = state.ensemble_choices
    return state


def launched(state: State) -> AppTest:
    app = opened("flow", state).run()
    assert not app.exception
    assert not app.error
    return app


def solved(state: State) -> State:
    start_answers(state)
    run = state.page(FlowState).run
    assert run is not None
    assert run.wait(120)
    assert run.error is None
    return state


@pytest.mark.parametrize("shape", [(24, 30), (4, 12, 15)])
def test_the_shown_realization_is_solved(shape):
    state = state_of(shape)
    app = launched(state)
    settings = settings_of(state.page(FlowState), state.ensemble)
    k = np.array(settings.conductivity)[state.ensemble.indices[0]]
    assert f"effective K {darcy(k, west_east=(1.0, 0.0)).effective_k:.3g} m/s" in html(app)
    assert "balance" in html(app)


def test_another_conductivity_gives_another_answer():
    state = state_of()
    app = launched(state)
    before = html(app)
    named(app.select_slider, "flow_k_1").set_value(1e-3).run()
    assert not app.exception
    after = app.session_state[KEY].page(FlowState)
    assert rock_of(after, state.ensemble.training_image, 1)[0] == 1e-3
    assert html(app) != before


def test_units_change_the_numbers_and_not_the_rocks():
    state = state_of()
    page_state = state.page(FlowState)
    before = settings_of(page_state, state.ensemble)
    app = launched(state)
    named(app.get("button_group"), "flow_unit").set_value("m/d").run()
    assert not app.exception
    assert settings_of(app.session_state[KEY].page(FlowState), state.ensemble) == before
    assert "m/d</span>" in html(app)


def test_equal_heads_are_refused_in_one_sentence():
    state = state_of()
    state.page(FlowState).high = 0.0
    app = launched(state)
    assert "so nothing flows" in texts(app)


def test_all_realizations_are_solved_with_a_well():
    state = state_of()
    set_well(state.page(FlowState), state.ensemble, (12, 20))
    assert state.page(FlowState).rate > 0
    app = launched(solved(state))
    result = state.page(FlowState).run.result
    assert result.times.shape[0] == 5
    assert result.capture.captured.shape[0] == 5
    assert "Brier score" in html(app)
    assert {b.label for b in app.button} >= {"Open", "Remove the well"}
    named(app.button, "flow_open_90").click().run()
    assert app.session_state[KEY].shown == int(np.argsort(result.k.each)[4])


def test_changed_settings_make_the_answers_out_of_date():
    state = solved(state_of())
    state.page(FlowState).high = 2.0
    assert "Solve all again" in html(launched(state))


def test_a_well_of_another_grid_is_left_out():
    state = state_of()
    state.page(FlowState).well = (100, 100)
    assert settings_of(state.page(FlowState), state.ensemble).well is None
    assert "No well" in html(launched(state))


def test_files_have_a_line_for_each_point_and_particle():
    state = solved(state_of())
    page_state = state.page(FlowState)
    found = solution(state.ensemble, 0, settings_of(page_state, state.ensemble)).work(
        lambda _: None
    )
    rows = csv_rows(tracks_csv(found.tracks))
    assert len(rows) == sum(map(len, found.tracks.paths))
    assert set(rows[0]) == {"track", "time_s", "x", "y"}
    assert len(csv_rows(times_csv(page_state.run.result))) == page_state.run.result.times.shape[1]
    assert grdecl_zip(state.ensemble, {0: 1.0, 1: 2.0}, 1.0, "a")[:2] == b"PK"


def test_particles_move_along_their_tracks():
    state = state_of()
    settings = settings_of(state.page(FlowState), state.ensemble)
    found = solution(state.ensemble, 0, settings).work(lambda _: None).tracks
    time = float(np.median(found.times))
    x0, x1 = (positions(found, share * time)[:, 0].mean() for share in (0.1, 0.5))
    assert x0 < x1
    assert len(thinned(found.paths[0][:, 1:])) <= len(found.paths[0])


def test_worth_names_both_scores():
    e = ensemble(4)
    state = State(ensemble=e)
    set_well(state.page(FlowState), e, (12, 15))
    start_answers(state)
    run = state.page(FlowState).run
    assert run.wait(120)
    text = worth(run.result.capture, run.result.capture.captured[0])
    assert "reference field" in text
    assert "constant" in text


def test_durations_have_units():
    assert duration(0.5 * DAY) == "0.5 d"
    assert "years" in duration(1e9)


def test_the_first_well_of_a_volume_is_in_the_middle():
    state = state_of((4, 12, 15))
    app = launched(state)
    named(app.button, "flow_place").click().run()
    assert not app.exception
    assert app.session_state[KEY].page(FlowState).well == (2, 6, 7)
    assert Grid(12, 15, nz=4).holds(np.array([[2, 6, 7]])).all()
