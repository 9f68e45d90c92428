"""A memo of values: each is computed once for all threads, and the latest are kept."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import Future, wait
from dataclasses import is_dataclass
from threading import RLock
from typing import Any, Generic, TypeVar

import numpy as np

from ccwsim.jobs.scheduler import PAGE_TURNS
from ccwsim.jobs.workers import WORKER_POLL_SECONDS, check_stop
from ccwsim.model import Cancelled

Value = TypeVar("Value")
AnyFuture = TypeVar("AnyFuture", bound="Future[Any]")


class Memo(Generic[Value]):
    """Values by key, each computed by one thread while others wait; errors are not kept.

    The most recently used values are kept: at most `max_values`, and at most `max_bytes` of arrays
    and texts, but at least `min_values`.
    """

    def __init__(
        self, max_values: float = np.inf, max_bytes: float = np.inf, min_values: int = 1
    ) -> None:
        self._max_values, self.max_bytes, self._min_values = max_values, max_bytes, min_values
        self._values: OrderedDict[Hashable, Value] = OrderedDict()
        self._pending: dict[Hashable, Any] = {}  # futures, by key
        self._lock = RLock()
        self.n_bytes = 0
        """Bytes of the values when the latest value was stored."""

    def get(self, key: Hashable) -> Value | None:
        """Return a value, or None if it is not kept."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
            return self._values.get(key)

    def put(self, key: Hashable, value: Value) -> None:
        """Keep a value; drop the least recently used values if the bounds are exceeded."""
        with self._lock:
            self._values[key] = value
            self._values.move_to_end(key)
            self.n_bytes = n_bytes(self._values)
            while len(self._values) > self._max_values or (
                len(self._values) > self._min_values and self.n_bytes > self.max_bytes
            ):
                self._values.popitem(last=False)
                self.n_bytes = n_bytes(self._values)

    def value(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return a value, which `make` computes if it is neither kept nor being computed.

        All waiting threads get the error of `make`. If `make` was only cancelled, the next waiting
        thread computes the value instead. A thread does not wait if it is asked to stop.
        """
        future = self.claim(key, mine := Future[Value]())
        if future is mine:
            self.compute(key, future, make)
            return future.result()
        with PAGE_TURNS.paused():
            while not wait([future], WORKER_POLL_SECONDS).done:
                check_stop()
        error = future.exception()
        if isinstance(error, Cancelled) or not isinstance(error, Exception | None):
            return self.value(key, make)
        return future.result()

    def claim(self, key: Hashable, future: AnyFuture) -> AnyFuture:
        """Return the future of a value that is being computed, or else `future`.

        If the value is kept, `future` gets the value. Otherwise, the caller must call `compute`.
        """
        with self._lock:
            if key not in self._values:
                return self._pending.setdefault(key, future)
            self._values.move_to_end(key)
            future.set_result(self._values[key])
        return future

    def compute(self, key: Hashable, future: Future[Value], make: Callable[[], Value]) -> None:
        """Give a future its value or the error of `make`, unless it has its value already."""
        if future.done():
            return
        try:
            self.put(key, value := make())
        except BaseException as error:
            self.give_up(key, future)
            future.set_exception(error)
        else:
            self.give_up(key, future)
            future.set_result(value)

    def give_up(self, key: Hashable, future: Future[Value]) -> None:
        """Let the next caller compute a value anew if it is still being computed."""
        with self._lock:
            if self._pending.get(key) is future:
                del self._pending[key]


def n_bytes(value: Any) -> int:
    """Return the bytes of all arrays and texts in a value."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, Memo):
        return value.n_bytes
    if isinstance(value, str | bytes):
        return len(value)
    if isinstance(value, dict):
        return sum(n_bytes(each) for each in list(value.values()))
    if isinstance(value, list | tuple):
        return sum(n_bytes(each) for each in value)
    return n_bytes(vars(value)) if is_dataclass(value) and hasattr(value, "__dict__") else 0
