"""What `ccwsim` does: find the command, run it, and say what went wrong."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper

import click

import ccwsim
from ccwsim.model.errors import CCWSIMError

COMMANDS = ("simulate", "dashboard", "datasets", "paper", "warm-up")
"""Each is the `command` of a module of this folder, loaded when it is asked for."""

OK, BAD_INPUT, STOPPED = 0, 2, 130
"""Exit codes; 2 is also click's own, 130 is a shell's for Ctrl-C."""

EPILOG = (
    "'ccwsim COMMAND --help' explains a command. Exit codes: 0 all is well, 2 the input is not "
    "right, 130 stopped by Ctrl-C, 143 by SIGTERM, 129 by a terminal that was closed: what is "
    "finished is written. Completion by Tab: put "
    'eval "$(_CCWSIM_COMPLETE=bash_source ccwsim)" into ~/.bashrc (zsh_source into ~/.zshrc, '
    "fish_source for fish)."
)


class Commands(click.Group):
    """The commands of this folder."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        return import_module(f"ccwsim.cli.{cmd_name.replace('-', '_')}").command


@click.group(
    cls=Commands,
    epilog=EPILOG,
    no_args_is_help=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(ccwsim.__version__, message="ccwsim %(version)s")
def program() -> None:
    """Wavelet-based multiple-point simulation of categorical fields."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code: 0, 2 for bad input, 130 for Ctrl-C."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # a text must not fail for an old code page
    given = None if arguments is None else list(arguments)
    try:
        return program.main(given, "ccwsim", standalone_mode=False) or OK
    except click.ClickException as error:
        error.show()
    except CCWSIMError as error:
        print(f"ccwsim: {error}", file=sys.stderr)
    except (click.Abort, KeyboardInterrupt):
        print("ccwsim: stopped", file=sys.stderr)
        return STOPPED
    return BAD_INPUT
