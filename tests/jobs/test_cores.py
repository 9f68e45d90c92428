"""Test that runs share cores fairly: no run waits long, and each gets its share."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from threading import Event, Thread

import numpy as np
import pytest

from ccwsim import Cancelled, Grid, Parameters, TrainingImage, simulate
from ccwsim.engine import compilation
from ccwsim.jobs import workers
from ccwsim.jobs.scheduler import (
    HEAD_START_SECONDS,
    HEAD_START_SHARE,
    SLICE_SECONDS,
    Cores,
    Lease,
    Usage,
)
from ccwsim.jobs.workers import run_all
from tests.waiting import wait_until

STRIPES = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
SMALL = Parameters(template_size=16, overlap_size=4, wavelet_level=1)


class Clock:
    """A clock that stands still until a test moves it."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def asked(cores: Cores, *usages: Usage) -> list[Lease]:
    leases = [Lease(usage, Event()) for usage in usages]
    for lease in leases:
        cores.request(lease)
    return leases


def having(leases: list[Lease]) -> list[bool]:
    return [has_core(lease) for lease in leases]


def has_core(lease: Lease) -> bool:
    return lease.since < inf


def test_who_has_used_least_is_next():
    clock = Clock()
    cores = Cores(2, clock)
    one, two = Usage(), Usage()
    ended, *leases = asked(cores, one, one, one, one, two)
    assert having([ended, *leases]) == [True, True, False, False, False]
    clock.now = 10.0
    cores.release(ended)
    assert having(leases) == [True, False, False, True]
    clock.now = 12.0
    cores.release(leases.pop())
    assert having(leases) == [True, True, False]  # no other job waits


def test_two_that_have_used_alike_get_a_core_each():
    cores = Cores(2, Clock())
    one, two = Usage(), Usage()
    (busy,) = asked(cores, one)
    leases = [*asked(cores, one), *asked(cores, two), *asked(cores, one)]
    assert having([busy, *leases]) == [True, True, False, False]
    cores.release(busy)
    assert having(leases) == [True, True, False]


def test_a_task_yields_to_a_new_user_after_its_slice_until_the_head_start_is_used():
    clock = Clock()
    cores = Cores(1, clock)
    long, quick = Usage(), Usage()
    (lease,) = asked(cores, long)
    clock.now = 100.0
    (other,) = asked(cores, quick)
    cores.request(lease, first=True)  # as `yield_if_due` does, but without waiting
    assert having([lease, other]) == [False, True]
    clock.now += SLICE_SECONDS / 2
    other.answered.clear()
    cores.yield_if_due(other)  # its time slice is not over
    assert not other.answered.is_set()
    clock.now += HEAD_START_SECONDS / 2
    cores.yield_if_due(other)  # it is still new
    assert other.answered.is_set()
    assert having([lease, other]) == [False, True]
    clock.now += HEAD_START_SECONDS / 2
    cores.request(other, first=True)
    assert having([lease, other]) == [True, False]


def test_the_runs_of_one_usage_count_together_and_have_one_head_start():
    usage, clock = Usage(), Clock()
    cores = Cores(1, clock)
    (lease,) = asked(cores, usage)
    begin = usage.seconds
    clock.now = 10.0
    cores.release(lease)
    assert usage.seconds == begin + 10.0
    (other,) = asked(cores, Usage())
    assert has_core(other)
    asked(cores, usage)
    assert usage.seconds == pytest.approx(begin + 10.0 + SLICE_SECONDS)  # as much as the other
    assert usage.head_start == 0.0


def test_tasks_of_a_stopped_run_do_not_wait():
    cores, stop = Cores(1), Event()
    one, two = Usage(), Usage()
    asked(cores, one)
    waiting, late = Lease(two, stop), Lease(two, stop)
    cores.request(waiting)
    assert not waiting.answered.is_set()
    stop.set()
    cores.look()
    assert waiting.answered.is_set()
    with cores.held(late):
        assert having([waiting, late]) == [False, False]
    assert not cores._waiting
    assert cores.n_active == 1


class Simulation:
    """Users with tasks on cores; time passes in steps, at which tasks check whether to yield."""

    STEP = 0.01

    def __init__(self, n_cores: int) -> None:
        self.clock = Clock()
        self.cores = Cores(n_cores, self.clock)
        self.used: dict[Usage, float] = {}
        self.durations: list[float] = []
        self._left: dict[Lease, tuple[float, Callable[[], None]]] = {}

    def old(self, n_tasks: int, seconds: float = inf) -> Usage:
        """Start a user who always has `n_tasks` tasks."""
        usage = Usage()

        def start_task() -> None:
            self._start(usage, seconds, start_task)

        for _ in range(n_tasks):
            start_task()
        return usage

    def short(self, seconds: float, n_tasks: int = 1, repeat: bool = True) -> None:
        """Start a short run as a new user and, if `repeat`, the next one as soon as it ends."""
        usage, n_left, began = Usage(), [n_tasks], self.clock.now

        def end_task() -> None:
            n_left[0] -= 1
            if not n_left[0]:
                self.durations.append(self.clock.now - began)
                if repeat:
                    self.short(seconds, n_tasks)

        for _ in range(n_tasks):
            self._start(usage, seconds / n_tasks, end_task)

    def run(self, until: float) -> None:
        while self.clock.now < until - self.STEP / 2:
            active = list(self.cores._active)
            self.clock.now += self.STEP
            for lease in active:
                seconds, then = self._left[lease]
                self._left[lease] = seconds - self.STEP, then
                self.used[lease.usage] = self.used.get(lease.usage, 0.0) + self.STEP
            for lease in active:
                seconds, then = self._left[lease]
                if seconds < self.STEP / 2:
                    del self._left[lease]
                    self.cores.release(lease)
                    then()
                elif self.clock.now - lease.since > SLICE_SECONDS - self.STEP / 2:
                    self.cores.request(lease, first=True)

    def used_in(self, seconds: float, *usages: Usage) -> list[float]:
        """Return the core seconds of users in the next seconds."""
        before = dict(self.used)
        self.run(self.clock.now + seconds)
        return [self.used.get(usage, 0.0) - before.get(usage, 0.0) for usage in usages]

    def _start(self, usage: Usage, seconds: float, then: Callable[[], None]) -> None:
        lease = Lease(usage)
        self._left[lease] = seconds, then
        self.cores.request(lease)


