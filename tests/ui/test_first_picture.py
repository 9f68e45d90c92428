"""Test that a new machine shows stored realizations, marks them, and then recomputes them."""

from __future__ import annotations

import re
from threading import Event

import pytest
from streamlit.testing.v1 import AppTest

from ccwsim.engine import compilation, numba_hooks
from ccwsim.ui.session import progress
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study import run
from ccwsim.ui.widgets.text import page_labels
from tests.ui.test_pages import ROOT, SMALL, html
from tests.ui.widgets import opened


@pytest.fixture
def held(monkeypatch):
    """Yield an event for which simulations wait, with kernels that are not compiled."""
    release = Event()
    own = run.simulate_study

    def simulate(*arguments, **options):
        release.wait(60)
        return own(*arguments, **options)

    monkeypatch.setattr(run, "simulate_study", simulate)
    monkeypatch.setattr(run, "is_ready", lambda: False)
    yield release
    release.set()


@pytest.mark.usefixtures("no_kept_run")
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


@pytest.mark.slow
def test_no_other_study_is_shown_from_the_store(held):
    app = AppTest.from_file(str(ROOT / "pages" / "simulate.py"), default_timeout=120)
    app.query_params["seed"] = "5"
    app.run()
    assert app.session_state[KEY].ensemble is None


def test_compiling_says_how_many_kernels_are_done_and_how_long_it_takes(monkeypatch):
    start = "Compiling kernels for this kind of study, once on this machine"
    monkeypatch.setattr(progress, "compilation", lambda: None)
    assert progress.compilation_text() == f"{start} …"
    modules = ("ccwsim.engine.tiles", "ccwsim.engine.corrections.guidance", "ccwsim.engine.tiles")
    for left, said in ((None, ""), (20.2, ", about 20 s left")):
        now = compilation.CompilationProgress(7, 24, left, modules)
        monkeypatch.setattr(progress, "compilation", lambda now=now: now)
        assert progress.compilation_text() == f"{start} (guides, patches): 7 of 24 done{said} …"


def test_the_feature_of_each_compiled_module_has_a_name():
    pattern = re.compile(r"^@\w*kernel\b", re.MULTILINE)
    package = ROOT / "ccwsim"
    modules = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for path in package.rglob("*.py")
        if pattern.search(path.read_text("utf-8"))
    }
    assert len(modules) > 20
    assert modules == set(page_labels("kernels"))


@pytest.mark.parametrize("page", ["sweep", "benchmark", "paper"])
def test_an_estimate_of_time_says_that_kernels_compile_before(page, monkeypatch):
    said = "Kernels are compiled first; this happens only once."
    for must in (True, False):
        monkeypatch.setattr(progress, "must_compile", lambda must=must: must)
        app = opened(page, State(choices=SMALL)).run()
        assert not app.exception
        assert (said in html(app)) == must


def test_kernels_must_compile_unless_they_are_on_disk(monkeypatch, tmp_path):
    monkeypatch.setattr(compilation, "KERNEL_FOLDER", str(tmp_path))
    for name in sorted(compilation.ENTRY_KERNELS):
        assert compilation.must_compile()
        file = tmp_path / f"module.{name}-12.py311.1.nbc"
        file.write_bytes(b"code" + numba_hooks._digest(b"code"))
    assert not compilation.must_compile()
    file.write_bytes(file.read_bytes()[:-1])
    assert compilation.must_compile()
