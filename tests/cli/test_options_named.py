"""Test that every command-line option that a message names exists."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import click

import ccwsim
from ccwsim.cli.program import COMMANDS, program

PACKAGE = Path(ccwsim.__file__).parent
OPTION = re.compile(r"(?<![\w-])--[a-z](?:[a-z-]*[a-z])?(?![\w-])(?:\.[a-zA-Z]+)?")
OF_STREAMLIT = re.compile(r"--(server|browser|client)\.[a-zA-Z]+")


def options() -> set[str]:
    """Return all options of all commands."""
    context = click.Context(program)
    commands = [program, *(program.get_command(context, name) for name in COMMANDS)]
    found = {"--help"}
    for command in commands:
        for parameter in command.params:
            found |= {*parameter.opts, *parameter.secondary_opts}
    return found


def named() -> set[tuple[str, str]]:
    """Return the options in the texts of the package with their files, except in style sheets."""
    found = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                if "var(--" in node.value or "style=" in node.value or "{ --" in node.value:
                    continue
                found |= {(option, path.name) for option in OPTION.findall(node.value)}
    for path in PACKAGE.rglob("options.csv"):
        found |= {(option, path.name) for option in OPTION.findall(path.read_text("utf-8"))}
    return found


def test_options_in_texts_exist():
    there, found = options(), named()
    assert {"--output", "--hard-data"} <= {option for option, _ in found}
    unknown = {pair for pair in found if pair[0] not in there and not OF_STREAMLIT.match(pair[0])}
    assert not unknown
