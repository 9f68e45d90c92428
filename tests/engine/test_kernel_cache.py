"""Test that kernels are stored by content, and that damaged or missing files stop no run."""

from __future__ import annotations

import gc
import importlib.util
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numba
import pytest

from ccwsim.engine import kernel_cache, kernels, numba_hooks

ROOT = Path(kernels.__file__).parents[2]
SOURCE = "def twice(x):\n    return 2 * x\n"


def loaded(file: Path):
    """Return a function from a separate file, as Numba's cache requires."""
    file.parent.mkdir(exist_ok=True)
    file.write_text(SOURCE)
    spec = importlib.util.spec_from_file_location("a_module", file)
    module = importlib.util.module_from_spec(spec)
    sys.modules["a_module"] = module  # Numba imports the module of a function that it loads
    spec.loader.exec_module(module)
    return module.twice


@pytest.fixture
def function(tmp_path):
    yield loaded(tmp_path / "a_module.py")
    del sys.modules["a_module"]


def compiled(function, folder: Path):
    return kernels._compiled(function, str(folder))


@pytest.mark.slow
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
    assert sum(again.stats.cache_hits.values()) == 1  # the cache was repaired, not only ignored


def test_a_truncated_file_is_left_to_the_process_that_compiles(function, tmp_path):
    """Test that a truncated file counts as missing, so that another process compiles the kernel."""
    folder, signature = tmp_path / "kernels-1", (numba.int64,)
    assert compiled(function, folder)(3) == 6
    (file,) = folder.rglob("*.nbc")
    whole = file.read_bytes()
    assert numba_hooks.is_on_disk(compiled(function, folder), signature)
    for n in (0, len(whole) // 2, len(whole) - numba_hooks.DIGEST_SIZE, len(whole) - 1):
        file.write_bytes(whole[:n])
        asked = []
        again = compiled(function, folder)
        numba_hooks.ask_first(again, asked.append)
        assert (again(4), asked) == (8, [signature])
        assert numba_hooks.is_complete_file(file)


def test_a_moved_copied_or_touched_file_finds_what_is_compiled(function, tmp_path):
    folder = tmp_path / "kernels-1"
    assert compiled(function, folder)(3) == 6
    gc.collect()  # Numba imports the module once the first function is deleted
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy / folder.name)
    os.utime(tmp_path / "a_module.py", (1e9, 1e9))
    for other in (function, loaded(copy / "a_module.py")):
        again = compiled(other, copy / folder.name)
        assert numba_hooks.is_on_disk(again, (numba.int64,))
        assert again(4) == 8
        assert sum(again.stats.cache_hits.values()) == 1


def test_processes_that_compile_one_kernel_at_the_same_time_share_no_file(function, tmp_path):
    folder = tmp_path / "kernels-1"
    first, second = compiled(function, folder), compiled(function, folder)
    assert (first(3), second(3.5)) == (6, 7.0)
    assert len(list(folder.rglob("*.nbi"))) == len(list(folder.rglob("*.nbc"))) == 2
    again = compiled(function, folder)
    assert (again(3), again(3.5)) == (6, 7.0)
    assert sum(again.stats.cache_hits.values()) == 2


def test_kernels_of_another_content_are_not_taken(function, tmp_path):
    assert compiled(function, tmp_path / "kernels-1")(3) == 6
    (tmp_path / "kernels-1").rename(tmp_path / "kernels-2")
    assert not numba_hooks.is_on_disk(compiled(function, tmp_path / "kernels-2"), (numba.int64,))


@pytest.mark.parametrize(
    "name", ["engine/stages/cut.py", "engine/kernels.py", "engine/numba_hooks.py"]
)
def test_the_name_of_the_folder_says_all_that_the_code_depends_on(name, tmp_path):
    shutil.copytree(kernel_cache.PACKAGE / "engine", tmp_path / "engine")
    before = kernel_cache._digest_of_sources(tmp_path)
    file = tmp_path / name
    os.utime(file, (1e9, 1e9))
    assert kernel_cache._digest_of_sources(tmp_path) == before
    file.write_text(file.read_text("utf-8") + "# changed\n", "utf-8")
    assert kernel_cache._digest_of_sources(tmp_path) != before
    assert kernel_cache.KERNEL_FOLDER_NAME.endswith(
        f"{kernel_cache.SOURCE}-numba{numba.__version__}"
    )


