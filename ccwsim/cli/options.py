"""Groups of options and types of values, shared by commands."""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterable
from contextlib import suppress
from difflib import get_close_matches
from glob import escape, glob
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

if TYPE_CHECKING:
    from ccwsim.model import Classes

EPILOGS = tomllib.loads(Path(__file__).with_name("epilogs.toml").read_text("utf-8"))
"""Last part of the help of commands, by name."""
quiet = click.option("-q", "--quiet", is_flag=True, help="Print only errors.")


class GroupedOption(click.Option):
    """An option that the help text lists under the heading `group`."""

    def __init__(self, *args: Any, group: str = "", **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.group = group


class GroupedCommand(click.Command):
    """A command whose help text lists options under headings."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None and isinstance(parameter, click.Option):
                heading = getattr(parameter, "group", "Other options")
                sections.setdefault(heading, []).append(record)
        sections["Other options"] = sections.pop("Other options", [])
        for heading, records in sections.items():
            with formatter.section(heading):
                formatter.write_dl(records)


def suggestion(word: str, words: Iterable[str]) -> str:
    """Return a question such as "Did you mean channels?", or "" if no allowed word is similar."""
    close = get_close_matches(word.lower(), list(words), n=1)
    return f" Did you mean {close[0]}?" if close else ""


def complete_input(
    context: click.Context, parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Return bundled names and files that begin with a text, or let the shell complete files."""
    from ccwsim import datasets

    is_data = parameter.name == "hard_data"
    names = datasets.BUNDLED_DATA if is_data else datasets.BUNDLED_IMAGES
    words = [name for name in names if name.startswith(incomplete)]
    if words:
        words += glob(f"{escape(incomplete)}*")
    return [*map(CompletionItem, words)] or [CompletionItem(incomplete, type="file")]


def output_file(path: str) -> Any:
    """Return a path, or standard output for "-"."""
    return sys.stdout.buffer if path == "-" else path


def _refused(text: str, needed: str) -> click.BadParameter:
    return click.BadParameter(f"{text!r} must be {needed}")


def piece(
    context: click.Context, parameter: click.Parameter, value: tuple[int, ...] | None
) -> tuple[int, ...] | None:
    """Return a piece of an image, given as x, y, nx, ny, as (row, column, n_rows, n_columns)."""
    if value is None:
        return None
    x, y, nx, ny = value
    return y, x, ny, nx


def sizes(text: str) -> tuple[int, ...]:
    """Convert the text `NXxNY` or `NXxNYxNZ` to the shape (ny, nx) or (nz, ny, nx)."""
    match = re.fullmatch(r"(\d+)[x×](\d+)(?:[x×](\d+))?", text.strip().lower())
    if not match:
        raise _refused(text, "columns x rows, such as 640x480 for 640 along x and 480 along y")
    return tuple(int(number) for number in reversed(match.groups()) if number)


def one_or_each(text: str) -> int | tuple[int, ...]:
    """Return one number for all axes, or the text `XxYxZ` as the numbers along (z, y, x)."""
    return _per_axis(text, int, "a whole number, or three along x, y and z, written XxYxZ")


def number_or_each(text: str) -> float | tuple[float, ...]:
    """Return one number for all axes, or the text `XxYxZ` as the numbers along (z, y, x)."""
    return _per_axis(text, float, "a number, or three along x, y and z, such as 0x0x2")


def _per_axis(text: str, kind: Any, needed: str) -> Any:
    with suppress(ValueError):
        numbers = [kind(part) for part in text.lower().replace("×", "x").split("x")]
        if len(numbers) in (1, 3):
            return tuple(numbers[::-1]) if len(numbers) == 3 else numbers[0]
    raise _refused(text, needed)


def classes(text: str) -> Classes:
    """Convert a text to a number of classes, to the inner edges of classes, or to "codes"."""
    return int(text) if re.fullmatch(r"\d+", text) else edges_or_codes(text)


def name_and_facies(text: str) -> tuple[str, int | str]:
    """Convert the text `NAME=FACIES` to a name and the code or name of a facies of the image."""
    name, _, facies = (part.strip() for part in text.rpartition("="))
    if not name or not facies:
        raise _refused(text, "a name and its facies in the image, such as Sand=1")
    return name, _code_or_name(facies)


def facies_and_number(text: str) -> tuple[int | str, float]:
    """Convert the text `FACIES=NUMBER` to the name or code of a facies and a number."""
    name, _, number = text.rpartition("=")
    with suppress(ValueError):
        if (name := name.strip()) and not isnan(value := float(number)):
            return _code_or_name(name), value
    raise _refused(text, "a facies and a number, such as sand=1e-4")


def _code_or_name(text: str) -> int | str:
    return int(text) if re.fullmatch(r"[+-]?\d{1,15}", text, re.ASCII) else text


def code_and_code(text: str) -> tuple[int, int | None]:
    """Convert the text `CODE=CODE` or `CODE=none` to two facies codes."""
    matches = re.fullmatch(r"\s*([+-]?\d{1,15})=([+-]?\d{1,15}|none)\s*", text, re.ASCII)
    if not matches:
        raise _refused(text, "a facies code and the code it becomes, such as 3=1 or 3=none")
    code, to = matches.groups()
    return int(code), None if to == "none" else int(to)


def edges_or_codes(text: str) -> Classes:
    """Convert a text to the inner edges of classes, or to "codes"."""
    if text == "codes":
        return "codes"
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        needed = "numbers with commas between them, such as 0.1,0.25, or the word codes"
        raise _refused(text, needed) from None
