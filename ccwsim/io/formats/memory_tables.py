"""Read tables in memory like files: DataFrames, dicts of columns and structured arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile, distinct_names
from ccwsim.io.formats.text_tables import UNKNOWN, is_number
from ccwsim.model.arrays import as_array
from ccwsim.model.errors import CCWSIMError, shown

NAME = "the table"
"""Name of a table in messages."""


def read_memory_table(table: Any) -> DataFile:
    """Return the columns of a table for which `is_table` is true.

    Columns of numbers are taken as they are. Other columns are texts, in which None and the missing
    values of pandas are empty; if all texts are numbers, the column is a column of numbers.

    Examples
    --------
    >>> file = read_memory_table({"Easting": [5, 15], "lith": ["sand", None]})
    >>> file.variables["Easting"], file.words
    (array([ 5., 15.]), {'lith': ('sand', '')})
    """
    keys = list(table.dtype.names) if hasattr(getattr(table, "dtype", None), "names") else []
    keys = keys or list(table if isinstance(table, Mapping) else table.columns)
    if not keys:
        raise CCWSIMError(f"{NAME} has no columns; give columns x, y and facies")
    columns = [_values_of(table[key]) for key in keys]
    n = len(columns[0]) if columns[0].ndim else 0
    names = distinct_names([str(key) for key in keys])
    variables, words = dict[str, NDArray](), dict[str, tuple[str, ...]]()
    for name, column in zip(names, columns, strict=True):
        if column.shape != (n,):
            raise CCWSIMError(
                f"{NAME}: column {shown(name)} has the shape {column.shape}, not ({n},); columns "
                "need one value for each row, and different names"
            )
        if column.dtype.kind in "buif":
            variables[name] = column.astype(np.float64)
            continue
        texts = tuple(_text_of(value) for value in column.tolist())
        given = [text for text in texts if text.lower() not in UNKNOWN]
        if given and all(map(is_number, given)):
            variables[name] = np.array([float(t) if is_number(t) else np.nan for t in texts])
        else:
            words[name] = texts
    if not n:
        raise CCWSIMError(f"{NAME} has no rows; give at least one datum")
    lines = np.arange(1, n + 1)
    kinds = {"is_table": True, "lines": lines, "counted": "row", "columns": tuple(names)}
    return DataFile("table", NAME, variables, words=words, **kinds)


def _values_of(column: Any) -> NDArray:
    """Return the values of a column; masked values are missing."""
    if isinstance(column, np.ma.MaskedArray):
        is_real = column.dtype.kind in "buif"
        column = np.ma.filled(column.astype(float if is_real else object), np.nan)
    return as_array(column, NAME)


def _text_of(value: Any) -> str:
    """Return a value of a column as text; missing values are empty."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    return "" if text in ("None", "nan", "NaN", "<NA>", "NaT") else text.strip()
