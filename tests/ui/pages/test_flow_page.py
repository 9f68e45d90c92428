"""Test the page Flow: the live solution, a well, and the answers of all realizations."""

from __future__ import annotations

from io import BytesIO
from types import SimpleNamespace
from zipfile import ZipFile

import numpy as np
import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import CCWSIMError, Grid, io
from ccwsim.flow import darcy
from ccwsim.model.numbers import with_power
from ccwsim.sharing.choices import Choices
from ccwsim.ui.flow.page import particle_positions, thinned, times_csv, tracks_csv, with_tracks
from ccwsim.ui.flow.solving import (
    FlowState,
    flow_settings,
    model_downloads,
    rock_of,
    set_well,
    solution,
    start_answers,
    take_choice,
    take_strokes,
    worth,
)
from ccwsim.ui.frontend.cells import facies_map
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.widgets import errors
from tests.flow.test_flow import ensemble
from tests.flow.test_outline import catchment
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
    settings = flow_settings(state.flow, state.ensemble)
    k = np.array(settings.conductivity)[state.ensemble.indices[0]]
    effective = with_power(darcy(k, west_east=(1.0, 0.0)).effective_k)
    assert f"effective K {effective} m/s" in html(app)
    assert "balance" in html(app)


def test_another_conductivity_gives_another_answer():
    state = state_of()
    app = launched(state)
    before = html(app)
    named(app.select_slider, "flow_k_1").set_value(1e-3).run()
    assert not app.exception
    after = app.session_state[KEY].flow
    assert rock_of(after, state.ensemble.training_image, 1)[0] == 1e-3
    assert html(app) != before


def test_units_change_the_numbers_and_not_the_rocks():
    state = state_of()
    before = flow_settings(state.flow, state.ensemble)
    app = launched(state)
    named(app.get("button_group"), "flow_unit").set_value("m/d").run()
    assert not app.exception
    assert flow_settings(app.session_state[KEY].flow, state.ensemble) == before
    assert "m/d</span>" in html(app)


def test_equal_heads_are_refused_in_one_sentence():
    state = state_of()
    state.change_flow(high=0.0)
    app = launched(state)
    assert "so nothing flows" in texts(app)


def test_all_realizations_are_solved_with_a_well():
    state = state_of()
    set_well(state, state.ensemble, (12, 20))
    assert state.flow.rate > 0
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
    state.change_flow(high=2.0)
    assert "Solve all again" in html(launched(state))


def test_a_well_of_another_grid_is_left_out():
    state = state_of()
    state.change_flow(well=(100, 100))
    assert flow_settings(state.flow, state.ensemble).well is None
    assert "No well" in html(launched(state))


def test_files_have_a_line_for_each_point_and_particle():
    state = solved(state_of())
    page_state = state.page(FlowState)
    found = solution(state.ensemble, 0, flow_settings(state.flow, state.ensemble)).work(
        lambda _: None
    )
    rows = csv_rows(tracks_csv(found.tracks))
    assert len(rows) == sum(map(len, found.tracks.paths))
    assert set(rows[0]) == {"track", "time_s", "x", "y"}
    assert len(csv_rows(times_csv(page_state.run.result))) == page_state.run.result.times.shape[1]


def test_particles_move_along_their_tracks():
    state = state_of()
    settings = flow_settings(state.flow, state.ensemble)
    found = solution(state.ensemble, 0, settings).work(lambda _: None).tracks
    time = float(np.median(found.times))
    x0, x1 = (particle_positions(found, share * time)[:, 0].mean() for share in (0.1, 0.5))
    assert x0 < x1
    assert len(thinned(found.paths[0])) <= len(found.paths[0])


def test_worth_names_both_scores():
    e = ensemble(4)
    state = State(ensemble=e)
    set_well(state, e, (12, 15))
    start_answers(state)
    run = state.page(FlowState).run
    assert run.wait(120)
    text = worth(run.result.capture, run.result.capture.captured[0])
    assert "reference field" in text
    assert "constant" in text


