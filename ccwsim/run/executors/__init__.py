"""Where realizations are simulated: threads of this process, any executor, a Dask cluster."""

from __future__ import annotations

import sys
from concurrent.futures import Executor, ThreadPoolExecutor
from typing import Any

from ccwsim.model.arrays import check_int
from ccwsim.model.errors import CCWSIMError, shown
from ccwsim.run.executors.batches import BatchBackend, BatchRunner
from ccwsim.run.executors.cluster import ClusterBackend, connect, executor_of_environment
from ccwsim.run.executors.threads import Take, ThreadRunner, Work
from ccwsim.system.machine import n_cores

__all__ = ["Take", "Work", "connect", "executor_of_environment", "runner_of"]


def runner_of(
    work: Work, executor: Any = None, n_workers: int | None = None
) -> ThreadRunner | BatchRunner:
    """Return the runner of some work for an executor, a Dask client, or threads for None."""
    workers = n_cores() if n_workers is None else check_int("n_workers", n_workers, 1)
    if executor is None:
        return ThreadRunner(work, workers)
    if isinstance(executor, ThreadPoolExecutor):
        return ThreadRunner(work, workers, executor)
    if isinstance(executor, Executor):
        return BatchRunner(BatchBackend(executor, workers), work)
    dask = sys.modules.get("distributed")  # a client exists only after its import
    if dask is not None and isinstance(executor, dask.Client):
        return BatchRunner(ClusterBackend(executor), work)
    raise CCWSIMError(
        f"executor: an Executor of concurrent.futures or a distributed.Client is needed, not "
        f"{shown(executor)}"
    )
