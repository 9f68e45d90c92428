"""Batches for a Dask cluster; Dask, an optional extra, is imported only when used."""

import asyncio
import os
import secrets
import socket
import time
from collections.abc import Iterable
from concurrent.futures import CancelledError, Future, InvalidStateError
from contextlib import suppress
from dataclasses import dataclass
from threading import Lock
from typing import Any
from urllib.parse import urlsplit

from ccwsim.model.errors import CCWSIMError, refused
from ccwsim.run.executors.batches import BatchBackend
from ccwsim.run.executors.threads import Work
from ccwsim.run.executors.worker import Reply, simulate_batch

SCHEDULER = "CCWSIM_SCHEDULER"
"""Environment variable with the address of a Dask scheduler, such as tcp://host:8786."""
CONNECT_SECONDS = 5.0
COUNT_SECONDS = 2.0  # seconds between two counts of the workers, whose number may change
RESULT_SECONDS = 3.0  # seconds to wait for a reply before it is requested again
MAX_LOSSES = 5  # maximum number of times the study is sent again after its workers were lost

_clients: dict[str, Any] = {}
_lock = Lock()


def connect(address: str, seconds: float = CONNECT_SECONDS) -> Any:
    """Return a client of the Dask scheduler at an address such as tcp://host:8786.

    Raises `CCWSIMError` if dask.distributed is not installed or the scheduler does not answer.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise refused("no_dask") from error
    try:
        # Check the address first, because a client without a scheduler retries for a long time.
        parts = urlsplit(address)
        if not parts.hostname or not parts.port:
            raise ValueError("host and port are needed")
        socket.create_connection((parts.hostname, parts.port), seconds).close()
        return Client(address, timeout=seconds, set_as_default=False)
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


@dataclass(frozen=True)
class ClusterFlag:
    """A stop flag that workers read from the scheduler of a Dask cluster."""

    name: str

    def is_set(self) -> bool:
        """Return whether the work should stop."""
        from distributed import Event

        return bool(Event(self.name).is_set())

    def report(self, number: int, share: float) -> None:
        """Send the finished share of a realization to all subscribers."""
        from distributed import get_worker

        get_worker().log_event(self.name, (number, share))


class ClusterBackend(BatchBackend):
    """Sends batches to the workers of a `distributed.Client`, which stays open.

    It does not use `Client.get_executor()`, because futures of that executor would wait for a
    killed worker until the connection times out.
    """

    def __init__(self, client: Any) -> None:
        super().__init__(client, 0)
        self._client = client
        self._next_count = 0.0
        self._n_losses = 0
        self._stopped = False
        self._shares: dict[int, float] = {}

    def open(self, work: Work) -> None:
        """Send the study to every worker."""
        from distributed import Event, secede

        with suppress(ValueError, KeyError):  # not called in a task, or already done
            secede()  # a task that waits for other tasks must not keep its thread from them
        super().open(work)
        self._flag.set()  # the folder of the base class is not needed
        self._flag = ClusterFlag(f"ccwsim-{secrets.token_hex(8)}")
        self._event = Event(self._flag.name, client=self._client)
        self._client.subscribe_topic(self._flag.name, self._hear)
        self._scatter()

    def _scatter(self) -> None:
        try:
            self._study = self._client.scatter(self._content, broadcast=True, hash=False)
        except Exception as error:
            raise refused("study_not_sent", error=error) from error

    def n_workers(self) -> int:
        """Number of threads of all workers together, at least 1."""
        if time.monotonic() > self._next_count:
            with suppress(Exception):
                self._n_workers = sum(self._client.nthreads().values())
            self._next_count = time.monotonic() + COUNT_SECONDS
        return max(self._n_workers, 1)

    def submit(self, numbers: tuple[int, ...], with_study: bool) -> Future[Reply]:
        """Send a batch without the study, which the workers have; Dask repeats lost batches."""
        request, future = self._request(numbers), Future()
        task = self._client.submit(simulate_batch, request, self._study, pure=False)
        task.add_done_callback(lambda task: self._fetch(task, future))
        future.add_done_callback(lambda future: task.cancel() if future.cancelled() else None)
        return future

    def _fetch(self, task: Any, future: Future[Reply]) -> None:
        """Move a reply to its future; ask again, because Dask waits long for a lost worker."""
        seconds = RESULT_SECONDS
        while not self._stopped and not future.done():
            try:
                future.set_result(task.result(timeout=seconds))
            except TimeoutError:
                seconds *= 2
            except InvalidStateError:  # the future was cancelled meanwhile
                return
            except BaseException as error:  # `CancelledError` of asyncio is not an `Exception`
                with suppress(InvalidStateError):
                    future.set_exception(error)

    def _hear(self, event: tuple[float, Any]) -> None:
        number, share = event[1]
        self._shares[number] = share

    def shares(self, numbers: Iterable[int]) -> dict[int, float]:
        """Return which share of each realization is finished, as its worker last reported."""
        return {number: self._shares[number] for number in numbers if number in self._shares}

    def recovers(self, error: BaseException) -> bool:
        """Send the study again if it was lost with its workers; otherwise call the base class."""
        from distributed import KilledWorker

        if isinstance(error, KilledWorker):
            raise refused("workers_ended", error=error) from error
        if not isinstance(error, (CancelledError, asyncio.CancelledError)) or self._stopped:
            return super().recovers(error)
        self._n_losses += 1
        if self._client.status != "running" or self._n_losses > MAX_LOSSES:
            raise CCWSIMError("the Dask scheduler or all of its workers were lost") from error
        self._next_count = 0.0
        self._scatter()
        return True

    def stop(self) -> None:
        """Set the event that workers poll."""
        self._stopped = True
        with suppress(Exception):  # the scheduler may be gone
            self._event.set()
            self._client.unsubscribe_topic(self._flag.name)
