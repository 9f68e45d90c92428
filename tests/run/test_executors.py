"""Test that other executors give the realizations of local threads, and can be stopped."""

from __future__ import annotations

import os
import tempfile
import threading
import time
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor

import numpy as np
import pytest

from ccwsim import (
    Cancelled,
    CCWSIMError,
    Ensemble,
    HardData,
    Parameters,
    Secondary,
    TrainingImage,
    flow,
    simulate,
)
from ccwsim.engine.kernel_cache import SOURCE
from ccwsim.engine.prepared_image import PreparedImage
from ccwsim.run.executors import parts
from ccwsim.run.executors.parts import Folder, simulate_part
from tests.processes import process_pool
from tests.small_images import blobs

P = Parameters(16, 4, 1, n_candidates=5, template_variation=0.4)
IMAGE = TrainingImage(
    7 * blobs((45, 61), 3).astype(int) - 5, name="blobs", facies_names=["a", "b", "c"]
)
DATA = HardData([[3, 4], [20, 30], [55, 2], [40, 40]], [-5, 2, 9, 2])


def study(n: int = 12, **options) -> Ensemble:
    return simulate(IMAGE, (60, 50), P, DATA, n, seed=3, **options)


def large(executor: Executor, **options) -> Ensemble:
    return simulate(IMAGE, (8000, 8000), P, n_realizations=2, executor=executor, **options)


def same(one: Ensemble, other: Ensemble) -> bool:
    return (
        one.digest == other.digest
        and np.array_equal(one.data_status, other.data_status)
        and np.array_equal(one.numbers, other.numbers)
    )


class InLine(Executor):
    """An executor that runs each task immediately."""

    def submit(self, fn, /, *args, **kwargs):
        future: Future = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class Wrapped(Executor):
    """An executor that wraps a pool of threads."""

    def __init__(self, n: int) -> None:
        self._pool = ThreadPoolExecutor(n)
        self._threads, self._shutdown_lock = self._pool._threads, self._pool._shutdown_lock

    def submit(self, fn, /, *args, **kwargs):
        return self._pool.submit(fn, *args, **kwargs)


@pytest.fixture(scope="module")
def processes():
    with process_pool(2) as pool:
        yield pool


def test_threads_of_the_caller_give_the_same_and_stay_open():
    with ThreadPoolExecutor(3) as pool:
        assert same(study(executor=pool), study())
        assert pool.submit(int, 5).result() == 5


@pytest.mark.parametrize("kind", [ThreadPoolExecutor, Wrapped])
def test_a_thread_of_a_pool_may_give_its_own_pool(kind):
    """Test a pool with one thread, which must not wait for itself; other threads simulate."""
    for _ in range(50):  # the pool may not have registered its thread yet
        with kind(1) as pool:
            assert same(pool.submit(study, 1, executor=pool).result(120), study(1))


@pytest.mark.parametrize("first", [0, 5])
def test_processes_give_the_same(processes, first):
    seen: list[tuple[float, int]] = []
    found = study(
        executor=processes, first_realization=first, progress=lambda *now: seen.append(now)
    )
    assert same(found, study(first_realization=first))
    assert found.cpu_seconds.min() > 0
    fractions, done = zip(*seen, strict=True)
    assert list(fractions) == sorted(fractions)
    assert list(done) == sorted(done)
    assert seen[-1] == (1.0, 12)


def test_processes_write_the_same_file(processes, tmp_path):
    image, out = TrainingImage(300 * blobs((45, 61), 3).astype(int) - 5), tmp_path / "out.npy"
    data = HardData([[3, 4], [20, 30]], image.codes[[0, 1]])
    inputs = image, (60, 50), P, data, 20
    simulate(*inputs, seed=3, out=out, executor=processes)
    np.testing.assert_array_equal(np.load(out), simulate(*inputs, seed=3).realizations)


def test_processes_use_secondary_information(processes):
    active = np.add(*np.indices((60, 50))) > 20
    secondary = Secondary(active=active, probabilities={2: 0.4})
    found = study(2, executor=processes, secondary=secondary)
    assert same(found, study(2, secondary=secondary))
    assert not same(found, study(2))


def test_processes_solve_flow(processes):
    e = study(3)
    values: dict[int | str, float] = {"a": 1e-3, "b": 1e-2, "c": 1.0}
    found = flow.effective_k(e, values, executor=processes)
    assert np.array_equal(found.each, flow.effective_k(e, values).each)


def test_any_executor_will_do_and_sources_come_with_it():
    found = study(executor=InLine(), keep_sources=True)
    here = study(keep_sources=True)
    assert same(found, here)
    np.testing.assert_array_equal(found.sources, here.sources)


class Looking(InLine):
    """An executor that keeps the arguments of its tasks."""

    def __init__(self) -> None:
        self.arguments: list[tuple] = []

    def submit(self, fn, /, *args, **kwargs):
        self.arguments.append(args)
        return super().submit(fn, *args, **kwargs)


def test_parts_are_consecutive_realizations():
    looking = Looking()
    study(12, executor=looking, first_realization=3, n_workers=1)
    assert [k for _, _, numbers, *_ in looking.arguments for k in numbers] == list(range(3, 15))


@pytest.mark.slow
def test_small_realizations_travel_in_parts():
    looking = Looking()
    study(200, executor=looking, n_workers=1)
    sizes = [len(numbers) for _, _, numbers, *_ in looking.arguments]
    assert max(sizes) > 1
    assert len(sizes) < 100


