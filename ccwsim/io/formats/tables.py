"""Make tables of columns, and read tables in memory and the first sheet of an Excel workbook."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from io import BytesIO
from typing import Any

import numpy as np

from ccwsim.io.archive import opened_archive
from ccwsim.io.data_file import DataFile, broken, distinct_names
from ccwsim.io.formats.text_tables import column_of_numbers, read_delimited
from ccwsim.io.hard_data.columns import is_points
from ccwsim.io.limits import check_table, limits
from ccwsim.model import Array, CCWSIMError, Ints, as_array, needs, refused, shown

UNNAMED_TABLE = "the table"  # name of a table in messages


def read_memory_table(table: Any) -> DataFile:
    """Return the columns of a table for which `is_table` is true."""
    keys = list(table.dtype.names) if hasattr(getattr(table, "dtype", None), "names") else []
    keys = keys or list(table if isinstance(table, Mapping) else table.columns)
    if not keys:
        raise CCWSIMError(f"{UNNAMED_TABLE} has no columns; give columns x, y and facies")
    columns = [_values_of(table[key]) for key in keys]
    n = len(columns[0]) if columns[0].ndim else 0
    for key, column in zip(keys, columns, strict=True):
        if column.shape != (n,):
            raise refused(
                "column_shape", name=UNNAMED_TABLE, key=shown(key), shape=column.shape, n=n
            )
    return make_table("table", UNNAMED_TABLE, keys, columns, np.arange(1, n + 1))


def make_table(
    kind: str,
    name: str,
    keys: Sequence[object],
    columns: Iterable[Array],
    lines: Ints,
    counted: str = "row",
) -> DataFile:
    """Return columns as a table; columns of other types are texts, unless all are numbers."""
    check_table(name, len(lines), len(keys))
    names = distinct_names([str(key) for key in keys])
    variables, words = dict[str, Array](), dict[str, tuple[str, ...]]()
    for label, column in zip(names, columns, strict=True):
        if column.dtype.kind in "buif":
            variables[label] = column.astype(np.float64)
            continue
        texts = tuple(_text_of(value) for value in column.tolist())
        numbers = column_of_numbers(texts) if any(texts) else None
        if numbers is None:
            words[label] = texts
        else:
            variables[label] = numbers
    table = DataFile(kind, name, variables, is_table=True, lines=lines, counted=counted)
    return replace(table, words=words, columns=tuple(names))


def _values_of(column: Any) -> Array:
    """Return the values of a column; masked values are missing."""
    if isinstance(column, np.ma.MaskedArray):
        is_real = column.dtype.kind in "buif"
        column = np.ma.filled(column.astype(float if is_real else object), np.nan)
    return as_array(column, UNNAMED_TABLE)


def _text_of(value: Any) -> str:
    """Return a value of a column as short text; missing values are empty."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return "" if text in ("None", "nan", "NaN", "<NA>", "NaT") else text[:200].strip()


SEPARATOR = "\t"  # separator of the cells in the text that a sheet becomes


def is_excel(content: bytes) -> bool:
    """Return whether a zip file contains a workbook."""
    return b"xl/workbook.xml" in content


def read_excel(content: bytes, name: str) -> DataFile:
    """Return the first sheet with coordinates, or else with values, read like a text."""
    openpyxl = needs("openpyxl")
    with opened_archive(content, name) as archive:
        archive.check(list(archive.infos))
    with broken(f"{name}: the workbook cannot be read", remedy="save it as CSV"):
        book = openpyxl.load_workbook(BytesIO(content), read_only=True, data_only=True)
        texts: list[bytes] = []
        for sheet in book.worksheets:
            rows: list[bytes] = []
            for row in sheet.iter_rows(values_only=True, max_row=limits().lines):
                fields = ["" if v is None else " ".join(str(v).split()) for v in row]
                rows.append(SEPARATOR.join(fields).encode() if any(fields) else b"")
            texts += [b"\n".join(rows) + b"\n"] if any(rows) else []
    if not texts:
        raise CCWSIMError(f"{name}: the workbook has no values")
    tables: list[DataFile] = []
    for text in texts[1:] and texts:  # a cover or a legend may be no table
        with suppress(CCWSIMError):
            tables.append(read_delimited(text, name))
    first = tables[0] if tables else read_delimited(texts[0], name)
    return next((table for table in tables if is_points(list(table.names))), first)
