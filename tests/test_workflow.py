"""Test the workflow of the checks on other systems: versions, commands and files that it names."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from tools.lowest_versions import lowest_versions

ROOT = Path(__file__).parents[1]
WORKFLOW = yaml.safe_load((ROOT / ".github/workflows/tests.yml").read_text("utf-8"))
JOBS = WORKFLOW["jobs"]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
VERSION = "Programming Language :: Python :: "
VERSIONS = [
    name.removeprefix(VERSION)
    for name in PROJECT["classifiers"]
    if name.startswith(VERSION) and "." in name
]
SYSTEMS = ["ubuntu-latest", "macos-latest", "windows-latest"]
SCRIPTS = [
    pytest.param(step["run"], id=f"{name}: {step['name']}")
    for name, job in JOBS.items()
    for step in job["steps"]
    if "run" in step
]


def matrix(job: str) -> dict[str, Any]:
    """Return the matrix of a job."""
    return JOBS[job]["strategy"]["matrix"]


def test_the_versions_of_python_are_those_of_the_project():
    assert f">={VERSIONS[0]}" == PROJECT["requires-python"]
    for job in ("tests", "wheel", "pinned"):
        assert matrix(job)["python"] == VERSIONS
        assert matrix(job)["os"] == SYSTEMS
    assert matrix("slow")["python"] == [VERSIONS[0], VERSIONS[-1]]


def test_the_lowest_versions_are_tested_with_the_lowest_python():
    lowest = {"os": "ubuntu-latest", "python": VERSIONS[0], "versions": "lowest"}
    assert matrix("wheel")["include"] == [lowest]
    assert len(lowest_versions()) == len(PROJECT["dependencies"])
    assert all(re.fullmatch(r"\w+==[\d.]+", line) for line in lowest_versions())


def test_each_job_has_a_limit_of_time_and_may_only_read():
    assert WORKFLOW["permissions"] == {"contents": "read"}
    for job in JOBS.values():
        assert 0 < job["timeout-minutes"] <= 180
        for step in job["steps"]:
            assert ("uses" in step) != ("run" in step)
            assert re.fullmatch(r"actions/[\w-]+@v\d+", step.get("uses", "actions/x@v1"))


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
@pytest.mark.parametrize("script", SCRIPTS)
def test_the_script_of_a_step_is_valid_and_names_what_exists(script):
    plain = re.sub(r"\$\{\{.*?\}\}", "value", script)
    checked = subprocess.run(["bash", "-n"], input=plain, text=True, capture_output=True)
    assert checked.returncode == 0, checked.stderr
    for name in re.findall(r"-r (\S+)|bash (\S+)", plain):
        assert (ROOT / "".join(name)).is_file(), name
    for module in re.findall(r"python -m ([\w.]+)", plain):
        assert importlib.util.find_spec(module), module