def test_a_worker_prepares_a_study_once(monkeypatch):
    prepared = []
    monkeypatch.setattr(
        parts, "PreparedImage", lambda study: prepared.append(study) or PreparedImage(study)
    )
    parts._image_of.cache_clear()
    for _ in range(2):
        study(5, executor=InLine(), n_workers=1)
    assert len(prepared) == 1
    assert prepared[0].hard_data == DATA


class TestCancel:
    def test_what_is_finished_is_handed_over(self, processes):
        done = [0]
        with pytest.raises(Cancelled, match="of 5000") as stopped:
            study(
                5000,
                executor=processes,
                progress=lambda _, n: done.append(n),
                cancel=lambda: done[-1] >= 3,
            )
        ensemble = stopped.value.ensemble
        assert ensemble is not None
        assert 3 <= ensemble.n < 5000
        r = int(ensemble.numbers[-1])
        one = study(1, first_realization=r)
        np.testing.assert_array_equal(ensemble.realizations[-1], one.realizations[0])

    @pytest.mark.slow
    def test_a_large_realization_is_stopped_in_its_process(self, processes):
        study(2, executor=processes)  # compiled
        start = time.monotonic()
        with pytest.raises(Cancelled, match="0 of 2"):
            large(processes, cancel=lambda: time.monotonic() > start + 0.5)
        # Both workers are free; otherwise these tasks would wait for the large ones.
        assert same(study(4, executor=processes), study(4))

    @pytest.mark.slow
    def test_the_share_of_a_large_realization_is_reported_before_it_is_finished(self, processes):
        seen: list[tuple[float, int]] = []
        with pytest.raises(Cancelled, match="0 of 2"):
            large(
                processes,
                progress=lambda *now: seen.append(now),
                cancel=lambda: bool(seen) and seen[-1][0] > 0,
            )
        assert 0 < seen[-1][0] < 0.5
        assert seen[-1][1] == 0

    def test_a_folder_is_seen_only_on_its_machine(self):
        folder = Folder()
        elsewhere = Folder(path=folder.path, host="another machine")
        assert folder.share(3) == 0.0
        assert not folder.report(3, 0.25)
        assert not folder.report(3, 0.5)
        assert not folder.report(7, 0.125)
        assert (folder.share(3), folder.share(5), folder.share(7)) == (0.5, 0.0, 0.125)
        folder.stop()
        assert folder.report(3, 1.0)
        assert not elsewhere.report(3, 1.0)
        assert folder.share(3) == 0.0
        folder.stop()

    def test_a_worker_begins_no_part_of_a_stopped_run(self):
        looking = Looking()
        study(1, executor=looking)
        content, _, _, _, folder = looking.arguments[0]
        assert simulate_part(content, SOURCE, range(3), False, folder) == {}

    def test_no_reports_are_left(self, monkeypatch, tmp_path):
        monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
        study(2, executor=InLine())
        with pytest.raises(Cancelled):
            study(40, executor=InLine(), n_workers=1, cancel=lambda: True)
        assert list(tmp_path.iterdir()) == []


def ended() -> None:
    os._exit(1)


class TestErrors:
    @pytest.mark.slow
    def test_a_worker_that_ends_is_said_in_words(self):
        with process_pool(1) as pool:
            pool.submit(ended)
            with pytest.raises(CCWSIMError, match="worker process ended"):
                study(500, executor=pool)

    @pytest.mark.parametrize("kind", [ThreadPoolExecutor, process_pool])
    def test_an_executor_that_is_shut_down_is_refused(self, kind):
        with kind(1) as pool:
            pass
        with pytest.raises(CCWSIMError, match="takes no work"):
            study(executor=pool)

    @pytest.mark.parametrize("value", ["tcp://127.0.0.1:8786", 2, ThreadPoolExecutor])
    def test_anything_else_is_refused(self, value):
        with pytest.raises(CCWSIMError, match="executor"):
            study(executor=value)

    def test_another_version_at_a_worker_is_refused(self):
        with pytest.raises(CCWSIMError, match="another version"):
            simulate_part(b"", "another", range(3), False, Folder())

    def test_an_error_of_the_callback_reaches_the_caller(self, processes):
        def broken(fraction: float, n_done: int) -> None:
            if n_done:
                raise RuntimeError("the page was closed")

        with pytest.raises(RuntimeError, match="closed"):
            study(500, executor=processes, progress=broken)
        assert same(study(4, executor=processes), study(4))

    @pytest.mark.parametrize(
        ("error", "match"),
        [
            (ValueError("a broken disk"), "broken disk"),
            (ModuleNotFoundError("no ccwsim"), "cannot import a module .no ccwsim"),
            (CancelledError(), "executor was cancelled"),
        ],
    )
    def test_a_task_that_fails_stops_the_others(self, error, match):
        class Failing(InLine):
            def submit(self, fn, /, *args, **kwargs):
                future: Future = Future()
                future.set_exception(error)
                return future

        kind = ValueError if isinstance(error, ValueError) else CCWSIMError
        with pytest.raises(kind, match=match):
            study(executor=Failing())


@pytest.mark.slow
def test_two_runs_share_an_executor(processes):
    found: dict[int, Ensemble] = {}

    def run(seed: int) -> None:
        found[seed] = simulate(IMAGE, (60, 50), P, DATA, 20, seed=seed, executor=processes)

    threads = [threading.Thread(target=run, args=(seed,)) for seed in (1, 2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for seed, ensemble in found.items():
        assert same(ensemble, simulate(IMAGE, (60, 50), P, DATA, 20, seed=seed))
    assert len(found) == 2
