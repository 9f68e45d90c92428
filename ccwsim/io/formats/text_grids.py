"""Read and write grids in text: SGeMS, GSLIB and Geo-EAS files, and ESRI ASCII grids."""

import re
from collections.abc import Sequence
from itertools import takewhile
from typing import NamedTuple

import numpy as np

from ccwsim import CCWSIMError, Grid
from ccwsim.io.data_file import DataFile, distinct_names, printable
from ccwsim.io.formats.text_tables import is_number, numbers_in
from ccwsim.io.limits import check, check_cells, limits
from ccwsim.model import Array, Floats, Ints, refused

_IN_TITLE = re.compile(r"\((\d{1,6}) ?[xX×] ?(\d{1,6})(?: ?[xX×] ?(\d{1,6}))?\)")
"""Sizes in a title such as "channels (250x250x1)", as SGeMS writes it."""
MAX_HEADER_LINE = 1000  # maximum number of bytes of a header line


def is_gslib(content: bytes) -> bool:
    """Return whether a text starts with a GSLIB header, perhaps after empty lines."""
    return _has_header(content) or _has_header(content.lstrip())


def _has_header(content: bytes) -> bool:
    """Return whether a text starts with a GSLIB header: title or sizes, count, names."""
    lines, _ = _head(content, 3)
    if len(lines) < 2:
        return False
    words = lines[1].split()
    if not words or not words[0].isdecimal():
        return False
    counted = not any(map(is_number, words[1:]))
    if _grid_sizes(lines[0]) and counted:
        return True
    sized = len(_leading_numbers(lines[1])) >= 4
    named = len(lines) < 3 or not all(map(is_number, lines[2].replace(",", " ").split() or ["0"]))
    return (counted or sized) and named


def read_gslib(content: bytes, name: str) -> DataFile:
    """Return the grid (sizes in the first two lines) or table of a GSLIB-like text."""
    content = content if _has_header(content) else content.lstrip()
    lines, _ = _head(content, 2)
    count = lines[1].split()
    n = int(count[0][:9])
    check(f"{name}, line 2", variables=n)
    lines, start = _head(content, n + 2)
    if len(lines) < n + 2:
        raise CCWSIMError(f"{name} ends before the {n} variable names that line 2 states")
    names = distinct_names(lines[2:])
    size = _size_of(lines)
    if size is None:
        return _table(content, name, names, start, lines[0])
    grids = _grid_variables(content, name, names, size, start)
    return DataFile("SGeMS/GSLIB grid", name, grids).at(size.cell, size.corner)


def grid_as_bytes(
    columns: Sequence[Array], names: Sequence[str], grid: Grid | None = None
) -> bytes:
    """Return grids as an SGeMS text, row 0 at the south, with size and origin as in DeeSse."""
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
    position = 0
    while len(lines) < n and position < len(content):
        end = content.find(b"\n", position, position + MAX_HEADER_LINE)
        if end < 0 and len(content) - position > MAX_HEADER_LINE:
            break
        end = end if end >= 0 else len(content)
        lines.append(content[position:end].decode("utf-8", "replace").strip())
        position = end + 1
    return lines, min(position, len(content))


def _grid_sizes(line: str) -> tuple[int, int, int] | None:
    words = line.split()
    if not 3 <= len(words) <= 10 or not all(map(is_number, words)):
        return None
    numbers = [float(word) for word in words]
    nx, ny, nz = numbers[:3]
    if any(n % 1 != 0 or n > 1e15 for n in (nx, ny, nz)):
        return None
    return int(nx), int(ny), int(nz)


class _Size(NamedTuple):
    """The numbers of a GSLIB header: cells along x, y and z, cell size, and corner of the grid."""

    sides: tuple[int, int, int]
    cell: list[float]
    corner: list[float]
    n_realizations: int = 1


def _size_of(lines: list[str]) -> _Size | None:
    """Return the size in line 1, after the count in line 2, or in the title."""
    in_first = _grid_sizes(lines[0])
    numbers = _leading_numbers(lines[0]) if in_first else _leading_numbers(lines[1])[1:]
    n_triples, left = divmod(len(numbers), 3)
    cell, corner, *_ = [*(numbers[k : k + 3] for k in range(3, 3 * n_triples, 3)), [], []]
    if not in_first:  # programs of GSLIB write the centre of the first cell before its size
        centre, cell = cell, corner
        corner = [c - s / 2 for c, s in zip(centre, cell, strict=False)]
    if sides := in_first or _grid_sizes(" ".join(map(str, numbers[:3]))):
        stacked = left == 1 and numbers[-1] % 1 == 0  # a last number counts realizations
        return _Size(sides, cell, corner, int(numbers[-1]) if stacked else 1)
    sizes = _IN_TITLE.search(lines[0])
    return _Size((int(sizes[1]), int(sizes[2]), int(sizes[3] or 1)), [], []) if sizes else None


