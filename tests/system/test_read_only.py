"""Test the program without write access, as in a container with read-only files."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ccwsim.engine import kernel_cache

ROOT = Path(__file__).parents[2]
IS_ROOT = hasattr(os, "geteuid") and os.geteuid() == 0
MORTAL = ["setpriv", "--bounding-set=-all"] if IS_ROOT and shutil.which("setpriv") else []
"""Command that removes root's right to write to any file."""
WORK = """
from numba.core import event
with event.install_recorder("numba:compile") as compiled:
    from ccwsim.engine.stages.conditioning import forced_side
    assert forced_side(0, 1, 1) == forced_side(old=0, new=1, datum=1)
from ccwsim.engine.kernel_cache import KERNEL_FOLDER
print(len(compiled.buffer), KERNEL_FOLDER)
"""


def run(app: Path, temporary: Path, cache: Path) -> tuple[int, str]:
    """Return the number of compilations for one kernel, and the folder of compiled kernels."""
    done = subprocess.run(
        [*MORTAL, sys.executable, "-c", WORK],
        cwd="/",
        capture_output=True,
        text=True,
        timeout=300,
        env={
            "PYTHONPATH": str(app),
            "PYTHONDONTWRITEBYTECODE": "1",
            "PATH": os.environ["PATH"],
            "HOME": "/nonexistent",
            "XDG_CACHE_HOME": str(cache),
            "TMPDIR": str(temporary),
        },
    )
    assert done.returncode == 0, done.stderr[-2000:]
    n, _, folder = done.stdout.strip().partition(" ")
    return int(n), folder


def closed(folder: Path) -> None:
    for path in [folder, *folder.rglob("*")]:
        path.chmod(0o555 if path.is_dir() else 0o444)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")
@pytest.mark.skipif(IS_ROOT and not MORTAL, reason="root writes anywhere")
def test_kernels_are_read_where_nothing_can_be_written(tmp_path):
    app, cache, room = (tmp_path / name for name in ("app", "cache", "room"))
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "ccwsim", app / "ccwsim", ignore=ignore)
    for folder in (cache, room):
        folder.mkdir()
        folder.chmod(0o777)
    closed(app)
    n, folder = run(app, room, cache)
    assert n > 0
    assert folder.startswith(str(cache))
    closed(cache)
    n, folder = run(app, room, cache)
    assert (n, folder.startswith(str(room))) == (0, True)
    assert list(room.iterdir()) == []  # copied kernels are removed again
    for path in [tmp_path, *tmp_path.rglob("*")]:
        path.chmod(0o755)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")
@pytest.mark.skipif(IS_ROOT and not MORTAL, reason="root enters any folder")
def test_an_inaccessible_cache_folder_stops_no_run(tmp_path):
    locked, room = tmp_path / "locked", tmp_path / "room"
    locked.mkdir(mode=0)
    room.mkdir()
    n, folder = run(ROOT, room, locked / "cache")
    locked.chmod(0o755)
    assert n > 0
    assert folder.startswith(str(room))


def test_where_there_is_no_room_at_all_kernels_are_compiled_each_time(monkeypatch):
    def full(**_):
        raise OSError("no space left on device")

    monkeypatch.setattr("tempfile.mkdtemp", full)
    monkeypatch.setattr(kernel_cache, "_is_writable", lambda place: False)
    assert kernel_cache._cache_folder() == ""
