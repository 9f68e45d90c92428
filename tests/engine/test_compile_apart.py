"""Test that other processes compile kernels, so that a server can answer meanwhile.

These processes end with the process that started them.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from ccwsim import simulate
from ccwsim.engine import compilation, kernels
from ccwsim.engine.compilation import LATER, NOW, SOON
from ccwsim.model.errors import Cancelled
from ccwsim.run.executors import threads
from tests.waiting import wait_until

PACKAGE = Path(kernels.__file__).parents[1]


def add_one(cells):
    for x in range(len(cells)):
        cells[x] += 1
    return len(cells)


def twice(cells):
    return 2 * cells


class Kernel:
    """The attributes of a kernel that a request needs."""

    __module__ = "tests"

    def __init__(self, name: str, n_functions: int = 1) -> None:
        self.__name__, self.n_functions = name, n_functions


@pytest.fixture
def compilers(monkeypatch):
    """Return compilers without processes; `compiled` lists the compiled names in order."""
    own = compilation._Compilers()
    own.compiled, own.release = [], Event()

    def let_compile(process, request):
        own.release.wait(60)
        own.compiled.append(request.kernel.__name__)

    monkeypatch.setattr(compilation, "_compilers", own)
    monkeypatch.setattr(compilation, "_start_process", lambda: None)
    monkeypatch.setattr(compilation, "_let_compile", let_compile)
    monkeypatch.setattr(compilation, "n_cores", lambda: 1)
    monkeypatch.setattr(compilation, "IDLE_SECONDS", 0.05)
    yield own
    own.release.set()
    wait_until(lambda: not own._n_running, "the end of the threads")


def ask(compilers, *requests):
    asked = [compilers.ask(Kernel(name, size), (), urgency) for name, size, urgency in requests]
    compilers.release.set()
    compilers.await_all(asked, lambda: None)
    return compilers.compiled


def test_what_is_waited_for_comes_first_and_of_these_the_largest(compilers):
    first = compilers.ask(Kernel("first"), (), LATER)
    wait_until(lambda: first.is_taken, "the first request")
    asked = ("later", 9, LATER), ("small", 1, SOON), ("large", 5, SOON), ("now", 1, NOW)
    assert ask(compilers, *asked) == ["first", "now", "large", "small", "later"]


def test_a_kernel_is_compiled_once_and_can_become_more_urgent(compilers):
    first = compilers.ask(Kernel("first"), (), LATER)
    wait_until(lambda: first.is_taken, "the first request")
    later = compilers.ask(Kernel("b"), (), LATER)
    assert compilers.ask(Kernel("b"), (), NOW) is later
    assert ask(compilers, ("a", 1, SOON)) == ["first", "b", "a"]


def test_a_process_that_cannot_be_started_leaves_the_work_to_this_one(compilers, monkeypatch):
    def fail():
        raise OSError("no processes")

    monkeypatch.setattr(compilation, "_start_process", fail)
    assert ask(compilers, ("a", 1, NOW), ("b", 1, LATER)) == []


def test_a_process_that_ends_leaves_its_kernel_to_this_one(compilers, monkeypatch):
    def end(process, request):
        raise BrokenPipeError

    monkeypatch.setattr(compilation, "_let_compile", end)
    assert ask(compilers, ("a", 1, SOON), ("b", 1, SOON)) == []


def test_waiting_ends_when_the_run_is_cancelled(compilers):
    request = compilers.ask(Kernel("a"), (), SOON)

    def check():
        raise Cancelled("stopped")

    with pytest.raises(Cancelled):
        compilation.await_all([request], check)


def test_a_run_that_is_stopped_while_kernels_compile_ends(monkeypatch):
    def wait(image, watch, load):
        while not Event().wait(0.01):
            watch.check()

    monkeypatch.setattr(threads, "is_compiled", lambda *_: False)
    monkeypatch.setattr(threads, "compile_kernels", wait)
    stopped = iter([False, False])
    with pytest.raises(Cancelled, match="stopped after 0 of 2") as caught:
        simulate(np.eye(40), (40, 40), n_realizations=2, cancel=lambda: next(stopped, True))
    assert caught.value.ensemble is None


def test_progress_counts_kernels_and_measures_their_pace(compilers, monkeypatch):
    assert compilation.compilation() is None
    a, b = (compilers.ask(Kernel(name, 10), (), SOON) for name in "ab")
    compilers.awaited, compilers.since = [a, b], 100.0
    monkeypatch.setattr(compilation.time, "monotonic", lambda: 130.0)
    assert compilation.compilation() == (0, 2, None, ("tests", "tests"))
    a.ended.set()
    assert compilation.compilation() == (1, 2, pytest.approx(30), ("tests",))
    b.n_typed = 5
    assert compilation.compilation().seconds_left == pytest.approx(30 * (1 / (0.5 + 1 / 6) - 1))
    b.ended.set()
    assert compilation.compilation() is None


def test_a_walk_finds_out_what_is_missing_and_runs_nothing(monkeypatch, tmp_path):
    monkeypatch.setattr(kernels, "KERNEL_FOLDER", str(tmp_path))
    plain, allocating = kernels.kernel(add_one), kernels.allocating_kernel(twice)
    missing, cells = [], np.zeros(3, int)
    with compilation.list_missing_kernels(
        lambda kernel, signature: missing.append((kernel, len(signature)))
    ):
        assert plain(cells) == 0
        assert (allocating(cells + 1) == 2).all()
    assert missing == [(plain, 1), (allocating, 1)]
    assert (cells == 0).all()
    assert plain(cells) == 3  # not in the package, therefore compiled here
    with compilation.list_missing_kernels(lambda *_: pytest.fail("it is there")):
        assert plain(cells) == 3


def test_functions_are_counted_with_the_parts_they_call():
    from ccwsim.engine.corrections.unseen_patterns import mark_known
    from ccwsim.engine.tiles import simulate_patches

    assert mark_known.n_functions == 4  # number_rows, number_run, number_patterns
    assert simulate_patches.n_functions > 30


def is_running(number: int) -> bool:
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.slow
def test_a_process_ends_when_its_input_is_closed():
    assert compilation._start_process().end() == 0


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at /proc")
@pytest.mark.parametrize("how", ["SIGTERM", "SIGKILL"])
def test_no_process_outlives_the_one_it_compiles_for(how):
    code = (
        "from ccwsim.engine import compilation\n"
        "process = compilation._start_process()\n"
        "print(process.pid, flush=True)\n"
        "process.answers.read()"
    )
    line = [sys.executable, "-c", code]
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent)}
    with subprocess.Popen(line, env=environment, stdout=subprocess.PIPE, text=True) as parent:
        child = int(parent.stdout.readline())
        assert is_running(child)
        parent.send_signal(getattr(signal, how))
    wait_until(lambda: not is_running(child), "the end of the process")


FIRST_RUN = """
from numba.core import event
from ccwsim import Parameters, datasets, simulate
with event.install_recorder("numba:compile") as compiled:
    simulate(datasets.load("channels"), (64, 64), Parameters(repair_seams=False))
