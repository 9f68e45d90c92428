"""Test that equal studies are simulated once for all jobs, and that failures stay separate."""

from __future__ import annotations

from threading import Event

import numpy as np
import pytest

from ccwsim import Cancelled, CCWSIMError, Parameters, simulate
from ccwsim.jobs.job import Job, Queue
from ccwsim.model.ensemble import Ensemble
from ccwsim.run.shared import SharedRun, SharedRuns
from tests.waiting import wait_until

SLOW = 300
STRIPES = np.tile([[0], [0], [1], [1]], (16, 64))
PARAMETERS = Parameters(template_size=16, overlap_size=4, wavelet_level=1)


@pytest.fixture(autouse=True)
def queue(monkeypatch):
    """Return a queue in which all jobs of a test can be active at once."""
    queue = Queue(9)
    monkeypatch.setattr("ccwsim.jobs.job.server_queue", lambda: queue)


def ensemble(seed: int = 0, n: int = 2) -> Ensemble:
    return simulate(STRIPES, (20, 20), PARAMETERS, n_realizations=n, seed=seed)


class Simulations:
    """Work that publishes a first part, then waits for permission; it counts its calls."""

    def __init__(self, runs: SharedRuns) -> None:
        self.runs, self.go_on, self.calls = runs, Event(), []
        self.error: Exception | None = None

    def job(self, key: str = "a") -> Job[Ensemble]:
        return Job(lambda job: self.runs.ensemble_for(job, key, self._work(key)), n=2)

    def _work(self, key: str):
        def work(run: SharedRun) -> Ensemble:
            self.calls.append(key)
            run.report(0.5, 1)
            run.publish_partial(part := ensemble(n=1))
            while not self.go_on.wait(0.01):
                if run.is_cancelled():
                    raise Cancelled("stopped after 1 of 2 realizations", part)
            if self.error:
                raise self.error
            return ensemble()

        return work


def test_jobs_that_need_the_same_ensemble_simulate_it_once_and_see_its_progress():
    several = Simulations(SharedRuns())
    jobs = [several.job() for _ in range(3)]
    for job in jobs:
        assert job.wait_first(SLOW)
        assert job.partial.n == 1
    assert jobs[0].n_done == 1
    several.go_on.set()
    assert all(job.wait(SLOW) for job in jobs)
    later = several.job()
    assert later.wait(SLOW)
    assert several.calls == ["a"]
    assert {job.result for job in (*jobs, later)} == {several.runs.get("a")}
    assert later.result.digest == ensemble().digest


def test_a_cancelled_job_leaves_the_run_of_the_others():
    several = Simulations(SharedRuns())
    first, second = several.job(), several.job()
    assert first.wait_first(SLOW)
    assert second.wait_first(SLOW)
    first.cancel()
    assert first.wait(SLOW)
    assert isinstance(first.error, Cancelled)
    assert str(first.error) == "stopped after 1 of 2 realizations"
    assert first.error.ensemble.n == 1
    assert not second.finished
    several.go_on.set()
    assert second.wait(SLOW)
    assert second.result.n == 2


def test_the_run_stops_with_its_last_job_and_the_next_one_begins_anew():
    several = Simulations(SharedRuns())
    jobs = [several.job(), several.job()]
    for job in jobs:
        assert job.wait_first(SLOW)
        job.cancel()
    assert all(job.wait(SLOW) for job in jobs)
    assert all(job.error.ensemble.n == 1 for job in jobs)
    assert several.runs.get("a") is None
    several.go_on.set()
    again = several.job()
    assert again.wait(SLOW)
    assert again.result.n == 2
    assert several.calls == ["a", "a"]


def test_an_error_reaches_every_job_and_is_not_kept():
    several = Simulations(SharedRuns())
    several.error = CCWSIMError("broken")
    jobs = [several.job(), several.job()]
    assert all(job.wait_first(SLOW) for job in jobs)
    several.go_on.set()
    assert all(job.wait(SLOW) for job in jobs)
    assert [job.error for job in jobs] == [several.error] * 2
    several.error = None
    again = several.job()
    assert again.wait(SLOW)
    assert again.result.n == 2


def test_only_equal_keys_meet():
    several = Simulations(SharedRuns())
    jobs = [several.job("a"), several.job("b")]
    wait_until(lambda: sorted(several.calls) == ["a", "b"], "both runs")
    several.go_on.set()
    assert all(job.wait(SLOW) for job in jobs)
    assert jobs[0].result is not jobs[1].result


def test_what_is_kept_is_bounded_by_number_and_bytes():
    several = Simulations(SharedRuns(2))
    several.go_on.set()
    for key in "abc":
        assert several.job(key).wait(SLOW)
    assert [several.runs.get(key) is not None for key in "abc"] == [False, True, True]
    small = Simulations(SharedRuns(max_bytes=100, min_values=0))
    small.go_on.set()
    assert small.job().wait(SLOW)
    assert small.runs.get("a") is None
