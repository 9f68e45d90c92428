"""Test that messages name options of the command line, and only options that exist."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import click
import pytest

import ccwsim
from ccwsim.cli.program import COMMANDS, main, program

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


WRONG_VALUES = [
    "--angle 1e9", "--candidates 0", "--co-template 9", "--level 9", "--location-weight 20",
    "--method 'fast'", "--mirrored 'q'", "--realizations 0", "--scale 50", "--search-fraction 2",
    "--seed -4", "--similarity 'x'", "--soft-weight 9", "--template 2", "--template-variation 2",
    "--workers 0",
]  # fmt: skip
"""Options of `ccwsim simulate` with a wrong value, as messages show them."""


@pytest.mark.parametrize("wrong", WRONG_VALUES)
def test_the_message_about_a_wrong_value_names_the_option(wrong, tmp_path, capsys):
    given = wrong.replace("'", "").split()
    command = ["simulate", "channels", "--grid", "40x40", "-o", str(tmp_path / "out.npz")]
    assert main([*command, *given]) == 2
    assert f"ccwsim: {wrong.replace('1e9', '1e+09')}" in capsys.readouterr().err


@pytest.mark.parametrize("wrong", ["--axis 'z'", "--anisotropy 0.0"])
def test_the_message_about_a_wrong_value_of_flow_names_the_option(wrong, tmp_path, capsys):
    path = str(tmp_path / "out.npz")
    ccwsim.write_realizations(path, ccwsim.simulate(ccwsim.datasets.load("channels"), (40, 40)))
    given = wrong.replace("'", "").split()
    assert main(["flow", path, "-k", "sand=1e-4", "-k", "mud=1e-8", *given]) == 2
    assert f"ccwsim: {wrong}" in capsys.readouterr().err