def test_the_first_well_of_a_volume_is_in_the_middle():
    state = state_of((4, 12, 15))
    app = launched(state)
    named(app.button, "flow_place").click().run()
    assert not app.exception
    assert app.session_state[KEY].flow.well == (2, 6, 7)
    assert Grid(12, 15, nz=4).holds(np.array([[2, 6, 7]])).all()


def solution_of(state: State) -> tuple:
    """Return the settings and the solution of the first realization."""
    settings = flow_settings(state.flow, state.ensemble)
    return settings, solution(state.ensemble, 0, settings).work(lambda _: None)


def test_a_choice_on_a_map_moves_the_well_and_the_heads():
    state = state_of()
    take_choice(state, state.ensemble, {"well": [3, 4], "heads": [2, 0.5]})
    assert (state.flow.well, state.flow.high, state.flow.low) == ((3, 4), 2.0, 0.5)
    assert state.flow.rate > 0
    take_choice(state, state.ensemble, {"well": None, "heads": None})
    assert state.flow.well == (3, 4)
    app = launched(state)
    assert "Well in row 3, column 4" in html(app)
    assert "effective K" not in html(app)


def test_a_stroke_of_the_cross_hairs_moves_the_well_of_a_volume_to_its_end():
    state = state_of((4, 12, 15))
    strokes = [{"seq": 5, "cells": [[0, 1, 1], [0, 2, 3]]}, {"seq": 6, "do": "undo"}]
    take_strokes(state, state.ensemble, strokes)
    assert (state.flow.well, state.page(FlowState).ack) == ((0, 2, 3), 6)
    app = launched(state)
    assert "Well in layer 0, row 2, column 3" in html(app)
    named(app.toggle, "flow_follows").set_value(False).run()
    assert not app.session_state[KEY].page(FlowState).follows


