"""Read and write grids in text: SGeMS, GSLIB and Geo-EAS files, and ESRI ASCII grids."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile, distinct_names
from ccwsim.io.formats.text_tables import is_number, numbers_in
from ccwsim.io.limits import MAX_VARIABLES, check_cells, limits
from ccwsim.model.errors import CCWSIMError
from ccwsim.model.grid import Grid

MAX_HEADER_LINE = 1000
"""Maximum number of bytes of a header line."""


def is_gslib(content: bytes) -> bool:
    """Return whether a text starts with a GSLIB header: title or sizes, count, names.

    Examples
    --------
    >>> is_gslib(b"250 250 1\\n1\\nfacies\\n0\\n"), is_gslib(b"x,y,facies\\n1,2,0\\n")
    (True, False)
    """
    lines, _ = _head(content, 3)
    if len(lines) < 2:
        return False
    count = lines[1].split()
    counted = bool(count) and count[0].isdecimal() and not any(map(is_number, count[1:]))
    if _grid_sizes(lines[0]) and counted:
        return True
    sized = len(count) >= 4 and all(map(is_number, count)) and count[0].isdecimal()
    named = len(lines) < 3 or not all(map(is_number, lines[2].replace(",", " ").split() or ["0"]))
    return (counted or sized) and named


def read_gslib(content: bytes, name: str) -> DataFile:
    """Return the grid or table of a GSLIB-like text.

    The text is a grid if line 1 has three to nine numbers (`nx ny nz [sx sy sz [ox oy oz]]`), or
    line 2 has the sizes after the count. The text is a table (points, or a grid of unknown size)
    if line 1 is a title or one number.

    Examples
    --------
    >>> file = read_gslib(b"3 2 1\\n1\\nfacies\\n0\\n0\\n1\\n1\\n1\\n0\\n", "ti.sgems")
    >>> file.variables["facies"].tolist()
    [[[0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]]
    """
    lines, _ = _head(content, 2)
    count = lines[1].split()
    n = int(count[0]) if len(count[0]) < 9 else MAX_VARIABLES + 1
    if not 1 <= n <= MAX_VARIABLES:
        raise CCWSIMError(
            f"{name}, line 2: {count[0][:20]} variables; 1 to {MAX_VARIABLES} are allowed"
        )
    lines, start = _head(content, n + 2)
    if len(lines) < n + 2:
        raise CCWSIMError(f"{name} ends before the {n} variable names that line 2 states")
    names = distinct_names(lines[2:])
    sizes = _grid_sizes(lines[0]) or _grid_sizes(" ".join(count[1:4])) or _sizes_in(lines[0])
    if sizes is None:
        return _table(content, name, names, start, lines[0])
    values = _grid_values(content, name, n, sizes, start)
    extra = [float(word) for word in lines[0].split()[3:]] if _grid_sizes(lines[0]) else []
    cell = (extra[0], extra[1]) if len(extra) >= 3 and min(extra[:2]) > 0 else None
    origin = (extra[3], extra[4]) if cell and len(extra) == 6 else None
    along_z = (extra[2], extra[5] if origin else 0.0) if cell and extra[2] > 0 else None
    grids = dict(zip(names, values, strict=True))
    file = DataFile("SGeMS/GSLIB grid", name, grids)
    return replace(file, cell_size=cell, origin=origin, along_z=along_z)


def grid_as_bytes(
    columns: Sequence[NDArray], names: Sequence[str], grid: Grid | None = None
) -> bytes:
    """Return grids of shape (ny, nx) or (nz, ny, nx) as an SGeMS text, row 0 at the south.

    If the cell size is not 1 or the origin is not 0, line 1 is `nx ny nz sx sy sz ox oy oz`, with
    cell size s and origin o, as in files of geone and DeeSse.

    Examples
    --------
    >>> grid_as_bytes([np.array([[0, 1], [1, 1]])], ["facies"])
    b'2 2 1\\n1\\nfacies\\n0\\n1\\n1\\n1\\n'
    >>> placed = Grid(1, 2, cell_size=(10.0, 5.0), origin=(350000.0, 4505000.0))
    >>> grid_as_bytes([np.array([[0, 1]])], ["facies"], placed)
    b'2 1 1 10.0 5.0 1 350000.0 4505000.0 0\\n1\\nfacies\\n0\\n1\\n'
    """
    nz, ny, nx = (1, *columns[0].shape)[-3:]
    place = ""
    if grid is not None and ({*grid.cell_size}, {*grid.origin}) != ({1.0}, {0.0}):
        sizes, origin = (*map(repr, grid.cell_size), "1")[:3], (*map(repr, grid.origin), "0")[:3]
        place = f" {' '.join(sizes)} {' '.join(origin)}"
    table = np.stack([column.ravel() for column in columns], axis=1)
    codes, indices = np.unique(table, return_inverse=True)
    width = max(len(str(code)) for code in codes)
    padded = "".join(f"{code:>{width}} " for code in codes.tolist()).encode()
    words = np.frombuffer(padded, np.uint8).reshape(len(codes), width + 1)
    text = words[indices.reshape(table.shape)]
    text[:, -1, -1] = ord("\n")
    header = "\n".join([f"{nx} {ny} {nz}{place}", str(len(names)), *names, ""])
    return header.encode() + text.tobytes()


def _head(content: bytes, n: int) -> tuple[list[str], int]:
    """Return the first n lines (fewer if a line is too long) and the position of the next line."""
    lines: list[str] = []
    at = 0
    while len(lines) < n and at < len(content):
        end = content.find(b"\n", at, at + MAX_HEADER_LINE)
        if end < 0 and len(content) - at > MAX_HEADER_LINE:
            break
        end = end if end >= 0 else len(content)
        lines.append(content[at:end].decode("utf-8", "replace").strip())
        at = end + 1
    return lines, min(at, len(content))


def _grid_sizes(line: str) -> tuple[int, int, int] | None:
    words = line.split()
    if not 3 <= len(words) <= 9 or not all(map(is_number, words)):
        return None
    numbers = [float(word) for word in words]
    nx, ny, nz = numbers[:3]
    if not np.isfinite(numbers).all() or any(n != int(n) or n > 1e15 for n in (nx, ny, nz)):
        return None
    return int(nx), int(ny), int(nz)


def _sizes_in(title: str) -> tuple[int, int, int] | None:
    """Return the sizes in a title such as "channels (250x250x1)", as SGeMS writes it."""
    sizes = re.search(r"\((\d{1,6}) ?[xX×] ?(\d{1,6})(?: ?[xX×] ?(\d{1,6}))?\)", title)
    return (int(sizes[1]), int(sizes[2]), int(sizes[3] or 1)) if sizes else None


def _grid_values(
    content: bytes, name: str, n: int, sizes: tuple[int, int, int], start: int
) -> NDArray[np.float64]:
    nx, ny, nz = sizes
    promised = check_cells(name, (n, nz, ny, nx))
    values = numbers_in(content, name, start=start, first_line=n + 3)
    if len(values) != promised:
        raise CCWSIMError(
            f"{name} states {nx} × {ny} × {nz} cells of {n} variables, which are {promised} "
            f"values, but {len(values)} follow; correct the header or get the complete file"
        )
    return np.ascontiguousarray(values.reshape(-1, n).T).reshape(n, nz, ny, nx)


def _table(content: bytes, name: str, names: list[str], start: int, title: str) -> DataFile:
    n = len(names)
    values = numbers_in(content, name, start=start, first_line=n + 3)
    if not len(values) or len(values) % n:
        raise CCWSIMError(f"{name}: {len(values)} values do not fill rows of {n} columns")
    rows = values.reshape(-1, n)
    if title.isdecimal() and len(title) < 9 and n > 1 and len(rows) < int(title):
        raise CCWSIMError(f"{name} states {title} points in line 1, but {len(rows)} follow")
    few = len(rows) <= limits().points and content.count(b"\n") <= 3 * limits().points
    lines = _line_numbers(content, name, start, n) if few else None
    columns = dict(zip(names, np.ascontiguousarray(rows.T), strict=True))
    return DataFile("GSLIB/Geo-EAS table", name, columns, is_table=True, lines=lines)


def _line_numbers(content: bytes, name: str, start: int, n: int) -> NDArray[np.int64]:
    """Return the line number of each row; raise an error if a line does not have n numbers."""
    counts = np.array([len(line.split()) for line in content[start:].split(b"\n")])
    numbers = np.flatnonzero(counts) + n + 3
    filled = counts[counts > 0]
    bad = numbers[filled != n]
    if n > 1 and len(bad):
        raise CCWSIMError(f"{name}, line {bad[0]}: {n} numbers are needed in every line")
    return np.repeat(numbers, filled // n)


MAX_ESRI_HEADER = 4096  # maximum number of bytes of a line
MAX_HEADER_LINES = 100
_ORIGINS = ("xllcorner", "yllcorner", "xllcenter", "yllcenter")
_KEYS = ("ncols", "nrows", *_ORIGINS, "cellsize", "dx", "dy", "nodata_value")


def is_esri(content: bytes) -> bool:
    """Return whether a text starts with `ncols` or `nrows`.

    Examples
    --------
    >>> is_esri(b"NCOLS 4\\nNROWS 3\\n")
    True
    """
    return content[:64].lstrip()[:5].lower() in (b"ncols", b"nrows")


def read_esri(content: bytes, name: str) -> DataFile:
    """Return the grid of an ESRI ASCII text; its first row is the north.

    Examples
    --------
    >>> file = read_esri(b"ncols 2\\nnrows 1\\ncellsize 5\\nNODATA_value -1\\n0 1\\n", "a.asc")
    >>> file.variables["grid"].tolist(), file.cell_size, file.missing
    ([[[0.0, 1.0]]], (5.0, 5.0), (-1.0,))
    """
    if b"," in content:  # decimal commas
        content = content.replace(b",", b".")
    content = re.sub(rb"(?i)\b(null|na|n/a)\b", b"nan", content)
    header, start, line = _header(content, name)
    if "ncols" not in header or "nrows" not in header:
        raise CCWSIMError(f"{name}: the header must contain ncols and nrows")
    shape = (int(header["nrows"]), int(header["ncols"]))
    check_cells(name, shape)
    values = numbers_in(content, name, start=start, first_line=line)
    if len(values) != shape[0] * shape[1]:
        raise CCWSIMError(
            f"{name} states {shape[0]} rows of {shape[1]} cells, but {len(values)} values follow"
        )
    side = header.get("cellsize", 1.0)
    cell = header.get("dx", side), header.get("dy", side)
    if min(cell) <= 0:
        raise CCWSIMError(f"{name}: the cell size {min(cell):g} must be positive")
    origin = header.get("xllcorner", 0.0), header.get("yllcorner", 0.0)
    if "xllcenter" in header and "yllcenter" in header:
        origin = (header["xllcenter"] - cell[0] / 2, header["yllcenter"] - cell[1] / 2)
    missing = (header["nodata_value"],) if "nodata_value" in header else ()
    grid = {"grid": values.reshape(1, *shape)}
    file = DataFile("ESRI ASCII grid", name, grid, south_first=False, missing=missing)
    return replace(file, cell_size=cell, origin=origin)


def _header(content: bytes, name: str) -> tuple[dict[str, float], int, int]:
    header: dict[str, float] = {}
    at, line = 0, 1
    while at < len(content):
        if line > MAX_HEADER_LINES:
            raise CCWSIMError(f"{name}: the header exceeds {MAX_HEADER_LINES} lines; correct it")
        end = content.find(b"\n", at, at + MAX_ESRI_HEADER)
        end = end if end >= 0 else min(len(content), at + MAX_ESRI_HEADER)
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
