"""Read numbers, tables and matrices from text; detect header, separator and decimal mark."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile, distinct_names
from ccwsim.io.limits import MAX_VARIABLES, check_cells, check_table, limits
from ccwsim.model.bounds import MAX_FACIES
from ccwsim.model.errors import CCWSIMError

CHUNK = 2**20
"""Number of bytes that are split into words at a time, to limit memory use."""

MAX_WORD = 80
"""Maximum number of characters in one number."""

_SPACE = re.compile(rb"\s")
_EXPONENT = re.compile(rb"(?<=\d)(\.?)[dD](?=[+-]?\d)")
"""The exponent letter of Fortran, as in 1.5D+02."""


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
    """Return all numbers in a text from byte `start` on; this byte is in line `first_line`."""
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
        line += chunk.count(b"\n")
        at = end
    return np.concatenate(parts) if parts else np.empty(0)


def _parsed(chunk: bytes, name: str, line: int) -> NDArray[np.float64]:
    words = chunk.split()
    if not words:
        return np.empty(0)
    if b"_" not in chunk and len(max(words, key=len)) <= MAX_WORD:
        for text in (words, _EXPONENT.sub(rb"\1e", chunk).split()):
            with suppress(ValueError):
                values = np.array(text, dtype=np.float64)
                if not np.isinf(values).any():
                    return values
    raise CCWSIMError(_first_bad(chunk, name, line))


def _first_bad(chunk: bytes, name: str, line: int) -> str:
    for k, text in enumerate(chunk.split(b"\n")):
        for word in text.split():
            said = word[:MAX_WORD].decode("latin-1")
            if len(word) > MAX_WORD or not is_number(said) or np.isinf(float(said)):
                return not_a_number(name, line + k, said)
    return f"{name}: a value after line {line} is not a number; correct it"


SEPARATORS = (";", "\t", ",", None)
"""Possible separators; None means white space."""

UNKNOWN = frozenset({"", "nan", "na", "n/a", "null", "none", "-"})
"""Fields that mean a missing value, in lower case."""

BOOLEANS = {"true": 1.0, "false": 0.0, "yes": 1.0, "no": 0.0}
"""Words that mean 1 and 0, in lower case."""

_QUOTED = re.compile(r'"[^"]*"|\S+')


def split_fields(line: str, separator: str | None) -> list[str]:
    """Split a line into fields and remove white space and quotes around each field.

    Examples
    --------
    >>> split_fields('"W 1"; 2,5;', ";"), split_fields('"W 1"  2.5', None)
    (['W 1', '2,5', ''], ['W 1', '2.5'])
    """
    if separator is None:
        fields = _QUOTED.findall(line) if '"' in line else line.split()
        return [field.strip("\"'") for field in fields]
    fields = line.split(separator)
    if '"' in line:
        with suppress(csv.Error, StopIteration):  # a quoted field may contain the separator
            fields = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    return [field.strip().strip("\"'") for field in fields]


_GROUPS = {
    ",": re.compile(r"[+-]?[1-9]\d{0,2}(\.\d{3})+(,\d*)?"),
    ".": re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?"),
}
"""Patterns of numbers with thousands separators, such as 1.234,5 or 1,234.5, by decimal mark."""


def field_number(field: str, decimal: str) -> float | None:
    """Return the number in a field; return NaN for a missing value and None for text.

    Examples
    --------
    >>> field_number("2,5", ","), field_number("1.234,5", ","), field_number("1,234.5", ".")
    (2.5, 1234.5, 1234.5)
    >>> field_number("NA", "."), field_number("sand", ".")
    (nan, None)
    """
    if field.lower() in UNKNOWN or field == "*" * len(field):
        return float("nan")
    if _GROUPS[decimal].fullmatch(field):
        field = field.replace("." if decimal == "," else ",", "")
    number = field.replace(",", ".") if decimal == "," else field
    return float(number) if len(number) <= MAX_WORD and is_number(number) else None


def column_of_numbers(fields: Sequence[str], decimal: str = ".") -> NDArray[np.float64] | None:
    """Return a column as numbers, if it consists of numbers, or of words for 1 and 0.

    Examples
    --------
    >>> column_of_numbers(["2", "NA"]), column_of_numbers(["yes", ""]), column_of_numbers(["sand"])
    (array([ 2., nan]), array([ 1., nan]), None)
    """
    if {field.lower() for field in fields} <= BOOLEANS.keys() | UNKNOWN:
        return np.array([BOOLEANS.get(field.lower(), np.nan) for field in fields])
    values = [field_number(field, decimal) for field in fields]
    return None if any(v is None or np.isinf(v) for v in values) else np.array(values, np.float64)


def numbered(
    words: Sequence[str], unknown: Collection[str]
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Return the index of each word among the sorted different words (NaN if unknown), and these.

    Examples
    --------
    >>> numbered(["sand", "", "mud"], {""})
    (array([ 1., nan,  0.]), ('mud', 'sand'))
    """
    names = tuple(sorted({*words} - {*unknown}))
    indices = {name: float(k) for k, name in enumerate(names)}
    return np.array([indices.get(word, np.nan) for word in words]), names


