"""Test that a package that only an extra installs is named with the extra, before any work."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import ccwsim
from ccwsim.model import extras

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
WITHOUT_EXTRAS = """
import importlib, pkgutil, sys
from ccwsim.model.extras import OPTIONAL
for package in [*OPTIONAL, "pandas", "markupsafe", "dask"]:
    sys.modules[package] = None
"""
IMPORT_ALL = """
import ccwsim
for module in pkgutil.walk_packages(ccwsim.__path__, "ccwsim.", onerror=bool):
    if not module.name.endswith("__main__"):
        try:
            importlib.import_module(module.name)
        except ccwsim.CCWSIMError as error:
            package = str(error).partition(" the package ")[2].partition(";")[0]
            print(module.name.split(".")[1], package)
image = ccwsim.datasets.load("channels")
assert image._repr_html_() is None
"""
COMMANDS = {
    "dashboard": "streamlit",
    "paper --output report.html": "plotly",
    "simulate channels --output out.npz --output out.nc": "xarray",
    "simulate channels --output out.tif": "rasterio",
    "simulate channels --output out.npz --scheduler tcp://localhost:8786": "distributed",
    "flow channels.npz -k sand=1e-4 --modflow model": "flopy",
}
"""The package that each command line needs; it is missed before a file is read or written."""


def run(code: str, folder: Path) -> str:
    """Return the output of a script that runs where no optional package is installed."""
    start = f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
    line = [sys.executable, "-c", start + WITHOUT_EXTRAS + code]
    return subprocess.run(line, cwd=folder, capture_output=True, text=True, check=True).stdout


def test_the_extras_are_those_of_the_project():
    declared = {
        Requirement(text).name: extra
        for extra, texts in PROJECT["optional-dependencies"].items()
        for text in texts
        if extra not in ("dev", "all") and not text.startswith("ccwsim")
    }
    del declared["dask"]  # the package `distributed` needs it
    assert {package: extra for package, (extra, _) in extras.OPTIONAL.items()} == declared


@pytest.mark.parametrize(("source", "target"), [(True, ".[files]"), (False, "ccwsim[files]")])
def test_a_missing_package_is_named_with_the_extra_that_installs_it(monkeypatch, source, target):
    monkeypatch.setattr(extras, "IN_SOURCE_FOLDER", source)
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    said = f"Excel files need the package openpyxl; install it: pip install '{target}'"
    assert not extras.is_installed("openpyxl")
    for ask in (extras.needs, extras.check_installed):
        with pytest.raises(ccwsim.CCWSIMError) as caught:
            ask("openpyxl")
        assert str(caught.value) == said


def test_an_installed_package_is_imported_only_where_it_is_used(monkeypatch):
    monkeypatch.delitem(sys.modules, "plotly", raising=False)
    extras.check_installed("plotly")
    assert extras.is_installed("plotly")
    assert "plotly" not in sys.modules
    assert extras.needs("plotly") is sys.modules["plotly"]


def test_without_extras_all_but_charts_reports_and_the_dashboard_can_be_imported(tmp_path):
    said = {tuple(line.split()) for line in run(IMPORT_ALL, tmp_path).splitlines()}
    assert {folder for folder, *_ in said} == {"figures", "report", "paper", "sharing", "ui"}
    assert {package for _, package in said} == {"plotly", "jinja2", "streamlit"}


def test_a_command_names_the_missing_package_before_it_reads_or_writes_a_file(tmp_path):
    code = "from ccwsim.cli.program import main\nsys.stderr = sys.stdout\n"
    code += f"for line in {list(COMMANDS)}: print(main(line.split()))"
    *said, code_of_last = run(code, tmp_path).splitlines()
    messages, codes = said[::2], [*said[1::2], code_of_last]
    assert codes == ["2"] * len(COMMANDS)
    for message, package in zip(messages, COMMANDS.values(), strict=True):
        extra, purpose = extras.OPTIONAL[package]
        assert message.startswith(f"ccwsim: {purpose} the package {package}; install it: ")
        assert message.endswith(f"[{extra}]'")
    assert not list(tmp_path.iterdir())
