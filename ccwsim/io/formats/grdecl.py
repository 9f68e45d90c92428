"""Read grids of reservoir programs: Eclipse GRDECL and IRAP ASCII."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from ccwsim.io.data_file import DataFile
from ccwsim.io.formats.text_tables import numbers_in
from ccwsim.io.limits import MAX_VARIABLES, check_cells
from ccwsim.model.errors import CCWSIMError

_KEYWORD = re.compile(rb"^[ \t]*([A-Za-z][A-Za-z0-9_+-]{0,31})[ \t]*\r?$", re.MULTILINE)
_SIZES = re.compile(rb"^[ \t]*(SPECGRID|DIMENS)\s+(\d{1,6})\s+(\d{1,6})\s+(\d{1,6})", re.M | re.I)
_REPEATED = re.compile(rb"(\d{1,9})\*(\S*)")
_NOT_VARIABLES = ("COORD", "ZCORN", "COORDSYS", "MAPAXES", "MAPUNITS", "GRIDUNIT", "GDORIENT")
IRAP_MARK = -996
"""First number of an IRAP ASCII grid."""
IRAP_UNKNOWN = 9999900.0
"""Value of an unknown cell in an IRAP ASCII grid."""


def is_grdecl(content: bytes) -> bool:
    """Return whether a text has the grid size of an Eclipse file.

    Examples
    --------
    >>> is_grdecl(b"SPECGRID\\n 2 1 1 1 F /\\n")
    True
    """
    return _SIZES.search(_bare(content[:65536])) is not None


def read_grdecl(content: bytes, name: str) -> DataFile:
    """Return the properties of an Eclipse file whose keywords have one value per cell.

    Rows run from the north and layers from the top, as reservoir programs number J and K.

    Examples
    --------
    >>> file = read_grdecl(b"DIMENS\\n 2 1 1 /\\nFACIES\\n 2*1 /\\n", "a.grdecl")
    >>> file.variables["FACIES"].tolist()
    [[[1.0, 1.0]]]
    """
    content = _bare(content)
    sizes = _SIZES.search(content)
    if sizes is None:
        raise CCWSIMError(f"{name} has no SPECGRID or DIMENS; add the size of the grid")
    nx, ny, nz = (int(size) for size in sizes.groups()[1:])
    n, variables = check_cells(name, (nz, ny, nx)), {}
    for n_keywords, keyword in enumerate(_KEYWORD.finditer(content), start=1):
        if n_keywords > MAX_VARIABLES:
            raise CCWSIMError(f"{name}: more than {MAX_VARIABLES} keywords; save fewer")
        key = keyword[1].decode().upper()
        end = content.find(b"/", keyword.end())
        if key in (*_NOT_VARIABLES, "SPECGRID", "DIMENS") or end < 0:
            continue
        values = _values(content[keyword.end() : end], n, name, key)
        if values is not None:
            check_cells(name, (len(variables) + 1, nz, ny, nx))
            variables[key] = values.reshape(nz, ny, nx)[::-1]
    if not variables:
        raise CCWSIMError(f"{name} has no keyword with {n} values, one per cell")
    return DataFile("Eclipse GRDECL", name, variables, south_first=False)


def is_irap(content: bytes) -> bool:
    """Return whether a text starts like an IRAP ASCII grid.

    Examples
    --------
    >>> is_irap(b"-996 30 10.0 10.0\\n")
    True
    """
    return content.lstrip()[:5].split() == [str(IRAP_MARK).encode()]


def read_irap(content: bytes, name: str) -> DataFile:
    """Return the values of an IRAP ASCII grid, whose nodes are the centres of cells.

    Examples
    --------
    >>> text = b"-996 1 10 10\\n5 15 5 5\\n2 0 5 5\\n0 0 0 0 0 0 0\\n0 1\\n"
    >>> file = read_irap(text, "a.irap")
    >>> file.variables["grid"].tolist(), file.origin
    ([[[0.0, 1.0]]], (0.0, 0.0))
    """
    values = numbers_in(content, name)
    if len(values) < 19:
        raise CCWSIMError(f"{name}: the header is incomplete; get the complete file")
    n = check_cells(name, (float(values[1]), float(values[8])))
    ny, nx, dx, dy = int(values[1]), int(values[8]), float(values[2]), float(values[3])
    if len(values) != n + 19 or values[9]:
        raise CCWSIMError(
            f"{name}: {n} values of a grid without rotation are needed, but the file has "
            f"{max(len(values) - 19, 0)} values and a rotation of {values[9]:g}°"
        )
    origin = float(values[4]) - dx / 2, float(values[6]) - dy / 2
    grid = {"grid": values[19:].reshape(1, ny, nx)}
    file = DataFile("IRAP ASCII grid", name, grid, missing=(IRAP_UNKNOWN,))
    return file.at((dx, dy), origin)


def _bare(content: bytes) -> bytes:
    """Return a text without comments."""
    return re.sub(rb"--[^\n]*", b"", content)


def _values(text: bytes, n: int, name: str, key: str) -> NDArray[np.float64] | None:
    """Return the n values of a keyword with repeat counts; None for another number of values."""
    words = text.split()
    if not words or len(words) > n:
        return None
    counts, plain = [], []
    for word in words:
        repeated = _REPEATED.fullmatch(word)
        counts.append(int(repeated[1]) if repeated else 1)
        plain.append(repeated[2] or b"nan" if repeated else word)
    if sum(counts) != n:
        return None
    return np.repeat(numbers_in(b" ".join(plain), f"{name}, {key}"), counts)
