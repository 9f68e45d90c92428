"""The program `ccwsim`, which runs a command and reports errors."""

import sys
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper

import click

import ccwsim
from ccwsim.cli.options import EPILOGS, suggestion

COMMANDS = ("simulate", "flow", "dashboard", "datasets", "paper", "warm-up")
"""Names of commands. Each command is the function `command` of a module, loaded on demand."""

OK, BAD_INPUT, STOPPED = 0, 2, 130  # exit codes, as in click (2) and in shells (130 for Ctrl-C)

PROGRAM = "program"  # context of a command whose process ends after the command


class Commands(click.Group):
    """The commands in this folder, loaded on demand."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if name not in COMMANDS and not name.startswith("-"):
            hint = suggestion(name, COMMANDS) or f" Choose one of {', '.join(COMMANDS)}."
            ctx.fail(f"No such command '{name}'.{hint}")
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        return import_module(f"ccwsim.cli.{cmd_name.replace('-', '_')}").command


@click.group(
    cls=Commands,
    epilog=EPILOGS["program"],
    no_args_is_help=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(ccwsim.__version__, message="ccwsim %(version)s")
def program() -> None:
    """Wavelet-based multiple-point simulation of categorical fields."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return the exit code: 0, 2 for bad input, 130 for Ctrl-C."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # some code pages lack characters
    words = None if arguments is None else list(arguments)
    try:
        context = PROGRAM if arguments is None else None
        return program.main(words, "ccwsim", standalone_mode=False, obj=context) or OK
    except click.ClickException as error:
        error.show()
    except ccwsim.CCWSIMError as error:  # looked up, with NumPy, only if there is an error
        print(f"ccwsim: {error}", file=sys.stderr)
    except (click.Abort, KeyboardInterrupt):
        print("ccwsim: stopped", file=sys.stderr)
        return STOPPED
    return BAD_INPUT
