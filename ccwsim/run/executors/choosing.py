"""Which runner serves what `simulate` was given."""

from __future__ import annotations

import sys
from concurrent.futures import Executor, ThreadPoolExecutor
from typing import Any

from ccwsim.model.arrays import check_int
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.run.executors.batches import Batches
from ccwsim.run.executors.cluster import Cluster
from ccwsim.run.executors.pool import Pool
from ccwsim.run.executors.runner import Runner
from ccwsim.run.executors.threads import Threads
from ccwsim.system.workers import n_cores


def runner_of(executor: Any, n_workers: int | None) -> Runner:
    """Return who runs realizations on an executor, a Dask client, or threads where it is None.

    Raises
    ------
    CCWSIMError
        For anything else.

    Examples
    --------
    >>> type(runner_of(None, 2)).__name__
    'Threads'
    """
    workers = n_cores() if n_workers is None else check_int("n_workers", n_workers, 1)
    if executor is None:
        return Threads(workers)
    if isinstance(executor, ThreadPoolExecutor):
        return Threads(workers, executor)
    if isinstance(executor, Executor):
        return Batches(Pool(executor, workers))
    dask = sys.modules.get("distributed")  # who has a client has imported it
    if dask is not None and isinstance(executor, dask.Client):
        return Batches(Cluster(executor))
    raise CCWSIMError(
        f"executor: an Executor of concurrent.futures or a distributed.Client is needed, not "
        f"{shown(executor)}"
    )
