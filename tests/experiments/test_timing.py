"""Test that timing measures the requested settings in order, and can be cancelled.

No test asserts a time.
"""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from ccwsim import (
    Auxiliary,
    Cancelled,
    CCWSIMError,
    Grid,
    HardData,
    Parameters,
    Secondary,
    TrainingImage,
)
from ccwsim.datasets.sampling import sample_random
from ccwsim.experiments.timing import (
    data_trials,
    expected_seconds,
    growth,
    time_trial,
    time_trials,
    typical,
    typical_seconds,
)
from ccwsim.experiments.trials import Trial, TrialResult
from ccwsim.paper import published_times as pub
from ccwsim.run.simulation import simulate_study
from ccwsim.system.machine import this_machine
from tests.small_images import blobs

TI = TrainingImage(blobs((64, 60), 2))
P = Parameters(template_size=16, overlap_size=4, wavelet_level=1)
LEVELS = [P, replace(P, wavelet_level=2)]


def took(side: int, seconds: float, p: Parameters = P, n_data: int = 0) -> TrialResult:
    trial = Trial(TI, Grid(side, side), p, n_sampled=n_data)
    return TrialResult(trial, np.array([seconds]), np.zeros(1, int))


def grids(*sides: int, parameters=(P,)) -> list[Trial]:
    return [t for side in sides for t in data_trials(TI, (side, side), [0], parameters)]


def test_a_study_is_timed_on_its_own_grid_with_its_own_data():
    data = HardData([[1, 2], [30, 40]], [0, 1])
    trial = Trial.of(TI, (40, 50), P, data)
    timing = time_trial(trial, n_realizations=4)
    assert timing.cpu_seconds.shape == timing.n_mismatched.shape == (4,)
    assert timing.trial is trial
    assert (trial.grid.shape, trial.n_data, trial.grid.n_cells) == ((40, 50), 2, 2000)
    assert (timing.n_mismatched == 0).all()
    assert timing.seconds == np.median(timing.cpu_seconds)
    with pytest.raises(FrozenInstanceError):
        trial.seed = 3  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        timing.cpu_seconds[0] = 0


def test_large_grids_are_timed_a_few_at_a_time(monkeypatch):
    asked = []

    def spied(study, n, **options):
        asked.append((n, options["first_realization"]))
        assert options["n_workers"] == 1
        return simulate_study(study, n, **options)

    monkeypatch.setattr("ccwsim.experiments.trials.simulate_study", spied)
    monkeypatch.setattr("ccwsim.experiments.timing.CELLS_AT_ONCE", 2 * 900)
    seen = []
    timing = time_trial(Trial(TI, Grid(30, 30), P), 5, lambda f, n: seen.append((f, n)))
    assert asked == [(2, 0), (2, 2), (1, 4)]
    assert len(timing.cpu_seconds) == 5
    assert [f for f, _ in seen] == sorted(f for f, _ in seen)
    assert seen[-1] == (1.0, 5)


def test_grids_and_levels_come_in_their_order():
    found = list(time_trials(grids(20, 48, parameters=LEVELS), n_realizations=2))
    assert [(t.trial.grid.nx, t.parameters.level) for t in found] == [
        (20, 1),
        (20, 2),
        (48, 1),
        (48, 2),
    ]
    assert all(len(t.cpu_seconds) == 2 and t.trial.n_data == 0 for t in found)


def test_data_come_few_first_and_are_the_same_for_all_settings(monkeypatch):
    given = []

    def spied(trial, *rest):
        given.append(trial.hard_data)
        return time_trial(trial, *rest)

    monkeypatch.setattr("ccwsim.experiments.timing.time_trial", spied)
    found = list(time_trials(data_trials(TI, (40, 50), [30, 0, 10], LEVELS), n_realizations=1))
    assert [(t.trial.n_data, t.parameters.level) for t in found] == [
        (n, level) for n in (0, 10, 30) for level in (1, 2)
    ]
    assert given[0].n == 0
    assert given[2].digest == given[3].digest
    few, many = ({tuple(c) for c in given[k].cells.tolist()} for k in (2, 4))
    assert few < many


def test_another_seed_gives_other_data_and_the_same_seed_the_same(monkeypatch):
    read = []

    def spied(*args):
        read.append(sample_random(*args))
        return read[-1]

    monkeypatch.setattr("ccwsim.experiments.timing.sample_random", spied)
    for seed in (4, 4, 5):
        list(time_trials(data_trials(TI, (40, 50), [12], [P], seed), 1))
    first, second, third = (data.digest for data in read)
    assert first == second != third


def test_results_come_one_by_one_and_progress_counts_all_work():
    seen = []
    results = time_trials(grids(20, 48), 1, progress=lambda *s: seen.append(s))
    next(results)
    between = seen[-1][0]
    assert 0 < between < 0.5  # the larger grid takes most of the work
    list(results)
    assert seen[-1] == (1.0, 2)
    assert [f for f, _ in seen] == sorted(f for f, _ in seen)


