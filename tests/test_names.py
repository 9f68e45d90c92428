"""Test that a name means one thing, and that calls say what they hand over."""

from __future__ import annotations

import ast
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "ccwsim"

SAME_JOB = {
    "command",  # of the command line, one a file
    "draw_page",  # of the dashboard, one a page
}
"""Public names that several modules define, because each definition does the same job there."""

VAGUE = ("found", "known", "said", "own", "made", "given")
"""Names that say nothing about the thing that they name."""
MAX_VAGUE = 10  # maximum number of variables and parameters with the same vague name

MAX_PARAMETERS = 8
MAX_POSITIONAL = 5
KERNEL_MARKS = ("kernel", "njit", "overload")
"""Parts of the names of decorators of compiled functions, which take only positional arguments."""


@cache
def modules() -> dict[str, ast.Module]:
    """Return the syntax tree of each module of the package, by its path in the package."""
    paths = sorted(PACKAGE.rglob("*.py"))
    return {p.relative_to(PACKAGE).as_posix(): ast.parse(p.read_text("utf-8")) for p in paths}


@cache
def nodes() -> list[tuple[str, ast.AST]]:
    """Return each node of the syntax trees with the path of its module."""
    return [(path, node) for path, tree in modules().items() for node in ast.walk(tree)]


def top_level_names(tree: ast.Module) -> Iterator[str]:
    """Return the names that a module defines, without type variables and names it only changes."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        targets = getattr(node, "targets", None) or [getattr(node, "target", None)]
        value = getattr(node, "value", None)
        if isinstance(node, ast.Assign | ast.AnnAssign) and not is_type_variable(value):
            yield from names_in(targets)


def names_in(targets: list[ast.AST | None]) -> Iterator[str]:
    for target in targets:
        if isinstance(target, ast.Tuple):
            yield from names_in([*target.elts])
        elif isinstance(target, ast.Name):
            yield target.id


def is_type_variable(value: ast.AST | None) -> bool:
    return isinstance(value, ast.Call) and ast.unparse(value.func) in ("TypeVar", "ParamSpec")


def repeated(places: dict[str, list[str]]) -> dict[str, list[str]]:
    return {name: where for name, where in places.items() if len(set(where)) > 1}


def test_a_public_name_is_defined_once():
    places = defaultdict(list)
    for path, tree in modules().items():
        for name in top_level_names(tree):
            if not name.startswith("_") and name not in SAME_JOB:
                places[name].append(path)
    assert not repeated(places)


def test_each_exception_is_needed():
    defined = Counter(name for tree in modules().values() for name in set(top_level_names(tree)))
    assert all(defined[name] > 1 for name in SAME_JOB)


def test_a_private_name_is_defined_once_in_a_folder():
    places = defaultdict(list)
    for path, tree in modules().items():
        for name in top_level_names(tree):
            if name.startswith("_") and not name.startswith("__"):
                places[f"{Path(path).parent}: {name}"].append(path)
    assert not repeated(places)


@pytest.mark.parametrize("name", VAGUE)
def test_vague_names_are_rare(name):
    stored = [
        f"{path}:{node.lineno}"
        for path, node in nodes()
        if (isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id == name)
        or (isinstance(node, ast.arg) and node.arg == name)
    ]
    assert len(stored) <= MAX_VAGUE, stored


def test_no_tuple_is_made_only_to_be_unpacked():
    starred = [
        f"{path}:{node.lineno}"
        for path, node in nodes()
        if isinstance(node, ast.Call)
        and any(isinstance(a, ast.Starred) and isinstance(a.value, ast.Tuple) for a in node.args)
    ]
    assert not starred


def test_fields_are_read_by_name():
    """Three and more values that are thrown away mean that one field was wanted."""
    unpacked = [
        f"{path}:{node.lineno}"
        for path, node in nodes()
        if isinstance(node, ast.Tuple) and isinstance(node.ctx, ast.Store)
        if sum(isinstance(e, ast.Name) and e.id == "_" for e in node.elts) >= 3
    ]
    assert not unpacked


def is_compiled(node: ast.FunctionDef) -> bool:
    decorators = [ast.unparse(decorator) for decorator in node.decorator_list]
    return any(mark in decorator for decorator in decorators for mark in KERNEL_MARKS)


@cache
def compiled_names() -> frozenset[str]:
    """Return the names of all kernels, which take arguments only by position."""
    return frozenset(
        node.name for _, node in nodes() if isinstance(node, ast.FunctionDef) and is_compiled(node)
    )


def test_only_kernels_and_public_functions_have_many_parameters():
    many = []
    for path, tree in modules().items():
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and not is_compiled(node):
                a = node.args
                n = len(a.args) + len(a.kwonlyargs) + len(a.posonlyargs)
                if n > MAX_PARAMETERS and node.name.startswith("_"):
                    many.append(f"{path}:{node.lineno} {node.name} {n}")
    assert not many


POSITIONAL = {
    *("reshape", "transpose"),  # NumPy: one argument an axis
    *("attrgetter", "Affine", "submit"),  # take their arguments only by position
    "Box",  # of ranges and overlaps, in the order of the axes
}
"""Functions that are not kernels and may get more than five arguments by position."""


def calls_outside_kernels(node: ast.AST, inside: bool = False) -> Iterator[ast.Call]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Call) and not inside:
            yield child
        in_kernel = isinstance(child, ast.FunctionDef) and child.name in compiled_names()
        yield from calls_outside_kernels(child, inside or in_kernel)


def test_calls_with_many_arguments_name_them():
    """Kernels are exempt: they take arguments only by position."""
    unnamed = [
        f"{path}:{call.lineno}"
        for path, tree in modules().items()
        for call in calls_outside_kernels(tree)
        if len(call.args) > MAX_POSITIONAL
        and ast.unparse(call.func).rsplit(".")[-1] not in POSITIONAL | compiled_names()
    ]
    assert not unnamed
