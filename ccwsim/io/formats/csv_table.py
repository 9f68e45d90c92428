"""Write tables as CSV that spreadsheets show as it is."""

import csv
from collections.abc import Iterable
from io import StringIO

from ccwsim.io.formats.text_tables import is_number

FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")  # a spreadsheet takes such a text for a formula


def csv_as_bytes(head: Iterable[object], lines: Iterable[Iterable[object]]) -> bytes:
    """Return a table as CSV; texts that a spreadsheet would compute begin with an apostrophe."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\r\n")  # so that it quotes texts with either of them
    writer.writerows([_cell(value) for value in line] for line in (head, *lines))
    return text.getvalue().replace("\r\n", "\n").encode()


def _cell(value: object) -> object:
    is_formula = isinstance(value, str) and value.startswith(FORMULA) and not is_number(value)
    return f"'{value}" if is_formula else value
