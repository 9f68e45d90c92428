"""Realizations on disk, read as facies indices on access."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray


class LazyStack:
    """A stack of facies codes on disk that behaves like an array of facies indices."""

    dtype = np.dtype(np.uint8)

    def __init__(self, stack: NDArray[np.integer], codes: NDArray[np.integer]) -> None:
        self.stack = stack
        self._codes = codes
        self.shape, self.ndim, self.size = stack.shape, stack.ndim, stack.size
        self.nbytes = stack.size

    def __len__(self) -> int:
        return len(self.stack)

    def __getitem__(self, which: Any) -> NDArray[np.uint8]:
        part = np.asarray(self.stack[which])
        indices = np.zeros(part.shape, np.uint8)
        for k, code in enumerate(self._codes):  # searchsorted would need eight bytes per cell
            np.copyto(indices, k, where=part == code)
        return indices

    def __iter__(self) -> Iterator[NDArray[np.uint8]]:
        return (self[k] for k in range(len(self)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray:
        return self[:].astype(dtype or self.dtype, copy=False)

    def copy(self) -> NDArray[np.uint8]:
        """Return all indices as an array in memory."""
        return self[:]
