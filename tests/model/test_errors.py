"""Test that each message of `errors.toml` is raised with the values that it names."""

import ast
import tomllib
from collections.abc import Collection
from pathlib import Path
from string import Formatter

import ccwsim
from ccwsim.model.errors import CCWSIMError, refused

PACKAGE = Path(ccwsim.__file__).parent


def test_a_message_contains_its_values():
    error = refused("several_frames", name="a.gif", n=3)
    assert isinstance(error, CCWSIMError)
    assert str(error).startswith("a.gif has 3 frames; save one frame as PNG")


def keys_of(node: ast.expr, messages: Collection[str]) -> set[str]:
    """Return the keys that a text names, or that an f-string can name according to its start."""
    if isinstance(node, ast.JoinedStr):
        start = ast.literal_eval(node.values[0])
        return {key for key in messages if key.startswith(start)}
    return {ast.literal_eval(node)}


def test_every_message_is_raised_with_the_values_that_it_names():
    messages = tomllib.loads((PACKAGE / "model/errors.toml").read_text("utf-8"))
    raised = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "refused":
                keys = keys_of(node.args[0], messages)
                assert keys, f"{path.name}: {ast.unparse(node)}"
                for key in keys:
                    named = {name for _, name, _, _ in Formatter().parse(messages[key]) if name}
                    assert {word.arg for word in node.keywords} == named, f"{path.name}: {key}"
                raised |= keys
    assert raised == messages.keys()
