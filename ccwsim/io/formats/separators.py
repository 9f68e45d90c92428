"""Which separator and decimal mark a table in text uses."""

from __future__ import annotations

from collections.abc import Sequence

from ccwsim.io.formats.numbers import is_number

SEPARATORS = (";", "\t", ",", None)
"""None stands for white space."""

UNKNOWN = frozenset({"", "nan", "na", "n/a", "null", "none", "-"})
"""Fields, in lower case, that stand for "not known"."""


def split_fields(line: str, separator: str | None) -> list[str]:
    """Return the fields of a line without white space and quotes around them.

    Examples
    --------
    >>> split_fields('"W 1"; 2,5;', ";")
    ['W 1', '2,5', '']
    """
    if separator is None:
        return [field.strip("\"'") for field in line.split()]
    return [field.strip().strip("\"'") for field in line.split(separator)]


def field_number(field: str, decimal_comma: bool) -> float | None:
    """Return the number in a field, NaN where it is not known, None where it is a text.

    Examples
    --------
    >>> field_number("2,5", True), field_number("NA", False), field_number("sand", False)
    (2.5, nan, None)
    """
    if field.lower() in UNKNOWN:
        return float("nan")
    number = field.replace(",", ".") if decimal_comma else field
    return float(number) if is_number(number) else None


def separator_of(sample: Sequence[str]) -> str | None:
    """Return the separator that finds the most numbers in a few lines of data.

    Examples
    --------
    >>> separator_of(["10,5;20;1"]), separator_of(["1, 2, 3"]), separator_of(["1,5 2,5 1"])
    (';', ',', None)
    """
    scores = [sum(_n_numbers(line, s) for line in sample) for s in SEPARATORS]
    return SEPARATORS[scores.index(max(scores))]


def has_decimal_comma(sample: Sequence[str], separator: str | None) -> bool:
    """Return whether numbers are written as 2,5.

    Examples
    --------
    >>> has_decimal_comma(["10,5;20;1"], ";")
    True
    """
    if separator == ",":
        return False
    fields = [field for line in sample for field in split_fields(line, separator)]
    return any("," in f and field_number(f, True) is not None for f in fields)


def _n_numbers(line: str, separator: str | None) -> int:
    fields = split_fields(line, separator)
    return sum(is_number(f if separator == "," else f.replace(",", ".")) for f in fields)
