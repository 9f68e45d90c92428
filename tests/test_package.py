"""Test the package: metadata match the files, and source archive and wheel are complete."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import time
import tomllib
import urllib.request
import venv
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

import ccwsim
from tools import tutorials

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]


def required(name: str) -> set[str]:
    """Return the requirements in a file and in the files that it includes."""
    found = set()
    for line in (ROOT / name).read_text("utf-8").splitlines():
        if line.startswith("-r "):
            found |= required(line.removeprefix("-r "))
        elif line and not line.startswith("#"):
            found.add(str(Requirement(line)))
    return found


def declared(texts: list[str]) -> set[str]:
    """Return requirements, with those of extras in place of `ccwsim[extra]`."""
    found = set()
    for requirement in map(Requirement, texts):
        if requirement.name != "ccwsim":
            found.add(str(requirement))
        for extra in requirement.extras if requirement.name == "ccwsim" else ():
            found |= declared(EXTRAS[extra])
    return found


@pytest.mark.parametrize(
    ("file", "extras"),
    [
        ("requirements.txt", ["dashboard"]),
        ("requirements-dask.txt", ["dashboard", "dask"]),
        ("requirements-dev.txt", ["all", "dev"]),
    ],
)
def test_requirements_are_those_of_the_project(file, extras):
    texts = [*PROJECT["dependencies"], f"ccwsim[{','.join(extras)}]"]
    only_docs = required("requirements-docs.txt") if file == "requirements-dev.txt" else set()
    assert required(file) == declared(texts) | only_docs


def test_the_extra_all_has_all_others_but_that_of_developers():
    others = EXTRAS.keys() - {"all", "dev"}
    assert declared(EXTRAS["all"]) == declared([f"ccwsim[{','.join(others)}]"])


def test_packages_whose_private_parts_are_used_stay_within_a_minor_version():
    texts = [*PROJECT["dependencies"], *EXTRAS["dashboard"]]
    required = {r.name: r.specifier for r in map(Requirement, texts)}
    for name in ("streamlit", "numba"):
        bounds = {bound.operator: Version(bound.version) for bound in required[name]}
        lower, upper = bounds[">="], bounds["<"]
        assert (lower.major, lower.minor + 1) == (upper.major, upper.minor)
        assert Version(version(name)) in required[name], "not the tested version"


def test_the_citation_names_this_version_and_the_paper():
    text = (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"\nversion: {ccwsim.__version__}\n" in text
    for name in ("Bavandsavadkoohi", "Gloaguen", "Tokhmechi", "Arab-Amiri", "Giroux"):
        assert f"family-names: {name}" in text


def test_the_licence_is_the_one_that_is_declared():
    assert PROJECT["license"] == "BSD-3-Clause"
    assert (ROOT / "LICENSE").read_text("utf-8").startswith("BSD 3-Clause License")


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    """Return the folder with the source archive, and with the wheel built from this archive."""
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "build", "--outdir", str(folder), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    return folder


LOWEST = "".join(
    f"{required.name}{str(bound).replace('>=', '==')}\n"
    for required in map(Requirement, declared([*PROJECT["dependencies"], "ccwsim[all]"]))
    for bound in required.specifier
    if str(bound).startswith(">=") and required.name != "numba"
)
LOWEST += f"numba=={version('numba')}\n"
"""Constraints that install the lowest allowed version of each direct dependency. Numba is pinned to
a minor version, and kernels compiled by this version need not be compiled again."""


def install(programs: Path, built: Path, extras: str = "") -> None:
    """Install the wheel in an environment, with the lowest allowed versions for Python 3.11."""
    (wheel,) = built.glob("*.whl")
    constraints = programs.parent / "constraints.txt"
    constraints.write_text(LOWEST if sys.version_info[:2] == (3, 11) else "")
    pip = [sys.executable, "-m", "pip", "--python", programs / "python", "install"]
    options = ["-q", "--no-compile", "-c", constraints]  # few modules are imported
    subprocess.run([*pip, *options, f"{wheel}{extras}"], check=True, capture_output=True)


@pytest.fixture(scope="module")
def installed(built, tmp_path_factory) -> Path:
    """Return the programs of a new environment without extras."""
    folder = tmp_path_factory.mktemp("lowest") / "env"
    venv.create(folder)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    install(programs, built)
    return programs


@pytest.fixture(scope="module")
def with_dashboard(built, installed) -> Path:
    """Return the same programs, from now on with the extra `dashboard`."""
    install(installed, built, "[dashboard]")
    return installed


def finished(program: Path, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a program outside this checkout."""
    without = "PYTHONPATH", "CCWSIM_DATA", "PYTHONDONTWRITEBYTECODE"
    environment = {k: v for k, v in os.environ.items() if k not in without}
    return subprocess.run(
        [program, *arguments], cwd=cwd, env=environment, capture_output=True, text=True
    )


