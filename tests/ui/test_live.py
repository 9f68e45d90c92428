"""Test live runs that show parts, the end of older runs, and the list of runs of a session."""

from __future__ import annotations

from dataclasses import replace
from threading import Event

import numpy as np
import pytest
from streamlit.runtime.scriptrunner import RerunData, get_script_run_ctx
from streamlit.runtime.state.safe_session_state import SafeSessionState
from streamlit.testing.v1 import AppTest

from ccwsim import Cancelled, Grid, Parameters, simulate
from ccwsim.jobs.job import Job
from ccwsim.sharing.choices import Choices, DataChoice, ImageChoice, Upload
from ccwsim.ui.session.resolve import image_of
from ccwsim.ui.session.state import KEY, PastRun, PastRuns, State
from ccwsim.ui.simulate.results import go_back, shown_run_index
from ccwsim.ui.study.changes import changes_between, study_name
from ccwsim.ui.study.run import (
    collect,
    describe_price,
    describe_prices_of_levels,
    first_part,
    in_parts,
    is_live,
    part_of,
    part_size,
    start_run,
)
from tests.ui.test_pages import ROOT, SMALL, html, launched, settled, texts
from tests.ui.widgets import named, open_menus

SIX = replace(SMALL, n_realizations=6)


def one_run(choices: Choices):
    image, n = image_of(choices.image), choices.n_realizations
    return simulate(image, choices.grid, choices.parameters, n_realizations=n, seed=choices.seed)


class Gates:
    """Simulation of a study that waits for permission before each part except the first."""

    def __init__(self, choices: Choices) -> None:
        self.some = part_of(choices)
        self.open = Event()

    def __call__(self, first, n, watch):
        while first and not self.open.wait(0.01):
            if watch.cancel():
                raise Cancelled("stopped", None)
        return self.some(first, n, watch)


def in_parts_of(some, choices: Choices = SIX, n_first: int = 2) -> Job:
    n = choices.n_realizations
    return Job(lambda job: in_parts(job, some, n_first), choices, n=n)


def gated(choices: Choices = SIX) -> tuple[Job, Gates]:
    gates = Gates(choices)
    job = in_parts_of(gates, choices)
    assert job.wait_first(60)
    return job, gates


def test_a_live_run_shows_a_few_first_and_ends_as_one_run():
    job, gates = gated()
    whole = one_run(SIX)
    assert not job.finished
    assert np.array_equal(job.partial.indices, whole.indices[:2])
    gates.open.set()
    assert job.wait(60)
    assert job.result.digest == whole.digest
    assert job.result.numbers.tolist() == [0, 1, 2, 3, 4, 5]
    assert job.fraction == pytest.approx(1.0)
    assert job.n_done == 6


def test_a_stopped_live_run_gives_what_was_finished():
    job, _ = gated()
    job.cancel()
    assert job.wait(60)
    assert isinstance(job.error, Cancelled)
    assert "stopped after 2 of 6" in str(job.error)
    assert job.error.ensemble.n == 2


def test_a_live_run_that_fails_leaves_the_part_that_came():
    def broken(first, n, watch):
        if first:
            raise MemoryError
        return part_of(SIX)(first, n, watch)

    state = State(choices=SIX, live=True)
    state.job = in_parts_of(broken)
    assert state.job.wait(60)
    part = state.ensemble = state.job.partial
    state.ensemble_choices = SIX
    collect(state)
    assert state.ensemble is part
    assert "memory" in state.message


def test_a_part_is_shown_and_the_realization_that_was_large_comes_back():
    state = State(choices=SIX, live=True, shown=4, realization_to_restore=4)
    state.job, gates = gated()
    collect(state)
    assert (state.ensemble.n, state.shown) == (2, 1)
    assert state.ensemble_choices == SIX
    assert state.job is not None
    gates.open.set()
    assert state.job.wait(60)
    collect(state)
    assert (state.ensemble.n, state.shown) == (6, 4)
    assert state.job is None


def test_a_realization_chosen_meanwhile_stays():
    state = State(choices=SIX, live=True, shown=4, realization_to_restore=4)
    state.job, gates = gated()
    collect(state)
    state.shown = 0
    gates.open.set()
    assert state.job.wait(60)
    collect(state)
    assert state.shown == 0


def test_an_older_run_is_stopped_and_never_taken_in():
    state = State(choices=SIX, live=True)
    state.job, _ = older, _ = gated()
    state.change(seed=3)
    start_run(state)
    assert older.is_cancelled()
    assert state.job is not older
    assert older.wait(60)
    assert state.job.wait(60)
    collect(state)
    assert state.ensemble.digest == one_run(replace(SIX, seed=3)).digest
    assert [run.choices.seed for run in state.runs.runs] == [3]


@pytest.mark.parametrize(
    ("left", "fits", "size"),
    [(100, 0.0, 2), (3, 0.0, 2), (100, 40.0, 40), (12, 9.0, 12), (1, 0.0, 1)],
)
def test_parts_are_as_large_as_time_allows(left, fits, size, monkeypatch):
    monkeypatch.setattr("ccwsim.ui.study.run.n_cores", lambda: 2)
    assert part_size(left, fits) == size


