"""Test that a folder imports only lower layers, so that the engine runs without a screen."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import ccwsim

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "ccwsim"

LAYERS = (
    {"model"},
    {"system"},
    {"jobs"},
    {"engine"},
    {"run"},
    {"flow"},
    {"metrics", "io"},
    {"datasets"},
    {"experiments"},
    {"figures"},
    {"report"},
    {"paper", "sharing"},
    {"cli"},
    {"ui/widgets"},
    {"ui/frontend"},
    {"ui/session"},
    {"ui/results"},
    {"ui/study"},
    {"ui/flow"},
    {"ui/simulate", "ui/hard_data", "ui/validate", "ui/compare", "ui/sweep", "ui/imports"},
    {"ui/guides", "ui/benchmark", "ui/how_it_works", "ui/paper", "ui/examples"},
    {"ui/share"},
    {"ui/page"},
)
"""Layers from the lowest to the highest; a folder may import only from lower layers."""

SPECIAL = {
    "streamlit": ("ui", "app", "pages"),
    "pandas": ("ui", "pages"),  # Streamlit needs pandas
    "plotly": ("figures",),
    "jinja2": ("report",),
    "markupsafe": ("report",),  # Jinja needs MarkupSafe
}
"""For some packages, the only parts of the program that may import the package."""
CORE = {"PyWavelets": "pywt", "pillow": "PIL"}
"""Names of the modules of packages that are always installed, if they differ from the package."""

MAX_MODULES = 25
"""Maximum number of modules in a folder."""


def files() -> list[Path]:
    return [*PACKAGE.rglob("*.py"), *(ROOT / "pages").glob("*.py"), ROOT / "app.py"]


def nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Return all nodes, except code that only a type checker reads."""
    for node in ast.iter_child_nodes(tree):
        if not (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)):
            yield node
            yield from nodes(node)


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"))


def named(node: ast.ImportFrom) -> set[tuple[str, str]]:
    """Return the names that a line imports with their modules, also those of public names."""
    homes = {name: f"ccwsim.{home}" for name, home in ccwsim._HOMES.items()}
    module = str(node.module)
    is_public = module == "ccwsim"
    return {
        (homes.get(alias.name, module) if is_public else module, alias.name) for alias in node.names
    }


@cache
def imported(path: Path) -> set[str]:
    """Return the full names of all modules and objects that a file imports, also in functions."""
    names: set[str] = set()
    for node in nodes(parsed(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide the folder"
            names |= {f"{module}.{name}" for module, name in named(node)}
    return names


def folder(parts: tuple[str, ...]) -> str:
    """Return the layer of a module of the package: ("ui", "study", "run") is in "ui/study"."""
    return "/".join(parts[:2]) if parts[0] == "ui" else parts[0]


def level(name: str) -> int | None:
    return next((k for k, names in enumerate(LAYERS) if name in names), None)


def modules() -> Iterator[tuple[Path, str, set[str]]]:
    """Yield each module of the package in a layer, with its folder and its imported modules."""
    for path in PACKAGE.rglob("*.py"):
        own = folder(path.relative_to(PACKAGE).with_suffix("").parts)
        names = [tuple(name.split(".")[1:]) for name in imported(path) if "ccwsim." in name]
        if level(own) is not None:
            yield path, own, {folder(name) for name in names} - {own}


def test_a_folder_imports_only_lower_ones():
    upward = [
        f"{path.relative_to(ROOT)} ({own}) imports {other}"
        for path, own, others in modules()
        for other in others
        if level(other) is not None and level(other) >= level(own)
    ]
    assert not upward


def test_optional_packages_are_imported_in_the_folders_for_them_or_by_needs():
    """Test that optional packages are imported only by modules that check for them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    names = [Requirement(text).name for text in project["dependencies"]]
    always = {*sys.stdlib_module_names, "ccwsim", *(CORE.get(name, name) for name in names)}
    offenders = []
    for path in files():
        inside = path.relative_to(PACKAGE if PACKAGE in path.parents else ROOT).parts
        own = inside[0].removesuffix(".py")
        roots = {name.split(".")[0] for name in imported(path)} - always
        offenders += [f"{path}: {p}" for p in roots if own not in SPECIAL.get(p, ())]
        text = path.read_text("utf-8")
        if "find_spec" in text and path != PACKAGE / "model" / "extras.py":
            offenders.append(f"{path}: find_spec")
    assert not offenders


@pytest.mark.parametrize("package", ["streamlit", "plotly", "jinja2"])
def test_a_folder_that_needs_a_package_checks_it_before_its_modules_are_imported(package):
    tree = parsed(PACKAGE / SPECIAL[package][0] / "__init__.py")
    first = [ast.unparse(node) for node in tree.body[1:3]]
    check = f"check_installed({package!r})"
    assert first == ["from ccwsim.model import check_installed", check]


def test_a_stage_knows_nothing_of_the_loop_that_runs_it():
    loops = {"prepared_image", "raster", "tiles", "multiscale", "realization", "revision", "trace"}
    for path in (PACKAGE / "engine" / "stages").glob("*.py"):
        names = {tuple(name.split(".")) for name in imported(path)}
        assert not {n[2] for n in names if n[:2] == ("ccwsim", "engine")} & loops, path


def test_figures_compute_nothing():
    below = {"engine", "run", "io", "datasets"}
    assert not [path for path, own, others in modules() if own == "figures" and others & below]


def test_every_folder_has_a_layer_and_few_modules():
    folders = {folder(p.relative_to(PACKAGE).parts) for p in PACKAGE.rglob("*.py")}
    known = {name for names in LAYERS for name in names}
    loose = {name for name in folders if name.endswith(".py")} - {"__init__.py", "__main__.py"}
    assert {name for name in folders if not name.endswith(".py")} - known == set()
    assert len({name for name in loose if not name.startswith("ui/")}) <= 4
    crowded = [
        str(path.relative_to(ROOT))
        for path in [PACKAGE, *PACKAGE.rglob("*"), *(ROOT / "tests").rglob("*")]
        if path.is_dir() and len([*path.glob("*.py")]) > MAX_MODULES
    ]
    assert not crowded


def every_import(path: Path, names: set[str]) -> set[str]:
    """Return the modules of the package that a file imports, also lazily or only for types."""
    found = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.ImportFrom):
            each = {f"{module}.{name}" for module, name in named(node)}
            found |= each & names or ({module for module, _ in named(node)} & names)
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names} & names
    return found


def test_no_modules_import_each_other_in_a_circle():
    paths = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for path in PACKAGE.rglob("*.py")
        if path != PACKAGE / "__init__.py"  # the package's own file imports everything lazily
    }
    left = {name: every_import(path, paths.keys()) - {name} for name, path in paths.items()}
    while free := [name for name, needed in left.items() if not needed & left.keys()]:
        for name in free:
            del left[name]
    while ends := left.keys() - {needed for names in left.values() for needed in names}:
        for name in ends:
            del left[name]
    assert not left, f"circles among {sorted(left)}"


def test_class_names_have_one_meaning():
    where: dict[str, list[str]] = {}
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ClassDef):
                where.setdefault(node.name, []).append(str(path.relative_to(PACKAGE)))
    twice = {name: files for name, files in where.items() if len(files) > 1}
    assert not twice


def test_the_core_can_be_imported_alone():
    module = importlib.import_module("ccwsim")
    for name in module.__all__:
        assert getattr(module, name) is not None


def test_the_public_names_are_loaded_when_used():
    assert set(ccwsim._HOMES) == set(ccwsim.__all__)
    code = "import sys, ccwsim; assert not {'numpy', 'numba'} & sys.modules.keys()"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
