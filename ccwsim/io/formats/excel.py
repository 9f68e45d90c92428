"""Read the first sheet of an Excel workbook as a table."""

from __future__ import annotations

from io import BytesIO

from ccwsim.io.archive import opened_archive
from ccwsim.io.data_file import DataFile, broken, optional_package
from ccwsim.io.formats.text_tables import read_delimited
from ccwsim.io.limits import limits
from ccwsim.model.errors import CCWSIMError

SEPARATOR = "\t"
"""Separator of the cells in the text that a sheet becomes."""


def is_excel(content: bytes) -> bool:
    """Return whether a zip file contains a workbook."""
    return b"xl/workbook.xml" in content


def read_excel(content: bytes, name: str) -> DataFile:
    """Return the first sheet that has values, read like a text with the same cells."""
    openpyxl = optional_package("openpyxl", "Excel files", "ccwsim[files]")
    with opened_archive(content, name) as archive:
        archive.check(list(archive.infos))
    with broken(f"{name}: the workbook cannot be read", remedy="save it as CSV"):
        book = openpyxl.load_workbook(BytesIO(content), read_only=True, data_only=True)
        for sheet in book.worksheets:
            rows: list[bytes] = []
            for row in sheet.iter_rows(values_only=True, max_row=limits().lines):
                fields = ["" if v is None else " ".join(str(v).split()) for v in row]
                rows.append(SEPARATOR.join(fields).encode() if any(fields) else b"")
            if any(rows):
                return read_delimited(b"\n".join(rows) + b"\n", name)
    raise CCWSIMError(f"{name}: the workbook has no values")
