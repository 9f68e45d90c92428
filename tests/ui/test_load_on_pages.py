"""Test the messages of a busy server: its limits, its queue, and scarce memory."""

from __future__ import annotations

import inspect
import logging
from dataclasses import replace
from threading import Event

import pytest
from streamlit.runtime import app_session
from streamlit.runtime.scriptrunner_utils import script_run_context
from streamlit.testing.v1 import AppTest

from ccwsim import CCWSIMError, Grid, datasets
from ccwsim.experiments.trials import Trial
from ccwsim.jobs import limits
from ccwsim.jobs.job import Job, Queue, server_queue
from ccwsim.jobs.limits import RESERVE
from ccwsim.jobs.memo import Memo
from ccwsim.jobs.scheduler import Lease, Usage
from ccwsim.jobs.statistics import StatisticsWorker, Task
from ccwsim.sharing.choices import DataChoice
from ccwsim.ui.benchmark.page import Benchmark, TimingRun
from ccwsim.ui.compare.settings import ComparePageState
from ccwsim.ui.paper.page import PaperState
from ccwsim.ui.session.resolve import data_of
from ccwsim.ui.session.server import NO_NEWS, is_news
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.study.run import start_run
from ccwsim.ui.sweep.planning import SweepState
from tests.ui.test_pages import ROOT, SMALL, html, launched, settled, texts
from tests.ui.widgets import named

SLOW = 120
CELLS = SMALL.grid.ny * SMALL.grid.nx * SMALL.n_realizations


class Somebody(Lease):
    """A job of another session."""

    def __init__(self) -> None:
        super().__init__(Usage("somebody else"))

    def still_to_take(self) -> float:
        return 0.0


class StillClock:
    """A clock that stands still, so that no active job becomes a long job."""

    def __call__(self) -> float:
        return 0.0


@pytest.fixture
def busy(monkeypatch):
    """Yield a server with one active job, which belongs to another session."""
    queue = Queue(1, StillClock())
    monkeypatch.setattr("ccwsim.jobs.job.server_queue", lambda: queue)
    other = Somebody()
    queue.request(other)
    return queue, other


def test_without_limits_the_page_says_nothing_of_them():
    assert "This server" not in html(launched(path="pages/simulate.py"))


def test_limits_are_stated_and_a_study_beyond_them_is_refused_before_it_starts(monkeypatch):
    monkeypatch.setenv("CCWSIM_MAX_CELLS", str(CELLS))
    app = launched(path="pages/simulate.py")
    said = f"This server allows up to {CELLS:,} cells × realizations per run."
    assert said in html(app)
    before = app.session_state[KEY].ensemble
    named(app.number_input, "n_realizations").set_value(3).run()
    run = named(app.button, "run")
    assert run.disabled
    assert f"the {CELLS:,} that this server allows" in run.help
    state = app.session_state[KEY]
    start_run(state)
    assert state.job is None
    assert "fewer realizations or a smaller grid" in state.message
    assert state.ensemble is before


def test_a_limit_that_is_no_number_is_said_on_the_page(monkeypatch):
    monkeypatch.setenv("CCWSIM_MAX_CELLS", "many")
    assert "CCWSIM_MAX_CELLS" in texts(launched(path="pages/simulate.py"))


@pytest.mark.parametrize(
    ("page", "button"),
    [("sweep", "sweep"), ("compare", "compare"), ("benchmark", "measure"),
     ("paper", "paper_start")],
)  # fmt: skip
def test_pages_that_start_runs_refuse_what_is_beyond_the_limit(monkeypatch, page, button):
    monkeypatch.setenv("CCWSIM_MAX_CELLS", str(CELLS))
    app = launched(path=f"pages/{page}.py")
    pressed = named(app.button, button)
    if not pressed.disabled:
        pressed.click().run()
    assert not app.exception
    assert "that this server allows for one run" in texts(app) + str(pressed.help)
    state = app.session_state[KEY]
    runs = (
        state.page(SweepState).run,
        state.page(ComparePageState).run,
        state.page(Benchmark).run,
        state.page(PaperState).run,
    )
    assert runs == (None,) * 4


@pytest.mark.slow
def test_a_run_says_which_place_it_has_in_the_queue_and_can_be_withdrawn(busy):
    queue, _ = busy
    app = launched_waiting()
    state = app.session_state[KEY]
    assert state.job.position == 1
    assert "Waiting: 1st in the queue" in progress(app)
    app.button(key="cancel").click().run()
    assert not app.exception
    assert state.job is None
    assert not queue._waiting
    assert "Stopped before" in texts(app)


@pytest.mark.slow
def test_a_run_that_waited_gives_its_results_when_it_is_its_turn(busy):
    queue, other = busy
    app = launched_waiting()
    queue.release(other)
    assert settled(app).session_state[KEY].ensemble.n == SMALL.n_realizations


