"""Write tables as CSV that spreadsheets show as it is."""

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from io import StringIO

from ccwsim.io.formats.text_tables import is_number

# Positions where a spreadsheet begins a formula; many divide lines at semicolons and tabs too.
FORMULA = re.compile(r"(?:^|(?<=;)|(?<=.\t))(?=[=+\-@\t\r\n＝＋－＠])")


def csv_as_bytes(head: Iterable[object], lines: Iterable[Iterable[object]]) -> bytes:
    """Return a table as CSV; texts that a spreadsheet would compute begin with an apostrophe."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\r\n")  # texts with CR or LF are then quoted
    writer.writerows([_cell(value) for value in line] for line in (head, *lines))
    return text.getvalue().replace("\r\n", "\n").encode()


def records_as_csv(records: Sequence[Mapping[str, object]]) -> bytes:
    """Return records with equal keys as CSV; floating-point numbers have six digits."""
    lines = (
        [f"{value:.6g}" if isinstance(value, float) else value for value in record.values()]
        for record in records
    )
    return csv_as_bytes(records[0] if records else (), lines)


def _cell(value: object) -> object:
    if isinstance(value, str) and not is_number(value):
        return FORMULA.sub("'", value)
    return value
