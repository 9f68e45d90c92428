"""Parameters of tests, of which some always run and the others run only with the slow tests."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Container, Iterable
from typing import Any

import pytest


def annotations_of(function: Callable[..., Any]) -> dict[str, str]:
    """Return the annotation of each parameter as written in the source of a function."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    except (OSError, TypeError, IndentationError):  # made by a decorator
        parameters = inspect.signature(function).parameters.values()
        return {p.name: str(p.annotation) for p in parameters}
    assert isinstance(tree, ast.FunctionDef | ast.AsyncFunctionDef)
    own = [*tree.args.posonlyargs, *tree.args.args, *tree.args.kwonlyargs]
    return {a.arg: ast.unparse(a.annotation) for a in own if a.annotation is not None}


def some(values: Iterable[Any], always: Container[Any]) -> list[Any]:
    """Return parameters for `parametrize`; those that are not in `always` are marked as slow."""
    return [v if v in always else pytest.param(v, marks=pytest.mark.slow) for v in values]
