"""Batches for a Dask cluster. Dask is an optional extra and only imported where it is used."""

from __future__ import annotations

import asyncio
import secrets
import socket
import time
from collections.abc import Iterable
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

from ccwsim.model.errors import CCWSIMError
from ccwsim.run.executors.batches import without_program
from ccwsim.run.executors.flags import ClusterFlag
from ccwsim.run.executors.runner import Work
from ccwsim.run.executors.serialization import name_of, packed
from ccwsim.run.executors.worker import BatchRequest, Reply, simulate_batch

CONNECT_SECONDS = 5.0
COUNT_EVERY = 2.0
"""Seconds between two counts of the workers, which may come and go."""
FETCH_SECONDS = 3.0
"""How long an answer may be on its way before it is asked for anew."""
MAX_LOSSES = 5
"""How often the study is sent out anew when all workers that had it are gone."""


def connect(address: str, seconds: float = CONNECT_SECONDS) -> Any:
    """Return a client of the Dask scheduler at an address such as tcp://host:8786.

    Raises
    ------
    CCWSIMError
        Where dask.distributed is not installed, or the scheduler does not answer.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise CCWSIMError(
            "a scheduler needs dask.distributed, which is not installed: "
            "pip install -r requirements-dask.txt"
        ) from error
    try:
        _knock(address, seconds)
        return Client(address, timeout=seconds, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise CCWSIMError(
            f"no Dask scheduler answers at {address} ({reason}); start one with "
            "'dask scheduler', and give its address, such as tcp://host:8786"
        ) from error


def _knock(address: str, seconds: float) -> None:
    """Fail at once where nobody listens: a client would ask again and again."""
    parts = urlsplit(address)
    if not parts.hostname or not parts.port:
        raise ValueError("host and port are needed")
    socket.create_connection((parts.hostname, parts.port), seconds).close()


class Cluster:
    """Sends batches to the workers of a Dask cluster; the client stays open.

    Parameters
    ----------
    client : distributed.Client
    """

    def __init__(self, client: Any) -> None:
        self._client = client
        self._counted, self._n_workers = 0.0, 0
        self._n_lost = 0
        self._stopped = False
        self._shares: dict[int, float] = {}

    def open(self, work: Work) -> None:
        """Send the study to every worker."""
        from distributed import Event

        self._content = packed(work.study)
        self._name = name_of(work.study)
        self._keep_sources = work.keep_sources
        self._flag = ClusterFlag(f"ccwsim-{secrets.token_hex(8)}")
        self._event = Event(self._flag.name, client=self._client)
        self._client.subscribe_topic(self._flag.name, self._hear)
        self._scatter()

    def _scatter(self) -> None:
        if not self.n_workers():
            with suppress(Exception):  # workers may be on their way
                self._client.wait_for_workers(1, timeout=CONNECT_SECONDS)
        try:
            self._study = self._client.scatter(self._content, broadcast=True, hash=False)
        except Exception as error:
            raise CCWSIMError(
                f"the study cannot be sent to the Dask workers ({error}); "
                "start some with 'dask worker ADDRESS'"
            ) from error

    def n_workers(self) -> int:
        """Say how many batches can be worked on at once."""
        if time.monotonic() > self._counted + COUNT_EVERY:
            with suppress(Exception):
                self._n_workers = sum(self._client.nthreads().values())
            self._counted = time.monotonic()
        return max(self._n_workers, 1)

    def send(self, numbers: tuple[int, ...], whole: bool) -> Any:
        """Submit a batch with the study, which is at the worker.

        Dask does it again by itself where the worker ends.
        """
        order = BatchRequest(self._name, numbers, self._keep_sources, self._flag)
        return self._client.submit(simulate_batch, order, self._study, pure=False)

    def fetch(self, future: Any) -> Reply:
        """Return the answer, wherever it is now: its worker may have ended since.

        Dask waits long for a worker that does not answer, although it has the batch done again
        meanwhile; so it is asked anew, with more patience each time as answers may be large.
        """
        patience = FETCH_SECONDS
        while True:
            try:
                return future.result(timeout=patience)
            except TimeoutError:
                if self._stopped:
                    raise
                patience *= 2

    def _hear(self, event: tuple[float, Any]) -> None:
        number, share = event[1]
        self._shares[number] = share

    def shares(self, numbers: Iterable[int]) -> dict[int, float]:
        """Return what workers told last of some realizations."""
        return {number: self._shares[number] for number in numbers if number in self._shares}

    def lost(self, error: BaseException) -> bool:
        """Say whether a batch is to be sent again: where the study was lost with its workers."""
        from distributed import KilledWorker

        if isinstance(error, KilledWorker):
            raise CCWSIMError(
                f"workers ended again and again before their work was done ({error}), perhaps "
                "for lack of memory; use fewer threads a worker or a smaller grid"
            ) from error
        if isinstance(error, ImportError):
            raise without_program(error) from error
        if not isinstance(error, (CancelledError, asyncio.CancelledError)) or self._stopped:
            return False
        self._n_lost += 1
        if self._client.status != "running" or self._n_lost > MAX_LOSSES:
            raise CCWSIMError("the Dask scheduler or all of its workers were lost") from error
        self._counted = 0.0
        self._scatter()
        return True

    def stop(self) -> None:
        """Set the event that workers look at."""
        self._stopped = True
        with suppress(Exception):  # a scheduler that is gone needs no telling
            self._event.set()
            self._client.unsubscribe_topic(self._flag.name)
