"""Read NumPy files of one array (.npy) or several (.npz), never pickled objects."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from io import BytesIO
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numpy.lib import format as npy

from ccwsim import Grid
from ccwsim.io.archive import Archive, opened_archive
from ccwsim.io.data_file import DataFile, Geometry, broken, distinct_names
from ccwsim.io.formats.tables import make_table
from ccwsim.io.limits import check, check_arrays, check_cells
from ccwsim.model import Array, CCWSIMError, Shape, refused, shown

MAX_NPY_HEADER = 10_000  # maximum number of bytes of an array header, equal to NumPy's limit


def read_npy(content: bytes, name: str, *, stacked: bool = False) -> DataFile:
    """Return an array (ny, nx) or (n, ny, nx); with `stacked`, also (n, nz, ny, nx)."""
    array = _Array.of_numbers(content, name)
    check_cells(name, array.shape or (1,))
    if len(array.shape) not in ((2, 3, 4) if stacked else (2, 3)):
        raise refused("not_a_grid", name=name, shape=shown(array.shape))
    return DataFile("NumPy array", name, {"array": array.grid()}, asks_up=True)


def read_npz(content: bytes, name: str) -> DataFile:
    """Return the grids in an `.npz` file, or its arrays `cells` and `facies` as a table."""
    with opened_archive(content, name) as archive:
        table = _cells_and_facies(archive, name)
        if table is not None:
            return table
        grids, reasons = _grids_and_reasons(archive, name)
    place = {}
    with suppress(CCWSIMError):  # members of other programs may have the same names
        place = npz_arrays(content, name, {"cell_size": "fiu", "origin": "fiu", "crs": "U"})
    if not grids:
        tail = f"; {reasons[0]}" if reasons else ""
        raise CCWSIMError(f"{name}: no array of the file has rows and columns{tail}")
    stated = Geometry(crs=str(place.get("crs", "")))
    file = DataFile("NumPy arrays", name, grids, asks_up=True, geometry=stated)
    size, origin = (place.get(key, np.zeros(0)) for key in ("cell_size", "origin"))
    placed = size.shape == origin.shape and size.shape in ((2,), (3,))
    return file.at(size.tolist(), origin.tolist()) if placed else file


def place_arrays(grid: Grid) -> dict[str, Array]:
    """Return cell size, origin and coordinate system of a grid as members of an `.npz` file."""
    keys = ("cell_size", "origin", "crs")
    return {key: np.array(getattr(grid, key)) for key in keys}


def npz_arrays(content: bytes, name: str, kinds: Mapping[str, str]) -> dict[str, Array]:
    """Return members of an `.npz` file; `kinds` maps their names to the allowed NumPy kinds."""
    with opened_archive(content, name) as archive:
        members = {key: f"{key}.npy" for key in kinds if f"{key}.npy" in archive.infos}
        archive.check(list(members.values()))
        arrays = {}
        for key, member in members.items():
            array = _Array.opened(archive.read(member), f"{name}, {key}")
            if array.dtype.kind not in kinds[key]:
                raise refused("unexpected_type", name=array.name, dtype=array.dtype)
            if prod(array.shape):
                check_cells(array.name, array.shape or (1,))
            arrays[key] = array.values()
            if array.dtype.kind == "U":
                arrays[key].tolist()  # raises here if a character is invalid
        return arrays


def one_value(arrays: Mapping[str, Array], name: str, default: Any) -> Any:
    """Return the only value of an array, or a default if there is no array of this name."""
    value = arrays.get(name, np.asarray(default))
    if value.size != 1:
        raise CCWSIMError(f"{name} must be one value, not {value.size}; save it again")
    return value.item()


def _cells_and_facies(archive: Archive, name: str) -> DataFile | None:
    """Return the arrays `cells` (n, 2 or 3) and `facies` (n,) of an archive as a table."""
    keys = ("cells", "facies")
    if not {f"{key}.npy" for key in keys} <= archive.infos.keys():
        return None
    archive.check([f"{key}.npy" for key in keys])
    arrays = [_Array.opened(archive.read(f"{key}.npy"), f"{name}, {key}") for key in keys]
    shape, of_facies = (array.shape for array in arrays)
    if len(shape) != 2 or shape[1] not in (2, 3) or of_facies != shape[:1] or not shape[0]:
        return None
    if arrays[0].dtype.kind not in "uif" or arrays[1].dtype.kind not in "buifU":
        return None
    check_cells(name, (shape[0] * (shape[1] + 1),))
    cells, facies = (array.values() for array in arrays)
    places, lines = ("layer", "row", "col")[-shape[1] :], np.arange(1, shape[0] + 1)
    return make_table("NumPy arrays", name, [*places, "facies"], [*cells.T, facies], lines)


def _grids_and_reasons(archive: Archive, name: str) -> tuple[dict[str, Array], list[str]]:
    """Return the arrays that are grids, and the reasons that exclude other arrays."""
    keys = [key for key in archive.infos if key.endswith(".npy")]
    check(name, variables=len(keys))
    archive.check(keys)
    arrays, reasons = dict[str, _Array](), list[str]()
    labels = distinct_names([key.removesuffix(".npy") for key in keys])
    for key, label in zip(keys, labels, strict=True):
        try:
            array = _Array.of_numbers(archive.read(key), f"{name}, {label}")
        except CCWSIMError as error:
            reasons.append(str(error))
            continue
        if len(array.shape) in (2, 3) and 0 not in array.shape:
            arrays[label] = array
    check_arrays(name, [array.shape for array in arrays.values()])
    return {label: array.grid() for label, array in arrays.items()}, reasons


class _Array(NamedTuple):
    """The header of an array, and the file that contains it, open at the first value."""

    file: BytesIO
    name: str
    shape: Shape
    by_columns: bool
    dtype: np.dtype

    @classmethod
    def opened(cls, content: bytes, name: str) -> _Array:
        """Read the header; raise an error if it is broken."""
        file = BytesIO(content)
        with broken(f"{name}: the NumPy header is broken; save it again"):
            version = npy.read_magic(file)
            read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, by_columns, dtype = read(file, max_header_size=MAX_NPY_HEADER)
        return cls(file, name, tuple(map(int, shape)), by_columns, dtype)

    @classmethod
    def of_numbers(cls, content: bytes, name: str) -> _Array:
        """Read the header; raise an error for a non-numeric type."""
        array = cls.opened(content, name)
        if array.dtype.kind not in "buif" or array.dtype.itemsize > 16:
            raise refused("not_numbers", name=name, dtype=array.dtype)
        return array

    def grid(self) -> Array:
        """Return the values as layers, rows and columns, or as a stack of volumes."""
        values = self.values()
        return values[None] if values.ndim == 2 else values

    def values(self) -> Array:
        """Return the values after the header."""
        content, n = self.file.getvalue(), prod(self.shape)  # shared with the file, no copy
        if len(content) - self.file.tell() < n * self.dtype.itemsize:
            raise CCWSIMError(f"{self.name} ends before the {n} values that its header states")
        values = np.frombuffer(content, self.dtype, count=n, offset=self.file.tell())
        kind = self.dtype.newbyteorder("=")
        if kind.kind == "f":
            kind = np.dtype(np.float64 if kind.itemsize > 4 else np.float32)
        native = values.astype(np.uint8 if kind.kind == "b" else kind, copy=False)
        return native.reshape(self.shape, order="F" if self.by_columns else "C")
