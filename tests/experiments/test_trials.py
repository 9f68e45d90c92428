"""Test the engine of trials: the order, the progress by expected time, and cancellation."""

from __future__ import annotations

import pytest

from ccwsim import Cancelled
from ccwsim.experiments.trials import run_trials
from ccwsim.model.watch import Watch

SECONDS = [1.0, 2.0, 5.0]


def test_each_part_of_the_progress_takes_its_share_of_the_expected_time():
    seen: list[tuple[float, int]] = []

    def run(trial: str, watch: Watch) -> str:
        watch.tell(0.5)
        return trial.upper()

    found = run_trials(["a", "b", "c"], run, SECONDS, Watch(lambda *at: seen.append(at)))
    assert list(found) == ["A", "B", "C"]
    assert [n for _, n in seen] == [0, 1, 1, 2, 2, 3]
    expected = [0.5 / 8, 1 / 8, 2 / 8, 3 / 8, 5.5 / 8, 1]
    assert [share for share, _ in seen] == pytest.approx(expected)


def test_a_trial_may_count_as_several_pieces():
    seen = []
    run = run_trials(
        [0, 1], lambda k, watch: watch.tell(0.5, 2), [1, 1], Watch(lambda _, n: seen.append(n)), 4
    )
    list(run)
    assert seen == [2, 4, 6, 8]


def test_a_run_stops_between_trials_and_keeps_what_is_finished():
    done = []
    trials = run_trials(list("abc"), lambda k, _: k, SECONDS, Watch(cancel=lambda: len(done) == 2))
    done += [next(trials), next(trials)]
    assert done == ["a", "b"]
    with pytest.raises(Cancelled, match="stopped after 2 of 3 settings"):
        next(trials)


def test_a_part_inside_a_part_ends_where_the_outer_part_ends():
    seen = []
    outer = Watch(lambda *at: seen.append(at)).part(0.2, 0.6, n_before=10)
    inner = outer.part(0.5, 1.0, n_before=3)
    for share in (0.0, 1.0):
        inner.tell(share, 1)
    assert seen == [(pytest.approx(0.4), 14), (0.6, 14)]
    with pytest.raises(Cancelled):
        Watch(cancel=lambda: True).part(0.0, 1.0).tell(0.5)