def _leading_numbers(line: str) -> list[float]:
    """Return the numbers at the start of a line."""
    return [float(word) for word in takewhile(is_number, line.split())]


def _grid_variables(
    content: bytes, name: str, names: list[str], size: _Size, start: int
) -> dict[str, Floats]:
    """Return the variables of a grid; realizations follow each other in the file."""
    nx, ny, nz = size.sides
    n = size.n_realizations
    promised = check_cells(name, (n * len(names), nz, ny, nx))
    values = numbers_in(content, name, start=start, first_line=len(names) + 3)
    if n * len(values) == promised:  # the last number of the header is not their count
        n = 1
    elif len(values) != promised:
        raise CCWSIMError(
            f"{name} states {nx} × {ny} × {nz} cells of {len(names)} variables, which are "
            f"{promised} values, but {len(values)} follow; correct the header or get the complete "
            "file"
        )
    stack = np.moveaxis(values.reshape(n, nz, ny, nx, -1), -1, 1).reshape(-1, nz, ny, nx)
    if n > 1:
        names = [f"{label} ({k})" for k in range(1, n + 1) for label in names]
    return dict(zip(names, np.ascontiguousarray(stack), strict=True))


def _table(content: bytes, name: str, names: list[str], start: int, title: str) -> DataFile:
    n = len(names)
    values = numbers_in(content, name, start=start, first_line=n + 3)
    if not n or not len(values) or len(values) % n:
        raise CCWSIMError(f"{name}: {len(values)} values do not fill rows of {n} columns")
    rows = values.reshape(-1, n)
    if title.isdecimal() and len(title) < 9 and n > 1 and len(rows) < int(title):
        raise CCWSIMError(f"{name} states {title} points in line 1, but {len(rows)} follow")
    few = len(rows) <= limits().points and content.count(b"\n") <= 3 * limits().points
    lines = _line_numbers(content, name, start, n) if few else None
    columns = dict(zip(names, np.ascontiguousarray(rows.T), strict=True))
    return DataFile("GSLIB/Geo-EAS table", name, columns, is_table=True, lines=lines)


def _line_numbers(content: bytes, name: str, start: int, n: int) -> Ints:
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
_ALIASES = {"xdim": "dx", "ydim": "dy", "nodata": "nodata_value"}  # entries of ESRI headers


def read_esri(content: bytes, name: str) -> DataFile:
    """Return the grid of an ESRI ASCII text; its first row is the north."""
    if b"," in content:  # decimal commas
        content = content.replace(b",", b".")
    content = re.sub(rb"(?i)\b(null|na|n/a)\b", b"nan", content)
    header, start, line = _header(content, name)
    if "ncols" not in header or "nrows" not in header:
        raise CCWSIMError(f"{name}: the header must contain ncols and nrows")
    check_cells(name, (header["nrows"], header["ncols"]))
    shape = int(header["nrows"]), int(header["ncols"])
    values = numbers_in(content, name, start=start, first_line=line)
    if len(values) != shape[0] * shape[1]:
        raise refused("rows_missing", name=name, rows=shape[0], columns=shape[1], there=len(values))
    side = header.get("cellsize", 1.0)
    cell = header.get("dx", side), header.get("dy", side)
    origin = (
        header.get("xllcorner", header.get("xllcenter", cell[0] / 2) - cell[0] / 2),
        header.get("yllcorner", header.get("yllcenter", cell[1] / 2) - cell[1] / 2),
    )
    missing = (header["nodata_value"],) if "nodata_value" in header else ()
    grid = {"grid": values.reshape((1, *shape))}
    file = DataFile("ESRI ASCII grid", name, grid, south_first=False, missing=missing)
    return file.at(cell, origin)


def _header(content: bytes, name: str) -> tuple[dict[str, float], int, int]:
    header: dict[str, float] = {}
    position, line = 0, 1
    while position < len(content):
        if line > MAX_HEADER_LINES:
            raise CCWSIMError(f"{name}: the header exceeds {MAX_HEADER_LINES} lines; correct it")
        end = content.find(b"\n", position, position + MAX_ESRI_HEADER)
        end = end if end >= 0 else min(len(content), position + MAX_ESRI_HEADER)
        words = content[position:end].decode("latin-1").replace(":", " ").replace("=", " ").split()
        if words and (is_number(words[0]) or not words[0][0].isalpha()):
            break
        if words and words[-1].upper() not in ("LSBFIRST", "MSBFIRST"):
            if len(words) != 2 or not is_number(words[1]):
                entry = printable(words[0], 30)
                raise CCWSIMError(f"{name}, line {line}: {entry} needs one number")
            key = words[0].lower()
            header[_ALIASES.get(key, key)] = float(words[1])
        position, line = end + 1, line + 1
    return header, position, line
