"""Test that an error on a page gives a message and a log entry, and that no work is lost."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from pathlib import Path

import pytest
from streamlit.testing.v1 import AppTest

from ccwsim import Grid, Parameters
from ccwsim.model.errors import CCWSIMError
from ccwsim.sharing.choices import Choices, DataChoice
from ccwsim.ui.frontend.component import reported
from ccwsim.ui.page import show_page
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.run import collect, start_run
from ccwsim.ui.widgets.errors import catch_callback_errors
from tests.ui.widgets import named, open_menus

ROOT = Path(__file__).parents[2]
SMALL = Choices(
    data=DataChoice(), grid=Grid(48, 64), parameters=Parameters(template_size=16, overlap_size=4),
    n_realizations=2,
)  # fmt: skip
PAGES = sorted(path.stem for path in (ROOT / "pages").glob("*.py"))


@pytest.fixture(scope="module")
def finished() -> State:
    """Return a study with results."""
    state = State(choices=SMALL)
    start_run(state)
    assert state.job is not None
    assert state.job.wait(300)
    collect(state)
    assert state.ensemble is not None
    return state


def launched(page: str, finished: State) -> AppTest:
    app = open_menus(AppTest.from_file(str(ROOT / "pages" / f"{page}.py"), default_timeout=120))
    app.session_state[KEY] = State(
        choices=SMALL, last_attempt=SMALL, ensemble_choices=SMALL, ensemble=finished.ensemble
    )
    return app


def boom(*args, **kwargs):
    raise RuntimeError("boom at /srv/secret/place")


def errors(app: AppTest) -> list[str]:
    return [error.value for error in app.error]


def break_body(monkeypatch) -> None:
    """Let the body of each page raise an error after it is drawn."""

    def shown(title, body, **options):
        show_page(title, lambda state: (body(state), boom()), **options)

    monkeypatch.setattr("ccwsim.ui.page.show_page", shown)


def break_fragment(monkeypatch) -> None:
    """Let a fragment of a page raise an error."""
    monkeypatch.setattr("ccwsim.ui.widgets.facts.facts_of", boom)


def break_top(monkeypatch) -> None:
    """Let the part above the body of each page raise an error."""
    monkeypatch.setattr("streamlit.page_link", boom)


@pytest.mark.parametrize(
    ("page", "break_it"),
    [*((page, break_body) for page in PAGES), ("simulate", break_fragment), ("data", break_top)],
)
def test_an_error_is_said_calmly_and_loses_nothing(page, break_it, finished, monkeypatch, caplog):
    app = launched(page, finished)
    break_it(monkeypatch)
    app.run()
    state = app.session_state[KEY]
    assert not app.exception
    said = errors(app)[0]
    assert said.startswith("This could not be drawn. Your training image, data, settings and")
    assert "boom" not in said
    assert "secret" not in said
    assert "Traceback" not in said
    number = said.split("report number ")[1].split(";")[0]
    (record, *_) = [r for r in caplog.records if number in r.getMessage()]
    assert record.exc_info is not None
    assert "boom" in caplog.text
    assert "Traceback" in caplog.text
    assert state.ensemble is finished.ensemble
    assert state.choices == SMALL
    monkeypatch.undo()
    app.run()
    assert errors(app) == []


@pytest.mark.parametrize(
    ("error", "words"),
    [(MemoryError(), "not enough memory"), (CCWSIMError("seed: *bad*"), r"seed: \*bad\*")],
)
def test_errors_that_a_user_can_fix_say_how(error, words, finished, monkeypatch):
    def raising(*_, **options):
        raise error

    app = launched("simulate", finished)
    monkeypatch.setattr("ccwsim.ui.widgets.facts.facts_of", raising)
    app.run()
    assert not app.exception
    assert words in errors(app)[0]


@pytest.mark.slow
def test_an_error_of_a_button_is_said_on_the_page_that_follows(finished, monkeypatch, caplog):
    monkeypatch.setattr("ccwsim.ui.study.run.start_run", boom)
    app = launched("simulate", finished).run()
    assert errors(app) == []
    named(app.button, "run").click()
    app.run()
    assert not app.exception
    (said,) = errors(app)
    assert said.startswith("This could not be done.")
    assert "Traceback" in caplog.text
    assert app.session_state[KEY].ensemble is finished.ensemble
    app.run()
    assert errors(app) == []


def test_an_error_of_a_box_is_said_and_the_value_stays(finished, monkeypatch):
    monkeypatch.setattr(State, "change", boom)
    app = launched("simulate", finished).run()
    named(app.number_input, "seed").set_value(77)
    app.run()
    assert not app.exception
    assert len(errors(app)) == 1
    assert app.session_state[KEY].choices == SMALL


def test_a_study_that_cannot_be_drawn_has_a_way_back(finished, monkeypatch):
    app = launched("simulate", finished).run()
    assert app.session_state[KEY].drawn == SMALL
    real = __import__("ccwsim.ui.study.image_step", fromlist=["image_thumbnail"]).image_thumbnail
    monkeypatch.setattr("ccwsim.ui.study.image_step.image_thumbnail", boom)
    app.session_state[KEY].choices = replace(SMALL, seed=9)
    app.run()
    assert len(errors(app)) == 1
    monkeypatch.setattr("ccwsim.ui.study.image_step.image_thumbnail", real)
    named(app.button, "way_back").click()
    app.run()
    assert errors(app) == []
    assert app.session_state[KEY].choices == SMALL


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_whatever_a_widget_calls_is_guarded(page, finished):
    app = launched(page, finished)
    app.run()
    state = app.session_state._state._state._new_widget_state
    calls = [
        call
        for one in state.widget_metadata.values()
        for call in (one.callback, *(one.callbacks or {}).values())
        if call is not None
    ]
    assert calls or page == "examples"
    assert [call for call in calls if not getattr(call, "is_safe", False)] == []


HELPERS = {"button", "fields.button", "file_uploader", "use_button"}
"""Functions that catch the errors of their callbacks themselves."""


def sources() -> list[tuple[str, ast.Module]]:
    paths = sorted((ROOT / "ccwsim" / "ui").rglob("*.py"))
    return [(path.name, ast.parse(path.read_text("utf-8"))) for path in paths]


@pytest.mark.slow
def test_whatever_the_source_hands_to_a_widget_is_guarded():
    """Test the callbacks of all widgets in the source, also of widgets that no test draws."""
    handed = [
        (f"{name}: {ast.unparse(call)}", keyword.value)
        for name, tree in sources()
        for call in ast.walk(tree)
        if isinstance(call, ast.Call) and ast.unparse(call.func).split("(")[0] not in HELPERS
        for keyword in call.keywords
        if re.fullmatch("on_(click|submit|select|.*change)", keyword.arg or "")
    ]
    assert handed
    for where, value in handed:
        said = ast.unparse(value)
        assert said.startswith("catch_callback_errors(") or isinstance(value, ast.Constant), where


def fragments() -> list[tuple[str, ast.FunctionDef]]:
    """Return all functions that Streamlit runs as fragments."""
    found = []
    for name, tree in sources():
        passed = {
            ast.unparse(call.args[0])
            for call in ast.walk(tree)
            if isinstance(call, ast.Call) and ast.unparse(call.func) == "st.fragment" and call.args
        }
        for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
            marks = [ast.unparse(mark).split("(")[0] for mark in function.decorator_list]
            if "st.fragment" in marks or function.name in passed:
                found.append((name, function))
    return found


@pytest.mark.slow
def test_the_body_of_every_fragment_is_guarded():
    assert len(fragments()) > 5
    for name, function in fragments():
        boundary = [
            node
            for node in function.body
            if isinstance(node, ast.With) and ast.unparse(node.items[0]) == "error_boundary()"
        ]
        assert boundary, f"{name}: {function.name}"


def test_what_streamlit_does_with_a_rerun_is_not_taken_for_an_error():
    from streamlit.runtime.scriptrunner import RerunException
    from streamlit.runtime.scriptrunner_utils.script_requests import RerunData

    def again():
        raise RerunException(RerunData())

    with pytest.raises(RerunException):
        catch_callback_errors(again)()


def test_a_component_of_an_interrupted_run_reports_nothing():
    assert reported("a_map", "cell") is None
