"""Test that a long study from a link or project does not run before the user agrees."""

from __future__ import annotations

from dataclasses import replace
from threading import Event

import numpy as np
import pytest

from ccwsim import Grid, Parameters, TrainingImage, simulate
from ccwsim.jobs import limits
from ccwsim.jobs.job import Job, server_queue
from ccwsim.model.numbers import duration
from ccwsim.sharing.choices import Choices, DataChoice, GuideChoice, ImageChoice, Upload
from ccwsim.sharing.link import link_of
from ccwsim.sharing.project import Project, project_as_bytes
from ccwsim.ui.session.resolve import image_of, study_of
from ccwsim.ui.session.state import KEY, State
from ccwsim.ui.share.menu import open_project
from ccwsim.ui.study import run
from ccwsim.ui.study.run import demand_of_run, describe_price, estimated_seconds, question_of
from tests.ui.test_pages import SMALL, html, settled, texts
from tests.ui.widgets import opened

LONG = replace(SMALL, grid=Grid(6000, 6000), n_realizations=500)
PAGES = ("simulate", "data", "validate")


def by_link(page: str, choices: Choices):
    app = opened(page)
    for name, values in link_of(choices).items():
        app.query_params[name] = values
    return app.run()


def asked(app) -> bool:
    """Return whether the page asks before a run."""
    return "or first choose fewer realizations" in texts(app)


def project_of(choices: Choices) -> Upload:
    project = Project(study_of(choices), choices.n_realizations, link_of(choices))
    return Upload("sent.ccwsim", project_as_bytes(project))


@pytest.fixture
def short_patience(monkeypatch):
    """Treat every study as long, so that tests need no long runs."""
    monkeypatch.setattr(limits, "UNASKED_SECONDS", 0.0)


@pytest.mark.parametrize("page", PAGES)
def test_a_link_to_a_long_run_asks_on_every_page_that_runs(page):
    app = by_link(page, LONG)
    state = app.session_state[KEY]
    assert state.choices == LONG
    assert (state.job, state.ensemble) == (None, None)
    assert asked(app)
    assert not app.exception


def test_a_link_to_a_short_run_starts_at_once():
    app = settled(by_link("simulate", SMALL))
    assert app.session_state[KEY].ensemble.n == SMALL.n_realizations
    assert not asked(app)


def test_run_starts_it_and_nothing_is_asked_again(short_patience):
    app = by_link("simulate", SMALL)
    assert app.session_state[KEY].ensemble is None
    app = settled(app.button(key="run").click().run())
    assert app.session_state[KEY].ensemble.n == SMALL.n_realizations
    assert not asked(app)
    app.session_state[KEY].live = True
    app = settled(app.number_input(key="seed").set_value(5).run())
    assert app.session_state[KEY].ensemble_choices.seed == 5


def test_a_change_is_no_yes(short_patience):
    app = by_link("simulate", SMALL)
    app.number_input(key="seed").set_value(5).run()
    app.toggle(key="live").set_value(True).run()
    state = app.session_state[KEY]
    assert (state.job, state.ensemble) == (None, None)
    assert asked(app)


def test_a_change_that_makes_it_short_starts_it(monkeypatch):
    many = replace(SMALL, n_realizations=8)
    monkeypatch.setattr(limits, "UNASKED_SECONDS", estimated_seconds(many) / 2)
    app = by_link("simulate", many)
    assert asked(app)
    app = settled(app.number_input(key="n_realizations").set_value(2).run())
    assert app.session_state[KEY].ensemble.n == 2


def test_a_study_set_up_by_hand_is_never_asked_about(short_patience):
    app = settled(opened("simulate", State(choices=SMALL)).run())
    assert app.session_state[KEY].ensemble is not None


def test_a_project_of_a_long_run_asks_and_earlier_results_stay():
    ensemble = simulate(
        image_of(SMALL.image), SMALL.grid, SMALL.parameters,
        n_realizations=2, seed=SMALL.seed,
    )  # fmt: skip
    state = State(choices=SMALL, ensemble=ensemble, ensemble_choices=SMALL)
    open_project(state, project_of(LONG))
    assert state.choices.grid == LONG.grid
    assert state.job is None
    assert state.ensemble is ensemble
    app = opened("simulate", state).run()
    assert asked(app)
    assert "Out of date" in html(app)