@pytest.mark.parametrize("shape", [(24, 30), (4, 12, 15)])
def test_tracks_are_lines_through_the_cells_in_the_colour_of_their_time(shape):
    state = state_of(shape)
    set_well(state, state.ensemble, tuple(n // 2 for n in shape))
    settings, found = solution_of(state)
    image = state.ensemble.training_image
    shown = facies_map(state.ensemble.indices[0], image, ["#000000", "#FFFFFF"], "a")
    shown = with_tracks(shown, found, settings, 0)
    *times, captured = range(len(shown.line_colours))
    n = len(found.tracks.paths)
    for line, path in zip(shown.lines, found.tracks.paths, strict=False):
        np.testing.assert_allclose(line[0][:-1], path[0, :0:-1], atol=0.01)
        np.testing.assert_allclose(line[-1][:-1], path[-1, :0:-1], atol=0.01)
        assert [point[-1] for point in line] == sorted(point[-1] for point in line)
        assert {point[-1] for point in line} <= set(times)
    assert {point[-1] for line in shown.lines[n:] for point in line} == {captured}
    assert len(shown.lines) == n + len(found.to_well.paths)
    assert len(shown.points) == len(shape) - 2


@pytest.mark.parametrize("page", ["flow", "simulate"])
def test_models_for_other_programs_name_and_have_the_values_of_the_page(page):
    state = state_of()
    state.last_attempt = state.choices
    state.change_flow(rocks=(("mud", (2e-9, 0.2)), ("sand", (3e-5, 0.3))))
    app = opened(page, state).run()
    if page == "simulate":
        app.session_state["downloads"] = True
        app.run()
    assert not app.exception
    labels = {element.proto.label for element in app.get("download_button")}
    assert {"GRDECL with permeability", "MODFLOW 6, realization 1"} <= labels
    title = "Models for flow programs, with the values of Flow: K in m/s: mud 2 × 10⁻⁹, sand 3 ×"
    assert title in html(app)


def test_models_for_other_programs_contain_the_realizations():
    state = state_of()
    set_well(state, state.ensemble, (12, 20))
    settings = flow_settings(state.flow, state.ensemble)
    (files,) = model_downloads(state.flow, state.ensemble, 1).values()
    eclipse, modflow = (ZipFile(BytesIO(file.content())) for file in files)
    inc = [name for name in eclipse.namelist() if name.endswith(".inc")]
    assert len(inc) == 2 * state.ensemble.n  # permeability and facies
    of_facies = io.millidarcy(np.array(settings.conductivity))
    assert all(f"{k:.9g}"[:8] in eclipse.read(inc[0]).decode() for k in of_facies.tolist())
    assert {"mfsim.nam", "flow.wel", "flow.ghb", "flow.npf"} <= {*modflow.namelist()}


def catchment_state() -> State:
    state, e = state_of(), catchment(3)
    state.ensemble, state.ensemble_choices = e, Choices(grid=e.grid)
    state.choices = state.ensemble_choices
    return state


def test_a_catchment_starts_with_heads_along_its_outline_and_says_so():
    state = catchment_state()
    app = launched(state)
    assert "heads are fixed along the outline" in texts(app) + html(app)
    assert "effective K" in html(app)
    settings, found = solution_of(state)
    assert found.flow.fixed == {"edge": (1.0, 0.0)}
    assert (found.tracks.status == 0).all()
    inflow = found.flow.inflow
    named(app.number_input, "flow_thickness").set_value(20.0).run()
    assert not app.exception
    state = app.session_state[KEY]
    assert solution_of(state)[1].flow.inflow == pytest.approx(20 * inflow)
    named(app.get("button_group"), "flow_along").set_value("points").run()
    assert not app.exception
    named(app.number_input, "flow_point_2").set_value(850000.0).run()
    settings = flow_settings(app.session_state[KEY].flow, state.ensemble)
    assert settings.ends.along == ((844000.0, 6521500.0), (850000.0, 6527500.0))


def test_sides_without_active_cells_are_refused_until_the_outline_is_chosen():
    state = catchment_state()
    state.change_flow(axis="x")
    app = launched(state)
    assert "along the outline of the active cells" in texts(app)
    start_answers(state)
    assert state.page(FlowState).run.wait(60)
    app = launched(state)
    assert "Not solved" in texts(app)
    named(app.get("button_group"), "flow_axis").set_value("edge").run()
    assert not app.exception
    assert "Not solved" not in texts(app)
    assert "effective K" in html(app)


def test_one_head_along_the_outline_needs_a_well_whose_capture_is_that_of_active_cells():
    state = catchment_state()
    page_state = state.page(FlowState)
    state.change_flow(axis="edge", along="constant")
    assert "place a well" in texts(launched(state))
    set_well(state, state.ensemble, (30, 75))  # at the edge of the active cells
    assert state.flow.rate > 0
    app = launched(solved(state))
    result = page_state.run.result
    assert result.k is None
    inactive = np.isnan(result.capture.probability).ravel()
    cells = state.ensemble.grid.cells_of(*result.capture.starts.T)
    np.testing.assert_array_equal(inactive, ~state.ensemble.active[tuple(cells.T)])
    assert "Brier score" in html(app)


def test_models_of_a_catchment_have_heads_along_its_outline():
    state = catchment_state()
    state.change_flow(thickness=7.0)
    ((title, files),) = model_downloads(state.flow, state.ensemble, 1).items()
    assert "heads along the outline" in title
    assert "thickness 7 m" in title
    eclipse, modflow = (ZipFile(BytesIO(file.content())) for file in files)
    assert "ACTNUM\n" in eclipse.read(eclipse.namelist()[1]).decode()
    ghb = modflow.read("flow.ghb").decode()
    assert len(ghb.splitlines()) > len(solution_of(state)[1].flow.fixed_faces.heads)


def test_the_reason_of_a_failed_download_is_shown_when_the_page_is_drawn_again(monkeypatch):
    session = SimpleNamespace(session_state={}, session_id="one")
    requests = []
    monkeypatch.setattr(errors, "get_script_run_ctx", lambda **_: session)
    monkeypatch.setattr(errors.Runtime, "exists", lambda: True)
    monkeypatch.setattr(errors, "_draw_again", requests.append)

    def content() -> bytes:
        raise CCWSIMError("well in cell (1, 2) is inactive; move it")

    with pytest.raises(CCWSIMError):
        errors.tells_errors(content)()
    assert "is inactive" in session.session_state[errors.PENDING_ERROR]
    assert requests == ["one"]
