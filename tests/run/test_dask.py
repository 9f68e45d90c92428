"""Test that a Dask cluster of processes gives the results of local threads, even if workers die."""

from __future__ import annotations

import os
import signal
import time

import numpy as np
import pytest

from ccwsim import Cancelled, CCWSIMError, Ensemble, HardData, Parameters, TrainingImage, simulate
from ccwsim.cli.program import main
from ccwsim.model.watch import UNWATCHED
from ccwsim.run.executors import connect, executor_of_environment
from ccwsim.run.executors.cluster import SCHEDULER
from ccwsim.sharing.choices import Choices
from ccwsim.ui.study.run import part_of
from tests.small_images import blobs

dask = pytest.importorskip("dask", reason="dask.distributed is an optional extra")
distributed = pytest.importorskip("distributed", reason="dask.distributed is an optional extra")

P = Parameters(16, 4, 1, n_candidates=5)
IMAGE = TrainingImage(blobs((45, 61), 2))
DATA = HardData([[3, 4], [20, 30], [155, 2], [40, 40]], [0, 1, 1, 0])


@pytest.fixture(scope="module")
def client():
    """Yield a client of two worker processes, which are restarted if they end."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client


def study(n: int = 20, **options) -> Ensemble:
    return simulate(IMAGE, (160, 150), P, DATA, n, seed=5, **options)


def large(client, n: int, **options) -> Ensemble:
    return simulate(IMAGE, (8000, 8000), P, n_realizations=n, executor=client, **options)


def same(one: Ensemble, other: Ensemble) -> bool:
    return one.digest == other.digest and np.array_equal(one.data_status, other.data_status)


@pytest.mark.slow
def test_the_cluster_gives_the_same(client):
    seen: list[tuple[float, int]] = []
    found = study(executor=client, progress=lambda *now: seen.append(now))
    assert same(found, study())
    assert found.cpu_seconds.min() > 0
    assert [n for _, n in seen] == sorted(n for _, n in seen)
    assert seen[-1] == (1.0, 20)


@pytest.mark.slow
def test_the_study_is_sent_once_to_the_cluster(client, monkeypatch):
    sent: list[int] = []
    submit = client.submit

    def counting(fn, *args, **kwargs):
        sent.extend(len(arg) for arg in args if isinstance(arg, bytes))
        return submit(fn, *args, **kwargs)

    monkeypatch.setattr(client, "submit", counting)
    study(20, executor=client)
    assert len(sent) == 1
    assert sent[0] > IMAGE.indices.nbytes


@pytest.mark.slow
def test_a_scheduler_without_workers_is_said_in_words(monkeypatch):
    monkeypatch.setattr("ccwsim.run.executors.cluster.WORKER_SECONDS", 0.1)
    none = {"n_workers": 0, "processes": False, "dashboard_address": None}
    with (
        distributed.Client(**none, set_as_default=False) as client,
        pytest.raises(CCWSIMError, match="no worker"),
    ):
        study(1, executor=client)


@pytest.mark.slow
def test_a_task_on_the_only_thread_of_a_cluster_may_use_this_cluster():
    def task() -> Ensemble:
        return study(3, executor=distributed.get_client())

    one = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "dashboard_address": None}
    with distributed.Client(**one, set_as_default=False) as client:
        assert same(client.submit(task).result(120), study(3))


@pytest.mark.slow
def test_the_cluster_gives_the_same_volumes(client):
    image = TrainingImage(blobs((9, 45, 61), 3))
    wells = [(z, y, x) for z in range(7) for y, x in ((3, 4), (20, 30), (39, 49))]
    data = HardData(wells, [z // 3 for z, *_ in wells])
    given = image, (7, 40, 50), Parameters((4, 16, 16), (2, 4, 4), (0, 1, 1)), data, 5
    found = simulate(*given, seed=3, executor=client)
    assert same(found, simulate(*given, seed=3))
    assert not found.n_mismatched.any()


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="processes cannot be killed here")
@pytest.mark.parametrize("which", ["one", "all"])
def test_realizations_of_a_killed_worker_are_done_again(client, which):
    client.wait_for_workers(2)
    pids = list(client.run(os.getpid).values())
    doomed = pids[:1] if which == "one" else pids
    killed: list[int] = []

    def kill_half_way(fraction: float, n_done: int) -> None:
        if n_done >= 60 and not killed:
            killed.extend(doomed)
            for pid in doomed:
                os.kill(pid, signal.SIGKILL)

    found = study(300, executor=client, progress=kill_half_way)
    assert killed == doomed
    assert found.n == 300
    assert same(found, study(300))


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="processes cannot be killed here")
def test_a_part_that_ends_its_workers_is_said_in_words():
    kind = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": None}
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.Client(**kind, set_as_default=False) as client,
    ):
        pids = list(client.run(os.getpid).values())

        def kill(fraction: float, n_done: int) -> None:
            if n_done and pids:
                os.kill(pids.pop(), signal.SIGKILL)

        with pytest.raises(CCWSIMError, match="workers ended repeatedly"):
            study(300, executor=client, progress=kill)


@pytest.mark.slow
def test_cancel_stops_what_runs(client):
    study(2, executor=client)  # compiled
    start = time.monotonic()
    with pytest.raises(Cancelled, match="0 of 3"):
        large(client, 3, cancel=lambda: time.monotonic() > start + 0.5)
    assert same(study(4, executor=client), study(4))


@pytest.mark.slow
def test_the_share_of_a_large_realization_is_reported_before_it_is_finished(client):
    seen: list[tuple[float, int]] = []
    with pytest.raises(Cancelled, match="0 of 1"):
        large(
            client,
            1,
            progress=lambda *now: seen.append(now),
            cancel=lambda: bool(seen) and seen[-1][0] > 0,
        )
    assert 0 < seen[-1][0] < 1


@pytest.mark.slow
def test_the_command_line_takes_the_address_of_a_scheduler(client, tmp_path):
    line = ["simulate", "channels", "--grid", "60x40", "--template", "16", "--overlap", "4"]
    line += ["--level", "1", "--realizations", "3", "--quiet"]
    here, there = tmp_path / "here.npy", tmp_path / "there.npy"
    assert main([*line, "-o", str(here)]) == 0
    address = client.scheduler.address
    assert main([*line, "--scheduler", address, "-o", str(there)]) == 0
    np.testing.assert_array_equal(np.load(here), np.load(there))


@pytest.mark.slow
def test_the_dashboard_takes_the_address_from_the_environment(client, monkeypatch):
    monkeypatch.delenv(SCHEDULER, raising=False)
    assert executor_of_environment() is None
    choices = Choices(n_realizations=2)
    here = part_of(choices)(0, 2, UNWATCHED)
    monkeypatch.setenv(SCHEDULER, client.scheduler.address)
    own = executor_of_environment()
    assert own is executor_of_environment()
    assert same(part_of(choices)(0, 2, UNWATCHED), here)
    own.close()
    monkeypatch.setenv(SCHEDULER, "tcp://127.0.0.1:9")
    with pytest.raises(CCWSIMError, match="no Dask scheduler answers"):
        part_of(choices)(0, 2, UNWATCHED)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "tcp://127.0.0.1:port", ""])
def test_a_scheduler_that_does_not_answer_is_said_in_words(address):
    with pytest.raises(CCWSIMError, match="no Dask scheduler answers"):
        connect(address)
