"""Kernels on disk that are damaged, or that have no place, never stop a run."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from ccwsim.engine import kernels

ROOT = Path(kernels.__file__).parents[2]
SOURCE = "def twice(x):\n    return 2 * x\n"


@pytest.fixture
def function(tmp_path):
    """A function in a file of its own, as Numba's cache wants it."""
    file = tmp_path / "a_module.py"
    file.write_text(SOURCE)
    # Numba takes the date for the version: some file systems still change that of a new file.
    os.utime(file, (1e9, 1e9))
    spec = importlib.util.spec_from_file_location("a_module", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.twice


def compiled(function, folder: Path):
    return kernels._compiled(function, str(folder))


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize(
    "content", [lambda b: b"", lambda b: b[: len(b) // 2], lambda b: bytes(999)]
)
def test_a_damaged_file_is_compiled_anew(function, tmp_path, ending, content, caplog):
    folder = tmp_path / "cache"
    assert compiled(function, folder)(3) == 6
    (file,) = folder.rglob(f"*.{ending}")
    whole = file.read_bytes()
    file.write_bytes(content(whole))
    assert compiled(function, folder)(4) == 8
    (said,) = caplog.messages
    assert "twice on disk is damaged" in said
    again = compiled(function, folder)
    assert again(5) == 10
    assert sum(again.stats.cache_hits.values()) == 1  # the cache was mended, not only left alone


def python(code: str, **environment: str) -> str:
    given = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    line = [sys.executable, "-c", code]
    return subprocess.run(line, env=given, capture_output=True, text=True, check=True).stdout


def test_a_user_without_a_home_can_import():
    code = (
        "import os, pwd\n"
        "os.environ.pop('HOME', None); os.environ.pop('XDG_CACHE_HOME', None)\n"
        "def unknown(uid): raise KeyError(uid)\n"
        "pwd.getpwuid = unknown\n"
        "from ccwsim.engine.kernels import FOLDER\n"
        "print(bool(FOLDER))"
    )
    assert python(code).strip() == "True"


def test_without_compilation_the_cells_are_the_same():
    code = (
        "import numpy as np, ccwsim\n"
        "image = ccwsim.TrainingImage(np.kron(np.eye(8, dtype=int), np.ones((4, 4), int)))\n"
        "p = ccwsim.Parameters(template_size=8, overlap_size=2, wavelet_level=1)\n"
        "data = ccwsim.HardData([[3, 4], [9, 20], [10, 20]], [1, 0, 1])\n"
        "print(ccwsim.simulate(image, (16, 24), p, data, 2, n_workers=1).digest)"
    )
    assert python(code, NUMBA_DISABLE_JIT="1") == python(code)