def launched_waiting() -> AppTest:
    app = AppTest.from_file(str(ROOT / "pages/simulate.py"), default_timeout=SLOW)
    app.session_state[KEY] = State(choices=SMALL)
    return app.run()


def test_statistics_wait_in_the_queue_too_and_say_so(busy):
    queue, other = busy
    bench = StatisticsWorker(Memo())
    statistic = Task(("six",), lambda progress: 6)
    bench.ask(statistic)
    assert bench.job.position == 1
    queue.release(other)
    assert bench.wait_for(statistic, SLOW) == 6


def test_statistics_of_a_tab_that_was_closed_are_worked_out_when_they_are_asked_for_again(busy):
    queue, other = busy
    bench = StatisticsWorker(Memo())
    statistic = Task(("seven",), lambda progress: 7)
    bench.ask(statistic)
    (place,) = (p for p in queue.jobs_of("") if p is not other)
    place.abandon()
    queue.release(other)
    bench.ask(Task(("eight",), lambda progress: 8))
    assert bench.wait_for(statistic, SLOW) == 7


def progress(app) -> str:
    return " ".join(element.proto.text for element in app.get("progress"))


def test_a_run_that_does_not_fit_into_memory_is_refused_with_a_reason(monkeypatch):
    app = launched(path="pages/simulate.py")
    monkeypatch.setattr(limits, "free_memory", lambda: RESERVE + 1000)
    before = app.session_state[KEY].ensemble
    named(app.number_input, "seed").set_value(40417).run()
    app.button(key="run").click().run()
    assert not app.exception
    assert "of memory" in texts(app)
    assert "--out" in texts(app)
    assert app.session_state[KEY].ensemble is before


def test_a_run_that_takes_the_place_of_one_of_the_session_gets_its_memory(monkeypatch):
    state = State(choices=replace(SMALL, grid=Grid(1000, 1000)))
    go = Event()

    def work(job):
        while not job.is_cancelled():
            go.wait(0.01)

    state.job = before = Job(work)
    asked = []

    def free() -> int:
        asked.append(before.finished)
        return RESERVE + (10**9 if before.finished else 0)

    monkeypatch.setattr(limits, "free_memory", free)
    start_run(state)
    assert asked[-1]
    assert state.job is not None
    assert state.job.wait(SLOW)


def test_data_are_not_sampled_from_a_grid_beyond_the_limit(monkeypatch):
    monkeypatch.setattr(limits, "free_memory", lambda: RESERVE)
    choices = replace(SMALL, data=DataChoice("sampled", seed_sampled=987))
    with pytest.raises(CCWSIMError, match="memory"):
        data_of(choices)


def test_a_link_cannot_make_a_page_sample_data_for_minutes(monkeypatch):
    monkeypatch.setattr("ccwsim.ui.session.resolve.UNASKED_SECONDS", 1e-9)
    choices = replace(SMALL, data=DataChoice("sampled", seed_sampled=986))
    with pytest.raises(CCWSIMError, match=r"takes about .* choose a smaller grid"):
        data_of(choices)


def test_a_large_truth_takes_its_turn(monkeypatch):
    monkeypatch.setattr("ccwsim.jobs.job.MAX_CELLS_AT_ONCE", 1)
    choices = replace(SMALL, data=DataChoice("sampled", seed_sampled=988))
    assert data_of(choices).n == choices.data.n_sampled
    assert not server_queue()._waiting


@pytest.mark.parametrize("alone", [True, False])
def test_times_that_others_disturbed_are_told(monkeypatch, alone):
    queue = Queue(2, StillClock())
    for module in ("jobs.job", "ui.benchmark.page"):
        monkeypatch.setattr(f"ccwsim.{module}.server_queue", lambda: queue)
    if not alone:
        queue.request(Somebody())
    trial = Trial(datasets.load("channels"), Grid(32, 32), SMALL.parameters)
    run = TimingRun(trials=[trial], n_realizations=1).start()
    assert run.job.wait(SLOW)
    assert run.disturbed is not alone
    state = State(choices=SMALL)
    state.page(Benchmark).run = run
    app = AppTest.from_file(str(ROOT / "pages/benchmark.py"), default_timeout=SLOW)
    app.session_state[KEY] = state
    assert ("Other sessions were computing" in html(app.run())) is not alone


def test_only_lines_that_report_no_problem_are_left_out_of_the_log():
    said = [inspect.getsource(module) for module in (app_session, script_run_context)]
    for text, source in zip(NO_NEWS, said, strict=True):
        assert text in source, "Streamlit says this in other words; look at is_news again"
        assert not is_news(logging.makeLogRecord({"msg": f"{text} Ignoring."}))
    assert is_news(logging.makeLogRecord({"msg": "Uncaught app exception"}))
