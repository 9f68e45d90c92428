"""Test the page Paper: the plan, the progress, the verdicts, the report and errors."""

from __future__ import annotations

import re
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from streamlit.testing.v1 import AppTest

import ccwsim.paper.reproduction as reproduction
import ccwsim.ui.paper.page as paper_page
from ccwsim import CCWSIMError
from ccwsim.jobs.job import Job
from ccwsim.paper.experiment import Experiment, Outcome, PaperInputs
from ccwsim.paper.reproduction import Finished
from ccwsim.report.document import Judgement, Text
from ccwsim.ui.paper.page import (
    PaperRun,
    PaperState,
    describe_source,
    ended_text,
    progress_label,
    server_inputs,
    verdict_list,
)
from ccwsim.ui.session.progress import progress_text
from ccwsim.ui.session.state import KEY, State
from tests.ui.widgets import html, named, opened

ROOT = Path(__file__).parents[3]
ODD = "<b>&"


def quick(run) -> Outcome:
    run.step()
    verdicts = (("agrees", "good"), ("differs", "bad"))
    judgements = tuple(Judgement(f"not {w}?", "found", w, tone) for w, tone in verdicts)
    return Outcome((Text("words"),), judgements)


def failing(run) -> Outcome:
    raise CCWSIMError(f"no room for {ODD}")


def made(name: str, run=quick) -> Experiment:
    return Experiment(f"{name} {ODD}", "Section 0", "shows", run)


@pytest.fixture
def few(monkeypatch):
    """Return a page with three small experiments, one of which fails."""
    chosen = (made("first"), made("second", failing), made("third"))
    use(monkeypatch, chosen)
    return chosen


def use(monkeypatch, chosen) -> None:
    for module in (paper_page, reproduction):
        monkeypatch.setattr(module, "EXPERIMENTS", chosen)


def launched(**changes) -> AppTest:
    app = opened("paper", State(pages={PaperState: PaperState(**changes)})).run()
    assert not app.exception
    return app


def test_the_cold_page_says_what_it_will_do_and_runs_nothing(monkeypatch):
    monkeypatch.delenv("CCWSIM_DATA", raising=False)
    app = launched()
    said = html(app)
    assert re.search(r"13 experiments, about \d+ min on two cores\.", said)
    assert "bundled training images" in said
    for experiment in reproduction.EXPERIMENTS:
        assert experiment.title in said
    assert app.session_state[KEY].page(PaperState).run is None
    named(app.get("button_group"), "paper_extent").set_value(True).run()
    assert app.session_state[KEY].page(PaperState).quick
    assert re.search(r"about \d+ s on two cores", html(app))


def test_a_run_shows_verdicts_and_gives_the_report(few):
    app = launched()
    named(app.button, "paper_start").click().run()
    run = app.session_state[KEY].page(PaperState).run
    assert run.job.wait(60)
    app.run()
    assert not app.exception
    said = html(app)
    assert "3 experiments were run, 1 of them failed" in said
    assert '<span class="good">agrees</span>, <span class="bad">differs</span>' in said
    assert "failed: no room for &lt;b&gt;&amp;" in said
    assert ODD not in said
    assert run.report.startswith(b"<!DOCTYPE html>")
    assert [b.proto.label for b in app.get("download_button")] == ["Download the report (0 MB)"]
    assert named(app.button, "paper_start").label == "Run again"


def test_a_run_is_followed_by_name_and_can_be_cancelled(monkeypatch):
    go, inside = threading.Event(), threading.Event()

    def waiting(run) -> Outcome:
        inside.set()
        assert go.wait(60)
        run.step()
        return quick(run)

    use(monkeypatch, (made("first"), made("second", waiting), made("third")))
    app = launched()
    named(app.button, "paper_start").click().run()
    assert inside.wait(60)
    app.run()
    run = app.session_state[KEY].page(PaperState).run
    assert progress_text(run.job, progress_label(run)).startswith(
        f"1 of 3 experiments · now second {ODD}"
    )
    assert html(app).count('<span class="good">agrees</span>') == 1
    named(app.button, "paper_cancel").click().run()
    assert progress_text(run.job, progress_label(run)).endswith("Stopping …")
    go.set()
    assert run.job.wait(60)
    app.run()
    assert not app.exception
    assert "Stopped. 1 experiments were run" in html(app)
    assert b"The run was stopped" in run.report


def test_a_broken_folder_of_the_server_is_said_and_ours_is_used(monkeypatch, tmp_path):
    monkeypatch.setenv("CCWSIM_DATA", str(tmp_path / "none"))
    assert server_inputs()[0] == PaperInputs()
    app = launched()
    assert "CCWSIM_DATA on the server" in app.warning[0].value
    assert "bundled" in html(app)


def test_the_folder_of_the_server_is_used_where_it_is_right(monkeypatch, data_dir):
    monkeypatch.setenv("CCWSIM_DATA", str(data_dir))
    inputs, problem = server_inputs()
    assert problem == ""
    assert inputs.is_own("channel")
    assert "authors’" in describe_source(inputs)
    assert str(data_dir) not in html(launched())


def test_a_run_that_breaks_down_is_said():
    def broken(job):
        raise RuntimeError("no disk")

    run = PaperRun(PaperInputs(), True, 0)
    run.job = Job(broken)
    assert run.job.wait(10)
    assert ended_text(run).startswith("The run ended early: an error, number")
    app = launched(run=run)
    assert "in the server's log" in app.error[0].value
    assert app.get("download_button") == []


def test_experiments_to_come_are_quiet():
    done = Finished(reproduction.EXPERIMENTS[0], quick(_Silent()), "", 1.0)
    said = verdict_list([done])
    assert said.count("<details>") == 1
    assert said.count('class="coming"') == len(reproduction.EXPERIMENTS) - 1
    assert "<td>not agrees?</td><td>found</td>" in said


class _Silent:
    def step(self) -> None:
        """Ignore progress."""


def test_choices_survive_another_page():
    state = PaperState(quick=True, seed=7)
    app = launched(quick=state.quick, seed=state.seed)
    assert named(app.number_input, "paper_seed").value == 7
    assert replace(state, seed=8).quick


def test_the_steps_and_the_paper_as_a_program_are_shown_whole():
    app = opened("paper_and_ours").run()
    assert not app.exception
    document = (ROOT / "docs" / "method.md").read_text("utf-8")
    rows = [line for line in document.splitlines() if line.startswith("|") and "|--" not in line]
    said = html(app)
    assert said.count("<tr>") == len(rows)
    for step in ("inverse DWT", "minimum error boundary cut", "seam repair", "channel, 397 data"):
        assert f"<th>{step}</th>" in said
    program = (ROOT / "docs" / "the_paper.py").read_text("utf-8")
    assert [code.value for code in app.code] == [program.rstrip()]