def separator_of(sample: Sequence[str]) -> str | None:
    """Return the separator that splits a few lines of data into the most numbers.

    Examples
    --------
    >>> separator_of(["10,5;20;1"]), separator_of(["1, 2, 3"]), separator_of(["1,5 2,5 1"])
    (';', ',', None)
    """
    scores = [sum(_n_numbers(line, s) for line in sample) for s in SEPARATORS]
    if not any(scores):  # only words: the most fields in every line
        scores = [min(len(split_fields(line, s)) for line in sample) for s in SEPARATORS]
    return SEPARATORS[scores.index(max(scores))]


def decimal_of(sample: Sequence[str], separator: str | None) -> str:
    """Return the decimal mark of a few lines: a comma if they contain numbers such as 2,5.

    Examples
    --------
    >>> decimal_of(["10,5;20;1"], ";"), decimal_of(["1,234.5;2;1"], ";")
    (',', '.')
    """
    if separator == ",":
        return "."
    fields = [field for line in sample for field in split_fields(line, separator)]
    if any(f.rfind(".") > f.rfind(",") >= 0 and field_number(f, ".") is not None for f in fields):
        return "."
    return "," if any("," in f and field_number(f, ",") is not None for f in fields) else "."


def _n_numbers(line: str, separator: str | None) -> int:
    marks = "." if separator == "," else ".,"
    fields = split_fields(line, separator)
    return sum(any(_counts(f, mark) for mark in marks) for f in fields)


def _counts(field: str, decimal: str) -> bool:
    number = field_number(field, decimal)
    return number is not None and field.lower() not in UNKNOWN - {"nan"}


_COMMENT = (b"#", b"%", b"//")