def test_kernels_are_stored_in_the_cache_folder_of_the_user_and_not_beside_the_package(
    monkeypatch, tmp_path
):
    """Test a writable package, which stays as it was installed, with and without a cache folder."""
    monkeypatch.delenv(kernel_cache.FOLDER_VARIABLE, raising=False)
    monkeypatch.setattr("pathlib.Path.home", lambda: tmp_path / "home")
    own = "ccwsim", kernel_cache.KERNEL_FOLDER_NAME
    for given in (None, "", "relative"):
        if given is None:
            monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
        else:
            monkeypatch.setenv("XDG_CACHE_HOME", given)
        for platform, caches in (("linux", ".cache"), ("darwin", "Library/Caches")):
            monkeypatch.setattr("sys.platform", platform)
            expected = tmp_path.joinpath("home", caches, *own)
            assert kernel_cache._cache_folder() == str(expected)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert kernel_cache._cache_folder() == str(tmp_path.joinpath(*own))


def test_only_folders_of_other_versions_that_were_long_unused_are_removed(tmp_path):
    names = "kernels-own", "kernels-old", "kernels-recent", "something-else"
    for name in names:
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").touch()
        os.utime(tmp_path / name, (1e9, 1e9))
    kernel_cache.note_use(str(tmp_path / "kernels-recent"))
    assert time.time() - (tmp_path / "kernels-recent").stat().st_mtime < 3600
    kernel_cache.remove_unused(str(tmp_path / "kernels-own"))
    assert {path.name for path in tmp_path.iterdir()} == {*names} - {"kernels-old"}


def test_the_private_parts_of_numba_are_those_that_were_tested():
    assert numba_hooks.are_known(), (
        f"Numba {numba.__version__} is installed, but the private parts used in numba_hooks.py are "
        f"tested only with {numba_hooks.TESTED}, so kernels compile slowly. Read the changes of "
        "numba.core.caching, codegen and compiler, run the golden tests, then change TESTED."
    )


def test_with_another_version_kernels_are_compiled_in_the_usual_way(monkeypatch, tmp_path):
    monkeypatch.setattr(numba_hooks, "TESTED", "0.1")
    monkeypatch.setattr(kernels, "KERNEL_FOLDER", str(tmp_path))
    monkeypatch.setitem(globals(), "_part", kernels.part_of_kernel(_part_of_it))
    assert kernels.kernel(_whole)(3) == 7
    assert {file.name.split(".")[1].split("-")[0] for file in tmp_path.rglob("*.nbi")} == {
        "_whole",
        "_part_of_it",
    }


def _part_of_it(x):
    return 2 * x


def _whole(x):
    return _part(x) + 1  # noqa: F821 - made by the test


def python(code: str, **environment: str) -> str:
    given = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    line = [sys.executable, "-c", code]
    return subprocess.run(line, env=given, capture_output=True, text=True, check=True).stdout


@pytest.mark.slow
def test_a_user_without_a_home_can_import():
    code = (
        "import os, pwd\n"
        "os.environ.pop('HOME', None); os.environ.pop('XDG_CACHE_HOME', None)\n"
        "def unknown(uid): raise KeyError(uid)\n"
        "pwd.getpwuid = unknown\n"
        "from ccwsim.engine.kernel_cache import KERNEL_FOLDER\n"
        "print(bool(KERNEL_FOLDER))"
    )
    assert python(code).strip() == "True"


@pytest.mark.slow
def test_without_compilation_the_cells_are_the_same():
    code = (
        "import numpy as np, ccwsim\n"
        "image = ccwsim.TrainingImage(np.kron(np.eye(8, dtype=int), np.ones((4, 4), int)))\n"
        "p = ccwsim.Parameters(template_size=8, overlap_size=2, wavelet_level=1)\n"
        "data = ccwsim.HardData([[3, 4], [9, 20], [10, 20]], [1, 0, 1])\n"
        "print(ccwsim.simulate(image, (16, 24), p, data, 2, n_workers=1).digest)"
    )
    assert python(code, NUMBA_DISABLE_JIT="1") == python(code)
