"""A bounded cache that drops the least recently used value first."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import is_dataclass
from threading import Lock
from typing import Any, Generic, TypeVar

import numpy as np

Value = TypeVar("Value")


class LruCache(Generic[Value]):
    """The most recently used values, by key; safe to use from several threads.

    At most `max_values` values and `max_bytes` of arrays and texts, but at least `min_values`.
    """

    def __init__(
        self, max_values: float = np.inf, max_bytes: float = np.inf, min_values: int = 1
    ) -> None:
        self._max_values, self._max_bytes, self._min_values = max_values, max_bytes, min_values
        self._values: OrderedDict[Hashable, Value] = OrderedDict()
        self._lock = Lock()
        self.n_bytes = 0
        """Bytes of the values when the latest value was stored."""

    def get(self, key: Hashable) -> Value | None:
        """Return a value, or None if it is not in the cache."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
            return self._values.get(key)

    def put(self, key: Hashable, value: Value) -> None:
        """Store a value; drop the least recently used values if the bounds are exceeded."""
        with self._lock:
            self._values[key] = value
            self._values.move_to_end(key)
            self.n_bytes = n_bytes(self._values)
            while len(self._values) > self._max_values or (
                len(self._values) > self._min_values and self.n_bytes > self._max_bytes
            ):
                self._values.popitem(last=False)
                self.n_bytes = n_bytes(self._values)

    def get_or_make(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return a value, computed if absent from the cache. Two threads may compute it twice."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                return self._values[key]
        value = make()
        self.put(key, value)
        return value


def n_bytes(value: Any) -> int:
    """Return the bytes of all arrays and texts in a value."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, LruCache):
        return value.n_bytes
    if isinstance(value, str | bytes):
        return len(value)
    if isinstance(value, dict):
        return sum(n_bytes(each) for each in list(value.values()))
    if isinstance(value, list | tuple):
        return sum(n_bytes(each) for each in value)
    return n_bytes(vars(value)) if is_dataclass(value) and hasattr(value, "__dict__") else 0
