"""Test that runs share cores: the run with the least core time is next, and none waits long."""

from __future__ import annotations

from threading import Event, Thread

import numpy as np
import pytest

from ccwsim import Cancelled, Grid, Parameters, TrainingImage, simulate
from ccwsim.engine import compilation
from ccwsim.jobs import workers
from ccwsim.jobs.cores import CREDIT_SECONDS, SLICE_SECONDS, CoreLease, Cores, Usage
from ccwsim.jobs.workers import run_all

STRIPES = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
SMALL = Parameters(template_size=16, overlap_size=4, wavelet_level=1)


class Clock:
    """A clock that stands still until a test moves it."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def asked(cores: Cores, *usages: Usage) -> list[CoreLease]:
    leases = [CoreLease(cores, usage, Event()) for usage in usages]
    for lease in leases:
        cores.request(lease)
    return leases


def having(leases: list[CoreLease]) -> list[bool]:
    return [lease.has_core for lease in leases]


def test_who_has_used_least_is_next():
    clock = Clock()
    cores = Cores(2, clock)
    one, two = Usage(), Usage()
    leases = asked(cores, one, one, one, one, two)
    assert having(leases) == [True, True, False, False, False]
    clock.now = 10.0
    cores.release(leases[0])
    assert having(leases) == [False, True, False, False, True]
    clock.now = 12.0
    cores.release(leases[4])
    assert having(leases) == [False, True, True, False, False]  # no other job waits


def test_two_that_have_used_alike_get_a_core_each():
    cores = Cores(2, Clock())
    one, two = Usage(), Usage()
    (busy,) = asked(cores, one)
    leases = [*asked(cores, one), *asked(cores, two), *asked(cores, one)]
    assert having([busy, *leases]) == [True, True, False, False]
    cores.release(busy)
    assert having(leases) == [True, True, False]


def test_a_task_gives_its_core_to_one_that_has_used_less_after_its_slice():
    clock = Clock()
    cores = Cores(1, clock)
    long, quick = Usage(), Usage()
    (lease,) = asked(cores, long)
    clock.now = 100.0
    (other,) = asked(cores, quick)
    assert quick.seconds == 100.0 - CREDIT_SECONDS
    assert cores.yield_core(lease)
    assert having([lease, other]) == [False, True]
    clock.now += SLICE_SECONDS / 2
    other.yield_if_due()  # its time slice is not over
    clock.now += CREDIT_SECONDS / 2
    other.yield_if_due()  # it has used much less core time
    assert other.has_core
    clock.now += CREDIT_SECONDS
    assert cores.yield_core(other)
    assert having([lease, other]) == [True, False]


def test_who_comes_new_is_ahead_by_the_credit_and_not_by_all_that_others_have_used():
    clock = Clock()
    cores = Cores(1, clock)
    old, new = Usage(), Usage()
    (lease,) = asked(cores, old)
    clock.now = 100.0
    cores.release(lease)
    asked(cores, old)
    asked(cores, new)
    assert new.seconds == old.seconds - CREDIT_SECONDS


def test_the_runs_of_one_usage_count_together():
    usage, clock = Usage(), Clock()
    cores = Cores(1, clock)
    (lease,) = asked(cores, usage)
    clock.now = 10.0
    cores.release(lease)
    assert usage.seconds == 10.0
    (other,) = asked(cores, Usage())
    assert other.has_core
    asked(cores, usage)
    assert usage.seconds == 10.0


def test_tasks_of_a_stopped_run_do_not_wait():
    cores, stop = Cores(1), Event()
    one, two = Usage(), Usage()
    asked(cores, one)
    waiting = CoreLease(cores, two, stop)
    cores.request(waiting)
    assert not waiting.answered.is_set()
    stop.set()
    cores.let_stopped_go()
    assert waiting.answered.is_set()
    assert not waiting.has_core
    with cores.lease(two, stop) as late:
        assert not late.has_core
    assert not cores.contended


@pytest.fixture
def shared(monkeypatch):
    cores = Cores(1)
    monkeypatch.setattr(workers, "_shared_cores", cores)
    return cores


def test_two_runs_both_get_on_and_give_what_each_gives_alone(shared, monkeypatch):
    alone = [simulate(STRIPES, (400, 400), SMALL, n_realizations=4, seed=s) for s in (1, 2)]
    # Runs swap cores at every check:
    monkeypatch.setattr("ccwsim.jobs.cores.SLICE_SECONDS", 0.0)
    found: dict[int, object] = {}

    def run(seed: int) -> None:
        ensemble = simulate(STRIPES, (400, 400), SMALL, n_realizations=4, seed=seed, n_workers=2)
        found[seed] = ensemble.digest

    threads = [Thread(target=run, args=(seed,)) for seed in (1, 2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)
    assert found == {1: alone[0].digest, 2: alone[1].digest}
    assert not shared.contended


def test_a_run_that_waits_for_a_core_can_be_stopped(shared):
    let_go, busy = Event(), Event()

    def keeps(number, watch):
        busy.set()
        assert let_go.wait(60)

    holder = Thread(target=run_all, args=(keeps, 1, 1))
    holder.start()
    assert busy.wait(60)
    with pytest.raises(Cancelled):
        simulate(STRIPES, Grid(40, 50), SMALL, n_realizations=3, cancel=lambda: True)
    let_go.set()
    holder.join(60)
    assert not shared.contended
    assert simulate(STRIPES, Grid(40, 50), SMALL).n == 1


def test_kernels_are_looked_for_while_tasks_with_all_cores_wait_for_it(shared, monkeypatch):
    """Test that the tasks of `compilation.walk`, which holds a lock, do not wait for a core."""
    monkeypatch.setattr(compilation, "_can_compile_apart", lambda: True)
    walking, go_on = Event(), Event()

    def work() -> None:
        walking.set()
        assert go_on.wait(60)
        run_all(lambda number, watch: None, 2, 2)

    def with_a_core(number: int, watch: object) -> None:
        go_on.set()
        compilation.ask_for(lambda: None)

    threads = [
        Thread(target=compilation.ask_for, args=(work,), daemon=True),
        Thread(target=run_all, args=(with_a_core, 1, 1), daemon=True),
    ]
    threads[0].start()
    assert walking.wait(60)
    threads[1].start()
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads)
