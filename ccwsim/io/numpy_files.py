"""NumPy files: one array (.npy) or several (.npz), never pickled objects."""

from __future__ import annotations

import zipfile
from io import BytesIO
from math import prod

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ccwsim.errors import CCWSIMError
from ccwsim.io.data_file import DataFile
from ccwsim.io.limits import MAX_VARIABLES, check_bytes, check_cells


def read_npy(content: bytes, name: str) -> DataFile:
    """Return the array of an `.npy` file: (ny, nx), or (n, ny, nx) with n slices.

    Raises
    ------
    CCWSIMError
        For a broken file, values that are not real numbers, or another number of dimensions.

    Examples
    --------
    >>> content = BytesIO()
    >>> np.save(content, np.eye(2))
    >>> read_npy(content.getvalue(), "a.npy").variables["array"].shape
    (1, 2, 2)
    """
    array = _array(content, name)
    if array.ndim not in (2, 3):
        raise CCWSIMError(f"{name}: an array of shape {array.shape} is no grid of rows and columns")
    return DataFile("NumPy array", name, {"array": _as_grid(array)}, asks_up=True)


def read_npz(content: bytes, name: str) -> DataFile:
    """Return the arrays of an `.npz` file that can be grids.

    Raises
    ------
    CCWSIMError
        For a broken file, one that unpacks to too much, or one without such an array.

    Examples
    --------
    >>> content = BytesIO()
    >>> np.savez_compressed(content, ti=np.eye(2), seed=7)
    >>> list(read_npz(content.getvalue(), "a.npz").variables)
    ['ti']
    """
    members = _members(content, name)
    if not members:
        raise CCWSIMError(f"{name}: the zip file holds no NumPy array")
    grids: dict[str, NDArray] = {}
    reasons: list[str] = []
    for key, member in members.items():
        try:
            array = _array(member, f"{name}, {key}")
        except CCWSIMError as error:
            reasons.append(str(error))
            continue
        if array.ndim in (2, 3):
            grids[key] = _as_grid(array)
    if not grids:
        tail = f"; {reasons[0]}" if reasons else ""
        raise CCWSIMError(f"{name}: no array in it has rows and columns{tail}")
    return DataFile("NumPy arrays", name, grids, asks_up=True)


def _as_grid(array: NDArray) -> NDArray:
    return array.reshape((1, *array.shape)) if array.ndim == 2 else array


def _members(content: bytes, name: str) -> dict[str, bytes]:
    try:
        with zipfile.ZipFile(BytesIO(content)) as archive:
            infos = [info for info in archive.infolist() if info.filename.endswith(".npy")]
            if len(infos) > MAX_VARIABLES:
                raise CCWSIMError(f"{name}: {len(infos)} arrays are more than {MAX_VARIABLES}")
            check_bytes(name, sum(max(info.file_size, 0) for info in infos))
            return {info.filename[:-4]: archive.read(info) for info in infos}
    except CCWSIMError:
        raise
    except Exception as error:  # zipfile and zlib raise a dozen types for broken archives
        raise CCWSIMError(f"{name}: the zip file is broken ({error}); get it again") from error


def _array(content: bytes, name: str) -> NDArray:
    file = BytesIO(content)
    try:
        version = npy.read_magic(file)
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, by_columns, dtype = read(file, max_header_size=10_000)
    except Exception as error:  # the header is a Python literal: any parser error may come
        raise CCWSIMError(f"{name}: the NumPy header is broken; save it again") from error
    if dtype.kind not in "buif" or dtype.itemsize > 16:
        raise CCWSIMError(f"{name}: values of type {dtype} are no numbers; save real numbers")
    shape = tuple(map(int, shape))
    check_cells(name, shape or (1,))
    n_bytes = prod(shape) * dtype.itemsize
    if len(content) - file.tell() < n_bytes:
        raise CCWSIMError(f"{name} ends before the {prod(shape)} values that it promises")
    values = np.frombuffer(content, dtype, count=prod(shape), offset=file.tell())
    native = values.astype(_native(dtype), copy=False)
    return native.reshape(shape, order="F" if by_columns else "C")


def _native(dtype: np.dtype) -> np.dtype:
    if dtype.kind == "f":
        return np.dtype(np.float64 if dtype.itemsize > 4 else np.float32)
    return np.dtype(np.uint8) if dtype.kind == "b" else dtype.newbyteorder("=")
