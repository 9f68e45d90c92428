"""Test the recipe of the conda packages: its fields, and a build with stand-ins of a channel."""

from __future__ import annotations

import subprocess
import sys
import tomllib
import venv
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

import ccwsim

ROOT = Path(__file__).parents[1]
RECIPE = ROOT / "deploy" / "conda" / "recipe.yaml"
RAW = yaml.safe_load(RECIPE.read_text("utf-8"))
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PROJECT = PYPROJECT["project"]
EXTRAS = PROJECT["optional-dependencies"]

CONDA_NAMES = {
    "click": "click",
    "tqdm": "tqdm",
    "numpy": "numpy",
    "PyWavelets": "pywavelets",
    "scipy": "scipy",
    "pyamg": "pyamg",
    "pillow": "pillow",
    "numba": "numba",
    "plotly": "plotly",
    "jinja2": "jinja2",
    "streamlit": "streamlit",
    "xarray": "xarray",
    "pyogrio": "pyogrio",
    "rasterio": "rasterio",
    "h5py": "h5py",
    "h5netcdf": "h5netcdf",
    "openpyxl": "openpyxl",
    "flopy": "flopy",
    "dask": "dask-core",
    "distributed": "distributed",
    "hatchling": "hatchling",
    "hatch-fancy-pypi-readme": "hatch-fancy-pypi-readme",
}
"""Names on conda-forge of the packages of PyPI."""


def output(name: str) -> dict[str, Any]:
    """Return the output of a name."""
    (only,) = [each for each in RAW["outputs"] if each["package"]["name"] == name]
    return only


def conda_packages(requirements: list[str]) -> dict[str, SpecifierSet]:
    """Return the bounds of the packages of a recipe, without Python and outputs of the recipe."""
    pairs = [text.partition(" ")[::2] for text in requirements if not text.startswith("${{")]
    return {name: SpecifierSet(bounds) for name, bounds in pairs if name not in ("python", "pip")}


def of_project(texts: list[str]) -> dict[str, SpecifierSet]:
    """Return the bounds that pyproject.toml states, under the names of conda-forge."""
    required = [each for each in map(Requirement, texts) if each.name != "ccwsim"]
    return {CONDA_NAMES[each.name]: each.specifier for each in required}


DASHBOARD = of_project([*EXTRAS["plot"], *EXTRAS["dashboard"]])
OPTIONAL = DASHBOARD | of_project([*EXTRAS["files"], *EXTRAS["modflow"], *EXTRAS["dask"]])


def test_packages_and_bounds_are_those_of_the_project():
    library = output("ccwsim")["requirements"]
    assert conda_packages(library["run"]) == of_project(PROJECT["dependencies"])
    assert conda_packages(library["host"]) == of_project(PYPROJECT["build-system"]["requires"])
    assert conda_packages(library["run_constraints"]) == OPTIONAL
    run = output("ccwsim-dashboard")["requirements"]["run"]
    assert run[0] == '${{ pin_subpackage("ccwsim", exact=True) }}'
    assert conda_packages(run) == DASHBOARD


def test_each_extra_is_in_the_recipe():
    assert EXTRAS.keys() == {"plot", "dashboard", "files", "modflow", "dask", "all", "dev"}


def test_version_python_licence_and_command_are_those_of_the_project():
    library = output("ccwsim")
    assert RAW["schema_version"] == 1
    assert RAW["context"]["version"] == ccwsim.__version__
    assert f">={RAW['context']['python_min']}" == PROJECT["requires-python"]
    requirements = library["requirements"]
    assert requirements["host"][0] == "python ${{ python_min }}.*"
    assert requirements["run"][0] == "python >=${{ python_min }}"
    scripts = [f"{name} = {target}" for name, target in PROJECT["scripts"].items()]
    assert library["build"]["python"]["entry_points"] == scripts
    assert library["about"]["summary"] == PROJECT["description"]
    for each in RAW["outputs"]:
        assert each["build"]["noarch"] in ("python", "generic")
        assert each["about"]["license"] == PROJECT["license"]
        assert (ROOT / each["about"]["license_file"]).is_file()
        assert each["tests"]
    assert (RECIPE.parent / RAW["source"]["path"] / "pyproject.toml").is_file()


def test_rattler_build_reads_the_recipe():
    rattler = pytest.importorskip("rattler_build", reason="py-rattler-build is not installed")
    recipe = rattler.Stage0Recipe.from_file(RECIPE)
    rendered = [each.recipe.to_dict() for each in recipe.render(rattler.VariantConfig())]
    assert [each["package"]["name"] for each in rendered] == ["ccwsim", "ccwsim-dashboard"]
    assert {each["package"]["version"] for each in rendered} == {ccwsim.__version__}
    assert rendered[0]["build"]["string"].startswith("py")


def channel_of_stand_ins(rattler: Any, folder: Path) -> Path:
    """Make a channel of packages that stand for those of conda-forge, and return its folder.

    The package `python` is an environment that also finds the packages of the running one, and
    `hatchling` has the files of the build backend. The others are empty; their names and versions
    are used to resolve the requirements of the recipe.
    """
    site = Path("lib", f"python{sys.version_info[0]}.{sys.version_info[1]}", "site-packages")
    python, backend, channel = folder / "env", folder / "backend", folder / "channel"
    venv.create(python, symlinks=False)
    for extra in ("bin/activate", "bin/activate.csh", "bin/activate.fish", "bin/Activate.ps1"):
        (python / extra).unlink(missing_ok=True)
    if (python / "lib64").is_symlink():
        (python / "lib64").unlink()
    packages = [path for path in sys.path if path.endswith("-packages")]
    (python / site / "packages.pth").write_text("\n".join(packages) + "\n")
    install = [sys.executable, "-m", "pip", "install", "-q", "--target", str(backend / site)]
    subprocess.run([*install, *PYPROJECT["build-system"]["requires"]], check=True)

    def assemble(name: str, number: str, files: Path | None = None) -> None:
        if files is None:
            files = folder / name
            (files / "share" / "stand-ins").mkdir(parents=True)
            (files / "share" / "stand-ins" / name).touch()
        rattler.assemble_package(
            name, number, "noarch", "0", channel / "noarch", files_dir=files, noarch="generic",
            compression_level=1,
        )  # fmt: skip

    (channel / "noarch").mkdir(parents=True)
    assemble("python", sys.version.split()[0], python)
    assemble("hatchling", "1.27.0", backend)
    for name, number in (("pip", "25.0"), ("hatch-fancy-pypi-readme", "25.1.0")):
        assemble(name, number)
    for name in {Requirement(text).name for text in PROJECT["dependencies"]}:
        assemble(CONDA_NAMES[name], version(name))
    for name in DASHBOARD:
        assemble(name, version(name))
    return channel


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the stand-ins are made for Linux")
@pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="the recipe builds with Python 3.11")
def test_both_packages_are_built_and_pass_their_tests(tmp_path):
    """Test the recipe as far as it goes without conda-forge; see `channel_of_stand_ins`."""
    rattler = pytest.importorskip("rattler_build", reason="py-rattler-build is not installed")
    channel = channel_of_stand_ins(rattler, tmp_path)
    results = rattler.Stage0Recipe.from_file(RECIPE).run_build(
        channels=[channel.as_uri()],
        output_dir=channel,  # whose packages are indexed before the build
        tool_config=rattler.ToolConfiguration(test_strategy="native"),
    )
    assert [result.name for result in results] == ["ccwsim", "ccwsim-dashboard"]
