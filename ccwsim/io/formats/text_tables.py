"""Numbers, tables and matrices in text: header, separator, decimal comma, the line of an error."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile, distinct_names
from ccwsim.io.limits import MAX_VARIABLES, check_cells, check_lines, check_time, limits
from ccwsim.model.errors import CCWSIMError

CHUNK = 2**20
"""Bytes split into words at a time, so that memory stays small."""

MAX_WORD = 80
"""No number is longer."""

_SPACE = re.compile(rb"\s")


def is_number(word: str) -> bool:
    """Return whether a word is a number (or NaN).

    Examples
    --------
    >>> is_number(" 0.0000000e+000"), is_number("sand")
    (True, False)
    """
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def numbers_in(
    content: bytes, name: str, *, start: int = 0, first_line: int = 1
) -> NDArray[np.float64]:
    """Return all numbers of a text from byte `start` on, which is in line `first_line`.

    Examples
    --------
    >>> numbers_in(b"1 2.5\\n nan", "text")
    array([1. , 2.5, nan])
    """
    parts: list[NDArray[np.float64]] = []
    n, at, line = 0, start, first_line
    while at < len(content):
        cut = _SPACE.search(content, at + CHUNK)
        end = cut.start() if cut else len(content)
        chunk = content[at:end]
        parts.append(_parsed(chunk, name, line))
        n += len(parts[-1])
        if n > limits().cells:
            raise CCWSIMError(f"{name}: more than {limits().cells} values; cut a smaller piece")
        check_time(name)
        line += chunk.count(b"\n")
        at = end
    return np.concatenate(parts) if parts else np.empty(0)


def _parsed(chunk: bytes, name: str, line: int) -> NDArray[np.float64]:
    words = chunk.split()
    if not words:
        return np.empty(0)
    if b"_" not in chunk and len(max(words, key=len)) <= MAX_WORD:
        try:
            values = np.array(words, dtype=np.float64)
        except ValueError:
            pass
        else:
            if not np.isinf(values).any():
                return values
    raise CCWSIMError(_first_bad(chunk, name, line))


def _first_bad(chunk: bytes, name: str, line: int) -> str:
    for k, text in enumerate(chunk.split(b"\n")):
        for word in text.split():
            said = word[:MAX_WORD].decode("latin-1")
            if len(word) > MAX_WORD or not is_number(said) or np.isinf(float(said)):
                return f"{name}, line {line + k}: {said[:30]!r} is not a number; correct it"
    return f"{name}: a value after line {line} is not a number; correct it"


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


_COMMENT = (b"#", b"%", b"//")


def read_delimited(content: bytes, name: str) -> DataFile:
    """Return the columns of a table with a header, or the matrix of a text without one.

    Examples
    --------
    >>> file = read_delimited(b"x;y;facies\\r\\n10,5;2;1\\r\\n", "data.csv")
    >>> {k: v.tolist() for k, v in file.variables.items()}
    {'x': [10.5], 'y': [2.0], 'facies': [1.0]}
    """
    check_lines(name, content.count(b"\n"))
    lines, numbers, remark = _filled_lines(content, name)
    if not lines:
        raise CCWSIMError(f"{name}: the file holds no values")
    sample = [line[:2000].decode("utf-8", "replace") for line in lines[1:21] or lines]
    separator = separator_of(sample)
    comma = has_decimal_comma(sample, separator)
    first = split_fields(lines[0].decode("utf-8", "replace"), separator)
    headed = any(field_number(field, comma) is None for field in first)
    names = first if headed else split_fields(remark, separator)
    body, numbers = (lines[1:], numbers[1:]) if headed else (lines, numbers)
    if not body:
        raise CCWSIMError(f"{name}: {lines[0][:40].decode('latin-1')!r} holds no numbers")
    n = len(names) if headed else len(split_fields(body[0].decode("latin-1"), separator))
    if headed and n > MAX_VARIABLES:
        raise CCWSIMError(f"{name}: {n} columns are more than {MAX_VARIABLES}")
    check_cells(name, (len(body), n))
    values = _fast(body, name, n, separator, comma)
    if values is None:
        values = _by_field(body, numbers, name, n, separator, comma)
    at = np.array(numbers, dtype=np.int64)
    if not headed and len(names) != n:
        matrix = values.reshape(1, len(body), n)
        return DataFile(
            "text matrix", name, {"matrix": matrix}, lines=at, south_first=False, asks_up=True
        )
    columns = dict(zip(distinct_names(names), np.ascontiguousarray(values.T), strict=True))
    texts = [key for key, column in columns.items() if headed and np.isnan(column).all()]
    kept = {key: column for key, column in columns.items() if key not in texts}
    if not kept:
        raise CCWSIMError(f"{name}: no column holds numbers")
    return DataFile("table in text", name, kept, is_table=True, lines=at)


def _filled_lines(content: bytes, name: str) -> tuple[list[bytes], list[int], str]:
    """Lines that hold something, their numbers, and the last comment before them."""
    lines: list[bytes] = []
    numbers: list[int] = []
    remark = ""
    for k, line in enumerate(content.split(b"\n"), start=1):
        if len(line) > limits().line_bytes:
            raise CCWSIMError(
                f"{name}, line {k}: {len(line)} bytes are more than {limits().line_bytes} in a "
                "line; break it up"
            )
        bare = line.strip(b" \r")
        if bare.startswith(_COMMENT):
            remark = bare[:2000].lstrip(b"#%/ ").decode("utf-8", "replace") if not lines else remark
        elif bare.strip():
            lines.append(bare)
            numbers.append(k)
    return lines, numbers, remark


def _fast(
    body: list[bytes], name: str, n: int, separator: str | None, comma: bool
) -> NDArray[np.float64] | None:
    """All numbers at once; None where a field is empty, a text or missing."""
    sep = separator.encode() if separator else None
    if any(len(line.split(sep)) != n for line in body):
        return None
    text = b"\n".join(body)
    text = text.replace(b",", b".") if comma else text
    text = text.replace(sep, b" ") if sep else text
    try:
        values = numbers_in(text, name)
    except CCWSIMError:
        return None
    return values.reshape(-1, n) if len(values) == n * len(body) else None


def _by_field(
    body: list[bytes], numbers: list[int], name: str, n: int, separator: str | None, comma: bool
) -> NDArray[np.float64]:
    """Field by field: empty ones become NaN, columns of words NaN throughout."""
    table: list[list[str]] = []
    for line, number in zip(body, numbers, strict=True):
        fields = split_fields(line.decode("utf-8", "replace"), separator)
        while len(fields) > n and not fields[-1]:
            fields.pop()
        if len(fields) != n:
            raise CCWSIMError(f"{name}, line {number}: {len(fields)} fields where {n} are needed")
        table.append(fields)
        if len(table) * n > limits().fields:
            raise CCWSIMError(f"{name}: words or empty fields in a table this large; clean it")
        if len(table) % 1000 == 0:
            check_time(name)
    columns = [_column(column, numbers, name, comma) for column in zip(*table, strict=True)]
    return np.stack(columns, axis=1)


def _column(
    fields: tuple[str, ...], numbers: list[int], name: str, comma: bool
) -> NDArray[np.float64]:
    found = [field_number(field, comma) for field in fields]
    words = [k for k, value in enumerate(found) if value is None or np.isinf(value)]
    if 2 * len(words) > len(words) + sum(v is not None and v == v for v in found):
        return np.full(len(found), np.nan)
    if words:
        k = words[0]
        raise CCWSIMError(
            f"{name}, line {numbers[k]}: {fields[k][:30]!r} is not a number; facies are whole "
            "numbers, so give every name a number"
        )
    return np.array(found, dtype=np.float64)
