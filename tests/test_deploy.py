"""Test the pinned packages, and the container, service and settings of a server."""

from __future__ import annotations

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from ccwsim.jobs.limits import PROCESSES_VARIABLE

ROOT = Path(__file__).parents[1]
DEPLOY = ROOT / "deploy"


def read(*parts: str) -> str:
    return ROOT.joinpath(*parts).read_text("utf-8")


def locked() -> dict[str, set[str]]:
    """Return the versions in the lock file by package; some depend on the Python version."""
    versions: dict[str, set[str]] = {}
    for name, version in re.findall(r"(?m)^([\w.-]+)==([\w.]+)", read("requirements-lock.txt")):
        versions.setdefault(name.lower(), set()).add(version)
    return versions


def test_the_lock_has_all_that_is_required_in_versions_that_are_allowed():
    versions = locked()
    for line in read("requirements.txt").split():
        required = Requirement(line)
        assert any("<" in str(bound) for bound in required.specifier), f"{line}: no upper bound"
        for version in versions[required.name.lower()]:
            assert version in required.specifier, f"{line}: {version}"


def test_every_package_of_the_lock_has_its_hashes_and_no_place_is_named():
    text = read("requirements-lock.txt")
    blocks = re.split(r"(?m)^(?=[\w.-]+==)", text)[1:]
    assert len(blocks) > 20
    assert all("--hash=sha256:" in block for block in blocks)
    assert "://" not in text
    assert "index" not in text


def test_the_settings_of_the_dashboard_are_those_of_a_public_server():
    settings = tomllib.loads(read(".streamlit", "config.toml"))
    server, client = settings["server"], settings["client"]
    assert server["address"] == "localhost"
    assert server["enableXsrfProtection"] is True
    assert server["enableCORS"] is True
    assert server["enableStaticServing"] is False
    assert server["maxUploadSize"] <= 64
    assert client["showErrorDetails"] == "none"
    assert client["showErrorLinks"] is False
    assert client["toolbarMode"] == "viewer"
    assert settings["browser"]["gatherUsageStats"] is False
    assert settings["runner"]["postScriptGC"] is False
    assert settings["runner"]["fastReruns"] is False  # one thread at a time changes a session


def test_the_container_runs_without_rights_and_has_all_it_copies():
    text = read("deploy", "Dockerfile")
    users = re.findall(r"(?m)^USER (\S+)", text)
    assert users == ["10001"]
    assert "--require-hashes" in text
    assert "/_stcore/health" in text
    assert text.index("USER") < text.index("RUN python -m ccwsim warm-up")
    kept = re.findall(r"(?m)^!(\S+)", read(".dockerignore"))
    assert {"app.py", "pages", "ccwsim", "assets", ".streamlit", "requirements-lock.txt"} <= {*kept}
    assert all((ROOT / name).exists() for name in kept)


def test_the_container_and_the_service_simulate_in_worker_processes():
    for name in ("Dockerfile", "ccwsim.service"):
        assert re.search(rf"\b{PROCESSES_VARIABLE}=1\b", read("deploy", name)), name


@pytest.mark.skipif(not shutil.which("hadolint"), reason="there is no hadolint")
def test_hadolint_finds_nothing_in_the_container():
    done = subprocess.run(["hadolint", DEPLOY / "Dockerfile"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="there is no systemd")
def test_the_service_is_closed():
    done = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", "--threshold=20",
         DEPLOY / "ccwsim.service"], capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr


@pytest.mark.skipif(not shutil.which("caddy"), reason="there is no caddy")
def test_caddy_takes_its_file():
    done = subprocess.run(
        ["caddy", "adapt", "--adapter", "caddyfile", "--config", DEPLOY / "Caddyfile"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