def test_the_first_part_follows_the_pace_of_the_latest_run():
    ensemble = replace(one_run(SIX), wall_seconds=6 * 0.01)
    many = replace(SIX, n_realizations=1000)
    assert 20 <= first_part(many, ensemble) <= 30
    assert first_part(replace(many, grid=Grid(480, 640)), ensemble) < 10
    assert first_part(many, None) == 2


# on the page


def live(choices: Choices = SIX) -> AppTest:
    app = launched(choices)
    app.toggle(key="live").set_value(True).run()
    return app


def test_five_quick_changes_end_in_the_last():
    app = live()
    for seed in range(1, 6):
        app.number_input(key="seed").set_value(seed).run()
    settled(app)
    state = app.session_state[KEY]
    assert state.ensemble.digest == one_run(replace(SIX, seed=5)).digest
    assert state.ensemble_choices == state.choices


def test_a_change_is_kept_although_another_arrives_before_it_is_stored(monkeypatch):
    app, read, arrived = live(), SafeSessionState.__getitem__, []

    def read_later(self, key):
        if str(key).strip() == "seed" and not arrived:
            arrived.append(get_script_run_ctx().script_requests.request_rerun(RerunData()))
        return read(self, key)

    monkeypatch.setattr(SafeSessionState, "__getitem__", read_later)
    settled(app.number_input(key="seed").set_value(15).run())
    assert arrived == [True]
    assert named(app.number_input, "seed").value == 15
    assert app.session_state[KEY].ensemble.digest == one_run(replace(SIX, seed=15)).digest


def test_a_run_simulates_the_study_with_which_it_is_labelled(monkeypatch):
    state, some = State(choices=SIX), part_of

    def meanwhile(choices):
        found = some(choices)
        state.change(seed=15)
        return found

    monkeypatch.setattr("ccwsim.ui.study.run.part_of", meanwhile)
    start_run(state)
    assert state.job.wait(60)
    assert state.job.about.seed == state.job.result.seed == 0


def test_a_part_is_on_the_page_before_the_rest():
    app = launched(SIX)
    state = app.session_state[KEY]
    state.live = True
    state.change(seed=8)
    state.job, gates = gated(state.choices)
    app.run()
    assert not app.exception
    assert "2 realizations in" in html(app)
    assert "Realization 1 of 2" in html(app)
    assert app.button(key="cancel")
    gates.open.set()
    settled(app)
    assert "6 realizations in" in html(app)
    assert app.session_state[KEY].ensemble.digest == one_run(replace(SIX, seed=8)).digest


def test_a_live_study_that_cannot_run_stops_the_run_of_the_older_one():
    app = live()
    state = app.session_state[KEY]
    job, _ = gated(state.choices)
    state.job = job
    state.change(data=DataChoice("bundled", "channels_60_wells"))
    app.run()
    assert not app.exception
    assert job.is_cancelled()
    assert state.job is None
    assert state.ensemble is not None


def test_a_live_run_that_was_stopped_or_failed_starts_again_only_after_a_change():
    app = live()
    state = app.session_state[KEY]
    state.change(seed=4)
    state.last_attempt = state.choices
    state.job = Job(lambda job: 1 / 0, about=state.choices)
    assert state.job.wait(60)
    app.run()
    assert state.job is None
    assert "in the server's log" in texts(app)
    settled(named(app.number_input, "seed").set_value(5).run())
    assert state.ensemble.seed == 5


def test_the_latest_runs_are_kept_within_their_number_and_memory():
    ensemble = one_run(SMALL)
    runs = PastRuns(max_runs=4, max_bytes=3 * PastRun(SMALL, ensemble).nbytes)
    for seed in range(6):
        runs.remember(PastRun(replace(SMALL, seed=seed), ensemble))
    assert [run.choices.seed for run in runs.runs] == [5, 4, 3]
    runs.max_bytes = 1
    runs.remember(PastRun(replace(SMALL, seed=9), ensemble))
    assert [run.choices.seed for run in runs.runs] == [9]
    many = PastRuns()
    for seed in range(20):
        many.remember(PastRun(replace(SMALL, seed=seed), ensemble))
    assert len(many.runs) == 12


def test_the_same_study_again_is_one_run():
    ensemble, runs = one_run(SMALL), PastRuns()
    for _ in range(3):
        runs.remember(PastRun(SMALL, ensemble))
    assert len(runs.runs) == 1


def test_memory_counts_realizations_in_codes_of_their_own():
    ensemble = one_run(SMALL)
    assert PastRun(SMALL, ensemble).nbytes >= ensemble.indices.nbytes


