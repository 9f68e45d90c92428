"""A fresh machine shows stored realizations, says so, and replaces them by its own."""

from __future__ import annotations

from threading import Event

import pytest
from streamlit.testing.v1 import AppTest

from ccwsim.engine import kernels
from ccwsim.ui.session import progress
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study import run
from tests.ui.test_pages import ROOT, SMALL, html
from tests.ui.widgets import opened


@pytest.fixture
def held(monkeypatch):
    """Kernels that are not ready, and simulations that wait until the event is set."""
    release = Event()
    own = run.simulate

    def simulate(*arguments, **options):
        release.wait(60)
        return own(*arguments, **options)

    monkeypatch.setattr(run, "simulate", simulate)
    monkeypatch.setattr(run, "is_ready", lambda: False)
    yield release
    release.set()


def test_stored_realizations_are_marked_and_replaced(held):
    app = AppTest.from_file(str(ROOT / "pages" / "simulate.py"), default_timeout=120).run()
    state: State = app.session_state[KEY]
    assert state.ensemble is not None
    assert state.ensemble.is_stored
    assert "stored with the program, not run on this machine" in html(app)
    assert "CPU each" not in html(app)
    stored = state.ensemble.digest
    held.set()
    assert state.job is not None
    assert state.job.wait(60)
    app.run()
    state = app.session_state[KEY]
    assert state.ensemble is not None
    assert not state.ensemble.is_stored
    assert state.ensemble.digest == stored
    assert "CPU each" in html(app)
    assert "stored with the program" not in html(app)


def test_no_other_study_is_shown_from_the_store(held):
    app = AppTest.from_file(str(ROOT / "pages" / "simulate.py"), default_timeout=120)
    app.query_params["seed"] = "5"
    app.run()
    assert app.session_state[KEY].ensemble is None


def test_compiling_says_how_many_kernels_are_done(monkeypatch):
    assert "of" not in progress.compilation_text().split(":")[0].replace("of this", "")
    monkeypatch.setattr(progress, "compilation", lambda: (7, 24, "search"))
    assert "7 of 24 done" in progress.compilation_text()
    assert kernels.COMPILE_TIME in progress.compilation_text()


@pytest.mark.parametrize("page", ["sweep", "benchmark", "paper"])
def test_an_estimate_of_time_says_that_kernels_compile_before(page, monkeypatch):
    said = "Before that the kernels compile, once"
    for must in (True, False):
        monkeypatch.setattr(progress, "must_compile", lambda must=must: must)
        app = opened(page, State(choices=SMALL)).run()
        assert not app.exception
        assert (said in html(app)) == must


def test_kernels_must_compile_where_they_are_neither_loaded_nor_on_disk(monkeypatch):
    for ready, disk, must in (
        (False, {"paste"}, True),
        (False, kernels.OUTERMOST | {"paste"}, False),
        (True, set(), False),
    ):
        monkeypatch.setattr(kernels, "_ready", ready)
        monkeypatch.setattr(kernels, "kernels_on_disk", lambda disk=disk: disk)
        assert kernels.must_compile() == must
