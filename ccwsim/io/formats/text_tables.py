"""Read numbers, tables and matrices from text; detect header, separator and decimal mark."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ccwsim import CCWSIMError
from ccwsim.io.data_file import DataFile, distinct_names
from ccwsim.io.limits import check, check_cells, check_table
from ccwsim.model import MAX_FACIES, Floats, Ints

CHUNK = 2**20  # number of bytes that are split into words at a time, to limit memory use

MAX_WORD = 80  # maximum number of characters in one number

_SPACE = re.compile(rb"\s")
_EXPONENT = re.compile(rb"(?<=\d)(\.?)[dD](?=[+-]?\d)")  # as Fortran writes it in 1.5D+02


def is_number(word: str) -> bool:
    """Return whether a word is a number (or NaN)."""
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def numbers_in(content: bytes, name: str, *, start: int = 0, first_line: int = 1) -> Floats:
    """Return all numbers in a text from byte `start` on; this byte is in line `first_line`."""
    parts: list[Floats] = []
    n, position, line = 0, start, first_line
    while position < len(content):
        cut = _SPACE.search(content, position + CHUNK)
        end = cut.start() if cut else len(content)
        chunk = content[position:end]
        parts.append(_parsed(chunk, name, line))
        n += len(parts[-1])
        check(name, cells=n)
        line += chunk.count(b"\n")
        position = end
    return np.concatenate(parts) if parts else np.empty(0)


def _parsed(chunk: bytes, name: str, line: int) -> Floats:
    """Return the numbers in a part of a text; raise an error for the first other word."""
    words = chunk.split()
    if b"_" not in chunk and len(max(words, key=len, default=b"")) <= MAX_WORD:
        for text in (words, _EXPONENT.sub(rb"\1e", chunk).split()):
            with suppress(ValueError):
                values = np.array(text, dtype=np.float64)
                if not np.isinf(values).any():
                    return values
    for k, text in enumerate(chunk.split(b"\n")):
        for word in text.split():
            field = word[:MAX_WORD].decode("latin-1")
            if len(word) > MAX_WORD or not is_number(field) or np.isinf(float(field)):
                raise CCWSIMError(not_a_number(name, line + k, field))
    raise CCWSIMError(f"{name}: a value after line {line} is not a number; correct it")


SEPARATORS = (";", "\t", ",", None)  # possible separators; None means white space

# words for a missing value, errors of spreadsheets, values beyond a limit of detection, and marks
_MISSING = re.compile(
    r"|nan|nat|na|<na>|n[./][ad]\.?|nd|s[./]d\.?|k\. ?a\.|\(?null\)?|nil|none|missing|empty|"
    r"unknown|no ?data|not (available|measured|known)|unbekannt|fehlt|inconnu|desconocido|"
    r"#\w+[!?]|#n[adv]|#\w+/\w+!?|#+|[<>]\s*[\d.,]+|[-.?*–—…]+",
    re.IGNORECASE,
)
# words that mean 1 and 0, also as spreadsheets write them in other languages
_TRUE = re.compile("true|yes|wahr|ja|vrai|oui|verdadero", re.IGNORECASE)
_FALSE = re.compile("false|no|falsch|nein|faux|non|falso", re.IGNORECASE)

_QUOTED = re.compile(r'"[^"]*"|\S+')


def split_fields(line: str, separator: str | None) -> list[str]:
    """Split a line into fields and remove white space and quotes around each field."""
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
_APOSTROPHE = re.compile(r"(?<=\d)['’\u00a0\u202f](?=\d{3})")
"""Thousands separators that cannot be a decimal mark."""


def is_missing(field: str) -> bool:
    """Return whether a field stands for a missing value."""
    return _MISSING.fullmatch(field) is not None


def field_number(field: str, decimal: str) -> float | None:
    """Return the number in a field; return NaN for a missing value and None for text."""
    if is_missing(field):
        return float("nan")
    field = _APOSTROPHE.sub("", field)
    if _GROUPS[decimal].fullmatch(field):
        field = field.replace("." if decimal == "," else ",", "")
    number = field.replace(",", ".") if decimal == "," else field
    return float(number) if len(number) <= MAX_WORD and is_number(number) else None


def column_of_numbers(fields: Sequence[str], decimal: str = ".") -> Floats | None:
    """Return a column as numbers, if it consists of numbers, or of words for 1 and 0."""
    values = [field_number(field, decimal) for field in fields]
    if all(_TRUE.fullmatch(f) or _FALSE.fullmatch(f) or is_missing(f) for f in {*fields}):
        values = [np.nan if is_missing(f) else float(bool(_TRUE.fullmatch(f))) for f in fields]
    return None if any(v is None or np.isinf(v) for v in values) else np.array(values, np.float64)


def numbered(words: Sequence[str], unknown: Collection[str]) -> tuple[Floats, tuple[str, ...]]:
    """Return the index of each word among the sorted names (NaN if unknown), and the names."""
    names = tuple(sorted({*words} - {*unknown}))
    indices = {name: float(k) for k, name in enumerate(names)}
    return np.array([indices.get(word, np.nan) for word in words]), names


def separator_of(sample: Sequence[str]) -> str | None:
    """Return the separator that splits a few lines of data into the most numbers."""
    scores = [sum(_n_numbers(line, s) for line in sample) for s in SEPARATORS]
    if not any(scores):  # only words: the most fields in every line
        scores = [min(len(split_fields(line, s)) for line in sample) for s in SEPARATORS]
    return SEPARATORS[scores.index(max(scores))]


def decimal_of(sample: Sequence[str], separator: str | None) -> str:
    """Return the decimal mark of a few lines: a comma if they contain numbers such as 2,5."""
    if separator == ",":
        return "."
    fields = [field for line in sample for field in split_fields(line, separator)]
    if any(f.rfind(".") > f.rfind(",") >= 0 and field_number(f, ".") is not None for f in fields):
        return "."
    comma = any("," in f or f.count(".") > 1 for f in fields if field_number(f, ",") is not None)
    return "," if comma else "."


def _n_numbers(line: str, separator: str | None) -> int:
    marks = "." if separator == "," else ".,"
    fields = split_fields(line, separator)
    return sum(any(_counts(f, mark) for mark in marks) for f in fields)


def _counts(field: str, decimal: str) -> bool:
    number = field_number(field, decimal)
    return number is not None and (field.lower() == "nan" or not is_missing(field))


_COMMENT = (b"#", b"%", b"//")


def read_delimited(content: bytes, name: str) -> DataFile:
    """Return the columns of a table with a header, or the matrix in a text without a header."""
    check(name, lines=content.count(b"\n"))
    lines, remark = _filled_lines(content, name)
    header = _own_header(lines.texts)
    lines = lines.after(header.n_lines)
    if header.n_lines:  # a date and a time are one field
        lines = lines._replace(texts=[_DATE_AND_TIME.sub(rb"\1T\2", k) for k in lines.texts])
    if header.wrapped:
        lines = _unwrapped(lines, len(header.names))
    stated = re.fullmatch(rb'"?sep=(.)"?', lines.texts[0], re.IGNORECASE) if lines.texts else None
    lines = lines.after(1 if stated else 0)
    if not lines.texts:
        raise CCWSIMError(f"{name}: the file contains no values")
    sample = [line[:2000].decode("utf-8", "replace") for line in lines.texts[1:21] or lines.texts]
    separator = stated[1].decode() if stated else header.separator
    if not stated and not header.names:
        separator = separator_of(sample)
    marks = _Marks(separator, decimal_of(sample, separator))
    lines = lines.after(_n_titles(lines.texts, marks))
    lines = lines.after(0 if header.names else _n_numbers_of_columns(lines.texts, marks))
    if not header.names and (matrix := _matrix_of_names(lines, marks, name)):
        return matrix
    first = lines.texts[0][:40].decode("latin-1")
    names, n_above = (header.names, 0) if header.names else _names_above(lines.texts, marks)
    lines = lines.after(n_above)
    if not lines.texts:
        raise CCWSIMError(f"{name}: {first!r} contains no numbers")
    n = len(names) or len(marks.fields(lines.texts[0]))
    if not names and len(remarked := split_fields(remark, separator)) == n:
        names = remarked
    if names:
        check_table(name, len(lines.texts), n)
    else:
        check_cells(name, (len(lines.texts), n))
    columns = _fast(lines.texts, name, n, marks) or _by_field(lines, name, n, marks, bool(names))
    line_numbers = np.array(lines.numbers, dtype=np.int64)
    if not names:
        values, line_numbers = _without_margins(np.stack(columns, axis=1), line_numbers)
        return _matrix_file(name, values, line_numbers)
    named = dict(zip(distinct_names(list(names)), columns, strict=True))
    if names[0] in ("", "Unnamed: 0") and n > 1 and _counts_up(columns[0]):  # the index of pandas
        del named[next(iter(named))]
    words = {key: column for key, column in named.items() if isinstance(column, tuple)}
    numbers = {
        key: column
        for key, column in named.items()
        if not isinstance(column, tuple) and not np.isnan(column).all()
    }
    if not numbers:
        raise CCWSIMError(f"{name}: no column contains numbers; give a table or a grid of numbers")
    keys = tuple(key for key in named if key in numbers or key in words)
    if header.well and "well" not in map(str.lower, keys):
        words["well"], keys = (header.well,) * len(line_numbers), ("well", *keys)
    table = DataFile(header.kind, name, numbers, is_table=True, lines=line_numbers, words=words)
    return replace(table, columns=keys, missing=header.missing)


def _matrix_file(name: str, values: Floats, lines: Ints) -> DataFile:
    """Return a matrix as a file with one layer, whose first row is assumed to be the north."""
    return DataFile(
        "text matrix",
        name,
        {"matrix": values[None]},
        lines=lines,
        south_first=False,
        asks_up=True,
    )


def _without_margins(values: Floats, lines: Ints) -> tuple[Floats, Ints]:
    """Return a matrix without numbers of its rows and columns, and without an empty last column."""
    if values.shape[1] > 1 and np.isnan(values[:, -1]).all():  # a separator ends each line
        values = values[:, :-1]
    ny, nx = values.shape
    columns, rows = values[0, 1:] == np.arange(nx - 1), values[1:, 0] == np.arange(ny - 1)
    if min(ny, nx) > 1 and np.isnan(values[0, 0]) and columns.all() and rows.all():
        return values[1:, 1:], lines[1:]
    if ny >= MIN_NUMBERED and nx > 2 and _counts_up(values[:, 0]) and not _counts_up(values[:, 1]):
        return values[:, 1:], lines
    return values, lines


def _counts_up(column: Sequence[float] | Floats | tuple[str, ...]) -> bool:
    """Return whether the values are whole numbers that follow each other."""
    numbers = np.asarray(column)
    if numbers.dtype.kind != "f" or numbers[0] % 1:
        return False
    return np.array_equal(numbers, numbers[0] + np.arange(len(numbers)))


def _n_numbers_of_columns(lines: list[bytes], marks: _Marks) -> int:
    """Return 1 if the first line numbers the columns of a matrix, as 0, 1, 2 … or V1, V2, …"""

    def counts_up(fields: list[str]) -> bool:
        parts = [re.fullmatch(r"(\D*)(\d{1,6})", field) for field in fields]
        numbers = [float(part[2]) for part in parts if part]
        alike = len({part[1] for part in parts if part}) == 1
        return alike and len(numbers) == len(fields) >= MIN_NUMBERED and _counts_up(numbers)

    first, *following = map(marks.fields, lines[:2])
    numbered = [counts_up(row) or counts_up(row[1:]) for row in (first, *following)]
    return int(numbered == [True, False])


class _Lines(NamedTuple):
    """The lines of a text that are not empty, and their numbers in the file."""

    texts: list[bytes]
    numbers: list[int]

    def after(self, n: int) -> _Lines:
        """Return the lines after the first n."""
        return _Lines(self.texts[n:], self.numbers[n:])


class _Marks(NamedTuple):
    """The separator of fields and the decimal mark."""

    separator: str | None
    decimal: str

    def fields(self, line: bytes) -> list[str]:
        return split_fields(line.decode("utf-8", "replace"), self.separator)


MIN_NUMBERED = 8  # minimum count of successive numbers that are read as row or column numbers
N_SAMPLED_LINES = 20  # number of lines at the start of a text from which its structure is detected


def _n_titles(lines: list[bytes], marks: _Marks) -> int:
    """Return the number of lines above the header with no field except the first."""
    if marks.separator is None:
        return 0
    rows = [marks.fields(line) for line in lines[:N_SAMPLED_LINES]]
    titles = [len(row) < 2 < len(rows[-1]) or (len(row) > 2 and not any(row[1:])) for row in rows]
    return titles.index(False) if False in titles else 0


def _names_above(lines: list[bytes], marks: _Marks) -> tuple[list[str], int]:
    """Return the names of the columns, and the number of lines above the first row."""
    first, *following = map(marks.fields, lines[:3])
    if all(field_number(field, marks.decimal) is not None for field in first):
        return [], 0
    counted = [any(_counts(field, marks.decimal) for field in row) for row in following]
    if counted != [False, True]:
        return first, 1
    return max(first, following[0], key=len), 2


def _matrix_of_names(lines: _Lines, marks: _Marks, name: str) -> DataFile | None:
    """Return a matrix of facies names, which repeats names in its first line, or None."""
    first = marks.fields(lines.texts[0])
    first = first[1:] if first[0].isdecimal() else first  # the number of the row
    if len(lines.texts) < 2 or len(set(first)) == len(first) or len(first) < 2:
        return None
    if any(_counts(field, marks.decimal) for field in first):
        return None
    rows = [marks.fields(line) for line in lines.texts]
    rows = [row[1:] if row[0].isdecimal() else row for row in rows]
    rows = [row[:-1] if row[-1:] == [""] else row for row in rows]
    fields = [field for row in rows for field in row]
    if len({len(row) for row in rows}) > 1 or any(map(is_number, {*fields} - {""})):
        return None
    values, names = numbered(fields, {field for field in fields if is_missing(field)})
    if len(names) > MAX_FACIES:
        return None
    check_cells(name, (len(rows), len(rows[0])))
    line_numbers = np.array(lines.numbers, np.int64)
    file = _matrix_file(name, values.reshape(len(rows), -1), line_numbers)
    return replace(file, labels={"matrix": names})


class _Header(NamedTuple):
    """The column names in a header of several lines, and the number of these lines."""

    names: tuple[str, ...] = ()
    n_lines: int = 0
    missing: tuple[float, ...] = ()
    wrapped: bool = False
    well: str = ""
    separator: str | None = None
    kind: str = "table in text"


PETREL = "Petrel table"
_TYPE_OF_COLUMN = re.compile(r'[A-Z]+(,\s*|\s+(?="))')
"""The type before the name of a column in a Petrel file, as in FLOAT,Porosity or STRING "Well"."""
MAX_OWN_HEADER = 4000  # maximum number of header lines


def _own_header(lines: list[bytes]) -> _Header:
    """Return the header of Petrel points or tops (BEGIN HEADER …) or a well log (~Curve, ~A)."""
    start = [line[:200].decode("utf-8", "replace").strip() for line in lines[:MAX_OWN_HEADER]]
    upper = [line.upper() for line in start]
    if "BEGIN HEADER" in upper[:5] and "END HEADER" in upper:
        first, last = upper.index("BEGIN HEADER") + 1, upper.index("END HEADER")
        names = (_TYPE_OF_COLUMN.sub("", line).strip('"') for line in start[first:last])
        return _Header(tuple(names), last + 1, kind=PETREL)
    starts = "~A", "~LOG_DATA"  # in LAS 3 the second
    data_line = next((k for k, line in enumerate(upper) if line.startswith(starts)), None)
    if data_line is None or not upper[0].startswith("~"):
        return _Header()
    section, curves, entries = "", list[str](), dict[str, tuple[str, str]]()
    for line in start[:data_line]:
        mnemonic = re.split(r"[.\s]", line, maxsplit=1)[0]
        if line.startswith("~"):
            section = "C" if line.upper().startswith("~LOG_DEF") else line[1:2].upper()
        elif section == "C":
            curves.append(mnemonic)
        value, _, remark = line.partition(".")[2].partition(":")
        entries[mnemonic.upper()] = value.strip(), remark.strip()
    null, wrap, version, mark = (entries.get(k, ("",))[0] for k in ("NULL", "WRAP", "VERS", "DLM"))
    return _Header(
        names=tuple(curves or start[data_line].split()[1:]),
        n_lines=data_line + 1,
        missing=(float(null),) if is_number(null) else (),
        wrapped=wrap.upper() == "YES",
        well=entries.get("WELL", ("", ""))[version.startswith("1.")],  # in version 1, the remark
        separator={"COMMA": ",", "TAB": "\t"}.get(mark.upper()),
    )


_DATE_AND_TIME = re.compile(rb"(\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}) (\d{1,2}:\d{2})")


def _unwrapped(lines: _Lines, n: int) -> _Lines:
    """Join the lines of each depth of a wrapped well log, so that each line has n fields."""
    joined, words, start = _Lines([], []), list[bytes](), 0
    for line, number in zip(lines.texts, lines.numbers, strict=True):
        start = start if words else number
        words += line.split()
        if len(words) >= n or number == lines.numbers[-1]:
            joined.texts.append(b" ".join(words))
            joined.numbers.append(start)
            words = []
    return joined


def _filled_lines(content: bytes, name: str) -> tuple[_Lines, str]:
    """Return the non-empty lines, and the last comment before these lines."""
    lines, remark = _Lines([], []), ""
    for k, line in enumerate(content.split(b"\n"), start=1):
        check(f"{name}, line {k}", line_bytes=len(line))
        bare = line.strip(b" \r")
        if not bare.startswith(_COMMENT) and bare.strip():
            lines.texts.append(bare)
            lines.numbers.append(k)
        elif bare.strip() and not lines.texts:
            remark = bare[:2000].lstrip(b"#%/ ").decode("utf-8", "replace")
    return lines, remark


def _fast(body: list[bytes], name: str, n: int, marks: _Marks) -> list[Floats] | None:
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
    complete = len(values) == n * len(body)
    return list(np.ascontiguousarray(values.reshape(-1, n).T)) if complete else None


def _by_field(
    lines: _Lines, name: str, n: int, marks: _Marks, words_allowed: bool
) -> list[Floats | tuple[str, ...]]:
    """Return each column as numbers, NaN for empty fields, or as words."""
    table: list[list[str]] = []
    for line, number in zip(lines.texts, lines.numbers, strict=True):
        fields = marks.fields(line)
        while len(fields) > n and not fields[-1]:
            fields.pop()
        if len(fields) != n:
            raise CCWSIMError(f"{name}, line {number}: {len(fields)} fields, but {n} are needed")
        table.append(fields)
        check(name, fields=len(table) * n)
    columns = []
    for fields in zip(*table, strict=True):
        column = column_of_numbers(fields, marks.decimal)
        if column is None and not words_allowed:
            values = [field_number(field, marks.decimal) for field in fields]
            bad = next(j for j, value in enumerate(values) if value is None or np.isinf(value))
            raise CCWSIMError(not_a_number(name, lines.numbers[bad], fields[bad]))
        columns.append(fields if column is None else column)
    return columns


def not_a_number(name: str, line: int, field: str, counted: str = "line") -> str:
    """Return the error message for a word in a field that must be a number."""
    return f"{name}, {counted} {line}: {field[:30]!r} is not a number; correct it"
