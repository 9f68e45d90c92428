"""What `python -m ccwsim` does: find the command, run it, and say what went wrong."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import ccwsim
from ccwsim.cli import paper, simulate, warm_up
from ccwsim.model.errors import CCWSIMError

COMMANDS = (simulate, paper, warm_up)
"""Modules with `add_command(commands)`, which sets the function to run as the default `run`."""

OK, BAD_INPUT, STOPPED = 0, 2, 130
"""Exit codes; 2 is also argparse's own, 130 is a shell's for Ctrl-C."""

CODES = "Exit codes: 0 all is well, 2 the input is not right, 130 stopped by Ctrl-C."


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line.

    Examples
    --------
    >>> build_parser().parse_args(["simulate", "channels", "--level", "1"]).wavelet_level
    1
    """
    parser = argparse.ArgumentParser(
        prog="python -m ccwsim",
        description="Wavelet-based multiple-point simulation of categorical fields.",
        epilog=f"'python -m ccwsim COMMAND --help' explains a command. {CODES}",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"ccwsim {ccwsim.__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in COMMANDS:
        command.add_command(commands)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those after the program's name; by default those the process was started with.

    Returns
    -------
    int
        0, 2 for bad input (the message goes to stderr), 130 where the user stopped it.

    Raises
    ------
    SystemExit
        For ``--help``, ``--version`` and options that do not exist, as argparse does.
    """
    parsed = build_parser().parse_args(arguments)
    try:
        return parsed.run(parsed)
    except CCWSIMError as error:
        print(f"ccwsim: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("ccwsim: stopped", file=sys.stderr)
        return STOPPED
