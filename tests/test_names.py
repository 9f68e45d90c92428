"""One name, one thing: a class name has one meaning in the whole package."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]


def classes() -> dict[str, list[str]]:
    """Return the modules that define each class, also private classes and those in functions."""
    modules = defaultdict(list)
    for path in (ROOT / "ccwsim").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ClassDef):
                modules[node.name].append(str(path.relative_to(ROOT)))
    return modules


def test_class_names_are_unique():
    assert {name: paths for name, paths in classes().items() if len(paths) > 1} == {}
