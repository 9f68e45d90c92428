"""Who may import whom: a layer knows only lower ones, so that the core runs without a screen."""

from __future__ import annotations

import ast
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "ccwsim"

LAYERS = (
    {"errors"},
    {"arrays", "kernels", "lazy_stack"},
    {"grid", "parameters", "training_image"},
    {"hard_data"},
    {"cores"},
    {"choices", "ensemble", "sampling", "machine", "memory", "study", "workers"},
    {"stages"},
    {"footprint", "prepared_image"},
    {"multiscale", "tiles"},
    {"raster"},
    {"realization"},
    {"executors", "output"},
    {"revision", "simulation"},
    {"trace"},
    {"metrics", "io", "datasets", "published", "timing", "timing_case", "timing_growth"},
    {"comparison"},
    {"sweep"},
    {"figures"},
    {"report"},
    {"paper", "sharing"},
    {"cli", "ui"},
)
"""From the lowest to the highest. Modules of one layer may know each other."""

ENTRIES = {"__init__", "__main__", "app", "pages"}
"""Where everything comes together: they may import any layer."""


def files() -> list[Path]:
    found = [*PACKAGE.rglob("*.py"), *(ROOT / "pages").glob("*.py"), ROOT / "app.py"]
    return sorted(path for path in found if "__pycache__" not in path.parts)


def nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes but those that only a type checker reads."""
    for node in ast.iter_child_nodes(tree):
        if not (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)):
            yield node
            yield from nodes(node)


def imported(path: Path) -> set[str]:
    """Full names of all modules that a file imports, also inside functions."""
    names: set[str] = set()
    for node in nodes(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide the layer"
            names |= {str(node.module)} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def roots(path: Path) -> set[str]:
    return {name.split(".")[0] for name in imported(path)}


def part(path: Path) -> str:
    """The layer's name of a file: a module of the package, or app and pages."""
    inside = path.relative_to(PACKAGE if PACKAGE in path.parents else ROOT).parts
    return inside[0].removesuffix(".py")


def level(name: str) -> int:
    found = [k for k, names in enumerate(LAYERS) if name in names]
    assert found, f"{name} has no layer: give it one in LAYERS"
    return found[0]


def parts_of(path: Path) -> set[str]:
    """Which parts of the package a file imports."""
    known = {p for names in LAYERS for p in names} | ENTRIES
    inside = {n.split(".")[1] for n in imported(path) if n.startswith("ccwsim.")}
    return {name for name in inside if name in known or (PACKAGE / f"{name}.py").exists()}


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", files(), ids=name_of)
def test_a_layer_imports_only_lower_ones(path):
    own = part(path)
    if own in ENTRIES:
        return
    above = {name for name in parts_of(path) - {own} if level(name) > level(own)}
    assert not above, f"{name_of(path)} ({own}) imports from above: {sorted(above)}"


@pytest.mark.parametrize("path", files(), ids=name_of)
def test_only_the_screen_knows_streamlit_and_only_figures_know_plotly(path):
    own = part(path)
    if own not in {"ui", "app", "pages"}:
        assert "streamlit" not in roots(path)
    if own != "figures":
        assert "plotly" not in roots(path)
    if own not in {"ui", "app", "pages"}:
        assert "pandas" not in roots(path)


@pytest.mark.parametrize("path", sorted((PACKAGE / "stages").glob("*.py")), ids=name_of)
def test_a_stage_knows_no_conductor(path):
    conductors = {"simulation", "prepared_image", "raster", "tiles", "multiscale"}
    assert parts_of(path).isdisjoint(conductors | {"study", "workers"})


def test_figures_compute_nothing_from_metrics():
    for path in (PACKAGE / "figures").glob("*.py"):
        assert parts_of(path).isdisjoint({"simulation", "stages", "io", "datasets"})


def test_the_layers_are_those_that_exist():
    there = {part(path) for path in PACKAGE.rglob("*.py") if "__pycache__" not in path.parts}
    assert {name for names in LAYERS for name in names} == there - ENTRIES


def test_the_core_can_be_imported_alone():
    module = importlib.import_module("ccwsim")
    for name in module.__all__:
        assert getattr(module, name) is not None
