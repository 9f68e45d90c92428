"""ESRI ASCII grids (.asc): a few named sizes, then rows from the north."""

from __future__ import annotations

from ccwsim.io.data_file import DataFile
from ccwsim.io.formats.numbers import is_number, numbers_in
from ccwsim.io.limits import check_cells
from ccwsim.model.errors import CCWSIMError

MAX_HEADER = 4096
"""Bytes of a line of the header."""

MAX_HEADER_LINES = 100
_KEYS = (
    "ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx", "dy",
    "nodata_value",
)  # fmt: skip


def is_esri(content: bytes) -> bool:
    """Return whether a text starts with `ncols` or `nrows`.

    Examples
    --------
    >>> is_esri(b"NCOLS 4\\nNROWS 3\\n")
    True
    """
    return content[:64].lstrip()[:5].lower() in (b"ncols", b"nrows")


def read_esri(content: bytes, name: str) -> DataFile:
    """Return the grid of an ESRI ASCII text, rows from the north.

    Raises
    ------
    CCWSIMError
        For sizes that are missing, absurd, or do not fit the values.

    Examples
    --------
    >>> file = read_esri(b"ncols 2\\nnrows 1\\ncellsize 5\\nNODATA_value -1\\n0 1\\n", "a.asc")
    >>> file.variables["grid"].tolist(), file.cell_size, file.missing
    ([[[0.0, 1.0]]], (5.0, 5.0), (-1.0,))
    """
    header, start, line = _header(content, name)
    if "ncols" not in header or "nrows" not in header:
        raise CCWSIMError(f"{name}: the header must say ncols and nrows")
    shape = (int(header["nrows"]), int(header["ncols"]))
    check_cells(name, shape)
    values = numbers_in(content, name, start=start, first_line=line)
    if len(values) != shape[0] * shape[1]:
        raise CCWSIMError(
            f"{name} promises {shape[0]} rows of {shape[1]}, but {len(values)} values follow"
        )
    cell = _pair(header, ("dx", "dy"), header.get("cellsize", 1.0))
    if min(cell) <= 0:
        raise CCWSIMError(f"{name}: the cell size {min(cell):g} must be positive")
    origin = _pair(header, ("xllcorner", "yllcorner"), 0.0)
    if "xllcenter" in header and "yllcenter" in header:
        origin = (header["xllcenter"] - cell[0] / 2, header["yllcenter"] - cell[1] / 2)
    missing = (header["nodata_value"],) if "nodata_value" in header else (-9999.0,)
    return DataFile(
        "ESRI ASCII grid", name, {"grid": values.reshape(1, *shape)},
        south_first=False, missing=missing, cell_size=cell, origin=origin,
    )  # fmt: skip


def _header(content: bytes, name: str) -> tuple[dict[str, float], int, int]:
    header: dict[str, float] = {}
    at, line = 0, 1
    while at < len(content):
        if line > MAX_HEADER_LINES:
            raise CCWSIMError(f"{name}: more than {MAX_HEADER_LINES} lines of header; mend it")
        end = content.find(b"\n", at, at + MAX_HEADER)
        end = end if end >= 0 else min(len(content), at + MAX_HEADER)
        words = content[at:end].decode("latin-1").split()
        if words and words[0].lower() not in _KEYS:
            break
        if words:
            header[words[0].lower()] = _value(name, line, words)
        at, line = end + 1, line + 1
    return header, at, line


def _value(name: str, line: int, words: list[str]) -> float:
    key, value = words[0].lower(), words[1] if len(words) == 2 else ""
    if not is_number(value) or (key != "nodata_value" and not abs(float(value)) < 1e15):
        raise CCWSIMError(f"{name}, line {line}: {words[0]} needs one number")
    value = float(value)
    if key in ("ncols", "nrows") and value != int(value):
        raise CCWSIMError(f"{name}, line {line}: {words[0]} must be a whole number, not {value:g}")
    return value


def _pair(header: dict[str, float], keys: tuple[str, str], default: float) -> tuple[float, float]:
    return header.get(keys[0], default), header.get(keys[1], default)