@pytest.mark.slow
def test_going_back_brings_study_and_results_without_simulating(monkeypatch):
    app = live()
    first = app.session_state[KEY].ensemble
    named(app.selectbox, "wavelet_level").set_value(1).run()
    settled(app)
    state = app.session_state[KEY]
    assert state.ensemble is not first
    assert "Runs of this session" in html(app)

    def never(*_, **__):
        raise AssertionError("nothing is simulated again")

    monkeypatch.setattr("ccwsim.ui.study.run.simulate_study", never)
    go_back(state, state.runs.runs[1].key)
    app.run()
    assert not app.exception
    assert state.ensemble is first
    assert state.choices == state.ensemble_choices == SIX
    assert named(app.selectbox, "wavelet_level").value == 2
    assert shown_run_index(state) == 1
    assert state.job is None
    assert len(state.runs.runs) == 2


def test_going_back_stops_a_run_and_a_run_that_is_gone_changes_nothing():
    state = State(choices=SIX, live=True)
    state.runs.remember(PastRun(SMALL, one_run(SMALL)))
    state.job, _ = job, _ = gated()
    go_back(state, "long ago")
    assert state.job is job
    go_back(state, state.runs.runs[0].key)
    assert job.is_cancelled()
    assert (state.job, state.choices) == (None, SMALL)


def test_what_changed_is_said_in_few_words():
    p = Parameters(template_size=48, n_candidates=5, random_path=False)
    after = replace(SMALL, parameters=replace(p, overlap_size=4), grid=Grid(60, 70))
    parameters = ["template 16 → 48", "K 20 → 5", "random path on → off"]
    assert changes_between(SMALL, after) == ["grid 64 × 48 → 70 × 60", *parameters]
    data = replace(SMALL, data=DataChoice("bundled", "channels_60_wells"))
    assert changes_between(SMALL, data) == ["no data → channels 60 wells"]
    image = replace(SMALL, image=ImageChoice(bundled="stonewall"), seed=4)
    assert changes_between(SMALL, image) == ["channels → stonewall", "seed 0 → 4"]
    colours = replace(SMALL, image=ImageChoice(colours=((0, "#112233"),)))
    assert changes_between(SMALL, colours) == ["channels, other colours"]
    assert changes_between(SMALL, SMALL) == []
    assert study_name(SMALL) == "channels, level 2, seed 0"


def test_the_page_launches_with_a_history_of_many_runs():
    ensemble = one_run(SMALL)
    app = open_menus(AppTest.from_file(str(ROOT / "app.py"), default_timeout=120))
    state = State(choices=SMALL)
    for seed in range(14):
        state.runs.remember(PastRun(replace(SMALL, seed=seed), ensemble))
    app.session_state[KEY] = state
    settled(app.run())
    assert "Runs of this session" in html(app)


def test_short_runs_are_live_until_the_user_decides():
    long = replace(SMALL, grid=Grid(4000, 4000), n_realizations=100)
    broken = replace(SMALL, data=DataChoice("bundled", "channels_60_wells"))
    assert [is_live(State(choices=c)) for c in (SMALL, long, broken)] == [True, False, True]
    assert not is_live(State(choices=SMALL, live=False))
    assert is_live(State(choices=long, live=True))


def test_undo_restores_the_study_before_each_change(monkeypatch):
    app = launched(SMALL)
    named(app.number_input, "seed").set_value(8).run()
    named(app.number_input, "n_realizations").set_value(3).run()
    state = app.session_state[KEY]
    assert state.choices == replace(SMALL, seed=8, n_realizations=3)
    for before in (replace(SMALL, seed=8), SMALL, SMALL):  # without earlier studies nothing changes
        state.undo()
        app.run()
        assert state.choices == before
        assert named(app.number_input, "seed").value == before.seed


def test_undo_keeps_no_files_that_neither_the_study_nor_the_one_before_uses():
    state, files = State(), [Upload(f"{k}.png", bytes([k])) for k in range(3)]
    for file in files:
        state.choices = Choices(ImageChoice(upload=file))
        state.note_drawn()
    assert [choices.image.upload for choices in state.earlier] == [files[1]]


def test_sliders_change_the_method_while_live_is_on():
    app = launched()
    assert not app.select_slider
    app.session_state[KEY].live = True
    settled(app.run())
    for name, slider, new in (
        ("template_size", "template_size_slider", 20),
        ("n_candidates", "n_candidates_slider", 5),
    ):
        named(app.select_slider, slider).set_value(new)
        settled(app.run())
        assert getattr(app.session_state[KEY].choices.parameters, name) == new
        widgets = app.selectbox if name == "template_size" else app.number_input
        assert named(widgets, name).value == new
    named(app.number_input, "n_candidates").set_value(7).run()
    assert named(app.select_slider, "n_candidates_slider").value == 7


def test_the_method_says_the_times_of_the_levels_beside_the_present_one():
    study = Choices(grid=Grid(256, 256), data=DataChoice())
    one, three = describe_prices_of_levels(study).splitlines()
    assert one.startswith("Level 1: about")
    assert three.startswith("Level 3: about")
    assert one.endswith(describe_price(study, wavelet_level=1).split(", ")[1])
    coarse = replace(study, parameters=Parameters(template_size=32, wavelet_level=0))
    assert describe_prices_of_levels(coarse).startswith("Level 1: ")
    assert "\n" not in describe_prices_of_levels(coarse)
    assert not describe_prices_of_levels(replace(study, parameters=Parameters(method="ccsim")))
