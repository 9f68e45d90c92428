"""Whether the dashboard simulates on a Dask cluster: the environment says so."""

from __future__ import annotations

import os
from threading import Lock
from typing import Any

from ccwsim.run.executors import connect

VARIABLE = "CCWSIM_SCHEDULER"
"""The environment variable that holds the address of a scheduler, such as tcp://host:8786."""

_clients: dict[str, Any] = {}
_lock = Lock()


def executor_of_environment() -> Any:
    """Return the client of the scheduler that the environment names, None where it names none.

    All sessions share it; call it on the thread of a job, as connecting may take seconds.

    Raises
    ------
    CCWSIMError
        Where Dask is not installed or the scheduler does not answer.

    Examples
    --------
    >>> executor_of_environment() is None or VARIABLE in os.environ
    True
    """
    address = os.environ.get(VARIABLE, "").strip()
    if not address:
        return None
    with _lock:
        client = _clients.get(address)
        if client is None or client.status != "running":
            _clients[address] = client = connect(address)
        return client
