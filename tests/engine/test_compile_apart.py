"""A server lets another process compile, so that it can send pages meanwhile."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ccwsim.engine import kernels

PACKAGE = Path(kernels.__file__).parents[1]
WAIT = "import time; time.sleep(60)"


@pytest.fixture
def started(monkeypatch):
    """The processes that were started, each of which does nothing for a minute."""
    processes: list[subprocess.Popen] = []

    class Idle(subprocess.Popen):
        def __init__(self, command, **options):
            assert command[1:4] == ["-m", "ccwsim", "warm-up"]
            super().__init__([sys.executable, "-c", WAIT], **options)
            processes.append(self)

    monkeypatch.setattr(kernels.subprocess, "Popen", Idle)
    monkeypatch.setattr(kernels, "_apart", None)
    yield processes
    for process in processes:
        process.kill()


def test_it_ends_when_the_kernels_of_a_run_are_there(monkeypatch, started):
    looks = [set(), {"paste"}, {"paste", "simulate_patches"}, kernels.OUTERMOST]
    seen = []

    def on_disk():
        seen.append(kernels.compilation())
        return looks[min(len(seen) - 1, 3)]

    monkeypatch.setattr(kernels, "kernels_on_disk", on_disk)
    kernels.compile_apart(lambda: False)
    assert len(started) == 1
    assert [now[0] if now else None for now in seen] == [None, None, 1, 2]
    assert kernels.compilation() is None


def test_it_ends_when_the_run_is_cancelled(monkeypatch, started):
    monkeypatch.setattr(kernels, "kernels_on_disk", set)
    end = time.monotonic() + 0.3
    kernels.compile_apart(lambda: time.monotonic() > end)
    assert len(started) == 1
    assert kernels.compilation() is None


def test_two_runs_wait_for_the_same_process(monkeypatch, started):
    monkeypatch.setattr(kernels, "kernels_on_disk", set)
    kernels.compile_apart(lambda: True)
    kernels.compile_apart(lambda: True)
    assert len(started) == 1


def test_nothing_is_started_where_kernels_are_on_disk(monkeypatch, started):
    monkeypatch.setattr(kernels, "kernels_on_disk", lambda: kernels.OUTERMOST)
    kernels.compile_apart(lambda: False)
    monkeypatch.setattr(kernels, "kernels_on_disk", set)
    monkeypatch.setattr(kernels, "FOLDER", "")  # nothing can be kept, so nothing would be gained
    kernels.compile_apart(lambda: False)
    assert started == []


@pytest.mark.slow
def test_another_process_compiles_what_this_one_then_reads(tmp_path):
    """In a copy of the package that has no kernels yet."""
    away = shutil.ignore_patterns("__pycache__")
    shutil.copytree(PACKAGE, tmp_path / "ccwsim", ignore=away)
    code = """
from numba.core import event
from ccwsim import simulate
from ccwsim.datasets import load, load_hard_data
from ccwsim.engine import kernels
from ccwsim.sharing.choices import Choices
assert not kernels.kernels_on_disk()
kernels.compile_apart(lambda: False)
c = Choices()
with event.install_recorder("numba:compile") as compiled:
    data = load_hard_data(c.data.bundled)
    simulate(load(c.image.bundled), c.grid, c.parameters, data, 1, c.seed)
print("compiled here:", len(compiled.buffer))
"""
    own = {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "home")}
    options = {"cwd": tmp_path, "env": {**os.environ, **own}, "timeout": 300}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, **options)
    assert "compiled here: 0" in done.stdout, done.stdout + done.stderr[-2000:]
