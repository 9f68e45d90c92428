"""Test that a run starts only within the limits of the server and the free memory."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from ccwsim import CCWSIMError, Grid, HardData, Parameters, TrainingImage, simulate
from ccwsim.engine import realization
from ccwsim.jobs import job as jobs, limits
from ccwsim.jobs.job import Job, Queue
from ccwsim.jobs.limits import RESERVE, Demand, admit, limits_of_environment
from ccwsim.model.study import Study
from ccwsim.run.footprint import KERNELS, demand_of, footprint
from ccwsim.system.memory import free_memory

STRIPES = TrainingImage(np.tile([[0], [0], [1], [1]], (16, 64)))
STUDY = Study(STRIPES, Grid(1000, 1000), Parameters(16, 4, 1))
MEGABYTE = 10**6


def with_free(monkeypatch, n_bytes: int) -> None:
    monkeypatch.setattr(limits, "free_memory", lambda: n_bytes + RESERVE)


def test_without_variables_there_is_no_limit(monkeypatch):
    for name in ("CCWSIM_MAX_CELLS", "CCWSIM_MAX_DATA"):
        monkeypatch.delenv(name, raising=False)
    limits = limits_of_environment()
    assert str(limits) == ""
    limits.check(Demand(10**15, 10**9))


@pytest.mark.parametrize("text", ["2000000", "2_000_000", "2e6"])
def test_a_limit_is_stated_and_names_value_limit_and_mend(monkeypatch, text):
    monkeypatch.setenv("CCWSIM_MAX_CELLS", text)
    monkeypatch.setenv("CCWSIM_MAX_DATA", "500")
    limits = limits_of_environment()
    assert str(limits) == (
        "This server allows up to 2 million cells × realizations and 500 hard data per run."
    )
    limits.check(Demand(2_000_000, 500))
    with pytest.raises(CCWSIMError, match=r"3\.1 million .* the 2 million .* fewer realizations"):
        limits.check(Demand(3_100_000))
    with pytest.raises(CCWSIMError, match=r"501 hard data .* the 500 .* use fewer"):
        limits.check(Demand(1, 501))


@pytest.mark.parametrize("text", ["many", "-3", "1.5", "nan", "inf"])
def test_a_variable_that_is_no_number_is_named(monkeypatch, text):
    monkeypatch.setenv("CCWSIM_MAX_CELLS", text)
    with pytest.raises(CCWSIMError, match=f"CCWSIM_MAX_CELLS = '{text}'"):
        limits_of_environment()


def test_a_run_that_does_not_fit_is_refused_with_a_reason(monkeypatch):
    with_free(monkeypatch, 40 * MEGABYTE)
    admit(Demand(1, 0, 40 * MEGABYTE))
    with pytest.raises(CCWSIMError, match=r"about 12\.0 GB .* 40 MB are free: .*--out"):
        admit(Demand(1, 0, 12_000 * MEGABYTE))


def test_what_other_runs_have_still_to_take_counts(monkeypatch):
    with_free(monkeypatch, 40 * MEGABYTE)
    with pytest.raises(CCWSIMError, match="10 MB are free now, beside other runs; wait"):
        admit(Demand(1, 0, 30 * MEGABYTE), promised=30 * MEGABYTE)


def test_where_the_system_does_not_tell_nothing_is_refused(monkeypatch):
    monkeypatch.setattr(limits, "free_memory", lambda: None)
    admit(Demand(1, 0, 10**15))


def test_a_server_can_be_given_less_than_the_machine_has(monkeypatch):
    with_free(monkeypatch, 10_000 * MEGABYTE)
    monkeypatch.setattr(limits, "used_memory", lambda: 300 * MEGABYTE)
    monkeypatch.setattr(limits, "memory_of_children", lambda: 0)  # of other tests
    monkeypatch.setenv("CCWSIM_MEMORY_MB", "1000")
    admit(Demand(1, 0, 500 * MEGABYTE))
    with pytest.raises(CCWSIMError, match="572 MB are free"):
        admit(Demand(1, 0, 600 * MEGABYTE))


def test_the_promise_to_a_job_shrinks_as_it_gets_on_and_ends_with_it(monkeypatch):
    queue = Queue(2)
    monkeypatch.setattr(jobs, "server_queue", lambda: queue)
    with_free(monkeypatch, 100 * MEGABYTE)
    half, go = Event(), Event()

    def work(job):
        job.report(0.5, 1)
        half.set()
        go.wait(60)

    job = Job(work, demand=Demand(1, 0, 80 * MEGABYTE))
    assert half.wait(60)
    assert queue.still_to_take == 40 * MEGABYTE
    with pytest.raises(CCWSIMError, match="60 MB are free now"):
        Job(work, demand=Demand(1, 0, 70 * MEGABYTE))
    assert queue.n_active == 1
    go.set()
    assert job.wait(60)
    assert queue.still_to_take == 0


def test_a_larger_run_needs_more():
    data = HardData([[1, 1], [50, 60]], [0, 1])
    more = (
        footprint(STUDY, 20),
        footprint(STUDY, 10, n_workers=8),
        footprint(replace(STUDY, grid=Grid(2000, 2000)), 10),
        footprint(replace(STUDY, hard_data=data), 10, n_workers=2),
    )
    assert all(n_bytes > footprint(STUDY, 10, n_workers=2) for n_bytes in more)
    assert demand_of(STUDY, 10, n_kept=2).n_bytes < demand_of(STUDY, 10).n_bytes
    assert demand_of(STUDY, 10, n_kept=2).n_cells == 10_000_000


def test_kernels_count_until_the_process_has_run_them(monkeypatch):
    p = STUDY.parameters
    simulate(STRIPES, (50, 50), p)
    compiled = footprint(STUDY, 10)
    monkeypatch.setattr(realization, "_compiled_kinds", set())
    assert footprint(STUDY, 10) == compiled + KERNELS


def written(root: Path, files: dict[str, str]) -> Path:
    for name, content in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(content)
    return root


MACHINE = {"proc/meminfo": "MemTotal: 9000 kB\nMemAvailable:    5000 kB\n"}


def test_the_memory_of_a_machine(tmp_path):
    assert free_memory(written(tmp_path, MACHINE)) == 5000 * 1024


@pytest.mark.parametrize("path", ["/", "/docker/abc"])
def test_a_container_of_version_2_has_less(tmp_path, path):
    root = written(tmp_path, {
        **MACHINE,
        "proc/self/cgroup": f"0::{path}\n",
        "sys/fs/cgroup/memory.max": "3000000\n",
        "sys/fs/cgroup/memory.current": "2500000\n",
        "sys/fs/cgroup/memory.stat": "anon 1\ninactive_file 400000\n",
    })  # fmt: skip
    assert free_memory(root) == 900_000


def test_a_container_of_version_1_has_less(tmp_path):
    root = written(tmp_path, {
        **MACHINE,
        "proc/self/cgroup": "4:cpu,memory:/box\n0::/\n",
        "sys/fs/cgroup/memory/memory.limit_in_bytes": "9223372036854771712\n",
        "sys/fs/cgroup/memory/memory.usage_in_bytes": "7\n",
        "sys/fs/cgroup/memory/box/memory.limit_in_bytes": "2000000\n",
        "sys/fs/cgroup/memory/box/memory.usage_in_bytes": "1500000\n",
        "sys/fs/cgroup/memory/box/memory.stat": "total_inactive_file 100000\n",
    })  # fmt: skip
    assert free_memory(root) == 600_000


def test_a_container_without_a_limit_has_what_the_machine_has(tmp_path):
    files = {"proc/self/cgroup": "0::/\n", "sys/fs/cgroup/memory.max": "max\n"}
    assert free_memory(written(tmp_path, {**MACHINE, **files})) == 5000 * 1024
