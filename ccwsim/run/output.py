"""Storage of finished realizations, in memory or in a file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from math import prod
from pathlib import Path
from threading import Lock

import numpy as np

from ccwsim.model import (
    Array,
    Bytes,
    CCWSIMError,
    Floats,
    Int32s,
    LazyStack,
    Shape,
    Study,
    codes_with_nan,
    describe_shape,
    shown,
)
from ccwsim.system.whole_files import WholeFile, check_writable, unwritable

Stored = tuple[Bytes, Int32s | None, Floats | None]
"""Finished realizations as facies indices (array or `LazyStack`), the source and the value of each
cell."""


@contextmanager
def store_of(
    study: Study, n: int, keep_sources: bool, out: str | os.PathLike[str] | None
) -> Iterator[Memory | MapFile]:
    """Yield a store for n realizations; a file is replaced only if the run succeeds."""
    if out is None:
        yield Memory(study, n, keep_sources)
        return
    if not isinstance(out, (str, os.PathLike)):
        raise CCWSIMError(f"out = {shown(out)} must be the path of an npy file, or None")
    if keep_sources:
        raise CCWSIMError("sources cannot be written to disk; omit `out` or `keep_sources`")
    image, masked = study.training_image, study.active is not None
    codes = codes_with_nan(image.codes, masked)
    file = MapFile(out, codes, (n, *study.grid.shape), continuous=bool(image.values))
    try:
        yield file
    finally:
        file.drop()


class Memory:
    """Keeps realizations in memory."""

    def __init__(self, study: Study, n: int, keep_sources: bool) -> None:
        shape, continuous = (n, *study.grid.shape), study.training_image.values
        self._indices = _allocate(shape, np.uint8)
        self._sources = _allocate(shape, np.int32) if keep_sources else None
        self._values = _allocate(shape, np.float64) if continuous else None

    def put(self, k: int, indices: Bytes, sources: Int32s, values: Floats) -> None:
        """Copy realization k."""
        self._indices[k] = indices
        if self._sources is not None:
            self._sources[k] = sources
        if self._values is not None:
            self._values[k] = values

    def finish(self, finished: list[int]) -> Stored:
        """Return the finished realizations in order, without a copy if all are finished."""
        stored = self._indices, self._sources, self._values
        if len(finished) < len(self._indices):
            stored = tuple(None if each is None else each[finished] for each in stored)
        return stored  # type: ignore[return-value]


class MapFile:
    """Writes realizations to a temporary file and renames it; mapping it would count as memory."""

    def __init__(
        self, out: str | os.PathLike[str], codes: Array, shape: Shape, continuous: bool
    ) -> None:
        self._path = path = Path(out)
        if path.suffix.lower() != ".npy":
            raise CCWSIMError(f"{path}: realizations can be written to disk only as .npy")
        codes = codes.astype(np.float64) if continuous else codes
        self._codes, self._shape, self._lock = codes, shape, Lock()
        self._classes = _allocate(shape, np.uint8) if continuous else None
        self._header = self._header_of(shape[0])
        self._size = prod(shape[1:]) * codes.itemsize
        check_writable(path, shape[0] * self._size)
        with unwritable(path):
            self._whole = WholeFile(path)
            self._file = self._whole.file
            self._file.write(self._header)

    def put(self, k: int, indices: Bytes, sources: Int32s, values: Floats) -> None:
        """Write the codes or values of realization k at its position."""
        codes = np.ascontiguousarray(values if values.size else self._codes[indices])
        if self._classes is not None:
            self._classes[k] = indices
        with self._lock, unwritable(self._path):
            self._file.seek(len(self._header) + k * self._size)
            self._file.write(codes.data)

    def finish(self, finished: list[int]) -> Stored:
        """Close the gaps left by missing realizations, rename the file, and map it."""
        n = len(finished)
        if not n:
            return np.empty((0, *self._shape[1:]), np.uint8), None, None
        with unwritable(self._path):
            for to, k in enumerate(finished):
                if to != k:
                    self._file.seek(len(self._header) + k * self._size)
                    content = self._file.read(self._size)
                    self._file.seek(len(self._header) + to * self._size)
                    self._file.write(content)
            self._file.seek(0)
            self._file.write(self._header_of(n))
            self._file.truncate(len(self._header) + n * self._size)
            mapped = np.load(self._whole.commit(), mmap_mode="r")
        if self._classes is not None:
            return self._classes[finished], None, mapped
        plain = np.array_equal(self._codes, np.arange(len(self._codes)))
        return mapped if plain else LazyStack(mapped, self._codes), None, None  # type: ignore[return-value]

    def drop(self) -> None:
        """Delete the temporary file, if it still exists."""
        self._whole.drop()

    def _header_of(self, n: int) -> bytes:
        """Return a header; its length does not depend on n, because NumPy pads the digits."""
        header = BytesIO()
        kind = np.lib.format.dtype_to_descr(self._codes.dtype)
        description = {"descr": kind, "fortran_order": False, "shape": (n, *self._shape[1:])}
        np.lib.format.write_array_header_1_0(header, description)
        return header.getvalue()


def _allocate(shape: Shape, kind: type[np.number]) -> Array:
    try:
        return np.empty(shape, kind)
    except (MemoryError, ValueError):
        raise CCWSIMError(
            f"{shape[0]} realizations of {describe_shape(shape[1:])} cells do not fit into memory; "
            "simulate fewer, use a smaller grid, or write realizations to disk"
        ) from None
