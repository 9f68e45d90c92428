"""One option a parameter, with the help text of the one table of parameters."""

from __future__ import annotations

import argparse
from dataclasses import asdict, fields
from typing import Any

from ccwsim.io import parameters_from_json
from ccwsim.io.source import read_bytes
from ccwsim.model.codec import short_name
from ccwsim.model.parameters import Parameters, parameter_table


def option_of(name: str) -> str:
    """Return what a parameter is called on the command line.

    Examples
    --------
    >>> [option_of(name) for name in ("template_size", "wavelet_level", "n_candidates", "refine")]
    ['--template', '--level', '--candidates', '--refine']
    """
    return "--" + short_name(name)


def add_parameter_options(parser: argparse.ArgumentParser) -> None:
    """Add an option for each row of the table of parameters, and `--parameters`."""
    group = parser.add_argument_group("parameters of the simulation")
    group.add_argument(
        "--parameters", metavar="FILE.json",
        help="take parameters from a JSON file, as the dashboard saves them; options given here "
        "come first",
    )  # fmt: skip
    defaults = {f.name: f.default for f in fields(Parameters)}
    for row in parameter_table():
        default = defaults[row["name"]]
        how: dict[str, Any] = {"type": str if default is None else type(default)}
        if isinstance(default, bool):
            how = {"action": argparse.BooleanOptionalAction}
        else:
            how["metavar"] = _metavar(row["symbol"], default)
        group.add_argument(
            option_of(row["name"]), dest=row["name"], default=None, help=_help(row), **how
        )


def parameters_of(options: argparse.Namespace) -> Parameters:
    """Return the parameters of a command line: options, then `--parameters`, then defaults.

    Raises
    ------
    CCWSIMError
        For a file that cannot be read, or a value that is not allowed.

    Examples
    --------
    >>> parser = argparse.ArgumentParser()
    >>> add_parameter_options(parser)
    >>> parameters_of(parser.parse_args(["--template", "48", "--no-refine"])).step
    40
    """
    given = {f.name: getattr(options, f.name) for f in fields(Parameters)}
    given = {name: value for name, value in given.items() if value is not None}
    if options.parameters is None:
        return Parameters(**given)
    content, _ = read_bytes(options.parameters)
    return Parameters(**{**asdict(parameters_from_json(content)), **given})


def _metavar(symbol: str, default: object) -> str:
    if isinstance(default, int):
        return symbol or "N"
    return "SHARE" if isinstance(default, float) else "NAME"


def _help(row: dict[str, str]) -> str:
    meaning = row["meaning"].replace("%", "%%")
    if row["default"] in ("True", "False"):
        return f"{meaning} (default: {'yes' if row['default'] == 'True' else 'no'})"
    return f"{meaning} ({row['allowed'].replace('%', '%%')}; default: {row['default']})"
