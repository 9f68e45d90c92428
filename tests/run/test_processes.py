"""Test that worker processes give the realizations of threads, and that only their runs can end."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from subprocess import PIPE
from threading import Event
from typing import Any

import numpy as np
import pytest

from ccwsim import Cancelled, CCWSIMError, Ensemble, HardData, Parameters, TrainingImage, simulate
from ccwsim.engine.prepared_image import fresh_images
from ccwsim.jobs import child
from ccwsim.jobs.child import WarmProcesses
from ccwsim.jobs.limits import RESERVE
from ccwsim.run.executors import processes
from tests.small_images import blobs
from tests.waiting import wait_until

ROOT = Path(__file__).parents[2]
SLOW = 300
P = Parameters(16, 4, 1, n_candidates=5)
IMAGE = TrainingImage(
    7 * blobs((45, 61), 3).astype(int) - 5, name="blobs", facies_names=["a", "b", "c"]
)
DATA = HardData([[3, 4], [20, 30], [55, 2], [40, 40]], [-5, 2, 9, 2])
LARGE: dict[str, Any] = {"grid_shape": (300, 300), "hard_data": None, "n_realizations": 9}


def run(**options) -> Ensemble:
    study = {"grid_shape": (60, 50), "hard_data": DATA, "n_realizations": 6, "seed": 3}
    return simulate(IMAGE, parameters=P, **{**study, **options})


@pytest.fixture(scope="module", params=["forked", pytest.param("spawned", marks=pytest.mark.slow)])
def workers(request):
    """Use worker processes, and yield the idle ones; spawned ones take seconds to start."""
    if request.param == "forked" and not child.CAN_FORK:
        pytest.skip("the system has no safe fork")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(processes, "CAN_FORK", request.param == "forked")
        patch.setattr(processes, "is_used", True)
        patch.setattr(processes, "_workers", WarmProcesses(2))
        run()
        yield processes._workers.idle
        for process in processes._workers.idle:
            process.end()


@pytest.fixture(scope="module")
def expected():
    return run()


def same(one: Ensemble, other: Ensemble) -> bool:
    return (
        one.digest == other.digest
        and np.array_equal(one.data_status, other.data_status)
        and np.array_equal(one.numbers, other.numbers)
    )


@pytest.mark.parametrize(
    "options", [{}, {"first_realization": 7}, {"n_workers": 1}, {"keep_sources": True}]
)
def test_a_worker_gives_the_realizations_of_threads(workers, monkeypatch, options):
    pid = workers[-1].pid
    ensemble = run(**options)
    assert workers[-1].pid == pid  # it stays for the next run
    monkeypatch.setattr(processes, "is_used", False)
    on_threads = run(**options)
    assert same(ensemble, on_threads)
    if options == {"keep_sources": True}:
        assert ensemble.sources is not None
        assert on_threads.sources is not None
        assert np.array_equal(ensemble.sources, on_threads.sources)


def test_progress_rises_to_the_end(workers):
    reports: list[tuple[float, int]] = []
    run(**LARGE, progress=lambda share, n_done: reports.append((share, n_done)))
    assert len(reports) > 3
    assert reports == sorted(reports)
    assert reports[-1] == (1.0, 9)


def test_a_cancelled_run_returns_its_first_realizations_and_the_worker_stays(workers, expected):
    reports: list[int] = []
    options = {"progress": lambda _, n_done: reports.append(n_done), **LARGE}
    pid, start = workers[-1].pid, time.monotonic()
    with pytest.raises(Cancelled) as stopped:
        run(**{**options, "n_realizations": 300}, cancel=lambda: bool(reports and reports[-1] > 1))
    assert time.monotonic() - start < SLOW
    part = stopped.value.ensemble
    assert 2 <= part.n < 300
    whole = run(**{**LARGE, "n_realizations": int(part.numbers[-1]) + 1})
    np.testing.assert_array_equal(part.indices, whole.indices[part.numbers])
    assert workers[-1].pid == pid
    assert same(run(), expected)


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="the system cannot stop a process")
def test_a_worker_that_does_not_stop_is_killed(workers, monkeypatch, expected):
    monkeypatch.setattr(processes, "STOP_RUN_SECONDS", 0.1)
    victim, begun = workers[-1], Event()

    def cancel() -> bool:
        if begun.is_set():
            os.kill(victim.pid, signal.SIGSTOP)
        return begun.is_set()

    with pytest.raises(Cancelled):
        run(**LARGE, progress=lambda *_: begun.set(), cancel=cancel)
    assert not victim.runs()
    assert same(run(), expected)


def test_an_error_of_the_run_is_raised_and_the_worker_stays(workers, expected):
    codes = blobs((40, 40), 3).astype(float)
    codes[::8, ::8] = np.nan
    pid = workers[-1].pid
    with pytest.raises(CCWSIMError, match="piece"):
        simulate(codes, (60, 50), P)
    assert same(run(), expected)
    assert workers[-1].pid == pid


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV])
def test_a_crash_ends_one_run_with_a_message_and_no_other(workers, expected, number):
    begun, go_on = Event(), Event()

    def progress(share, n_done):
        begun.set()
        assert go_on.wait(SLOW)

    with ThreadPoolExecutor(2) as pool:
        victim = workers[-1]
        first = pool.submit(run, **LARGE, progress=progress)
        assert begun.wait(SLOW)
        second = pool.submit(run, **{**LARGE, "n_realizations": 2})
        os.kill(victim.pid, number)
        go_on.set()
        error = first.exception(SLOW)
        assert isinstance(error, CCWSIMError)
        assert "the process that simulated it stopped" in str(error)
        assert same(run(), expected)  # the next run of the same visitor
        assert second.result(SLOW).n == 2
    assert victim.pid not in {process.pid for process in workers}
    assert not victim.runs()


def test_a_worker_that_ended_while_it_waited_is_replaced(workers, expected):
    for process in workers:
        os.kill(process.pid, signal.SIGKILL)
    wait_until(lambda: not any(process.runs() for process in workers), "the end of the workers")
    assert same(run(), expected)


def test_an_error_of_the_caller_ends_the_run_of_the_worker(workers, expected):
    def fail(share, n_done):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run(**LARGE, progress=fail)
    assert same(run(), expected)


@pytest.mark.skipif(sys.platform == "win32", reason="the system cannot limit memory")
def test_a_run_that_takes_more_memory_than_is_free_ends_without_the_worker(
    workers, expected, monkeypatch
):
    monkeypatch.setattr(processes, "free_bytes", lambda limits: 150_000_000 - RESERVE)
    with pytest.raises(MemoryError):
        simulate(np.tile(IMAGE.array, (60, 60)), (100, 100), P)
    assert same(run(), expected)


def test_measured_runs_keep_no_image(workers, expected):
    with fresh_images():
        assert same(run(), expected)


def test_a_template_that_has_ended_is_replaced(workers, expected):
    if not processes.CAN_FORK:
        pytest.skip("workers are spawned")
    template = processes._running_template()
    os.kill(template._process.pid, signal.SIGKILL)
    for process in workers:
        os.kill(process.pid, signal.SIGKILL)
    wait_until(lambda: not any(process.runs() for process in workers), "the end of the workers")
    assert same(run(), expected)
    assert processes._running_template() is not template


SERVER = """
import sys
from ccwsim.run.executors import processes
from tests.run.test_processes import run
processes.CAN_FORK &= sys.argv[1] == "forked"
processes.use_processes()
print(run().digest)
print(processes._workers.idle[-1].pid, flush=True)
sys.stdin.read()
"""


@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="only Linux tells when a process ended")
@pytest.mark.parametrize("kind", ["forked", "spawned"])
def test_workers_end_with_their_server_even_if_it_is_killed(kind, expected):
    command = [sys.executable, "-c", SERVER, kind]
    with subprocess.Popen(command, cwd=ROOT, stdin=PIPE, stdout=PIPE) as server:
        assert server.stdout is not None
        assert server.stdout.readline().decode().strip() == expected.digest
        worker = os.pidfd_open(int(server.stdout.readline()))
        server.kill()
    assert select.select([worker], [], [], SLOW)[0]