def read_delimited(content: bytes, name: str) -> DataFile:
    """Return the columns of a table with a header, or the matrix in a text without a header.

    A row without numbers below the header, such as a row of units, is skipped. Headers of Petrel
    points and well logs (LAS) are also recognized.

    Examples
    --------
    >>> file = read_delimited(b"x;y;facies\\r\\nm;m;-\\r\\n10,5;2;1\\r\\n", "data.csv")
    >>> {k: v.tolist() for k, v in file.variables.items()}
    {'x': [10.5], 'y': [2.0], 'facies': [1.0]}
    >>> read_delimited(b"x,y,facies\\n1,2,sand\\n", "data.csv").words
    {'facies': ('sand',)}
    """
    if (n_lines := content.count(b"\n")) > limits().lines:
        raise CCWSIMError(
            f"{name}: {n_lines} lines exceed the limit of {limits().lines}; use an SGeMS grid or "
            "an npy file, or cut a smaller piece"
        )
    lines, numbers, remark = _filled_lines(content, name)
    if not lines:
        raise CCWSIMError(f"{name}: the file contains no values")
    header = _own_header(lines)
    lines, numbers = lines[header.n_lines :], numbers[header.n_lines :]
    if header.wrapped:
        lines, numbers = _unwrapped(lines, numbers, len(header.names))
    stated = re.fullmatch(rb"sep=(.)", lines[0], re.IGNORECASE) if lines else None
    lines, numbers = (lines[1:], numbers[1:]) if stated else (lines, numbers)
    if not lines:
        raise CCWSIMError(f"{name}: no values follow the header")
    sample = [line[:2000].decode("utf-8", "replace") for line in lines[1:21] or lines]
    separator = None if header.names else stated[1].decode() if stated else separator_of(sample)
    n_titles = _n_titles(lines, separator)
    lines, numbers = lines[n_titles:], numbers[n_titles:]
    marks = _Marks(separator, decimal_of(sample, separator))
    first = marks.fields(lines[0])
    if not header.names and (words := _words_of_matrix(lines, marks)):
        return _matrix_of_names(words, numbers, name)
    headed = not header.names and any(field_number(f, marks.decimal) is None for f in first)
    names = first if headed else split_fields(remark, separator)
    body, numbers = (lines[1:], numbers[1:]) if headed else (lines, numbers)
    if headed and len(body) > 1 and _units(body, marks):
        second = marks.fields(body[0])
        names = names if len(second) <= len(names) else second  # a title precedes the header
        body, numbers = body[1:], numbers[1:]
    if not body:
        raise CCWSIMError(f"{name}: {lines[0][:40].decode('latin-1')!r} contains no numbers")
    names, headed = (list(header.names), True) if header.names else (names, headed)
    if header.n_lines:
        body = [_DATE_AND_TIME.sub(rb"\1T\2", line) for line in body]
    n = len(names) if headed else len(marks.fields(body[0]))
    if headed:
        check_table(name, len(body), n)
    else:
        check_cells(name, (len(body), n))
    at = np.array(numbers, dtype=np.int64)
    values, words = _fast(body, name, n, marks), {}
    if values is None:
        values, words = _by_field(body, numbers, name, n, marks, headed)
    if not headed and len(names) != n:
        values, at = _without_margins(values, at)
        return DataFile("text matrix", name, {"matrix": values[None]}, lines=at, **_OF_MATRIX)
    keys = distinct_names(names)
    columns = dict(zip(keys, np.ascontiguousarray(values.T), strict=True))
    empty = [k for k, key in enumerate(keys) if headed and np.isnan(columns[key]).all()]
    kept = {key: columns[key] for k, key in enumerate(keys) if k not in {*empty, *words}}
    if not kept:
        raise CCWSIMError(f"{name}: no column contains numbers")
    texts = {keys[k]: fields for k, fields in words.items()}
    names = tuple(key for key in keys if key in kept or key in texts)
    if header.well and "well" not in map(str.lower, names):
        texts["well"], names = (header.well,) * len(body), ("well", *names)
    table = DataFile("table in text", name, kept, is_table=True, lines=at, words=texts)
    return replace(table, columns=names, missing=header.missing)


_OF_MATRIX: dict[str, Any] = {"south_first": False, "asks_up": True}


