"""Read grids and points from binary files of SGeMS: big-endian numbers, and texts with a length."""

from dataclasses import replace
from io import BytesIO

import numpy as np

from ccwsim import CCWSIMError
from ccwsim.io.data_file import DataFile, broken, distinct_names, printable
from ccwsim.io.limits import check, check_cells
from ccwsim.model import Array

_N_MAGIC = 4  # number of bytes that mark the format


def read_sgems(content: bytes, name: str) -> DataFile:
    """Return the variables of a grid, or of a set of points as a table with X, Y and Z."""
    file = BytesIO(content[_N_MAGIC:])
    with broken(f"{name} ends before the values that it states; get a complete file", ValueError):
        kind, *_ = _text(file), _text(file), _take(file, 1)  # the name and the version
        is_grid = kind == "Cgrid"
        if not is_grid and kind != "Point_set":
            label = printable(kind, 30)
            raise CCWSIMError(f"{name}: an SGeMS {label} is not read; save it in SGeMS as GSLIB")
        shape = _take(file, 3 if is_grid else 1).tolist()[::-1]
        cell, centre = _take(file, 6 * is_grid, ">f4").astype(float).reshape(2, -1)
        n = int(_take(file, 1)[0])
        check(name, variables=n)
        names = [_text(file) for _ in range(n)]
        n_values = check_cells(name, (n, *shape))
        places = [] if is_grid else _take(file, 3 * shape[0], ">f4").reshape(-1, 3).T
        columns = [*places, *_take(file, n_values, ">f4").reshape([n, *shape])]
    names = distinct_names(names if is_grid else ["X", "Y", "Z", *names])
    variables = {key: one.astype(float) for key, one in zip(names, columns, strict=True)}
    read = DataFile("binary SGeMS file", name, variables)
    if is_grid:
        return read.at(cell.tolist(), (centre - cell / 2).tolist())
    return replace(read, is_table=True, lines=np.arange(1, shape[0] + 1), counted="row")


def _take(file: BytesIO, n: int, dtype: str = ">u4") -> Array:
    """Return the next n numbers of a file; raise `ValueError` if the file has fewer."""
    values = np.frombuffer(file.read(n * np.dtype(dtype).itemsize), dtype)
    if len(values) < n:
        raise ValueError(n)
    return values


def _text(file: BytesIO) -> str:
    return _take(file, int(_take(file, 1)[0]), "u1").tobytes().rstrip(b"\0").decode("latin-1")
