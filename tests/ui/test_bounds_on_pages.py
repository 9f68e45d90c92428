"""Test that a study at any bound opens from a link and a project, on usable pages."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ccwsim.model.bounds import MAX_GRID_SIDE_OFFERED
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid
from ccwsim.model.parameters import Parameters
from ccwsim.sharing.choices import Choices, DataChoice, Shown, Upload
from ccwsim.sharing.codec import FIELDS, FieldSpec, parts_of
from ccwsim.sharing.link import link_of
from ccwsim.sharing.project import Project, project_as_bytes
from ccwsim.ui.session.resolve import study_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.share.menu import open_project
from tests.some import some
from tests.ui.widgets import html, named, opened, texts

SMALL = Choices(
    data=DataChoice(),
    grid=Grid(24, 32),
    parameters=Parameters(template_size=16, overlap_size=4, wavelet_level=1),
    n_realizations=1,
)
SIDE = MAX_GRID_SIDE_OFFERED
SHAPES = [(1, 1), (1, 300), (300, 1), (1, SIDE), (SIDE, 1)]


def at_bounds() -> list[Choices]:
    """Return studies with one number (or pair) at its lowest or highest value, if it is allowed."""
    found: list[Choices | None] = [replace(SMALL, grid=Grid(*shape)) for shape in SHAPES]
    for row in FIELDS:
        has_bounds = row.kind not in ("sizes", "word") and not row.words
        if row.part in ("grid", "parameters", "study") and has_bounds:
            found += [
                choices for bound in (row.low, row.high) if (choices := with_value(row, bound))
            ]
    return found


def with_value(row: FieldSpec, bound: float) -> Choices | None:
    """Return the small study with one setting at a bound, or at ±1e300 without a bound."""
    bound = max(min(bound, 1e300), -1e300)
    value = (bound, bound) if row.kind == "lengths" else bound
    value = value if isinstance(value, tuple) or row.kind not in ("count", "whole") else int(value)
    parts = parts_of(SMALL, Shown())
    try:
        part = replace(parts[row.part], **row.as_fields(value))
    except CCWSIMError:  # valid only together with other settings
        return None
    named_part = {"grid": "grid", "parameters": "parameters"}.get(row.part)
    return replace(SMALL, **{named_part: part}) if named_part else part


def name_of(choices: Choices) -> str:
    query = {key: values for key, values in link_of(choices).items() if key != "data"}
    return "&".join(f"{key}={values[0][:12]}" for key, values in query.items())


def rested(app):
    """Return the page when its job is finished and the page is drawn."""
    while (job := app.session_state[KEY].job) is not None:
        assert job.wait(120)
        app.run()
    assert not app.exception
    assert "could not be drawn" not in texts(app)
    return app


QUICK = [c for c in at_bounds() if c.n_realizations == 1][::3]


def goes_together(choices: Choices) -> bool:
    try:
        study_of(choices)
    except CCWSIMError:  # a link is adjusted, and no project is written
        return False
    return True


@pytest.mark.slow
@pytest.mark.parametrize("choices", [*filter(goes_together, at_bounds())], ids=name_of)
def test_a_project_at_a_bound_opens(choices):
    content = project_as_bytes(Project(study_of(choices), choices.n_realizations))
    state = State()
    open_project(state, Upload("bound.ccwsim", content))
    assert state.job is not None
    state.job.cancel()
    assert study_of(state.choices).grid == choices.grid


@pytest.mark.slow
@pytest.mark.parametrize("choices", some(at_bounds(), always=QUICK), ids=name_of)
def test_a_link_at_a_bound_opens(choices):
    app = opened("simulate")
    for key, values in link_of(choices).items():
        app.query_params[key] = values
    rested(app.run())
    state = app.session_state[KEY]
    assert not app.error
    assert state.choices.grid == choices.grid
    assert state.choices.n_realizations == choices.n_realizations


@pytest.mark.slow
@pytest.mark.parametrize("page", ["validate", "data", "compare", "sweep", "how_it_works"])
@pytest.mark.parametrize("shape", some([(1, 1), (1, 300)], always=[(1, 1)]))
def test_other_pages_take_one_row_and_one_cell(page, shape):
    app = rested(opened(page, State(choices=replace(SMALL, grid=Grid(*shape)))).run())
    assert "number" not in " ".join(error.value for error in app.error if "report" in error.value)


@pytest.mark.slow
def test_a_session_can_always_start_afresh():
    # a seed that differs from all times and shares on the page
    app = rested(opened("simulate", State(choices=replace(SMALL, seed=987654))).run())
    assert named(app.number_input, "seed").value == 987654
    named(app.button, "afresh").click().run()
    assert app.session_state[KEY].choices == Choices()
    assert named(app.number_input, "seed").value == 0
    assert "987654" not in html(app)


def test_a_step_that_cannot_be_drawn_leaves_the_others(monkeypatch):
    def broken(state):
        raise RuntimeError("a fault")

    broken.__name__ = "grid_step"
    monkeypatch.setattr("ccwsim.ui.study.study_column.grid_step", broken)
    app = opened("simulate", State(choices=SMALL)).run()
    assert not app.exception
    assert "could not be drawn" in texts(app)
    assert named(app.number_input, "seed").value == 0