def test_it_stops_when_asked_and_keeps_what_was_finished():
    stop = []
    results = time_trials(grids(20, 24, 28), 1, cancel=lambda: bool(stop))
    assert next(results).trial.grid.shape == (20, 20)
    stop.append(True)
    with pytest.raises(Cancelled, match="1 of 3"):
        next(results)


def test_what_cannot_be_timed_says_why():
    with pytest.raises(CCWSIMError, match="do not fit a grid of 100 cells"):
        data_trials(TI, (10, 10), [101], [P])
    with pytest.raises(CCWSIMError, match="n_realizations"):
        time_trial(Trial(TI, Grid(20, 20), P), n_realizations=0)
    with pytest.raises(CCWSIMError, match="seed"):
        time_trial(Trial(TI, Grid(20, 20), P, seed=-1))
    with pytest.raises(CCWSIMError, match="Template 64"):
        time_trial(Trial(TI, Grid(20, 20), replace(P, template_size=64)))


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0])
def test_growth_finds_the_exponent(exponent):
    sizes = np.array([100.0, 300.0, 1000.0])
    assert growth(sizes, 1e-7 * sizes**exponent) == pytest.approx(exponent)


def test_growth_needs_two_sizes():
    with pytest.raises(CCWSIMError, match="two sizes"):
        growth(np.array([100.0, 100.0]), np.ones(2))


def test_the_usual_time_grows_with_what_there_is_to_do():
    base = typical_seconds(P, TI.shape, (200, 200))
    for harder in (
        typical_seconds(P, TI.shape, (200, 400)),
        typical_seconds(replace(P, wavelet_level=0), TI.shape, (200, 200)),
        typical_seconds(P, TI.shape, (200, 200), n_data=50),
        typical_seconds(P, TI.shape, (200, 200), n_facies=4),
        typical_seconds(P, (500, 500), (200, 200)),
        typical_seconds(P, TI.shape, (200, 200), disorder=0.5),
    ):
        assert harder > base


def test_expected_time_follows_the_most_similar_measurement():
    trials = data_trials(TI, (200, 200), [0, 100], LEVELS)
    usual = expected_seconds(trials, 3)
    each = [typical_seconds(p, TI.shape, (200, 200), 2, n) for n in (0, 100) for p in LEVELS]
    assert usual == pytest.approx(3 * sum(each))
    slow = took(200, 7.0)
    assert expected_seconds([slow.trial], 2, [slow]) == pytest.approx(14.0)
    others = [slow, took(200, 9.0, LEVELS[1]), took(200, 11.0, P, 100)]
    assert expected_seconds(trials[:3], 1, others) == pytest.approx(27.0)


def test_published_times_are_those_of_the_paper():
    assert all(t.cpu_seconds > 0 for t in pub.ALL_TIMES)
    keys = [(t.where, t.image, t.n_cells, t.n_data, t.method, t.level) for t in pub.ALL_TIMES]
    assert len(set(keys)) == len(keys)
    case = "channel", 512 * 512, 1000, "ms-ccsim", 1
    seconds = {
        (t.image, t.n_cells, t.n_data, t.method, t.level): t.cpu_seconds for t in pub.TABLE_2
    }
    assert seconds[case] == 26.78


def test_the_machine_is_described():
    machine = this_machine()
    assert machine.processor in str(machine)
    assert "numba" in str(machine)
    assert machine.free_bytes is None or machine.free_bytes > 0


RAMP = np.tile(np.linspace(0.0, 1.0, 60), (50, 1))
GUIDES = {
    "probabilities": Secondary(probabilities={1: RAMP / 2}),
    "auxiliary variable": Secondary(auxiliary=[Auxiliary(TI.array.astype(float), RAMP)]),
    "angles": Secondary(angle=90 * RAMP),
    "scales": Secondary(scale=1 + RAMP),
    "mirrored": Secondary(mirrored=("x",)),
    "images": Secondary(images=[TI]),
}


@pytest.mark.parametrize("name", GUIDES)
def test_guides_cost_time(name):
    plain = Trial(TI, Grid(50, 60), P)
    guided = replace(plain, secondary=GUIDES[name])
    assert typical(guided) > typical(plain)
    fitted = replace(plain, secondary=GUIDES[name].fitted(plain.grid, TI))
    assert typical(fitted) == typical(guided)


def test_inactive_cells_save_time_and_more_copies_cost_more():
    plain = Trial(TI, Grid(50, 60), P)
    half = replace(plain, secondary=Secondary(active=RAMP < 0.5))
    assert typical(half) == pytest.approx(typical(plain) / 2)
    few, many = (replace(plain, secondary=Secondary(angle=span * RAMP)) for span in (10, 90))
    assert typical(many) > typical(few)
