"""Read arrays of numbers from MATLAB files, versions 5 to 7.

`scipy.io.loadmat` does not check sizes and types, so a few changed bytes can crash the process.
This reader follows chapter 1 of "MAT-File Format" by MathWorks.
"""

import zlib
from collections.abc import Iterator
from math import prod

import numpy as np

from ccwsim import CCWSIMError
from ccwsim.io.data_file import DataFile, broken, printable
from ccwsim.io.limits import check, check_arrays, check_cells, limits
from ccwsim.model import Array

_TYPE_NUMBERS = (1, 2, 3, 4, 5, 6, 7, 9, 12, 13)
_KINDS = ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8", "i8", "u8")
_DTYPES = dict(zip(_TYPE_NUMBERS, _KINDS, strict=True))
"""The NumPy type of each type number in the format."""
_MATRIX, _COMPRESSED = 14, 15
_NUMERIC_CLASSES = range(6, 16)
_COMPLEX = 0x08
_N_HEADER_BYTES = 2000  # number of bytes to unpack for the header of a packed variable


def read_matlab(content: bytes, name: str) -> DataFile:
    """Return the 2-D and 3-D arrays of real numbers in a MATLAB file."""
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    if order is None:
        raise CCWSIMError(f"{name}: the MATLAB header is broken; save it again with -v7")
    grids: dict[str, Array] = {}
    for kind, payload in _variables(_Elements(memoryview(content)[128:], order, name)):
        array = _named_array(_Elements(payload, order, name)) if kind == _MATRIX else None
        if array is not None:
            key, values = array  # slices are along the last axis, and come first here
            grids[key] = values[None] if values.ndim == 2 else np.moveaxis(values, 2, 0)
            check_arrays(name, [grid.shape for grid in grids.values()])
    return DataFile("MATLAB file", name, grids, asks_up=True)


def _check_whole(name: str, n_stated: int, n: int) -> None:
    """Raise an error if fewer bytes follow than a header states."""
    if n < n_stated:
        raise CCWSIMError(f"{name} ends in the middle of a variable; get a complete file")


class _Elements:
    """Elements that follow each other in a file or in a variable."""

    def __init__(self, content: memoryview, order: str, name: str) -> None:
        self.content, self.order, self.name, self.position = content, order, name, 0

    def take(self) -> tuple[int, memoryview]:
        """Return type and data of the next element."""
        content, position = self.content, self.position
        _check_whole(self.name, position + 8, len(content))
        first, second = np.frombuffer(content, self.order + "u4", count=2, offset=position).tolist()
        kind, size, start = first, second, position + 8
        if first >> 16:  # short element: one word holds size and type, the next word holds the data
            kind, size, start = first & 0xFFFF, first >> 16, position + 4
        padded = 0 if kind == _COMPRESSED else -size % 8
        self.position = position + 8 if first >> 16 else start + size + padded
        _check_whole(self.name, start + size, min(self.position, len(content)))
        return kind, content[start : start + size]


def _variables(elements: _Elements) -> Iterator[tuple[int, memoryview]]:
    """Unpack and yield the top-level elements."""
    n, n_free = 0, limits().unpacked
    while elements.position + 8 <= len(elements.content):
        kind, payload = elements.take()
        if kind == _COMPRESSED:
            payload = memoryview(_unpacked(payload, n_free, elements))
            n_free -= len(payload)
            kind, payload = _Elements(payload, elements.order, elements.name).take()
        n += 1
        check(elements.name, variables=n)
        yield kind, payload


def _unpacked(payload: memoryview, n_free: int, elements: _Elements) -> bytes:
    """Check the size and the number of cells of an element, then unpack it."""
    stream, order, name = zlib.decompressobj(), elements.order, elements.name
    with broken(f"{name}: a packed variable is broken; save it again", zlib.error):
        start = stream.decompress(payload, _N_HEADER_BYTES)
        _check_whole(name, 8, len(start))
        kind, size = np.frombuffer(start, order + "u4", count=2).tolist()
        if kind != _MATRIX:
            return start
        _shape_and_name(_Elements(memoryview(start)[8:], order, name))
        check(name, unpacked=limits().unpacked - n_free + size + 8)
        more = max(size + 8 - len(start), 0)
        remainder = stream.decompress(stream.unconsumed_tail, more) if more else b""
        if stream.decompress(stream.unconsumed_tail, 1) or not stream.eof:
            raise CCWSIMError(f"{name}: a packed variable is broken; save it again")
    return start + remainder


