"""Texts of the command line as values; what cannot be read is said by argparse."""

from __future__ import annotations

import argparse
import re

from ccwsim.io.formats.classes import Classes


def sizes(text: str) -> tuple[int, ...]:
    """Return `NXxNY` or `NXxNYxNZ` as an array's shape: (ny, nx) or (nz, ny, nx).

    Examples
    --------
    >>> sizes("640x480")
    (480, 640)
    """
    found = re.fullmatch(r"(\d+)[x×](\d+)(?:[x×](\d+))?", text.strip().lower())
    if not found:
        raise argparse.ArgumentTypeError(
            f"{text!r} must be columns x rows, such as 640x480 for 640 along x and 480 along y"
        )
    return tuple(int(number) for number in reversed(found.groups()) if number)


def grid_shape(text: str) -> tuple[int, ...]:
    """Return `NXxNY` as (ny, nx).

    Examples
    --------
    >>> grid_shape("640x480")
    (480, 640)
    """
    shape = sizes(text)
    if len(shape) != 2:
        raise argparse.ArgumentTypeError(f"{text!r} must be two numbers, columns x rows")
    return shape


def classes(text: str) -> Classes:
    """Return a number of classes, their inner edges, or "codes".

    Examples
    --------
    >>> classes("3"), classes("0.1,0.25"), classes("codes")
    (3, [0.1, 0.25], 'codes')
    """
    if text == "codes":
        return "codes"
    try:
        return int(text) if re.fullmatch(r"\d+", text) else edges(text)
    except argparse.ArgumentTypeError:
        raise argparse.ArgumentTypeError(
            f"{text!r} must be a number of classes, edges such as 0.1,0.25, or the word codes"
        ) from None


def edges_or_codes(text: str) -> Classes:
    """Return inner edges of classes, or "codes".

    Examples
    --------
    >>> edges_or_codes("128")
    [128.0]
    """
    return "codes" if text == "codes" else edges(text)


def edges(text: str) -> list[float]:
    """Return numbers with commas between them.

    Examples
    --------
    >>> edges("0.1, 0.25")
    [0.1, 0.25]
    """
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} must be numbers with commas between them, such as 0.1,0.25"
        ) from None
