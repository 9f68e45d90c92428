"""Test that an incomplete file never replaces a good file: full disk, killed process."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import ccwsim
from ccwsim import Parameters, Project, TrainingImage, save_project, simulate
from ccwsim.cli.program import main
from ccwsim.io import (
    write_hard_data,
    write_realizations,
    write_training_image,
)
from ccwsim.io.atomic import write_bytes
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.study import Study
from ccwsim.report.document import Document, Section, Text, write_report
from ccwsim.system.whole_files import WholeFile
from tests.some import some

ROOT = Path(__file__).parents[2]
IMAGE = TrainingImage(np.tile([[0, 0, 7, 7]], (24, 10)))
P = Parameters(template_size=8, overlap_size=2, wavelet_level=1)
DATA = ccwsim.HardData([[2, 3]], [7])
GRID = (30, 40)


def ensemble():
    return simulate(IMAGE, GRID, P, DATA, n_realizations=3, seed=1)


def a_project() -> Project:
    grid = ccwsim.Grid(*GRID)
    return Project(Study(IMAGE, grid, P, DATA, 1), 3)


def stream(path: Path) -> None:
    simulate(IMAGE, GRID, P, DATA, n_realizations=3, seed=1, out=path)


def command(path: Path) -> None:
    code = main(
        [
            "simulate",
            "channels",
            "--grid",
            "64x48",
            "--template",
            "16",
            "--overlap",
            "4",
            "--realizations",
            "2",
            "--output",
            str(path),
            "--quiet",
        ]
    )
    if code:
        raise CCWSIMError(f"exit code {code}")


WRITERS: dict[str, Callable[[Path], object]] = {
    "out.npz": lambda path: write_realizations(path, ensemble()),
    "out.sgems": lambda path: write_realizations(path, ensemble()),
    "out.png": lambda path: write_realizations(path, ensemble()),
    "stream.npy": stream,
    "image.npy": lambda path: write_training_image(path, IMAGE),
    "image.sgems": lambda path: write_training_image(path, IMAGE),
    "image.png": lambda path: write_training_image(path, IMAGE),
    "wells.csv": lambda path: write_hard_data(path, DATA),
    "study.ccwsim": lambda path: save_project(path, a_project()),
    "report.html": lambda path: write_report(path, Document("t", (Section("s", (Text("x"),)),))),
    "command.npz": command,
    "command.npy": command,
}
GOOD = b"what was there before, and is good"


@pytest.mark.parametrize("name", WRITERS)
def test_every_writer_replaces_a_file_whole(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(GOOD)
    WRITERS[name](path)
    assert path.read_bytes() != GOOD
    assert os.listdir(tmp_path) == [name]


@pytest.mark.parametrize("name", WRITERS)
def test_a_disk_that_fills_up_leaves_the_good_file(name, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / name
    path.write_bytes(GOOD)
    monkeypatch.setattr(os, "fsync", full)  # many file systems report a full disk only here
    with pytest.raises(CCWSIMError):
        WRITERS[name](path)
    assert path.read_bytes() == GOOD
    assert os.listdir(tmp_path) == [name]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
@pytest.mark.parametrize("name", ["out.npz", "stream.npy", "report.html", "study.ccwsim"])
def test_a_write_that_ends_half_way_leaves_the_good_file(name, tmp_path):
    """Test a write that the system refuses after a part, because of a limit of the process."""
    path = tmp_path / name
    path.write_bytes(GOOD)
    done = ran(f"""
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (200, 200))
from tests.system.test_whole_files import WRITERS
from ccwsim.model.errors import CCWSIMError
try:
    WRITERS[{name!r}]({str(path)!r})
except CCWSIMError as error:
    print("said:", error)
""")
    assert "cannot be written" in done.stdout, done.stderr[-1000:]
    assert path.read_bytes() == GOOD
    assert os.listdir(tmp_path) == [name]


def ran(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=300,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"},
    )  # a limit on the size of files would leave half of a compiled module


ENDLESS = """
import sys
from pathlib import Path
import numpy as np
from ccwsim.io.atomic import write_bytes
k = 0
print("ready", flush=True)
while True:
    k += 1
    write_bytes(sys.argv[1], bytes([k % 251]) * 3_000_000)