def _shape_and_name(elements: _Elements) -> tuple[tuple[int, ...], str] | None:
    """Return shape and name of a matrix; None if the matrix is not a real grid."""
    (_, flags), (_, sizes) = elements.take(), elements.take()
    if len(flags) < 4 or len(sizes) % 4:
        raise CCWSIMError(f"{elements.name}: a variable has a broken header; save it again")
    word = int(np.frombuffer(flags, elements.order + "u4", count=1)[0])
    if word & 0xFF not in _NUMERIC_CLASSES or (word >> 8) & _COMPLEX:
        return None
    if len(sizes) not in (8, 12):  # neither two nor three dimensions
        return None
    _, label = elements.take()
    shape = tuple(np.frombuffer(sizes, elements.order + "i4").tolist())
    key = printable(bytes(label[:800]).decode("latin-1"))
    if prod(shape) == 0:
        return None
    check_cells(f"{elements.name}, {key}", (*shape[2:], *shape[:2]))  # the order of our axes
    return shape, key


def _named_array(elements: _Elements) -> tuple[str, Array] | None:
    """Return name and values of a matrix element; None if its values are not real numbers."""
    header = _shape_and_name(elements)
    if header is None:
        return None
    shape, key = header
    kind, payload = elements.take()
    if kind not in _DTYPES or len(payload) != prod(shape) * np.dtype(_DTYPES[kind]).itemsize:
        raise CCWSIMError(f"{elements.name}, {key}: the values do not fill {shape}; save it again")
    values = np.frombuffer(payload, elements.order + _DTYPES[kind])
    return key, values.astype(values.dtype.newbyteorder("=")).reshape(shape, order="F")


_PRECISIONS_4 = ("f8", "f4", "i4", "i2", "u2", "u1")


def is_matlab4(content: bytes) -> bool:
    """Return whether a file starts with the header of a matrix of MATLAB 4."""
    if len(content) < 21:
        return False
    for order in "<>":
        kind, _, _, imaginary, n = np.frombuffer(content, f"{order}u4", count=5).tolist()
        machine, digits = divmod(kind, 1000)
        precision, form = divmod(digits, 10)
        fits = machine == (order == ">") and precision < len(_PRECISIONS_4) and form < 3
        if fits and imaginary <= 1 and 1 < n <= 64 and content[20 : 19 + n].isalnum():
            return True
    return False


def read_matlab4(content: bytes, name: str) -> DataFile:
    """Return the full matrices of real numbers in a file of MATLAB 4."""
    grids: dict[str, Array] = {}
    position = n_variables = 0
    while position + 20 <= len(content):
        order = (
            "<"
            if content[position + 3] == 0 and content[position : position + 2] != b"\0\0"
            else ">"
        )
        order = "<" if content[position : position + 4] == bytes(4) else order
        n_variables += 1
        check(name, variables=n_variables)
        kind, ny, nx, imaginary, n = np.frombuffer(content, f"{order}u4", 5, position).tolist()
        dtype = np.dtype(order + _PRECISIONS_4[min(kind % 1000 // 10, 5)])
        start = position + 20 + n
        size = ny * nx * dtype.itemsize
        _check_whole(name, start + size, len(content))
        if kind % 10 == 0 and not imaginary and ny * nx:
            check_arrays(name, [*(grid.shape for grid in grids.values()), (ny, nx)])
            values = np.frombuffer(content, dtype, ny * nx, start).reshape(nx, ny).T
            label = printable(content[position + 20 : start].decode("latin-1").rstrip("\0"))
            grids[label] = values.astype(dtype.newbyteorder("="))[None]
        position = start + size * (1 + imaginary)
    return DataFile("MATLAB file", name, grids, asks_up=True)