print("compiled here:", len(compiled.buffer))
"""


def compiled_in(folder: Path, **environment: str) -> str:
    """Return the output of a script: how many functions its own process compiled."""
    script = folder / "script.py"
    script.write_text(FIRST_RUN)
    own = {"PYTHONPATH": str(folder), "XDG_CACHE_HOME": str(folder / "home"), **environment}
    options = {"cwd": folder, "env": {**os.environ, **own}, "timeout": 600}
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.strip()


@pytest.mark.slow
def test_other_processes_compile_and_a_copy_compiles_nothing(tmp_path):
    """Test a copy of the package without kernels, then a copy of the copy with other file dates."""
    first, second = tmp_path / "first", tmp_path / "second"
    shutil.copytree(PACKAGE, first / "ccwsim", ignore=shutil.ignore_patterns("__pycache__"))
    assert compiled_in(first) == "compiled here: 0"
    shutil.copytree(first, second)
    for file in second.rglob("*.py"):
        os.utime(file, (1e9, 1e9))
    broken = {"PATH": "", "_CCWSIM_KERNELS": ""}
    before = sorted(file.name for file in second.rglob("*.nbc"))
    assert compiled_in(second, **broken) == "compiled here: 0"
    assert sorted(file.name for file in second.rglob("*.nbc")) == before