def test_short_runs_one_after_another_leave_an_older_run_its_share():
    simulation = Simulation(1)
    old = simulation.old(1)
    simulation.run(0.05)
    for _ in range(2):
        simulation.short(0.3)
    (used,) = simulation.used_in(60, old)
    assert used > 0.9 * 60 / 3


@pytest.mark.parametrize("n_cores", [1, 2, 4])
@pytest.mark.parametrize("seconds", [(0.05,), (0.3, 0.3), (0.05, 0.05, 0.3, 1.0), (2.5, 0.1)])
def test_old_runs_get_their_share_in_every_window(n_cores, seconds):
    simulation = Simulation(n_cores)
    olds = [simulation.old(n_cores), simulation.old(n_cores, 0.2)]
    for each in seconds:
        simulation.short(each, n_tasks=2)
    window, n_users = 10.0, len(olds) + len(seconds)
    shared = (1 - HEAD_START_SHARE) * window - HEAD_START_SECONDS
    for _ in range(6):
        for used in simulation.used_in(window, *olds):
            assert used > n_cores * shared / n_users - 2 * SLICE_SECONDS


def test_a_short_run_now_and_then_takes_as_long_as_without_other_runs():
    simulation = Simulation(2)
    for _ in range(6):
        simulation.old(2)
    for _ in range(10):
        simulation.run(simulation.clock.now + 5)
        simulation.short(0.96, n_tasks=12, repeat=False)
    simulation.run(simulation.clock.now + 5)
    assert max(simulation.durations[2:]) < 0.48 + 2 * SLICE_SECONDS


def test_who_comes_back_to_idle_cores_that_another_took_meanwhile_gets_a_share():
    clock = Clock()
    cores = Cores(1, clock)
    old, new = Usage(), Usage()
    (lease,) = asked(cores, old)
    clock.now = 100.0
    cores.release(lease)
    asked(cores, new)
    asked(cores, old)
    assert old.seconds - new.seconds <= SLICE_SECONDS


@pytest.mark.parametrize("n_others", [7, 8])
def test_a_user_of_few_cores_does_not_keep_another_from_its_share(n_others):
    simulation = Simulation(8)
    one, others = simulation.old(1), simulation.old(n_others)
    simulation.run(60)
    new = simulation.old(8)
    used = simulation.used_in(10, one, others, new)
    assert used[0] > 9.5
    assert used[1] == pytest.approx(used[2], rel=0.1)


@pytest.fixture
def shared(monkeypatch):
    cores = Cores(1)
    monkeypatch.setattr(workers, "_shared_cores", cores)
    return cores


def test_two_runs_both_get_on_and_give_what_each_gives_alone(shared, monkeypatch):
    alone = [simulate(STRIPES, (400, 400), SMALL, n_realizations=4, seed=s) for s in (1, 2)]
    # Runs swap cores at every check:
    monkeypatch.setattr("ccwsim.jobs.scheduler.SLICE_SECONDS", 1e-9)
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
    assert not shared._waiting


@pytest.mark.parametrize(
    ("seconds", "expected"), [(0.0, ["one"] * 3 + ["two"]), (0.1, ["one", "two", "one", "one"])]
)
def test_small_tasks_of_a_run_share_a_time_slice(monkeypatch, seconds, expected):
    clock, began = Clock(), []
    cores = Cores(1, clock)
    monkeypatch.setattr(workers, "_shared_cores", cores)
    other = Thread(target=run_all, args=(lambda number, watch: began.append("two"), 1, 1))

    def task(number: int, watch: object) -> None:
        began.append("one")
        if not number:
            other.start()
            wait_until(lambda: bool(cores._waiting), "the other run")
        clock.now += seconds

    assert run_all(task, 3, 1) == [0, 1, 2]
    other.join(60)
    assert began == expected


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
    assert not shared._waiting
    assert simulate(STRIPES, Grid(40, 50), SMALL).n == 1


def test_a_task_that_fails_gives_its_core_back(shared):
    def fails(number, watch):
        raise ZeroDivisionError

    for n in (1, 3):
        with pytest.raises(ZeroDivisionError):
            run_all(fails, n, 2)
        assert (shared.n_active, shared._waiting) == (0, [])


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