def test_a_project_of_a_short_run_starts_at_once():
    state = State()
    open_project(state, project_of(replace(SMALL, data=DataChoice())))
    assert state.job is not None
    assert state.job.wait(60)


@pytest.mark.parametrize("times", [2, 10])
def test_more_realizations_take_longer_and_are_said_so(times):
    more = replace(LONG, n_realizations=times * LONG.n_realizations)
    assert estimated_seconds(more) == pytest.approx(times * estimated_seconds(LONG))
    said = duration(estimated_seconds(more), rough=True)
    assert f"takes about {said} on this machine" in question_of(
        State(choices=more, needs_confirmation=True)
    )


@pytest.mark.parametrize(("side", "n", "asks"), [(10_000, 20, True), (1000, 20, False)])
def test_a_link_to_many_cells_asks_even_if_they_take_little_time(side, n, asks, monkeypatch):
    monkeypatch.setattr(limits, "UNASKED_SECONDS", 10.0**9)
    monkeypatch.setattr(limits, "free_memory", lambda: 64 * 10**9)
    choices = replace(SMALL, grid=Grid(side, side), n_realizations=n)
    assert bool(question_of(State(choices=choices, needs_confirmation=True))) == asks


def test_a_link_asks_if_its_run_takes_most_of_the_memory_that_is_free_now(monkeypatch):
    state = State(choices=SMALL, needs_confirmation=True)
    need = demand_of_run(state.choices).n_bytes + limits.RESERVE
    for free, asks in ((need, True), (4 * need, False)):
        monkeypatch.setattr(limits, "free_memory", lambda free=free: free)
        assert bool(question_of(state)) == asks


def test_runs_of_others_lengthen_the_estimate_and_own_runs_do_not(monkeypatch):
    idle, release, queue = estimated_seconds(LONG), Event(), server_queue()
    jobs = []
    try:
        for session in ("other", "own"):
            monkeypatch.setattr(queue, "current_session", lambda session=session: session)
            jobs.append(Job(lambda job: release.wait(60)))
        assert estimated_seconds(LONG) == pytest.approx(2 * idle)
    finally:
        release.set()
    assert all(job.wait(60) for job in jobs)
    assert estimated_seconds(LONG) == pytest.approx(idle)


def test_an_image_without_structure_lengthens_the_estimate(monkeypatch):
    noise = TrainingImage(np.random.default_rng(0).integers(0, 3, (200, 200)))
    blocks = TrainingImage(np.kron(noise.array[:20, :20], np.ones((10, 10), int)))
    assert (noise.disorder > 0.9, blocks.disorder) == (True, 0.0)
    seconds = []
    for image in (noise, blocks):
        monkeypatch.setattr(run.resolve, "image_of", lambda _, image=image: image)
        seconds.append(estimated_seconds(LONG))
    assert seconds[0] > 2 * seconds[1]


def test_what_cannot_run_is_said_instead():
    wrong = replace(SMALL, parameters=Parameters(template_size=512, overlap_size=4))
    assert not question_of(State(choices=wrong, needs_confirmation=True))


def test_advice_says_its_price_compared_with_the_study_of_today():
    study = Choices(data=DataChoice())
    assert describe_price(study, wavelet_level=2).endswith("a realization, 1 × the present setting")
    words = describe_price(study, wavelet_level=0)
    ratio = float(words.split(", ")[1].split(" ")[0])
    finer = replace(study, parameters=replace(study.parameters, wavelet_level=0))
    assert ratio == pytest.approx(estimated_seconds(finer) / estimated_seconds(study), rel=0.05)
    turned = replace(study, guides=GuideChoice(scale=2.0))
    assert estimated_seconds(turned) > estimated_seconds(study)
    volume = replace(study, image=ImageChoice(bundled="sinuous_channels"))
    assert "a realization" in describe_price(volume, template_size=(8, 16, 16))