def run(program: Path, *arguments: str, cwd: Path) -> str:
    """Run a program as `finished` does, and return its output."""
    done = finished(program, *arguments, cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_source_archive_has_every_file_and_can_be_tested_and_documented(built, tmp_path):
    """Test that each tracked file is in the archive; without Git, use the files of the archive."""
    (archive,) = built.glob("*.tar.gz")
    with tarfile.open(archive) as packed:
        packed.extractall(tmp_path, filter="data")
    (unpacked,) = tmp_path.iterdir()
    if shutil.which("git") and (ROOT / ".git").exists():
        git = ["git", "-C", str(ROOT), "ls-files", "-z", "--cached"]
        listed = subprocess.run(git, check=True, capture_output=True, text=True).stdout
        tracked = {name for name in listed.split("\0") if name}
        assert not {name for name in tracked if not (unpacked / name).is_file()}
    else:
        run(Path(sys.executable), "-m", "pytest", "--collect-only", "-n", "0", cwd=unpacked)
        run(Path(sys.executable), "-m", "mkdocs", "build", "--strict", cwd=unpacked)


@pytest.mark.slow
def test_the_readme_of_the_package_links_to_no_file(built):
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        (name,) = (name for name in packed.namelist() if name.endswith(".dist-info/METADATA"))
        text = packed.read(name).decode()
    assert "# CCWSIM" in text
    assert not re.findall(r"\]\((?!https?:)[^)]*\)", text)


@pytest.mark.slow
def test_the_script_of_the_readme_runs_from_an_empty_folder(installed, tmp_path):
    readme = (ROOT / "README.md").read_text("utf-8")
    script = next(code for code in re.findall(r"```python\n(.*?)```", readme, re.DOTALL))
    (tmp_path / "script.py").write_text(script, "utf-8")
    run(installed / "python", "script.py", cwd=tmp_path)
    assert (tmp_path / "out.npz").exists()


@pytest.mark.slow
def test_the_first_tutorial_runs_from_an_empty_folder(installed, tmp_path):
    text = (tutorials.PAGES / "first-study.md").read_text("utf-8")
    blocks = [*tutorials.BLOCK.finditer(text)]
    (tmp_path / "tutorial.py").write_text("".join(block["code"] for block in blocks), "utf-8")
    printed = run(installed / "python", "tutorial.py", cwd=tmp_path)
    assert printed == "".join(block["text"] or "" for block in blocks)


@pytest.mark.slow
def test_the_command_line_runs_from_an_empty_folder(installed, tmp_path):
    assert ccwsim.__version__ in run(installed / "ccwsim", "--version", cwd=tmp_path)
    out = tmp_path / "out.npy"
    run(
        installed / "ccwsim",
        "simulate",
        "channels",
        "--grid",
        "60x50",
        "--output",
        str(out),
        cwd=tmp_path,
    )
    assert out.exists()


@pytest.mark.slow
def test_without_extras_the_dashboard_says_what_to_install(installed, tmp_path):
    there = "from importlib.util import find_spec as f; print(*map(f, ('streamlit', 'pandas')))"
    assert run(installed / "python", "-c", there, cwd=tmp_path).split() == ["None", "None"]
    assert "channels" in run(installed / "ccwsim", "datasets", cwd=tmp_path)
    done = finished(installed / "ccwsim", "dashboard", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == (
        "ccwsim: the dashboard needs the package streamlit; "
        "install it: pip install 'ccwsim[dashboard]'\n"
    )


@pytest.mark.slow
def test_the_how_to_pages_are_installed(with_dashboard, tmp_path):
    script = "from ccwsim.ui.widgets.text import how_tos; print(*how_tos(), sep=', ')"
    titles = run(with_dashboard / "python", "-c", script, cwd=tmp_path)
    assert {"Simulate", "Paper", "Measures"} <= set(titles.strip().split(", "))


@pytest.mark.slow
def test_the_dashboard_starts_from_an_empty_folder(with_dashboard, tmp_path):
    port = 18_000 + os.getpid() % 2_000
    command = [
        with_dashboard / "ccwsim",
        "dashboard",
        "--port",
        str(port),
        "--server.headless=true",
    ]
    server = subprocess.Popen(command, cwd=tmp_path)
    try:
        end = time.monotonic() + 120
        while server.poll() is None and time.monotonic() < end:
            try:
                with urllib.request.urlopen(f"http://localhost:{port}/validate", timeout=5) as page:
                    assert b"<title>" in page.read()
                return
            except OSError:
                time.sleep(0.2)
        pytest.fail(f"no answer from the dashboard; exit code {server.poll()}")
    finally:
        server.terminate()
        server.wait(20)


@pytest.mark.slow
def test_all_modules_run_with_all_extras(built, installed, tmp_path):
    """Test all extras after the other tests, which must not need them."""
    install(installed, built, "[all]")
    script = """
import importlib, os, pkgutil
os.environ["NUMBA_DISABLE_JIT"] = "1"  # compiling would take minutes, and Numba is pinned
import ccwsim
for module in pkgutil.walk_packages(ccwsim.__path__, "ccwsim."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
image = ccwsim.TrainingImage(ccwsim.datasets.load("channels").array[:40, :40])
e = ccwsim.simulate(
    image, (24, 24), ccwsim.Parameters(8, 2, 1), hard_data=([[3, 4], [10, 12]], [0, 1]), seed=0
)
assert e.n_mismatched.tolist() == [0]
e.to_xarray()
"""
    run(installed / "python", "-c", script, cwd=tmp_path)


@pytest.mark.slow
def test_a_package_that_was_used_leaves_nothing_beside_it(installed, tmp_path):
    """Uninstall last: compiled kernels are stored in the user's cache folder."""
    simulate = "simulate", "channels", "--grid", "40x40", "--quiet", "--output", "out.npz"
    run(installed / "ccwsim", *simulate, cwd=tmp_path)
    pip = [sys.executable, "-m", "pip", "--python", installed / "python", "uninstall"]
    subprocess.run([*pip, "-q", "-y", "ccwsim"], check=True, capture_output=True)
    assert not list(installed.parent.rglob("*ccwsim*"))
