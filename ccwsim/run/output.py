"""Storage of finished realizations, in memory or in a file."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from math import prod
from pathlib import Path
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ccwsim.model.arrays import LazyStack, describe_shape
from ccwsim.model.ensemble import codes_with_nan
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.model.numbers import format_bytes
from ccwsim.model.study import Study
from ccwsim.system.whole_files import WholeFile, unwritable

Stored = tuple[NDArray[np.uint8], NDArray[np.int32] | None]
"""Finished realizations as facies indices (array or `LazyStack`), and the source of each cell."""


@contextmanager
def store_of(
    study: Study, n: int, keep_sources: bool, out: str | os.PathLike[str] | None
) -> Iterator[Memory | MapFile]:
    """Yield a store for n realizations; a file is replaced only if the run succeeds."""
    if out is None:
        yield Memory(study.grid.shape, n, keep_sources)
        return
    if not isinstance(out, (str, os.PathLike)):
        raise CCWSIMError(f"out = {shown(out)} must be the path of an npy file, or None")
    if keep_sources:
        raise CCWSIMError("sources cannot be written to disk; omit `out` or `keep_sources`")
    image, masked = study.training_image, study.active is not None
    file = MapFile(out, codes_with_nan(image.codes, masked), (n, *study.grid.shape))
    try:
        yield file
    finally:
        file.drop()


class Memory:
    """Keeps realizations in memory."""

    def __init__(self, shape: tuple[int, ...], n: int, keep_sources: bool) -> None:
        self._indices = _allocate((n, *shape), np.uint8)
        self._sources = _allocate((n, *shape), np.int32) if keep_sources else None

    def put(self, k: int, indices: NDArray[np.uint8], sources: NDArray[np.int32]) -> None:
        """Copy realization k."""
        self._indices[k] = indices
        if self._sources is not None:
            self._sources[k] = sources

    def finish(self, finished: list[int]) -> Stored:
        """Return the finished realizations in order, without a copy if all are finished."""
        indices, sources = self._indices, self._sources
        if len(finished) < len(indices):
            indices = indices[finished]
            sources = None if sources is None else sources[finished]
        return indices, sources


class MapFile:
    """Writes realizations to a temporary file and renames it; mapping it would count as memory."""

    def __init__(self, out: str | os.PathLike[str], codes: NDArray, shape: tuple[int, ...]) -> None:
        self._path = path = Path(out)
        if path.suffix.lower() != ".npy":
            raise CCWSIMError(f"{path}: realizations can be written to disk only as .npy")
        self._codes, self._shape, self._lock = codes, shape, Lock()
        self._header = self._header_of(shape[0])
        self._size = prod(shape[1:]) * codes.itemsize
        size = shape[0] * self._size
        with unwritable(path):
            if size > (free := shutil.disk_usage(path.parent).free):
                raise CCWSIMError(
                    f"realizations of {format_bytes(size)} do not fit into {path.parent}, which "
                    f"has {format_bytes(free)} free; simulate fewer or use another folder"
                )
            self._whole = WholeFile(path)
            self._file = self._whole.file
            try:
                self._file.write(self._header)
            except OSError:
                self.drop()
                raise

    def put(self, k: int, indices: NDArray[np.uint8], sources: NDArray[np.int32]) -> None:
        """Write realization k at its position."""
        codes = np.ascontiguousarray(self._codes[indices])
        with self._lock, unwritable(self._path):
            self._file.seek(len(self._header) + k * self._size)
            self._file.write(codes.data)

    def finish(self, finished: list[int]) -> Stored:
        """Close the gaps left by missing realizations, rename the file, and map it."""
        n = len(finished)
        if not n:
            return np.empty((0, *self._shape[1:]), np.uint8), None
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
        plain = np.array_equal(self._codes, np.arange(len(self._codes)))
        return mapped if plain else LazyStack(mapped, self._codes), None  # type: ignore[return-value]

    def drop(self) -> None:
        """Delete the temporary file, if it still exists."""
        self._whole.drop()

    def _header_of(self, n: int) -> bytes:
        """Return a header; its length does not depend on n, because NumPy pads the digits."""
        header = BytesIO()
        kind = np.lib.format.dtype_to_descr(self._codes.dtype)
        shape = n, *self._shape[1:]
        description = {"descr": kind, "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(header, description)
        return header.getvalue()


def _allocate(shape: tuple[int, ...], kind: type[np.integer]) -> NDArray:
    try:
        return np.empty(shape, kind)
    except (MemoryError, ValueError):
        raise CCWSIMError(
            f"{shape[0]} realizations of {describe_shape(shape[1:])} cells do not fit into memory; "
            "simulate fewer, use a smaller grid, or write realizations to disk"
        ) from None
