"""The workers of a Dask cluster; Dask, an optional extra, is imported only when used."""

from __future__ import annotations

import os
import secrets
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Lock
from typing import Any
from urllib.parse import urlsplit

from ccwsim.model import needs, refused
from ccwsim.run.executors.parts import PartRunner
from ccwsim.run.executors.threads import Work

SCHEDULER = "CCWSIM_SCHEDULER"
"""Environment variable with the address of a Dask scheduler, such as tcp://host:8786."""
CONNECT_SECONDS = 5.0
COUNT_SECONDS = 2.0  # seconds between two counts of the workers, whose number may change
WORKER_SECONDS = 30.0  # seconds to wait for the first worker

_clients: dict[str, Any] = {}
_lock = Lock()


def connect(address: str, seconds: float = CONNECT_SECONDS) -> Any:
    """Return a client of the Dask scheduler at an address such as tcp://host:8786.

    Raises `CCWSIMError` if dask.distributed is not installed or the scheduler does not answer.
    """
    distributed = needs("distributed")
    try:
        # Check the address first, because a client without a scheduler retries for a long time.
        parts = urlsplit(address)
        if not parts.hostname or not parts.port:
            raise ValueError("host and port are needed")
        socket.create_connection((parts.hostname, parts.port), seconds).close()
        return distributed.Client(address, timeout=seconds, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise refused("no_scheduler", address=address, reason=reason) from error


def executor_of_environment() -> Any:
    """Return a client of the scheduler in `CCWSIM_SCHEDULER`, or None without this variable."""
    address = os.environ.get(SCHEDULER, "").strip()
    if not address:
        return None
    with _lock:
        client = _clients.get(address)
        if client is None or client.status != "running":
            _clients[address] = client = connect(address)
        return client


class Topic:
    """A channel like `Folder`: a topic of reports and a stop event, both at the Dask scheduler."""

    def __init__(self, name: str, client: Any = None) -> None:
        self._name, self._client = name, client
        self._shares: dict[int, float] = {}
        if client is not None:
            client.subscribe_topic(name, self._hear)

    def __reduce__(self) -> tuple[type[Topic], tuple[str]]:
        return Topic, (self._name,)  # workers need no client

    def report(self, first: int, share: float) -> bool:
        """Send the finished share of a part to the caller; return whether to stop."""
        distributed = needs("distributed")
        distributed.get_worker().log_event(self._name, (first, share))
        return bool(distributed.Event(self._name).is_set())

    def _hear(self, event: tuple[float, Any]) -> None:
        first, share = event[1]
        self._shares[first] = share

    def share(self, first: int) -> float:
        """Return the latest reported share of a part."""
        return self._shares.get(first, 0.0)

    def stop(self) -> None:
        """Ask all workers to stop."""
        with suppress(Exception):  # the scheduler may be gone
            needs("distributed").Event(self._name, client=self._client).set()
            self._client.unsubscribe_topic(self._name)


class ClusterRunner(PartRunner):
    """Runs realizations on the workers of a `distributed.Client`; Dask repeats lost parts."""

    def __init__(self, work: Work, client: Any) -> None:
        super().__init__(work, client.get_executor(pure=False), 1)
        self._client, self._next_count = client, 0.0

    def _send(self, content: bytes) -> tuple[Any, Topic]:
        """Send the content once, as the result of a task, which Dask repeats if it is lost."""
        with suppress(ValueError, KeyError):  # not called in a task, or already done
            # a task that waits for other tasks must not keep its thread from them
            needs("distributed").secede()
        sent = self._client.submit(bytes, content, pure=False)
        try:
            self._client.wait_for_workers(1, WORKER_SECONDS)
        except TimeoutError as error:
            raise refused("no_dask_workers", seconds=WORKER_SECONDS) from error
        with suppress(Exception):  # a worker without the content fetches it with its first part
            self._client.replicate([sent])
        return sent, Topic(f"ccwsim-{secrets.token_hex(8)}", self._client)

    def n_workers(self) -> int:
        """Return the number of threads of all workers together, at least 1."""
        if time.monotonic() > self._next_count:
            with suppress(Exception):
                self._n_workers = max(sum(self._client.nthreads().values()), 1)
            self._next_count = time.monotonic() + COUNT_SECONDS
        return self._n_workers

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            with super()._explained():
                yield
        except needs("distributed").KilledWorker as error:
            raise refused("workers_ended", error=error) from error