def _without_margins(
    values: NDArray[np.float64], lines: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return a matrix without the row and column numbers of pandas, and without an empty column."""
    if values.shape[1] > 1 and np.isnan(values[:, -1]).all():  # a separator ends each line
        values = values[:, :-1]
    ny, nx = values.shape
    columns, rows = values[0, 1:] == np.arange(nx - 1), values[1:, 0] == np.arange(ny - 1)
    if min(ny, nx) > 1 and np.isnan(values[0, 0]) and columns.all() and rows.all():
        return values[1:, 1:], lines[1:]
    return values, lines


MAX_SAMPLED = 20
"""Number of lines at the start of a text from which its structure is told."""


def _n_titles(lines: list[bytes], separator: str | None) -> int:
    """Return the number of lines above the header whose fields, except the first, are empty."""
    if separator is None:
        return 0
    rows = [
        split_fields(line.decode("utf-8", "replace"), separator) for line in lines[:MAX_SAMPLED]
    ]
    titles = [len(row) > 2 and not any(row[1:]) for row in rows]
    return titles.index(False) if False in titles else 0


def _words_of_matrix(lines: list[bytes], marks: _Marks) -> list[list[str]] | None:
    """Return the fields of a matrix of names; None if a line has a number or other lengths.

    A table with a header has different names in its first line, a matrix repeats the names.
    """
    first = marks.fields(lines[0])
    if len(lines) < 2 or len(set(first)) == len(first) or len(first) < 2:
        return None
    if any(field_number(f, marks.decimal) is not None for f in first if f):
        return None
    rows = [marks.fields(line) for line in lines]
    rows = [row[:-1] if not row[-1] else row for row in rows]
    names = {field for row in rows for field in row}
    fits = len({len(row) for row in rows}) == 1 and len(names) <= MAX_FACIES
    return rows if fits and not any(map(is_number, names - {""})) else None


def _matrix_of_names(rows: list[list[str]], numbers: list[int], name: str) -> DataFile:
    """Return the facies of a matrix of names, numbered in the order of the alphabet."""
    check_cells(name, (len(rows), len(rows[0])))
    fields = [field for row in rows for field in row]
    values, names = numbered(fields, {field for field in fields if field.lower() in UNKNOWN})
    at, grid = np.array(numbers, dtype=np.int64), values.reshape(1, len(rows), -1)
    file = DataFile("text matrix", name, {"matrix": grid}, lines=at, **_OF_MATRIX)
    return replace(file, labels={"matrix": names})


class _Marks(NamedTuple):
    """The separator of fields and the decimal mark."""

    separator: str | None
    decimal: str

    def fields(self, line: bytes) -> list[str]:
        return split_fields(line.decode("utf-8", "replace"), self.separator)


def _units(body: list[bytes], marks: _Marks) -> bool:
    """Return whether the first row has only words and the second row has numbers."""
    first, second = ([_counts(f, marks.decimal) for f in marks.fields(row)] for row in body[:2])
    return not any(first) and any(second)


class _Header(NamedTuple):
    """The column names in a header of several lines, and the number of these lines."""

    names: tuple[str, ...] = ()
    n_lines: int = 0
    missing: tuple[float, ...] = ()
    wrapped: bool = False
    well: str = ""


MAX_OWN_HEADER = 4 * MAX_VARIABLES  # maximum number of header lines


def _own_header(lines: list[bytes]) -> _Header:
    """Return the header of a Petrel points file (BEGIN HEADER …) or a well log (~Curve, ~A)."""
    start = [line[:200].decode("utf-8", "replace").strip() for line in lines[:MAX_OWN_HEADER]]
    upper = [line.upper() for line in start]
    if "BEGIN HEADER" in upper[:5] and "END HEADER" in upper:
        first, last = upper.index("BEGIN HEADER") + 1, upper.index("END HEADER")
        return _Header(tuple(start[first:last]), last + 1)
    data = next((k for k, line in enumerate(upper) if line.startswith("~A")), None)
    if not upper[0].startswith("~") or data is None:
        return _Header()
    section, curves, missing, wrapped, well = "", [], (), False, ""
    for line in start[:data]:
        mnemonic = re.split(r"[.\s]", line, maxsplit=1)[0]
        if line.startswith("~"):
            section = line[1:2].upper()
        elif section == "C":
            curves.append(mnemonic)
        value = line.partition(".")[2].partition(":")[0].strip()
        if mnemonic.upper() == "NULL" and is_number(value):
            missing = (float(value),)
        elif mnemonic.upper() == "WRAP":
            wrapped = value.upper() == "YES"
        elif mnemonic.upper() == "WELL":
            well = value
    names = tuple(curves or start[data].split()[1:])
    return _Header(names, data + 1, missing, wrapped, well)


_DATE_AND_TIME = re.compile(rb"(\d{4}-\d{2}-\d{2}) (\d{2}:\d{2})")


def _unwrapped(lines: list[bytes], numbers: list[int], n: int) -> tuple[list[bytes], list[int]]:
    """Join the lines of each depth of a wrapped well log, so that each line has n fields."""
    joined: list[bytes] = []
    starts: list[int] = []
    words: list[bytes] = []
    for line, number in zip(lines, numbers, strict=True):
        if not words:
            starts.append(number)
        words += line.split()
        if len(words) >= n:
            joined.append(b" ".join(words))
            words = []
    return (joined, starts) if not words else ([*joined, b" ".join(words)], starts)


def _filled_lines(content: bytes, name: str) -> tuple[list[bytes], list[int], str]:
    """Return the non-empty lines, their line numbers, and the last comment before these lines."""
    lines: list[bytes] = []
    numbers: list[int] = []
    remark = ""
    for k, line in enumerate(content.split(b"\n"), start=1):
        if len(line) > limits().line_bytes:
            raise CCWSIMError(
                f"{name}, line {k}: {len(line)} bytes exceed the limit of {limits().line_bytes} "
                "bytes per line; split the line"
            )
        bare = line.strip(b" \r")
        if bare.startswith(_COMMENT):
            remark = bare[:2000].lstrip(b"#%/ ").decode("utf-8", "replace") if not lines else remark
        elif bare.strip():
            lines.append(bare)
            numbers.append(k)
    return lines, numbers, remark


def _fast(body: list[bytes], name: str, n: int, marks: _Marks) -> NDArray[np.float64] | None:
    """Parse all numbers at once; return None if a field is missing or is not a plain number."""
    sep = marks.separator.encode() if marks.separator else None
    if any(len(line.split(sep)) != n for line in body):
        return None
    text = b"\n".join(body)
    if marks.decimal == ",":
        if b"." in text:
            return None
        text = text.replace(b",", b".")
    text = text.replace(sep, b" ") if sep else text
    try:
        values = numbers_in(text, name)
    except CCWSIMError:
        return None
    return values.reshape(-1, n) if len(values) == n * len(body) else None


def _by_field(
    body: list[bytes], numbers: list[int], name: str, n: int, marks: _Marks, headed: bool
) -> tuple[NDArray[np.float64], dict[int, tuple[str, ...]]]:
    """Return all fields as numbers, and the text columns; empty fields and text become NaN."""
    table: list[list[str]] = []
    for line, number in zip(body, numbers, strict=True):
        fields = marks.fields(line)
        while len(fields) > n and not fields[-1]:
            fields.pop()
        if len(fields) != n:
            raise CCWSIMError(f"{name}, line {number}: {len(fields)} fields, but {n} are needed")
        table.append(fields)
        if len(table) * n > limits().fields:
            raise CCWSIMError(f"{name} is too large for words or empty fields; remove these")
    columns, words = [], {}
    for k, fields in enumerate(zip(*table, strict=True)):
        column = column_of_numbers(fields, marks.decimal)
        if column is None and not headed:
            values = [field_number(field, marks.decimal) for field in fields]
            bad = next(j for j, value in enumerate(values) if value is None or np.isinf(value))
            raise CCWSIMError(not_a_number(name, numbers[bad], fields[bad]))
        if column is None:
            words[k], column = fields, np.full(len(fields), np.nan)
        columns.append(column)
    return np.stack(columns, axis=1), words


def not_a_number(name: str, line: int, field: str, counted: str = "line") -> str:
    """Return the error message for a word in a field that must be a number."""
    return f"{name}, {counted} {line}: {field[:30]!r} is not a number; correct it"