"""


def killed(code: str, path: Path, seconds: float) -> None:
    """Run code, wait until it is ready, and kill its process after some time."""
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(path)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert process.stdout is not None
    assert process.stdout.readline().strip() == "ready"
    time.sleep(seconds)
    process.kill()
    process.wait(60)
    process.stdout.close()


@pytest.mark.parametrize("seconds", some([0.0, 0.031, 0.083], [0.031]))
def test_a_process_that_is_killed_leaves_a_whole_file(tmp_path, seconds):
    path = tmp_path / "out.bin"
    path.write_bytes(GOOD)
    killed(ENDLESS, path, seconds)
    content = path.read_bytes()
    assert content == GOOD or (len(content) == 3_000_000 and len(set(content)) == 1)


STREAMING = """
import sys
from threading import Timer
from ccwsim import simulate
from tests.system.test_whole_files import IMAGE, P
said = []
def progress(fraction, n):
    if n and not said:
        said.append(print("ready", flush=True))
simulate(IMAGE, (200, 200), P, n_realizations=3000, seed=1, out=sys.argv[1], progress=progress)
"""


@pytest.mark.slow
def test_a_run_that_is_killed_leaves_the_earlier_realizations(tmp_path):
    path = tmp_path / "out.npy"
    stream(path)
    before = path.read_bytes()
    killed(STREAMING, path, 0.02)
    assert path.read_bytes() == before
    stream(path)  # the remaining temporary file does no harm
    assert np.load(path).shape == (3, *GRID)


def test_a_stop_by_the_keyboard_leaves_the_good_file(tmp_path, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    path = tmp_path / "out.npz"
    path.write_bytes(GOOD)
    monkeypatch.setattr(os, "fsync", stop)
    with pytest.raises(KeyboardInterrupt):
        write_realizations(path, ensemble())
    assert path.read_bytes() == GOOD
    assert os.listdir(tmp_path) == ["out.npz"]


@pytest.mark.parametrize("write", ["bytes", "realizations"])
class TestTarget:
    """Test that properties of a target are kept: a link, its mode, its write protection."""

    @pytest.fixture
    def target(self, tmp_path):
        path = tmp_path / "deep" / "target.npy"
        path.parent.mkdir()
        path.write_bytes(GOOD)
        return path

    @staticmethod
    def write(how: str, path: Path) -> None:
        if how == "bytes":
            write_bytes(path, b"new")
        else:
            simulate(IMAGE, (16, 16), P, out=path)

    def test_a_link_leads_to_its_file(self, write, target, tmp_path):
        link = tmp_path / "link.npy"
        link.symlink_to(target)
        self.write(write, link)
        assert link.is_symlink()
        assert target.read_bytes() != GOOD

    def test_the_mode_is_kept(self, write, target):
        target.chmod(0o640)
        self.write(write, target)
        assert target.stat().st_mode & 0o777 == 0o640

    def test_a_read_only_file_is_not_replaced(self, write, target):
        target.chmod(0o444)
        with pytest.raises(CCWSIMError, match="cannot be written: it is read-only"):
            self.write(write, target)
        assert target.read_bytes() == GOOD

    def test_what_is_no_file_is_not_replaced(self, write, target):
        fifo = target.with_name("fifo.npy")
        os.mkfifo(fifo)
        with pytest.raises(CCWSIMError, match="cannot be written: it is not a regular file"):
            self.write(write, fifo)

    def test_only_what_a_killed_run_left_is_deleted(self, write, target):
        names = (".target.npy.0123.tmp", ".target.npy.4567.tmp", ".other.npy.0123.tmp", "a.tmp")
        old, new, other, plain = (target.with_name(name) for name in names)
        for path in (old, new, other, plain):
            path.write_bytes(b"left")
        for path in (old, other, plain):
            os.utime(path, (1, 1))
        self.write(write, target)
        assert not old.exists()
        assert all(path.exists() for path in (new, other, plain))

    def test_what_another_run_writes_is_not_deleted(self, write, target):
        running = WholeFile(target)
        try:
            (own,) = target.parent.glob("*.tmp")
            os.utime(own, (1, 1))
            self.write(write, target)
            assert own.exists()
        finally:
            running.drop()
